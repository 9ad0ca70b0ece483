//! A scene that was read, with all that it points at.

use super::choice::ModelChoice;
use super::components::Balls;
use super::file::SceneFile;
use super::gltf::GltfFacts;
use super::image_metadata::ImageMetadata;
use super::meshes::LoadedMesh;
use super::source::{SceneSource, UpAxis};
use super::stamp::Stamp;
use super::trees::Trees;
use crate::render::ImageTexture;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A scene with everything it needs, ready to be spawned into a world.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// What was opened.
    pub source: SceneSource,
    /// The scene as its file says it; of a model, the scene that is made around it.
    pub file: SceneFile,
    /// What the paths in `file` count from.
    pub folder: PathBuf,
    /// One an object of `file`, `None` for what is not a mesh.
    pub(super) meshes: Vec<Option<LoadedMesh>>,
    /// One an object of `file`, `None` for what is not a cloud.
    pub(super) balls: Vec<Option<Arc<Balls>>>,
    /// By the path in `file`.
    pub(super) pictures: HashMap<String, Arc<ImageTexture>>,
    /// Where they lie, and what they were when they were read.
    pub(super) picture_files: HashMap<String, (PathBuf, Stamp)>,
    /// Trees of its meshes and of its groups of spheres.
    pub trees: Trees,
    /// What a person should know of it, one sentence each.
    pub warnings: Vec<String>,
    /// Which axis of a model was asked to point up.
    pub up: Option<UpAxis>,
    /// The image that took the place of the scene's own environment.
    pub environment: Option<PathBuf>,
    /// What of a model was asked for.
    pub choice: ModelChoice,
    /// What the glTF file has that was opened by itself.
    pub facts: Option<GltfFacts>,
    /// What the picture said that this was opened by.
    pub shot: Option<ImageMetadata>,
    /// Reading and parsing.
    pub load_seconds: f64,
    /// Building trees.
    pub build_seconds: f64,
}

impl LoadedScene {
    pub(super) fn empty(source: &SceneSource, file: SceneFile, folder: PathBuf) -> Self {
        Self {
            source: source.clone(),
            file,
            folder,
            meshes: Vec::new(),
            balls: Vec::new(),
            pictures: HashMap::new(),
            picture_files: HashMap::new(),
            trees: Trees::default(),
            warnings: Vec::new(),
            up: None,
            environment: None,
            choice: ModelChoice::DEFAULT,
            facts: None,
            shot: None,
            load_seconds: 0.0,
            build_seconds: 0.0,
        }
    }

    /// Memory of the pictures of its textures and environment, bytes.
    pub fn picture_bytes(&self) -> usize {
        self.pictures.values().map(|picture| picture.bytes()).sum()
    }

    /// Meshes of objects that say nothing of materials and so take those of the mesh's file.
    pub(super) fn meshes_with_own_materials(&self) -> impl Iterator<Item = &LoadedMesh> {
        let objects = self.file.objects.iter().zip(&self.meshes);
        objects
            .filter(|(object, _)| object.material().is_none() && object.slot_materials().is_none())
            .filter_map(|(_, mesh)| mesh.as_ref())
    }
}
