//! The metadata of an image that is not finished yet.

use crate::files::hash::Fingerprint;
use crate::files::relative::{absolute, relative_path};
use crate::format::choice::UpAxis;
use crate::format::parts::FilmPart;
use crate::format::scene_file::SceneFile;
use crate::render::{Display, SampleAllocation};
use crate::scene::animation::edited::shown_camera;
use crate::scene::describe::Description;
use crate::scene::fingerprint::SceneContent;
use crate::scene::image_metadata::{FORMAT, ImageMetadata, ImageSamples, ImageScene};
use crate::scene::loaded::LoadedScene;
use crate::scene::source::SceneSource;
use bevy_ecs::prelude::World;
use std::path::Path;
use std::sync::OnceLock;

/// All data of a world that the metadata needs; created at once, completed when the film is finished.
#[derive(Clone, Debug)]
pub struct MetadataDraft {
    source: Option<SceneSource>,
    up: Option<UpAxis>,
    description: Description,
    content: SceneContent,
    /// The scene as it was opened.
    loaded: Option<LoadedScene>,
    seed: u32,
    allocation: SampleAllocation,
    prints: OnceLock<Prints>,
}

/// Data that depends on the whole scene: some seconds for a million objects.
#[derive(Clone, Copy, Debug)]
struct Prints {
    content: Fingerprint,
    /// Whether the scene differs from the one that was opened, and can be described.
    has_changed: bool,
}

impl MetadataDraft {
    /// From the contents of `world`; `loaded`: the scene that was opened into it.
    pub fn of(world: &mut World, loaded: Option<&LoadedScene>) -> Self {
        let description = Description::of(world, loaded);
        let settings = world
            .get_resource::<crate::scene::world::components::Rendering>()
            .map(|rendering| rendering.0)
            .unwrap_or_default();
        Self {
            source: loaded.map(|loaded| loaded.source.clone()),
            up: loaded.and_then(|loaded| loaded.up),
            content: SceneContent::of(world, &description),
            loaded: loaded.cloned(),
            description,
            seed: settings.seed,
            allocation: settings.allocation,
            prints: OnceLock::new(),
        }
    }

    /// How the scene is to be displayed.
    pub fn display(&self) -> Display {
        self.description.file.display
    }

    /// Computes the slow part of [`note`](Self::note) now.
    pub fn prepare(&self) {
        self.prints();
    }

    /// Reuses the slow part of another draft of the same scene, seen by another camera.
    pub fn prepared_as(mut self, other: &Self) -> Self {
        self.prints = other.prints.clone();
        self
    }

    /// The metadata of an image at `path`, with a film of this size (width, height; pixels) and these samples.
    pub fn note(&self, path: &Path, size: (u32, u32), samples: ImageSamples, display: Display) -> String {
        let folder = absolute(path).parent().map(Path::to_path_buf).unwrap_or_default();
        let relative = |path: &Path| relative_path(&folder, path);
        let scene = match &self.source {
            Some(SceneSource::Builtin(name)) => ImageScene::Builtin(name.clone()),
            Some(SceneSource::Scene(path) | SceneSource::Foreign(path)) => ImageScene::Scene(relative(path)),
            Some(SceneSource::Model(path)) => {
                let up = self.up.map(|up| if up == UpAxis::Y { 'y' } else { 'z' });
                let camera = self.loaded.as_ref().and_then(|loaded| loaded.choice.camera.clone());
                ImageScene::Model { path: relative(path), up, camera }
            }
            // What is named by the image, though it could not be read, is where the paths in the text count from.
            Some(SceneSource::Picture(from)) => {
                let shot = self.loaded.as_ref().and_then(|loaded| loaded.shot.clone());
                shot.map_or(ImageScene::None, |shot| shot.moved(from, path).scene)
            }
            None => ImageScene::None,
        };
        let file = &self.description.file;
        let Prints { content, has_changed } = self.prints();
        let film = FilmPart { width: size.0, height: size.1, filter: file.film.filter };
        let shot = ImageMetadata {
            format: FORMAT,
            program: concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene,
            fingerprint: content.to_string(),
            camera: shown_camera(file),
            film,
            integrator: file.integrator,
            max_depth: file.max_depth,
            display,
            seed: self.seed,
            first_sample: samples.first,
            spp: samples.spp,
            allocation: self.allocation,
            uneven: samples.uneven,
            denoised: None,
            denoised_layer: None,
            ended_early: None,
            // An image of the image has the same text.
            text: has_changed.then(|| SceneFile { film, display, ..file.clone() }.to_ron()),
        };
        shot.to_note()
    }
}

impl MetadataDraft {
    fn prints(&self) -> Prints {
        *self.prints.get_or_init(|| {
            let content = self.content.fingerprint();
            let opened = self.loaded.as_ref().map(LoadedScene::content_fingerprint);
            // The file does not name a replaced environment, nor the camera, time or variant of a model, nor the values
            // of its parameters; and a scene that was stored in an image has no file.
            let is_own = |it: &LoadedScene| {
                it.environment.is_some()
                    || it.choice.at.is_some()
                    || it.choice.shutter.is_some()
                    || it.choice.variant.is_some()
                    || it.choice.camera.is_some()
                    || !it.choice.defines.is_empty()
                    || it.shot.as_ref().is_some_and(|shot| shot.text.is_some())
            };
            let is_another = opened != Some(content) || self.loaded.as_ref().is_some_and(is_own);
            Prints { content, has_changed: is_another && self.description.loose_meshes.is_empty() }
        })
    }
}
