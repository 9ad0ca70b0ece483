//! A mesh of a glTF file for `mesh(source: gltf(…))`, with the materials of the file.

use crate::documents::Documents;
use crate::error::gltf::{GltfError, Located};
use crate::gltf::assembly::MeshKey;
use crate::gltf::surfaces::Surfaces;
use crate::model::imported::{ModelNormals, ModelOptions};
use firstlight_files::relative::{path_to_text, text_to_path};
use firstlight_files::stamp::Stamp;
use firstlight_files::warnings::Warnings;
use firstlight_format::material_textures::{rename_textures, texture_names};
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::{MeshOptions, MeshShading, TextureSource};
use firstlight_mesh::Mesh;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A mesh before simplification and shading, and the materials of its slots.
#[derive(Default)]
pub(crate) struct GltfBase {
    pub mesh: Mesh,
    pub slots: Vec<(String, MaterialPart)>,
    /// The textures of `slots`, with the paths of their images.
    pub textures: Vec<(String, TextureSource, PathBuf)>,
    pub warnings: Warnings,
    /// Warnings about `slots`.
    pub material_warnings: Warnings,
    /// All files that were read for it, each with its stamp.
    pub files: Arc<[(PathBuf, Stamp)]>,
}

/// Which mesh to build, and how.
pub(crate) struct GltfMesh<'a> {
    pub path: &'a Path,
    /// `None`: all meshes of the scene of the file, as one.
    pub key: Option<MeshKey>,
    /// Time in the animations, seconds; `None`: as stored.
    pub at: Option<f64>,
    pub options: MeshOptions,
}

impl GltfMesh<'_> {
    /// Builds it, or returns the one in `documents`.
    pub(crate) fn base(&self, documents: &Documents) -> Result<GltfBase, GltfError> {
        let opened = documents.open(self.path)?;
        let document = &opened.document;
        let wrong = |located: Located| document.error(located);
        // The images of the file's own materials have paths relative to the working directory.
        let file = path_to_text(self.path);
        let surfaces = opened.surfaces(&file);
        let computed = ModelOptions::default().normals;
        let normals = match self.options.shading {
            MeshShading::Auto => computed,
            MeshShading::Smooth if self.options.simplify.is_none() => ModelNormals::OfPositions,
            MeshShading::Smooth | MeshShading::Flat => ModelNormals::Ignore,
        };
        let (mesh, slots, warnings) = match self.key {
            Some(key) => {
                let (mesh, keys, warnings) = if normals == computed {
                    let built = documents.mesh(&opened, key, self.at).map_err(wrong)?;
                    (built.mesh.clone(), built.keys.clone(), built.warnings.clone())
                } else {
                    let posed = opened.posed(self.at);
                    let built = document.mesh_of(key, &posed, &normals).map_err(wrong)?;
                    (built.mesh, built.keys, built.warnings)
                };
                let slots = keys.iter().map(|key| surfaces.index(key.material)).collect();
                (mesh, slots, warnings.into_iter().collect::<Warnings>())
            }
            None => {
                let model = document.baked(&ModelOptions { normals, ..ModelOptions::default() }).map_err(wrong)?;
                let index = |name: &String| surfaces.materials.iter().position(|surface| surface.name == *name);
                let slots: Vec<usize> =
                    model.materials.iter().map(|material| index(&material.name).unwrap_or(0)).collect();
                (model.mesh, slots, model.warnings)
            }
        };
        let warnings = warnings.of_file(self.path);
        let mut base = GltfBase { mesh, warnings, files: opened.files.clone(), ..GltfBase::default() };
        self.add_materials(&mut base, &surfaces, &slots, &file);
        Ok(base)
    }

    /// The names of textures are prefixed with that of the model, since other models may use the same ones.
    fn add_materials(&self, base: &mut GltfBase, surfaces: &Surfaces, slots: &[usize], file: &str) {
        let own = |name: &str| format!("{file}: {name}");
        let mut known = HashSet::new();
        for &slot in slots {
            let Some(surface) = surfaces.materials.get(slot) else { continue };
            let mut part = surface.part.clone();
            let wanted: HashSet<String> = texture_names(&part).into_iter().collect();
            for (name, source) in surfaces.textures.iter().filter(|(name, _)| wanted.contains(name)) {
                let path = match source {
                    TextureSource::Image { file, .. } => text_to_path(file),
                    _ => PathBuf::new(),
                };
                if known.insert(name.clone()) {
                    base.textures.push((own(name), source.clone(), path));
                }
            }
            rename_textures(&mut part, own);
            base.slots.push((surface.name.clone(), part));
            let note = |note: &String| {
                format!("{}: `{}`: {note}", self.path.display(), firstlight_files::printable::name(&surface.name))
            };
            base.material_warnings.extend(surface.notes.iter().map(note));
        }
    }
}
