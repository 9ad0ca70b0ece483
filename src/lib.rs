//! firstlight: an interactive, progressive path tracer whose scene is a bevy_ecs world.
//!
//! Rooms, from the ground up; a room imports only from rooms below it (ARCHITECTURE.md has the whole picture):
//!
//! | row | room | what lives there |
//! |---|---|---|
//! | 0 | [`geometry`], [`sampling`], `lanes` | rays, boxes, robust arithmetic; sequences, warps, distributions; sixteen numbers at a time |
//! | 0 | [`printable`], [`console`] | foreign text made fit to be printed; what is said on a terminal |
//! | 1 | [`kdtree`], [`mesh`] | build and traversal; mesh data, normals, simplification |
//! | 2 | [`render`] | snapshot, camera, film, integrators, lights, materials, textures |
//! | 3 | [`scene`] | components, scene file, importers, built-in scenes, extraction of the snapshot |
//! | 4 | [`frame`] | the ECS schedule in the order in which a frame runs |
//! | 5 | [`report`] | speed against error: ladders, metrics, tables and plots |
//! | 5 | [`stability`] | the hard cases, counted |
//! | 5 | `viewer` (feature) | the window: input, overlays, presenting |

pub mod console;
pub mod frame;
pub mod geometry;
pub mod kdtree;
pub(crate) mod lanes;
pub mod mesh;
pub mod printable;
pub mod render;
pub mod report;
pub mod sampling;
pub mod scene;
pub mod stability;
#[cfg(feature = "viewer")]
pub mod viewer;
