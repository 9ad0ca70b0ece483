//! What shapes are made of: meshes of files, of the text, and of formulas.

use crate::model::imported::{ModelNormals, ModelOptions};
use crate::model::placing::oriented;
use crate::pbrt::build::{Builder, Geometry};
use crate::pbrt::params::Params;
use crate::pbrt::shapes::{is_whole_sphere, mesh_of};
use crate::pbrt::state::State;
use crate::ply::{has_normals, load_ply_with};
use firstlight_files::limits::Limits;
use firstlight_files::relative::{path_to_text, text_to_path};
use firstlight_files::stamp::stamp;
use firstlight_format::sources::{MeshShading, MeshSource};
use firstlight_mesh::Mesh;
use glam::Vec3;
use std::path::Path;
use std::sync::Arc;

impl Builder<'_> {
    /// What a shape is made of, or why it cannot be shown.
    pub(super) fn geometry(
        &mut self,
        kind: &str,
        params: &Params,
        state: &State,
        emits: bool,
        number: u32,
        file_name: Option<&str>,
    ) -> Result<Geometry, String> {
        if kind == "sphere" && is_whole_sphere(params) {
            let source = self.shape_source(number);
            let radius = params.number("radius").unwrap_or(1.0);
            // The front of our spheres is outside.
            if !state.is_reversed {
                return Ok(Geometry::Sphere { radius, shape: number });
            }
            let mesh = self.made(kind, params, true)?;
            self.parts.insert(number, mesh);
            return Ok(Geometry::Mesh { source, shading: MeshShading::Auto });
        }
        if kind != "plymesh" {
            let source = self.shape_source(number);
            let mesh = self.made(kind, params, state.is_reversed)?;
            self.parts.insert(number, mesh);
            return Ok(Geometry::Mesh { source, shading: MeshShading::Auto });
        }
        let source = self.shape_source(number);
        let name = file_name.ok_or("it has no `filename`")?;
        let file = self.file(name).ok_or_else(|| "its file must not be read".to_owned())?;
        let path = self.folder.join(text_to_path(&file));
        // Only the front of an emitter, and what is turned round, are not as in the file.
        if emits || state.is_reversed {
            let mesh = self.ply_mesh(&path, state.is_reversed)?;
            self.parts.insert(number, mesh);
            return Ok(Geometry::Mesh { source, shading: MeshShading::Auto });
        }
        // pbrt smooths nothing by itself.
        let shading = if self.has_normals(&path) == Some(false) { MeshShading::Flat } else { MeshShading::Auto };
        Ok(Geometry::Mesh { source: MeshSource::Ply(file), shading })
    }

    /// The mesh of a shape that is no file; see [`mesh_of`].
    pub(super) fn made(&mut self, kind: &str, params: &Params, is_reversed: bool) -> Result<Arc<Mesh>, String> {
        let is_written = kind == "trianglemesh";
        if !is_written && self.bytes_left == 0 {
            return Err(format!("there are too many shapes like it: {}", Limits::advice()));
        }
        let bytes_of = |n_vertices, n_triangles| size_of::<Vec3>() * (3 * n_vertices + n_triangles);
        // A subdivided surface has two triangles per vertex.
        let most_triangles = usize::try_from(self.bytes_left).unwrap_or(usize::MAX) / bytes_of(1, 2) * 2;
        let mesh = mesh_of(kind, params, is_reversed, most_triangles, self.path, &mut self.warnings)?;
        if !is_written {
            let bytes = bytes_of(mesh.positions.len(), mesh.triangles.len());
            self.bytes_left = self.bytes_left.saturating_sub(bytes as u64);
        }
        Ok(Arc::new(mesh))
    }

    fn ply_mesh(&mut self, path: &Path, is_reversed: bool) -> Result<Arc<Mesh>, String> {
        let key = (path.to_owned(), is_reversed);
        if let Some(known) = self.ply.get(&key) {
            return known.clone();
        }
        let normals = match self.has_normals(path) {
            Some(false) => ModelNormals::Ignore,
            _ => ModelOptions::default().normals,
        };
        let options = ModelOptions { normals, allow_outside: self.allow_outside, ..ModelOptions::default() };
        let before = stamp(path);
        let read = self.meshes.before(path).map_err(|error| error.to_string()).and_then(|length| {
            let model = load_ply_with(path, &options).map_err(|error| error.to_string())?;
            self.meshes.after(length, &model.mesh).map_err(|error| error.to_string())?;
            self.warnings.append(&model.warnings);
            Ok(Arc::new(oriented(model.mesh, is_reversed)))
        });
        // Also if it cannot be read, since it may appear later.
        self.files.push((path.to_owned(), before));
        self.ply.insert(key, read.clone());
        read
    }

    /// The mesh of a shape of the scene, by its number.
    pub(super) fn shape_source(&self, shape: u32) -> MeshSource {
        let file = self.path.file_name().map(|name| path_to_text(name.as_ref())).unwrap_or_default();
        MeshSource::Part { file, shape, defines: Vec::new() }
    }

    /// See [`has_normals`].
    fn has_normals(&mut self, path: &Path) -> Option<bool> {
        *self.with_normals.entry(path.to_owned()).or_insert_with(|| has_normals(path))
    }
}
