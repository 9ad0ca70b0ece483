//! A session: one scene, its image, and the threads that render it. The interface for a window or a script.

use crate::frame::Command;
use crate::frame::adopt::adopt;
use crate::frame::core::latency::LatencyHistogram;
use crate::frame::core::offline::Target;
use crate::frame::core::rig::{Rig, Turning};
use crate::frame::core::status::{MessageKind, Picture, Status};
use crate::frame::edit::{EditQueue, edit_scene};
use crate::frame::focus::{Focus, hold_focus};
use crate::frame::image::feature_layers::FeatureNames;
use crate::frame::input::{CommandQueue, ModelUp, input};
use crate::frame::object_map::ObjectMapSource;
use crate::frame::recording::{Recorder, record};
use crate::frame::reload::{HotReload, reload};
use crate::frame::saving::{SavedAs, Saving, save};
use crate::frame::scene_bounds::SceneBounds;
use crate::frame::state::background::BackgroundTasks;
use crate::frame::state::explain::{Explaining, explain_pixel};
use crate::frame::state::history::{History, notice, remember};
use crate::frame::state::resources::{
    Clock, CurrentScene, FrameChanges, MAX_THREADS, Paused, PictureSize, PlayRange, RenderRegion, RenderState,
    Renderer, SceneGeneration, StopAt, Threads, ViewMode, WantedMoment, WindowHidden,
};
use crate::frame::state::seen_lights::{axis_of, light_at};
use crate::frame::state::selection::{ActivePart, OwnBox, Selection};
use crate::frame::systems::{accumulate, develop, edit, present, rebuild, reset};
use crate::frame::views::{Bookmarks, ViewTrail};
use crate::frame::walls::is_in_room;
use crate::frame::worker::{KeptFilm, Waker, Worker};
use crate::render::{Film, Prepared, RenderSettings, SampleAllocation};
use crate::scene::{
    BadValue, Description, DisplaySettings, Extent, Inventory, LoadedScene, MetadataDraft, ModelChoice, Rendering,
    SceneInputs, SceneSource, UpAxis, check_film_size, unpacked_folder,
};
use bevy_ecs::prelude::{Entity, IntoScheduleConfigs, World};
use bevy_ecs::schedule::{Schedule, ScheduleLabel, SingleThreadedExecutor, SystemSet};
use bevy_ecs::system::ScheduleSystem;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// Options of a new session.
#[derive(Clone, Default)]
pub struct SessionOptions {
    /// Width of the image in pixels; 0 if the size is not known yet, and the session waits for it.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
    /// Number of worker threads; one per processor if not given.
    pub threads: Option<usize>,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Sample allocation for scenes that do not come from an image; an image has its own.
    pub allocation: SampleAllocation,
    /// When to stop; without a target, rendering never ends.
    pub target: Target,
    /// Workers yield to other threads, such as those that draw a window.
    pub yielding: bool,
    /// Up axis of models; guessed if not given.
    pub up: Option<UpAxis>,
    /// Called from another thread when [`Session::update`] would find new results.
    pub waker: Option<Waker>,
}

/// Why a session cannot be created.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The image size or the target is out of range.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// The system cannot start more threads; a whole sentence.
    #[error("{0}")]
    Threads(String),
}

impl From<SessionError> for String {
    fn from(error: SessionError) -> Self {
        error.to_string()
    }
}

/// Stages of a frame, in the order of execution. User systems join with `.in_set(…)`.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Commands become changes of components.
    Input,
    /// Loaded scenes replace the current one; user systems make their changes.
    Edit,
    /// Changes are detected, and the affected part of the snapshot is rebuilt.
    Rebuild,
    /// Samples are discarded if they are no longer valid.
    Reset,
    /// The workers get their job.
    Accumulate,
    /// The workers get the display settings.
    Develop,
    /// Finished images are fetched.
    Present,
}

#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
struct FrameSchedule;

/// A world, its schedule, and the threads that render it.
pub struct Session {
    world: World,
    frame: Schedule,
}

impl Session {
    /// Creates a session without a scene: [`open`](Self::open) one, or spawn entities into its
    /// [`world_mut`](Self::world_mut).
    ///
    /// # Errors
    /// If the threads cannot be started, or the image size or the target is out of range.
    pub fn new(options: SessionOptions) -> Result<Self, SessionError> {
        if options.width > 0 && options.height > 0 {
            check_film_size(options.width, options.height)?;
        }
        options.target.check()?;
        let threads = options.threads.unwrap_or(0).min(MAX_THREADS);
        let worker = Worker::start(threads, options.yielding, options.target, options.waker.clone())
            .map_err(SessionError::Threads)?;
        let mut world = World::new();
        world.insert_resource(Renderer(worker));
        let waker = options.waker;
        world.insert_resource(BackgroundTasks::new(waker.clone()));
        world.insert_resource(PictureSize { width: options.width, height: options.height });
        let settings =
            RenderSettings { seed: options.seed, allocation: options.allocation, ..RenderSettings::default() };
        world.insert_resource(Rendering(settings));
        world.insert_resource(StopAt(options.target));
        world.insert_resource(Threads(threads));
        world.insert_resource(ModelUp(options.up));
        let around = SceneBounds {
            extent: Extent::default(),
            corners: Vec::new(),
            home: Rig::default(),
            turning: Turning::default(),
            side_view: None,
            pace: None,
            reach: None,
            ground: None,
            floor: None,
        };
        world.insert_resource(around);
        world.init_resource::<Clock>();
        world.init_resource::<Paused>();
        world.init_resource::<DisplaySettings>();
        world.init_resource::<CommandQueue>();
        world.insert_resource(RenderState::for_session());
        world.init_resource::<FrameChanges>();
        world.init_resource::<Picture>();
        world.init_resource::<Status>();
        world.init_resource::<SceneGeneration>();
        world.init_resource::<SavedAs>();
        world.init_resource::<WantedMoment>();
        world.init_resource::<PlayRange>();
        world.init_resource::<Recorder>();
        world.insert_resource(Saving::new(waker.clone()));
        world.insert_resource(HotReload::new(waker));
        world.init_resource::<EditQueue>();
        world.init_resource::<Selection>();
        world.init_resource::<ActivePart>();
        world.init_resource::<History>();
        world.init_resource::<Focus>();
        world.init_resource::<Bookmarks>();
        world.init_resource::<ViewTrail>();
        world.init_resource::<WindowHidden>();
        world.init_resource::<ViewMode>();
        world.init_resource::<RenderRegion>();
        world.init_resource::<Explaining>();

        let mut frame = Schedule::new(FrameSchedule);
        // That of Bevy's features would wait here for the thread pool whose only thread may be the one that calls.
        frame.set_executor(SingleThreadedExecutor::new());
        frame.configure_sets(
            (
                Stage::Input,
                Stage::Edit,
                Stage::Rebuild,
                Stage::Reset,
                Stage::Accumulate,
                Stage::Develop,
                Stage::Present,
            )
                .chain(),
        );
        frame.add_systems((
            (record, input).chain().in_set(Stage::Input),
            (edit, edit_scene, hold_focus, save, reload).chain().in_set(Stage::Edit),
            // After user systems, so that their changes can be undone too.
            (notice, remember).chain().after(Stage::Edit).before(Stage::Rebuild),
            rebuild.in_set(Stage::Rebuild),
            reset.in_set(Stage::Reset),
            (accumulate, explain_pixel).chain().in_set(Stage::Accumulate),
            develop.in_set(Stage::Develop),
            present.in_set(Stage::Present),
        ));
        Ok(Self { world, frame })
    }

    /// Starts to load a scene in the background. A later [`update`](Self::update) replaces the current scene by it; if
    /// loading fails, the [`status`](Self::status) has a message, and the current scene stays.
    pub fn open(&mut self, source: SceneSource) {
        self.open_lit_by(source, None);
    }

    /// Like [`Self::open`], with an image in place of the scene's own environment.
    pub fn open_lit_by(&mut self, source: SceneSource, environment: Option<PathBuf>) {
        self.open_choice(source, environment, ModelChoice::default());
    }

    /// Like [`Self::open_lit_by`], for a model with several cameras, times or variants.
    pub fn open_choice(&mut self, source: SceneSource, environment: Option<PathBuf>, choice: ModelChoice) {
        let aspect = self.world.resource::<PictureSize>().aspect();
        let up = self.world.resource::<ModelUp>().0;
        let pool = self.world.resource::<Renderer>().0.pool();
        self.world.resource::<BackgroundTasks>().load(source, (up, environment), choice, aspect, pool, None);
    }

    /// Replaces the current scene by one that has been loaded already.
    pub fn adopt(&mut self, scene: LoadedScene) {
        let now = self.world.resource::<Clock>().0;
        adopt(&mut self.world, scene, now);
    }

    /// Queues a command; the next [`update`](Self::update) executes all of them in order.
    pub fn send(&mut self, command: Command) {
        self.world.resource_mut::<CommandQueue>().0.push(command);
    }

    /// Adds user systems; select the stage with `.in_set(…)`.
    pub fn add_systems<M>(&mut self, systems: impl IntoScheduleConfigs<ScheduleSystem, M>) {
        self.frame.add_systems(systems);
    }

    /// Runs one frame; never waits for the image. `now` is the time since any fixed moment, and must not decrease.
    pub fn update(&mut self, now: Duration) {
        self.world.resource_mut::<Clock>().0 = now;
        self.frame.run(&mut self.world);
        self.world.clear_trackers();
    }

    /// The newest image; empty before the first.
    pub fn picture(&self) -> &Picture {
        self.world.resource()
    }

    /// Reports that the image of this number is displayed. With these reports, workers pause until a coarse image is
    /// displayed; without any, they do not.
    pub fn note_seen(&self, number: u64) {
        self.world.resource::<Renderer>().0.note_seen(number);
    }

    /// Progress, messages, and the state of rendering.
    pub fn status(&self) -> &Status {
        self.world.resource()
    }

    /// The world with the scene's entities and the session's resources.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Mutable access to the world; the next [`Self::update`] detects the changes.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// Returns a copy of the film for saving: linear radiance at the current resolution. Takes a few milliseconds.
    pub fn film_snapshot(&self) -> Option<Film> {
        self.world.resource::<Renderer>().0.film()
    }

    /// Requests the film of the current view for saving; never blocks. It is sent once every pixel has a sample at full
    /// resolution; a coarser one is sent if the view changes or the workers go to sleep before that. Without a film,
    /// the channel is closed.
    ///
    /// - `denoised`: with the denoised image that is displayed, or as soon as one is.
    pub fn keep_film(&self, denoised: bool) -> Receiver<KeptFilm> {
        self.world.resource::<Renderer>().0.keep_film(denoised)
    }

    /// Returns the metadata for an image of the current view: see [`MetadataDraft::note`].
    pub fn shot_draft(&mut self) -> MetadataDraft {
        let current = self.world.get_resource::<CurrentScene>().map(|current| current.0.clone());
        MetadataDraft::of(&mut self.world, current.as_deref())
    }

    /// The snapshot and the settings that are being rendered.
    pub fn rendered(&self) -> Option<(Prepared, RenderSettings)> {
        self.world.resource::<RenderState>().rendered()
    }

    /// Names of the objects and materials that are being rendered, for layers of an image.
    pub fn feature_names(&self) -> Option<FeatureNames> {
        let shown = self.world.resource::<RenderState>();
        Some(FeatureNames::of(shown.extraction.as_ref()?, &shown.inputs))
    }

    /// Number of scenes that have been opened so far.
    pub fn n_adopted(&self) -> u64 {
        self.world.resource::<SceneGeneration>().0
    }

    /// Where the open scene is saved: the last saved file, or else the scene file that was opened. None for a scene of an
    /// archive, whose files may be deleted at any time, for that of an image, which may name any scene file of the user's
    /// as its own, and for one without some of its images, which the file still names.
    pub fn scene_file(&self) -> Option<PathBuf> {
        let saved = self.world.resource::<SavedAs>().path.clone();
        saved.or_else(|| {
            let scene = &self.world.get_resource::<CurrentScene>()?.0;
            match &scene.source {
                SceneSource::Scene(path)
                    if scene.shot.is_none() && unpacked_folder(path).is_none() && scene.lost_images.is_empty() =>
                {
                    Some(path.clone())
                }
                _ => None,
            }
        })
    }

    /// Whether there are edits since the scene was opened or saved.
    pub fn has_unsaved_edits(&self) -> bool {
        self.world.resource::<History>().is_unsaved()
    }

    /// Whether something is being saved, or will be.
    pub fn is_saving(&self) -> bool {
        !self.world.resource::<Saving>().is_idle() || !self.world.resource::<CommandQueue>().0.is_empty()
    }

    /// The scene as text, as [`Command::SaveScene`] would write it.
    pub fn describe(&mut self) -> Description {
        let current = self.world.get_resource::<CurrentScene>().map(|current| current.0.clone());
        Description::of(&mut self.world, current.as_deref())
    }

    /// Pool for other work, with as many threads as the workers have.
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        self.world.resource::<Renderer>().0.pool()
    }

    /// Latencies until the workers abandoned invalid work.
    pub fn cancels(&self) -> LatencyHistogram {
        self.world.resource::<Renderer>().0.cancels()
    }

    /// The scene as it is rendered.
    pub fn inputs(&self) -> &SceneInputs {
        &self.world.resource::<RenderState>().inputs
    }

    /// Lists of the scene's contents, which are valid as long as [`revision`](Self::revision) does not change.
    pub fn inventory(&self) -> Inventory {
        Inventory::of(&self.world, self.inputs())
    }

    /// Increases when anything but the camera is changed.
    pub fn revision(&self) -> u64 {
        self.world.resource::<RenderState>().revision()
    }

    /// Whether something that changes in time has been changed without a key: another time takes that back.
    pub fn needs_keys(&self) -> bool {
        !crate::scene::animation::off_their_tracks(&self.world).is_empty()
    }

    /// Adds to the messages that a file has been saved.
    pub fn log_saved(&mut self, text: String) {
        let now = self.world.resource::<Clock>().0;
        self.world.resource_mut::<Status>().say(now, MessageKind::Saved, text);
    }

    /// Whether the camera is in a room, not in front of things; `None` while the scene is not there to be seen.
    pub fn is_in_room(&self) -> Option<bool> {
        let shown = self.world.resource::<RenderState>();
        let scene = shown.extraction.as_ref().filter(|_| !shown.builds_missing)?;
        Some(is_in_room(scene, &self.status().rig.view))
    }

    /// The box around an object or a light, along its own axes.
    pub fn box_of(&mut self, entity: Entity) -> Option<OwnBox> {
        crate::frame::state::selection::box_of(&mut self.world, entity)
    }

    /// The object or light at this position in the image, fractions from the upper left corner.
    pub fn entity_at(&self, x: f64, y: f64) -> Option<Entity> {
        let (aspect, shown) = (self.world.resource::<PictureSize>().aspect(), self.world.resource::<RenderState>());
        let picked = || crate::frame::state::selection::pick(shown.extraction.as_ref()?, x, y, aspect);
        light_at(shown, [x, y], aspect).or_else(|| picked().map(|picked| picked.entity))
    }

    /// The axis of a spot light, from the light to what it hits, in the world; `None` for others.
    pub fn axis_of(&self, light: Entity) -> Option<[glam::DVec3; 2]> {
        axis_of(self.world.resource::<RenderState>(), light)
    }

    /// What a map of the objects of each pixel is made of.
    pub fn object_map(&self) -> Option<ObjectMapSource> {
        self.world.resource::<RenderState>().extraction.as_ref().map(ObjectMapSource::of)
    }

    /// Memory of all trees in bytes.
    pub fn tree_bytes(&self) -> usize {
        self.world.resource::<RenderState>().trees.bytes()
    }

    /// Whether there will be no new results without a change: the workers sleep and nothing is being loaded.
    pub fn is_idle(&self) -> bool {
        let renderer = &self.world.resource::<Renderer>().0;
        let nothing_to_show = !renderer.has_picture();
        let asleep = renderer.is_asleep();
        let no_commands = self.world.resource::<CommandQueue>().0.is_empty();
        let saved = self.world.resource::<Saving>().is_idle();
        let explained = self.world.resource::<Explaining>().is_idle();
        asleep
            && nothing_to_show
            && no_commands
            && saved
            && explained
            && self.world.resource::<BackgroundTasks>().is_idle()
            && self.world.resource::<RenderState>().unsettled_since.is_none()
    }

    /// When [`update`](Self::update) should be called even if nothing calls the waker; `None` for never.
    ///
    /// Everything in the background calls the waker, so only queued commands need a frame, and meshes that have come to
    /// rest.
    pub fn next_wake(&self, now: Duration) -> Option<Duration> {
        let commands = (!self.world.resource::<CommandQueue>().0.is_empty()).then_some(now);
        let shown = self.world.resource::<RenderState>();
        [commands, shown.next_sharing(), shown.next_improving()].into_iter().flatten().min()
    }
}
