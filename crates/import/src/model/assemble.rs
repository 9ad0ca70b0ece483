//! From indexed vertices to a mesh, for formats with one index per vertex.

use crate::error::{ModelError, ModelProblem, Place};
use crate::model::imported::{ModelNormals, ModelOptions, has_area, with_normals};
use crate::model::unused::{keep, renumber};
use firstlight_files::warnings::Warnings;
use firstlight_mesh::{Mesh, Welding};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::path::Path;

/// Vertices and triangles that index them; all indices are in range.
#[derive(Debug, Default)]
pub(crate) struct Indexed {
    /// Finite, in the coordinates of the file.
    pub positions: Vec<DVec3>,
    /// Unit vectors, zero if missing; empty, or one per position.
    pub normals: Vec<Vec3>,
    /// Finite; empty, or one per position.
    pub uvs: Vec<Vec2>,
    /// Linear Rec. 709 with alpha; empty, or one per position.
    pub colors: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle; empty if there is one.
    pub slots: Vec<u16>,
}

/// The mesh, and whether all of its normals are from the file.
///
/// Unused vertices and triangles that use a vertex twice are removed.
pub(crate) fn assemble(
    path: &Path,
    mut model: Indexed,
    options: &ModelOptions,
    warnings: &mut Warnings,
) -> Result<(Mesh, bool), ModelError> {
    let failed = |problem: ModelProblem| ModelError::of(path, Place::File, problem);
    let before = model.triangles.len();
    let is_triangle = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let mut kept = model.triangles.iter().map(is_triangle);
    model.slots.retain(|_| kept.next().expect("slots are empty or as many as triangles"));
    model.triangles.retain(is_triangle);
    let dropped = before - model.triangles.len();
    if model.triangles.is_empty() {
        return Err(failed(ModelProblem::NoArea { triangles: before }));
    }
    if dropped > 0 {
        warnings.push(format!("{}: {dropped} triangles use a vertex twice and were removed", path.display()));
    }
    model.leave_out_unused();
    let mut mesh = Mesh::from_f64(&model.positions, model.triangles).map_err(|error| failed(error.into()))?;
    if !mesh.triangles.iter().any(|&triangle| has_area(&mesh, triangle)) {
        return Err(failed(ModelProblem::NoArea { triangles: before }));
    }
    (mesh.uvs, mesh.colors, mesh.slots) = (model.uvs, model.colors, model.slots);
    let (mesh, from_file) = match options.normals {
        ModelNormals::FileOrComputed { crease_angle } => with_normals(mesh, &model.normals, crease_angle),
        ModelNormals::OfPositions => {
            // Vertices at the same position are welded: at seams they are duplicated for their normals or texture
            // coordinates.
            let welding = Welding::of_f64(&model.positions);
            (mesh.with_normals_of_vertices(|vertex| welding.place[vertex as usize]), false)
        }
        ModelNormals::Ignore => (mesh, false),
    };
    mesh.validate().map_err(|error| failed(error.into()))?;
    Ok((mesh, from_file))
}

impl Indexed {
    /// Removes unused vertices; the others keep their order.
    fn leave_out_unused(&mut self) {
        let Some(used) = renumber(&mut self.triangles, self.positions.len()) else { return };
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.uvs, &used);
        keep(&mut self.colors, &used);
    }
}
