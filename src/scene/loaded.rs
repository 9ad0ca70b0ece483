//! A scene that was read, with all data that it refers to.

use crate::files::stamp::Stamp;
use crate::files::warnings::Warnings;
use crate::format::choice::ModelChoice;
use crate::format::choice::UpAxis;
use crate::format::scene_file::SceneFile;
use crate::import::gltf::facts::GltfFacts;
use crate::import::gltf_motion::GltfMotion;
use crate::import::meshes::LoadedMesh;
use crate::render::ImageTexture;
use crate::scene::image_metadata::ImageMetadata;
use crate::scene::source::SceneSource;
use crate::scene::world::components::Balls;
use crate::scene::world::trees::Trees;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A scene with all its data, ready to be spawned into a world.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// What was opened.
    pub source: SceneSource,
    /// The scene as in its file; for a model, the scene that was made for it.
    pub file: SceneFile,
    /// The folder that the paths in `file` are relative to.
    pub folder: PathBuf,
    /// One per object of `file`; `None` for objects that are not meshes.
    pub(super) meshes: Vec<Option<LoadedMesh>>,
    /// One per object of `file`; `None` for objects that are not groups of spheres.
    pub(super) balls: Vec<Option<Arc<Balls>>>,
    /// By the path in `file`.
    pub(super) pictures: HashMap<String, Arc<ImageTexture>>,
    /// The image of the environment as it is rendered, if its file has another layout.
    pub(super) environment_image: Option<Arc<ImageTexture>>,
    /// Their files, each with its stamp at the time of reading.
    pub(super) picture_files: HashMap<String, (PathBuf, Stamp)>,
    /// Images of textures and of the environment that could not be read, by name, in order: what is saved has none of
    /// them.
    pub lost_images: Vec<String>,
    /// The scene of another renderer that was opened and the files that it includes, each with its stamp.
    pub(super) text_files: Vec<(PathBuf, Stamp)>,
    /// Trees of its meshes and of its groups of spheres.
    pub trees: Trees,
    /// What the user should know about how it was read.
    pub warnings: Warnings,
    /// The up axis that was given for a model.
    pub up: Option<UpAxis>,
    /// The image that replaced the environment of the scene.
    pub environment: Option<PathBuf>,
    /// The given camera, time and variant of a model.
    pub choice: ModelChoice,
    /// The contents of a glTF file that was opened by itself.
    pub facts: Option<GltfFacts>,
    /// What its animations move, if a moment was asked for.
    pub(super) motion: Option<Arc<GltfMotion>>,
    /// The metadata of the image that was opened.
    pub shot: Option<ImageMetadata>,
    /// Time for reading and parsing.
    pub load_seconds: f64,
    /// Time for building trees.
    pub build_seconds: f64,
}

impl LoadedScene {
    /// Length of the animations of a glTF file that was opened by itself, seconds.
    pub fn model_length(&self) -> Option<f64> {
        self.facts.as_ref()?.animation_length
    }

    pub(super) fn empty(source: &SceneSource, file: SceneFile, folder: PathBuf) -> Self {
        Self {
            source: source.clone(),
            file,
            folder,
            meshes: Vec::new(),
            balls: Vec::new(),
            pictures: HashMap::new(),
            environment_image: None,
            picture_files: HashMap::new(),
            lost_images: Vec::new(),
            text_files: Vec::new(),
            trees: Trees::default(),
            warnings: Warnings::default(),
            up: None,
            environment: None,
            choice: ModelChoice::DEFAULT,
            facts: None,
            motion: None,
            shot: None,
            load_seconds: 0.0,
            build_seconds: 0.0,
        }
    }

    /// Memory of the images of its textures and environment, bytes.
    pub fn picture_bytes(&self) -> usize {
        self.pictures.values().map(|picture| picture.bytes()).sum()
    }

    /// Meshes of objects that name no material and so use those of the mesh file.
    pub(super) fn meshes_with_own_materials(&self) -> impl Iterator<Item = &LoadedMesh> {
        let objects = self.file.objects.iter().zip(&self.meshes);
        objects
            .filter(|(object, _)| object.material().is_none() && object.slot_materials().is_none())
            .filter_map(|(_, mesh)| mesh.as_ref())
    }
}
