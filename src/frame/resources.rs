//! What the systems of a frame share, beside the scene itself.

use super::offline::Target;
use super::reset::Changes;
use super::worker::{ViewOptions, Worker};
use crate::render::{Display, Integrator, Prepared, RenderSettings};
use crate::scene::{ExtentCache, Extraction, LoadedScene, SceneInputs, Shape, Trees};
use bevy_ecs::prelude::Resource;
use std::sync::Arc;
use std::time::Duration;

/// The time of this frame, on the clock of whoever runs it.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct Clock(pub Duration);

/// The size of the picture, pixels. Without pixels (a minimised window) the last film is kept and rendering rests.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureSize {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl PictureSize {
    /// Whether it has no pixels.
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// Width over height; 1 without pixels.
    pub fn aspect(self) -> f64 {
        if self.is_empty() { 1.0 } else { f64::from(self.width) / f64::from(self.height) }
    }
}

/// When the picture is good enough.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct StopAt(pub Target);

/// Worker threads at most.
pub(super) const MAX_THREADS: usize = 1024;

/// Worker threads; 0 is one a processor.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Threads(pub usize);

/// Rendering rests, and all samples are kept.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paused(pub bool);

/// Nobody can see the picture: rendering rests, whatever else is asked for.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hidden(pub bool);

/// What is shown in place of the picture, and over it; no sample depends on this.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewMode(pub ViewOptions);

/// The part of the picture that gets all samples, in fractions of it: left, top, right, bottom.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderRegion(pub Option<[f64; 4]>);

/// The far end of the pipe.
#[derive(Resource)]
pub struct Renderer(pub Worker);

/// The scene that is open, for saving and reopening.
#[derive(Resource, Clone)]
pub struct CurrentScene(pub Arc<LoadedScene>);

/// The moment of the open model's animations that is asked for, seconds, or the stored pose; until it is being read.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct WantedMoment(pub Option<Option<f64>>);

/// How many scenes have taken their place so far.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneGeneration(pub u64);

/// What the workers have been given, to compare with.
#[derive(Resource, Default)]
pub struct RenderState {
    pub inputs: SceneInputs,
    pub extraction: Option<Extraction>,
    pub trees: Trees,
    pub(super) extents: ExtentCache,
    pub(super) look: ViewOptions,
    pub(super) settings: RenderSettings,
    pub(super) display: Display,
    pub(super) size: Option<PictureSize>,
    pub(super) target: Option<Target>,
    pub(super) threads: Option<usize>,
    pub(super) paused: bool,
    pub(super) region: Option<[f64; 4]>,
    /// The world has changes that wait for a tree.
    pub(super) waiting: bool,
    /// Better trees of what is shown are there.
    pub(super) better_trees: bool,
    /// Meshes whose better trees are being built, by address.
    pub(super) improving: Vec<Shape>,
    /// Drop all samples at the next frame, for this reason.
    pub(super) restart: Option<&'static str>,
    /// A scene has taken its place, for this reason.
    pub(super) adopted: Option<String>,
    pub(super) generation: u64,
    /// Grows when anything but the camera has been touched.
    pub(super) revision: u64,
}

impl RenderState {
    /// Of the picture that is rendered now.
    pub(super) fn generation(&self) -> u64 {
        self.generation
    }

    /// Grows whenever lists of what is in the scene may have become wrong; a camera that moves makes none wrong.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    pub(super) fn rendered(&self) -> Option<(Prepared, RenderSettings)> {
        Some((self.extraction.as_ref()?.prepared.clone(), self.settings))
    }

    pub(super) fn integrator(&self) -> Integrator {
        self.settings.integrator
    }
}

/// What this frame found to be different.
#[derive(Resource, Default)]
pub struct FrameChanges(pub Changes);
