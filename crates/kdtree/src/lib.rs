//! Closest-hit and any-hit queries over scenes, meshes and sphere clouds, answered in batches.
//!
//! [`SceneTree`] is the top level over the objects of a scene. Meshes that stand still share a [`StaticTree`]. A mesh that
//! is used several times or moves has a [`MeshTree`] and a cloud of spheres a [`SphereTree`], each built once in its own
//! space and shared by all objects that use it. Knows nothing of materials or entities: positions go in, hits come out.

mod batch;
mod block_tree;
mod blocks;
mod build;
pub mod geometry;
mod instance_stream;
mod instance_tree;
mod lanes;
mod leaf;
mod mesh_packet;
mod mesh_tree;
mod node8;
mod nodes;
mod objects;
mod present;
mod primitive_trees;
mod quad_filter;
mod ray;
mod ray_setup;
mod reference;
mod scene_tree;
mod shape;
mod shared_block;
mod simd;
mod sphere_tree;
mod split;
mod split_simd;
mod static_tree;
mod stats;
mod stream;
mod support;
mod surface;
mod trace;
mod visits;

pub use batch::{HitBatch, RayBatch};
pub use batch::{append, append_bits};
pub use firstlight_simd::InstructionSet;
pub use mesh_tree::{BuildPreset, MeshTree};
pub use scene_tree::SceneTree;
pub use shape::{Hit, HitSpace, RayClass, Shape};
pub use sphere_tree::SphereTree;
pub use static_tree::StaticTree;
pub use stats::KdTreeStats;
pub use surface::SurfacePoint;
pub use surface::{F64_ERROR, INSET, quad_rim, sphere_error};
pub use visits::Visits;
