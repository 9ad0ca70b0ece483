//! Triangle meshes: data, normals, procedural shapes, simplification. Knows no trees, files or entities.
//!
//! A [`Mesh`] comes from [`Mesh::from_f64`] (an importer), from [`procedural`], or from another mesh; all of them
//! produce only meshes that pass [`Mesh::validate`]. Start reading at [`Mesh`].

mod box_coordinates;
mod build;
mod colors;
mod deviation;
mod faults;
mod measure;
mod mikktspace;
mod normals;
pub mod procedural;
pub mod simplify;
mod split;
mod tangents;
mod topology;
mod weld;

pub use build::MeshError;
pub use deviation::{Deviation, Distances};
pub use faults::Faults;
pub use normals::NormalWeight;
pub use topology::Topology;
pub use weld::Welding;

use glam::{DVec3, Vec2, Vec3, Vec4};

/// An indexed triangle mesh in its own space, stored relative to its centre so that `f32` suffices.
///
/// Vertices that differ in normal or texture coordinates are stored separately with exactly equal positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Metres, relative to `center`.
    pub positions: Vec<Vec3>,
    /// Centre of the mesh in file coordinates: position plus centre is the position in the file.
    pub center: DVec3,
    /// Counter-clockwise seen from the front; every index lies within `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// One unit shading normal per vertex, or empty for flat shading.
    pub normals: Vec<Vec3>,
    /// One texture coordinate per vertex, or empty.
    pub uvs: Vec<Vec2>,
    /// A second texture coordinate per vertex, or empty.
    pub uvs2: Vec<Vec2>,
    /// One colour per vertex, linear Rec. 709 with alpha, or empty.
    pub colors: Vec<Vec4>,
    /// One tangent per vertex, or empty: `xyz` is the unit direction in which the first texture coordinate grows; the
    /// bitangent is `w · normal × xyz`, where `w` is 1 or -1.
    pub tangents: Vec<Vec4>,
    /// One material slot per triangle, or empty if all use slot 0.
    pub slots: Vec<u16>,
}
