//! Models to be added to a scene: their objects and materials alone, without light, ground and camera.

use crate::files::relative::{absolute, path_to_text, text_to_path};
use crate::format::choice::ModelChoice;
use crate::format::error::SceneError;
use crate::format::model_format::ModelFormat;
use crate::format::parts::ObjectPart;
use crate::format::sources::{MeshOptions, MeshSource};
use crate::import::documents::Documents;
use crate::import::gltf_scene;
use crate::import::meshes::load_mesh;
use crate::scene::default_scene;
use crate::scene::load::{LoadOptions, around_mesh, resolve};
use crate::scene::loaded::LoadedScene;
use crate::scene::source::SceneSource;
use std::path::{Path, PathBuf};

/// Reads a model to be added to a scene. Its trees are not built. All paths in it are absolute, so that it fits into a
/// scene of any folder.
///
/// - `folder`: of the scene, which the path in `model` may be relative to.
///
/// # Errors
/// As for [`load`](crate::scene::load).
pub fn load_model(model: &MeshSource, folder: &Path) -> Result<LoadedScene, SceneError> {
    let (options, documents) = (LoadOptions::default(), Documents::new(&ModelChoice::DEFAULT));
    let mut model = model.clone();
    if let Some(file) = model.file_mut() {
        *file = path_to_text(&absolute(&folder.join(text_to_path(file))));
    }
    let path = text_to_path(model.name());
    let source = SceneSource::Model(path.clone());
    let mut scene = if model.model_format() == Some(ModelFormat::Gltf) {
        let wish = gltf_scene::Wish { file: model.name(), choice: &ModelChoice::DEFAULT, aspect: 1.0 };
        let made = gltf_scene::generate(&documents, &path, &wish)?;
        let mut scene = resolve(&source, made.file, None, PathBuf::new(), &options, &documents)?;
        scene.warnings.append(&made.warnings);
        scene
    } else {
        let mesh = load_mesh(&model, MeshOptions::default(), Path::new(""), &documents)?;
        let (file, ..) = default_scene::around(&mesh, &model, None, 1.0);
        let mut scene = around_mesh(&source, file, PathBuf::new(), mesh, &options, &documents);
        if let Some(ObjectPart::Mesh { name, .. }) = scene.file.objects.first_mut() {
            *name = path.file_stem().map(|stem| path_to_text(stem.as_ref()));
        }
        scene
    };
    // Lights of a model are for showing it.
    scene.file.lights.clear();
    Ok(scene)
}
