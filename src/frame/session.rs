//! One scene, its picture, and everything between: what a window or a script holds on to.

use super::adopt::adopt;
use super::background::BackgroundTasks;
use super::edit::{EditQueue, edit_scene};
use super::explain::{Explaining, explain_pixel};
use super::feature_layers::FeatureNames;
use super::focus::{Focus, hold_focus};
use super::history::{History, notice, remember};
use super::input::{CommandQueue, ModelUp, input};
use super::navigation::{Rig, Turning};
use super::recording::{Recorder, record};
use super::reload::{HotReload, reload};
use super::resources::{
    Clock, CurrentScene, FrameChanges, Hidden, MAX_THREADS, Paused, PictureSize, RenderRegion, RenderState, Renderer,
    SceneGeneration, StopAt, Threads, ViewMode, WantedMoment,
};
use super::saving::{SavedAs, Saving, save};
use super::scene_bounds::SceneBounds;
use super::selection::{OwnBox, Selection};
use super::status::{Picture, Status};
use super::systems::{accumulate, develop, edit, present, rebuild, reset};
use super::views::{Bookmarks, ViewTrail};
use super::worker::{Waker, Worker};
use super::{Command, LatencyHistogram, Target};
use crate::render::{Film, Prepared, RenderSettings, SampleAllocation};
use crate::scene::{
    BadValue, Description, DisplaySettings, Extent, Inventory, LoadedScene, MetadataDraft, ModelChoice, Rendering,
    SceneInputs, SceneSource, UpAxis, check_film_size,
};
use bevy_ecs::prelude::{Entity, IntoScheduleConfigs, World};
use bevy_ecs::schedule::{Schedule, ScheduleLabel, SystemSet};
use bevy_ecs::system::ScheduleSystem;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// How to start.
#[derive(Clone, Default)]
pub struct SessionOptions {
    /// Width of the picture in pixels; 0 means that there is none yet, and the session waits for a size.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// One a processor when not given.
    pub threads: Option<usize>,
    /// Seed of the random numbers.
    pub seed: u32,
    /// How samples are spread over the pixels of scenes that do not come from an image, which has its own.
    pub allocation: SampleAllocation,
    /// When the picture is good enough; without a target it is rendered for ever.
    pub target: Target,
    /// Workers give way to other threads, for one that draws a window too.
    pub yielding: bool,
    /// Which axis of models points up; guessed when not given.
    pub up: Option<UpAxis>,
    /// Called from another thread when [`Session::update`] would find something new.
    pub waker: Option<Waker>,
}

/// Why a session cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The size of the picture or the target is out of range.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// The system starts no more threads; a whole sentence.
    #[error("{0}")]
    Threads(String),
}

impl From<SessionError> for String {
    fn from(error: SessionError) -> Self {
        error.to_string()
    }
}

/// The parts of a frame, in the order in which they run. Systems of a user's own fit in with `.in_set(…)`.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Commands become changes.
    Input,
    /// Scenes that were read take their place; a user's systems change what they like.
    Edit,
    /// What changed is found, and the part of the snapshot that depends on it made anew.
    Rebuild,
    /// The samples are dropped if they are worthless.
    Reset,
    /// The workers get their job.
    Accumulate,
    /// The workers are told how to develop it.
    Develop,
    /// Finished pictures are fetched.
    Present,
}

#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
struct Frame;

/// A world, its schedule, and the threads that render it.
pub struct Session {
    world: World,
    frame: Schedule,
}

impl Session {
    /// A session without a scene: [`open`](Self::open) one, or spawn entities into its [`world_mut`](Self::world_mut).
    ///
    /// # Errors
    /// When the threads cannot be started, or no picture may have that size.
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
            pace: None,
        };
        world.insert_resource(around);
        world.init_resource::<Clock>();
        world.init_resource::<Paused>();
        world.init_resource::<DisplaySettings>();
        world.init_resource::<CommandQueue>();
        world.init_resource::<RenderState>();
        world.init_resource::<FrameChanges>();
        world.init_resource::<Picture>();
        world.init_resource::<Status>();
        world.init_resource::<SceneGeneration>();
        world.init_resource::<SavedAs>();
        world.init_resource::<WantedMoment>();
        world.init_resource::<Recorder>();
        world.insert_resource(Saving::new(waker.clone()));
        world.insert_resource(HotReload::new(waker));
        world.init_resource::<EditQueue>();
        world.init_resource::<Selection>();
        world.init_resource::<History>();
        world.init_resource::<Focus>();
        world.init_resource::<Bookmarks>();
        world.init_resource::<ViewTrail>();
        world.init_resource::<Hidden>();
        world.init_resource::<ViewMode>();
        world.init_resource::<RenderRegion>();
        world.init_resource::<Explaining>();

        let mut frame = Schedule::new(Frame);
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
            // After a user's own systems, so that what they change can be undone too.
            (notice, remember).chain().after(Stage::Edit).before(Stage::Rebuild),
            rebuild.in_set(Stage::Rebuild),
            reset.in_set(Stage::Reset),
            (accumulate, explain_pixel).chain().in_set(Stage::Accumulate),
            develop.in_set(Stage::Develop),
            present.in_set(Stage::Present),
        ));
        Ok(Self { world, frame })
    }

    /// Begins to read a scene beside the old picture. It takes its place in a later [`update`](Self::update); when it
    /// cannot be read, that is a message in the [`status`](Self::status), and the old scene stays.
    pub fn open(&mut self, source: SceneSource) {
        self.open_lit_by(source, None);
    }

    /// The same with an image in place of the scene's own environment.
    pub fn open_lit_by(&mut self, source: SceneSource, environment: Option<PathBuf>) {
        self.open_choice(source, environment, ModelChoice::default());
    }

    /// The same of a model that has more than one camera, moment or variant.
    pub fn open_choice(&mut self, source: SceneSource, environment: Option<PathBuf>, choice: ModelChoice) {
        let aspect = self.world.resource::<PictureSize>().aspect();
        let up = self.world.resource::<ModelUp>().0;
        let pool = self.world.resource::<Renderer>().0.pool();
        self.world.resource::<BackgroundTasks>().load(source, (up, environment), choice, aspect, pool, None);
    }

    /// Takes over a scene that has been read already.
    pub fn adopt(&mut self, scene: LoadedScene) {
        let now = self.world.resource::<Clock>().0;
        adopt(&mut self.world, scene, now);
    }

    /// Will be carried out at the next [`update`](Self::update), in order.
    pub fn send(&mut self, command: Command) {
        self.world.resource_mut::<CommandQueue>().0.push(command);
    }

    /// Adds systems of a user's own; name the stage with `.in_set(…)`.
    pub fn add_systems<M>(&mut self, systems: impl IntoScheduleConfigs<ScheduleSystem, M>) {
        self.frame.add_systems(systems);
    }

    /// Runs one frame. Never waits for the picture; `now` counts from any moment, and never goes back.
    pub fn update(&mut self, now: Duration) {
        self.world.resource_mut::<Clock>().0 = now;
        self.frame.run(&mut self.world);
        self.world.clear_trackers();
    }

    /// The newest picture; empty before the first.
    pub fn picture(&self) -> &Picture {
        self.world.resource()
    }

    /// The picture of this number is on the window. A session that is told holds its workers back until a coarse picture can
    /// be seen; one that is never told does not.
    pub fn note_seen(&self, number: u64) {
        self.world.resource::<Renderer>().0.note_seen(number);
    }

    /// How rendering is getting on, and what there is to tell.
    pub fn status(&self) -> &Status {
        self.world.resource()
    }

    /// The world with the scene's entities and the session's resources.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The world, to be changed; the next [`Self::update`] finds what has changed.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// A copy of the film, for saving: linear light at the resolution that it has now. Takes a few milliseconds.
    pub fn film_snapshot(&self) -> Option<Film> {
        self.world.resource::<Renderer>().0.film()
    }

    /// The film of what is seen now, to be kept; never waits. It comes as soon as every pixel has a sample at full
    /// resolution; a coarser one comes if the view changes or the workers rest before that. Without any, the other
    /// end is closed.
    pub fn keep_film(&self) -> Receiver<Film> {
        self.world.resource::<Renderer>().0.keep_film()
    }

    /// What a picture of what is seen now is to say about itself: see [`MetadataDraft::note`].
    pub fn shot_draft(&mut self) -> MetadataDraft {
        let current = self.world.get_resource::<CurrentScene>().map(|current| current.0.clone());
        MetadataDraft::of(&mut self.world, current.as_deref())
    }

    /// What the workers render now, and how.
    pub fn rendered(&self) -> Option<(Prepared, RenderSettings)> {
        self.world.resource::<RenderState>().rendered()
    }

    /// Names of what the workers render now, for layers of a picture.
    pub fn feature_names(&self) -> Option<FeatureNames> {
        let shown = self.world.resource::<RenderState>();
        Some(FeatureNames::of(shown.extraction.as_ref()?, &shown.inputs))
    }

    /// How many scenes have taken their place so far.
    pub fn n_adopted(&self) -> u64 {
        self.world.resource::<SceneGeneration>().0
    }

    /// Where the open scene is saved: where it was saved last, or else the scene file that was opened.
    pub fn scene_file(&self) -> Option<PathBuf> {
        let saved = self.world.resource::<SavedAs>().path.clone();
        saved.or_else(|| match &self.world.get_resource::<CurrentScene>()?.0.source {
            SceneSource::Scene(path) => Some(path.clone()),
            _ => None,
        })
    }

    /// Whether something has been edited since the scene was opened or saved.
    pub fn has_unsaved_edits(&self) -> bool {
        self.world.resource::<History>().is_unsaved()
    }

    /// Something is to be saved, or is being saved.
    pub fn is_saving(&self) -> bool {
        !self.world.resource::<Saving>().is_idle() || !self.world.resource::<CommandQueue>().0.is_empty()
    }

    /// The scene in words, as [`Command::SaveScene`] would write it.
    pub fn describe(&mut self) -> Description {
        let current = self.world.get_resource::<CurrentScene>().map(|current| current.0.clone());
        Description::of(&mut self.world, current.as_deref())
    }

    /// As many threads as the workers have, for work beside them.
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        self.world.resource::<Renderer>().0.pool()
    }

    /// How long the workers took to drop what a change had made worthless, the latest times.
    pub fn cancels(&self) -> LatencyHistogram {
        self.world.resource::<Renderer>().0.cancels()
    }

    /// The scene as the picture shows it.
    pub fn inputs(&self) -> &SceneInputs {
        &self.world.resource::<RenderState>().inputs
    }

    /// Lists of what is in the scene, which stay right for as long as [`revision`](Self::revision) does not change.
    pub fn inventory(&self) -> Inventory {
        Inventory::of(&self.world, self.inputs())
    }

    /// Grows when anything but the camera has been touched.
    pub fn revision(&self) -> u64 {
        self.world.resource::<RenderState>().revision()
    }

    /// The box around an object or a light, along its own axes.
    pub fn box_of(&mut self, entity: Entity) -> Option<OwnBox> {
        super::selection::box_of(&mut self.world, entity)
    }

    /// Memory of all trees, bytes.
    pub fn tree_bytes(&self) -> usize {
        self.world.resource::<RenderState>().trees.bytes()
    }

    /// Nothing will come unless something is changed: the workers sleep and nothing is being read.
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
    }

    /// When [`update`](Self::update) should be called even if nothing calls the waker; `None` for never.
    ///
    /// Everything that happens beside the session calls the waker, so only commands that wait need a frame.
    pub fn next_wake(&self, now: Duration) -> Option<Duration> {
        (!self.world.resource::<CommandQueue>().0.is_empty()).then_some(now)
    }
}
