//! Resources that the systems of a frame share, apart from the scene itself.

use crate::frame::core::offline::Target;
use crate::frame::core::reset::Changes;
use crate::frame::worker::{ViewOptions, Worker};
use crate::render::{Display, Integrator, Prepared, RenderSettings};
use crate::scene::{ExtentCache, Extraction, LoadedScene, SceneInputs, Shape, Trees};
use bevy_ecs::prelude::Resource;
use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::Duration;

/// The time of this frame, on the caller's clock.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct Clock(pub Duration);

/// The image size. Without pixels (a minimised window) the last film is kept and rendering stops.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureSize {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl PictureSize {
    /// Whether there are no pixels.
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// Width over height; 1 without pixels.
    pub fn aspect(self) -> f64 {
        if self.is_empty() { 1.0 } else { f64::from(self.width) / f64::from(self.height) }
    }
}

/// When to stop rendering.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct StopAt(pub Target);

/// Maximum number of worker threads.
pub(crate) const MAX_THREADS: usize = 1024;

/// Number of worker threads; 0 for one per processor.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Threads(pub usize);

/// Rendering is paused, and all samples are kept.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paused(pub bool);

/// The image is not visible: rendering stops, whatever else is requested.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WindowHidden(pub bool);

/// What is displayed in place of the image and over it; samples do not depend on it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewMode(pub ViewOptions);

/// The region that gets all samples, in fractions of the image: left, top, right, bottom.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderRegion(pub Option<[f64; 4]>);

/// The render thread.
#[derive(Resource)]
pub struct Renderer(pub Worker);

/// The open scene, for saving and reopening.
#[derive(Resource, Clone)]
pub struct CurrentScene(pub Arc<LoadedScene>);

/// The requested time of the open model's animations in seconds, or `Some(None)` for the stored pose; `None` once it is
/// being loaded.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct WantedMoment {
    /// Seconds, or `None` for the stored pose of a glTF model.
    pub at: Option<Option<f64>>,
    /// Seconds by which to advance; of playing, what is left to the next frame.
    pub advance: f64,
}

/// The moment of an animation that is shown.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShownMoment {
    pub seconds: f64,
    /// When it last changed, until it has rested.
    pub changed_at: Option<Duration>,
    /// Seconds from a frame of the animation to the next.
    pub per_frame: f64,
    /// The moment of the rendered inputs: an earlier one while trees are awaited.
    pub of_inputs: f64,
}

/// The part of the animation that plays over and over, seconds; `None` for all of it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct PlayRange(pub Option<[f64; 2]>);

impl PlayRange {
    /// A time of an animation of this length, seconds, in what plays: past its end it starts over.
    pub fn wrap(self, seconds: f64, length: f64) -> f64 {
        let [from, until] = self.0.map(|range| range.map(|end| end.min(length))).unwrap_or([0.0, length]);
        // An animation that became shorter may leave nothing of it.
        let [from, until] = if from < until { [from, until] } else { [0.0, length] };
        if (from..until).contains(&seconds) { seconds } else { from + (seconds - from).rem_euclid(until - from) }
    }
}

/// Number of scenes that have been opened so far.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneGeneration(pub u64);

/// What the workers were given last, to compare with.
#[derive(Resource, Default)]
pub struct RenderState {
    pub inputs: SceneInputs,
    pub extraction: Option<Extraction>,
    pub trees: Trees,
    /// The exposure interval in seconds, if anything moves in it.
    pub(crate) exposure: Option<RangeInclusive<f64>>,
    pub(crate) extents: ExtentCache,
    pub(crate) look: ViewOptions,
    pub(crate) settings: RenderSettings,
    pub(crate) display: Display,
    pub(crate) size: Option<PictureSize>,
    pub(crate) target: Option<Target>,
    pub(crate) threads: Option<usize>,
    pub(crate) paused: bool,
    /// Whether the workers have not got the job of what is to be rendered.
    pub(crate) is_unordered: bool,
    pub(crate) region: Option<[f64; 4]>,
    /// Whether a tree has arrived that changes of the world may have waited for.
    pub(crate) waiting: bool,
    /// Whether the world has changes that wait for a tree: another moment would only replace this one unseen.
    pub(crate) builds_missing: bool,
    pub(crate) moment: ShownMoment,
    /// When the objects last changed, if that may be a reason to build trees that meshes share.
    pub(crate) unsettled_since: Option<Duration>,
    /// Whether such trees are being built.
    pub(crate) builds_statics: bool,
    /// Whether final trees of the rendered scene are available.
    pub(crate) better_trees: bool,
    /// Selected meshes whose own trees are being built.
    pub(crate) prepared_moves: Vec<Shape>,
    /// Shapes whose final trees are being built.
    pub(crate) improving: Vec<Shape>,
    /// Discard all samples at the next frame, for this reason.
    pub(crate) restart: Option<&'static str>,
    /// A scene has been opened, for this reason.
    pub(crate) adopted: Option<String>,
    pub(crate) generation: u64,
    /// Increases with every restart but those for another size of the image.
    pub(crate) view: u64,
    /// Increases when anything but the camera is changed.
    pub(crate) revision: u64,
}

impl RenderState {
    /// Empty, for a session, which does not wait for trees of large meshes.
    pub(crate) fn for_session() -> Self {
        Self { trees: Trees { defers: true, ..Trees::default() }, ..Self::default() }
    }

    /// Generation of the image that is being rendered.
    pub(crate) fn generation(&self) -> u64 {
        self.generation
    }

    /// Increases whenever lists of the scene's contents may be outdated; camera motion does not count.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    pub(crate) fn rendered(&self) -> Option<(Prepared, RenderSettings)> {
        Some((self.extraction.as_ref()?.prepared.clone(), self.settings))
    }

    pub(crate) fn integrator(&self) -> Integrator {
        self.settings.integrator
    }
}

/// The changes detected in this frame.
#[derive(Resource, Default)]
pub struct FrameChanges(pub Changes);
