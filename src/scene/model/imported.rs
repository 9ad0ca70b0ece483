//! What a model file becomes, whatever its format, and how to read it.

use crate::mesh::{Mesh, NormalWeight};
use crate::scene::limits::Limits;
use crate::scene::obj::ImportedMaterial;
use glam::{DVec3, Vec3};
use std::path::PathBuf;

/// A model as its file has it.
#[derive(Clone, Debug)]
pub struct ImportedModel {
    /// Its `slots` index `materials`.
    pub mesh: Mesh,
    /// Only materials that faces use. One whose name the libraries lack has its name and nothing else.
    pub materials: Vec<ImportedMaterial>,
    /// The material libraries that were found.
    pub libraries: Vec<PathBuf>,
    /// Whether every corner had a usable normal in the file; otherwise they were computed.
    pub normals_from_file: bool,
    /// Faces of more than three corners; they were cut into triangles.
    pub polygons: usize,
    /// What was left out or replaced, one sentence each.
    pub warnings: Vec<String>,
    /// The same of the materials, which matter only to those who use them.
    pub material_warnings: Vec<String>,
}

/// Where shading normals come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelNormals {
    /// From the file; where it has none, computed with angle weights. Computed edges stay hard where triangles
    /// meet at more than `crease_angle` radians.
    FileOrComputed {
        /// Largest angle between triangles across which normals are averaged, radians.
        crease_angle: f32,
    },
    /// Area-weighted at each position of the file, whatever normals it has and however texture coordinates split
    /// its vertices.
    OfPositions,
    /// None: the mesh has no normals, and vertices are split only where texture coordinates differ.
    Ignore,
}

/// How to read, and how much at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelOptions {
    /// Where shading normals come from.
    pub normals: ModelNormals,
    /// Larger files are refused. Loading takes up to about 25 bytes of memory for each byte of the file.
    pub max_bytes: u64,
    /// Larger material libraries are left out.
    pub max_library_bytes: u64,
}

impl Default for ModelOptions {
    /// A crease angle of 60°: the right angles of boxes stay hard, and curves come out smooth even when they are
    /// coarse (the faces of an icosahedron meet at 42°, those of an 8-sided column at 45°).
    fn default() -> Self {
        let normals = ModelNormals::FileOrComputed { crease_angle: 60_f32.to_radians() };
        let limits = Limits::of_this_process();
        Self { normals, max_bytes: limits.model_bytes, max_library_bytes: limits.library_bytes }
    }
}

/// Differences and products of `f32` numbers are exact enough in `f64` for corners on a line to give exactly nothing.
pub(in crate::scene) fn has_area(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}

/// Uses the file's normals where they have a length, computed ones elsewhere; says whether all were the file's.
pub(in crate::scene) fn with_normals(mesh: Mesh, from_file: &[Vec3], crease_angle: f32) -> (Mesh, bool) {
    let missing = from_file.iter().filter(|n| **n == Vec3::ZERO).count();
    if from_file.is_empty() || missing == from_file.len() {
        return (mesh.with_smooth_normals(NormalWeight::Angle, Some(crease_angle)), false);
    }
    if missing == 0 {
        return (Mesh { normals: from_file.to_vec(), ..mesh }, true);
    }
    // A crease would split vertices whose normals the file has given.
    let mut mesh = mesh.with_smooth_normals(NormalWeight::Angle, None);
    for (normal, &given) in mesh.normals.iter_mut().zip(from_file) {
        if given != Vec3::ZERO {
            *normal = given;
        }
    }
    (mesh, false)
}
