//! firstlight: an interactive, progressive path tracer whose scene is a bevy_ecs world.
//!
//! ```
//! # fn main() -> Result<(), firstlight::Error> {
//! # let out = std::env::temp_dir().join(format!("firstlight-lib-{}.png", std::process::id()));
//! use firstlight::prelude::*;
//! let scene = Scene::open("cornell")?; // or "model.obj", "scene.ron", "image.png"
//! let image = scene.render(&RenderOptions::default().size(64, 48).spp(4))?;
//! image.save(&out)?;
//! # std::fs::remove_file(out).unwrap();
//! # Ok(())
//! # }
//! ```
//!
//! [`Scene`], [`RenderOptions`] and [`Image`] cover what most programs need. An interactive program runs a
//! [`Session`](frame::Session), which shows the image while it converges and executes commands; its systems may change
//! the world between two frames. `docs/library.md` is a guide to both.
//!
//! Modules, from the top layer down; imports point down:
//!
//! | module | contents |
//! |---|---|
//! | `cli` (feature `cli`) | the program: one file per command |
//! | `viewer` (feature `viewer`) | the window: input, overlays, presenting |
//! | [`embed`] | [`Scene`], [`RenderOptions`], [`Image`] |
//! | `cluster` (feature `cli`) | parts of an image on many machines: what a set of films has, job files of engines |
//! | `report`, `stability` (feature `cli`) | error against time; counts of hard cases |
//! | [`frame`] | the session: the ECS schedule in the order in which a frame runs; image files |
//! | [`scene`] | the world: components, loading, saving, animation, extraction of the snapshot |
//! | [`import`] | OBJ, PLY, STL, glTF, and scenes of pbrt and Mitsuba, as meshes and parts of a scene file |
//! | [`export`] | scenes as files of pbrt and Mitsuba |
//! | [`format`](mod@format) | the scene file: values, checks and their limits, placements, lights, keys |
//! | [`files`], `console` (feature `cli`) | bounded reading, whole-file writing, escaping of foreign text; output to a terminal |
//! | [`render`], [`sampling`] | snapshot, camera, film, integrators, lights, materials; sequences, warps, distributions |
//! | [`mesh`] | mesh data, normals, procedural shapes, simplification |
//! | [`kdtree`], [`geometry`] | closest-hit and any-hit queries; rays, boxes, robust arithmetic |

// The command line names the library as other programs do.
extern crate self as firstlight;

pub use bevy_ecs;
pub use embed::{Error, Image, RenderOptions, Scene};
pub use firstlight_export as export;
pub use firstlight_files::{self as files, printable};
pub use firstlight_format as format;
pub use firstlight_import as import;
pub use firstlight_kdtree::{self as kdtree, geometry};
pub use firstlight_mesh as mesh;
pub use firstlight_render::{self as render, sampling};
pub use glam;

// Hidden: used by the program, its tests and its benchmarks, not by other libraries.
#[cfg(feature = "cli")]
#[doc(hidden)]
#[allow(missing_docs)]
pub mod cli;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cluster;
#[cfg(feature = "cli")]
#[doc(hidden)]
#[allow(missing_docs)]
pub mod console;
pub mod embed;
pub mod frame;
pub mod prelude;
// Hidden like `console`.
#[cfg(feature = "cli")]
#[doc(hidden)]
#[allow(missing_docs)]
pub mod report;
pub mod scene;
// Hidden like `console`.
#[cfg(feature = "cli")]
#[doc(hidden)]
#[allow(missing_docs)]
pub mod stability;
// Hidden like `console`.
#[cfg(feature = "viewer")]
#[doc(hidden)]
#[allow(missing_docs)]
pub mod viewer;

/// Compiles and runs the Rust code of the guide and the README.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
#[doc = include_str!("../README.md")]
struct CodeOfTheDocs;
