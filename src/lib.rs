//! firstlight: an interactive, progressive path tracer whose scene is a bevy_ecs world.
//!
//! From the ground up; imports point down (ARCHITECTURE.md has the whole picture):
//!
//! | module | what lives there |
//! |---|---|
//! | [`geometry`], [`kdtree`] | rays, boxes, robust arithmetic; which surface a ray meets first |
//! | [`mesh`] | mesh data, normals, procedural shapes, simplification |
//! | [`sampling`], [`render`] | sequences, warps, distributions; snapshot, camera, film, integrators, lights, materials |
//! | [`printable`], [`console`] | foreign text made fit to be printed; what is said on a terminal |
//! | [`scene`] | components, scene file, importers, built-in scenes, extraction of the snapshot |
//! | [`frame`] | the ECS schedule in the order in which a frame runs |
//! | [`report`] | speed against error: convergence curves, metrics, tables and plots |
//! | [`stability`] | the hard cases, counted |
//! | `viewer` (feature) | the window: input, overlays, presenting |

pub use firstlight_kdtree::{self as kdtree, geometry};
pub use firstlight_mesh as mesh;
pub use firstlight_render::{self as render, sampling};

pub mod console;
pub mod frame;
pub mod printable;
pub mod report;
pub mod scene;
pub mod stability;
#[cfg(feature = "viewer")]
pub mod viewer;
