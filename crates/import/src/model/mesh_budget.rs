//! The memory that all meshes of a scene may take together.

use crate::error::together::MeshesTooLarge;
use firstlight_files::limits::{Budget, Limits};
use firstlight_mesh::Mesh;
use std::path::Path;

/// What the meshes of a scene, and the files that are read for them, may still take.
#[derive(Debug)]
pub(crate) struct MeshBudget {
    left: Budget,
    /// Bytes of a file beyond which it is refused before it is read.
    most_of_one: u64,
}

impl Default for MeshBudget {
    fn default() -> Self {
        let limits = Limits::of_this_process();
        Self { left: Budget::new(limits.scene_mesh_bytes), most_of_one: limits.model_bytes }
    }
}

impl MeshBudget {
    pub(crate) fn take(&self, bytes: u64) -> Result<(), MeshesTooLarge> {
        self.left.take(bytes).map_err(MeshesTooLarge)
    }

    /// Takes the bytes of a file, whatever becomes of it; returns how many.
    pub(crate) fn before(&self, path: &Path) -> Result<u64, MeshesTooLarge> {
        let length = path.metadata().map(|info| info.len()).ok().filter(|length| *length <= self.most_of_one);
        let length = length.unwrap_or(0);
        self.take(length).map(|()| length)
    }

    /// Takes what a mesh has beyond the bytes of its file.
    pub(crate) fn after(&self, length: u64, mesh: &Mesh) -> Result<(), MeshesTooLarge> {
        let of_vertices = size_of_val(&*mesh.positions) + size_of_val(&*mesh.normals) + size_of_val(&*mesh.colors);
        let of_textures = size_of_val(&*mesh.uvs) + size_of_val(&*mesh.uvs2) + size_of_val(&*mesh.tangents);
        let of_triangles = size_of_val(&*mesh.triangles) + size_of_val(&*mesh.slots);
        self.take(((of_vertices + of_textures + of_triangles) as u64).saturating_sub(length))
    }
}
