//! A scene with all its data, ready to be written elsewhere.

use firstlight_files::warnings::Warnings;
use firstlight_format::scene_file::SceneFile;
use firstlight_mesh::Mesh;
use firstlight_render::{Environment, Texture};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A scene with all its data.
#[derive(Clone, Debug)]
pub struct WholeScene {
    /// At one moment, without an animation. All objects name their materials, and paths are not used.
    pub file: SceneFile,
    /// One per object of `file`; `None` for objects that are not meshes.
    pub meshes: Vec<Option<Arc<Mesh>>>,
    /// The textures of `file` by name.
    pub textures: HashMap<String, WholeTexture>,
    /// The environment as it is rendered.
    pub environment: Environment,
    /// The image file of the environment, if it has one.
    pub environment_file: Option<PathBuf>,
    /// What the scene file cannot say already.
    pub losses: Warnings,
}

impl WholeScene {
    /// The names of the materials that objects have, in alphabetical order.
    pub(crate) fn used_materials(&self) -> Vec<String> {
        let objects = self.file.objects.iter();
        let names = objects.flat_map(|object| {
            object.material().into_iter().chain(object.slot_materials().into_iter().flatten().map(String::as_str))
        });
        let mut names: Vec<String> = names.map(str::to_owned).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// A texture with its image.
#[derive(Clone, Debug)]
pub struct WholeTexture {
    /// The texture as it is rendered.
    pub texture: Texture,
    /// The file of its image, if it is one of its own.
    pub file: Option<PathBuf>,
}
