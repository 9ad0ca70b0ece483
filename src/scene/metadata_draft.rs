//! The note of a picture to come.

use super::describe::Description;
use super::file::{DisplayPart, FilmPart};
use super::fingerprint::{Fingerprint, SceneContent};
use super::image_metadata::{FORMAT, ImageMetadata, ImageSamples, ImageScene};
use super::loaded::LoadedScene;
use super::relative::{absolute, relative_path};
use super::source::{SceneSource, UpAxis};
use crate::render::SampleAllocation;
use bevy_ecs::prelude::World;
use std::path::Path;
use std::sync::OnceLock;

/// All that a note needs of a world; made at once, finished later, when the film is there.
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

/// What takes a look at everything in the scene: some seconds where a million objects are.
#[derive(Clone, Copy, Debug)]
struct Prints {
    content: Fingerprint,
    /// The scene is another than the one that was opened, and can be said in words.
    has_changed: bool,
}

impl MetadataDraft {
    /// Of what `world` shows; `loaded` is the scene that was opened into it.
    pub fn of(world: &mut World, loaded: Option<&LoadedScene>) -> Self {
        let description = Description::of(world, loaded);
        let settings = world.get_resource::<super::Rendering>().map(|rendering| rendering.0).unwrap_or_default();
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

    /// Does now what takes long about [`note`](Self::note).
    pub fn prepare(&self) {
        self.prints();
    }

    /// The same, for a draft of the same scene seen from elsewhere.
    pub fn prepared_as(mut self, other: &Self) -> Self {
        self.prints = other.prints.clone();
        self
    }

    /// The note of a picture that will lie at `path`, of a film of this size and so many samples.
    pub fn note(&self, path: &Path, size: (u32, u32), samples: ImageSamples, display: DisplayPart) -> String {
        let folder = absolute(path).parent().map(Path::to_path_buf).unwrap_or_default();
        let relative = |path: &Path| relative_path(&folder, path);
        let scene = match &self.source {
            Some(SceneSource::Builtin(name)) => ImageScene::Builtin(name.clone()),
            Some(SceneSource::Scene(path)) => ImageScene::Scene(relative(path)),
            Some(SceneSource::Model(path)) => {
                let up = self.up.map(|up| if up == UpAxis::Y { 'y' } else { 'z' });
                ImageScene::Model { path: relative(path), up }
            }
            Some(SceneSource::Picture(_)) | None => ImageScene::None,
        };
        let file = &self.description.file;
        let Prints { content, has_changed } = self.prints();
        let shot = ImageMetadata {
            format: FORMAT,
            program: concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene,
            fingerprint: content.to_string(),
            camera: file.camera.clone(),
            film: FilmPart { width: size.0, height: size.1, filter: file.film.filter },
            integrator: file.integrator,
            max_depth: file.max_depth,
            display,
            seed: self.seed,
            first_sample: samples.first,
            spp: samples.spp,
            allocation: self.allocation,
            uneven: samples.uneven,
            denoised: None,
            text: has_changed.then(|| file.to_ron()),
        };
        shot.to_note()
    }
}

impl MetadataDraft {
    fn prints(&self) -> Prints {
        *self.prints.get_or_init(|| {
            let content = self.content.fingerprint();
            let opened = self.loaded.as_ref().map(LoadedScene::content_fingerprint);
            // What was opened has an environment that its file does not name, or was itself written into a picture.
            // Nor does its file say which moment or variant of a model is shown.
            let is_own = |it: &LoadedScene| {
                it.environment.is_some()
                    || it.choice.at.is_some()
                    || it.choice.variant.is_some()
                    || it.shot.as_ref().is_some_and(|shot| shot.text.is_some())
            };
            let is_another = opened != Some(content) || self.loaded.as_ref().is_some_and(is_own);
            Prints { content, has_changed: is_another && self.description.loose_meshes.is_empty() }
        })
    }
}
