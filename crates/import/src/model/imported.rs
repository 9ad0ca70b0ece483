//! The result of reading a model file of any format, and the options for reading.

use crate::model::material::ImportedMaterial;
use firstlight_files::limits::Limits;
use firstlight_files::warnings::Warnings;
use firstlight_mesh::{Mesh, NormalWeight};
use glam::{DVec3, Vec3};
use std::path::PathBuf;

/// A model as in its file.
#[derive(Clone, Debug)]
pub struct ImportedModel {
    /// Its `slots` are indices of `materials`.
    pub mesh: Mesh,
    /// Only materials that faces use. One that the libraries lack has only its name.
    pub materials: Vec<ImportedMaterial>,
    /// The material libraries that were read.
    pub libraries: Vec<PathBuf>,
    /// Whether the file has a valid normal for every corner; otherwise they were computed.
    pub normals_from_file: bool,
    /// Number of faces with more than three corners, which were triangulated.
    pub polygons: usize,
    /// Omissions and replacements.
    pub warnings: Warnings,
    /// Warnings about the materials, which matter only if they are used.
    pub material_warnings: Warnings,
}

/// Source of the shading normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelNormals {
    /// From the file; if it has none, computed with angle weights. Computed normals keep edges hard where triangles
    /// meet at more than `crease_angle` radians.
    FileOrComputed {
        /// Maximum angle between triangles across which normals are averaged, radians.
        crease_angle: f32,
    },
    /// Area-weighted at each position of the file, regardless of its normals and of seams of texture coordinates.
    OfPositions,
    /// No normals; vertices are split only where texture coordinates differ.
    Ignore,
}

/// Options and limits for reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelOptions {
    /// Source of the shading normals.
    pub normals: ModelNormals,
    /// Larger files are rejected. Loading takes up to about 25 bytes of memory per byte of the file.
    pub max_bytes: u64,
    /// Larger material libraries are ignored.
    pub max_library_bytes: u64,
    /// Whether libraries and textures outside of the model's folder may be read.
    pub allow_outside: bool,
}

impl Default for ModelOptions {
    /// A crease angle of 60°: the right angles of boxes stay hard, and coarse curved surfaces become smooth (the faces
    /// of an icosahedron meet at 42°, those of an 8-sided column at 45°).
    fn default() -> Self {
        let normals = ModelNormals::FileOrComputed { crease_angle: 60_f32.to_radians() };
        let limits = Limits::of_this_process();
        Self { normals, max_bytes: limits.model_bytes, max_library_bytes: limits.library_bytes, allow_outside: false }
    }
}

/// Whether a triangle has an area. Differences and products of `f32` values in `f64` are exact enough for collinear
/// vertices to give exactly zero.
pub(crate) fn has_area(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}

/// Uses the normals of the file where they are valid and computed ones elsewhere; also returns whether all are from the
/// file.
pub(crate) fn with_normals(mesh: Mesh, from_file: &[Vec3], crease_angle: f32) -> (Mesh, bool) {
    let missing = from_file.iter().filter(|n| **n == Vec3::ZERO).count();
    if from_file.is_empty() || missing == from_file.len() {
        return (mesh.with_smooth_normals(NormalWeight::Angle, Some(crease_angle)), false);
    }
    if missing == 0 {
        return (Mesh { normals: from_file.to_vec(), ..mesh }, true);
    }
    let corners = mesh.triangles.clone();
    let mut mesh = mesh.with_smooth_normals(NormalWeight::Angle, Some(crease_angle));
    // Creases split vertices, also those that have a normal from the file.
    for (now, before) in mesh.triangles.iter().flatten().zip(corners.iter().flatten()) {
        let given = from_file[*before as usize];
        if given != Vec3::ZERO {
            mesh.normals[*now as usize] = given;
        }
    }
    (mesh, false)
}
