//! The open scene at any moment of its animation, in a world of its own: frames are rendered while the session goes on.

use crate::frame::camera_path::turntable;
use crate::frame::core::rig::Rig;
use crate::frame::session::Session;
use crate::frame::state::resources::{CurrentScene, RenderState};
use crate::scene::{
    Animation, Description, DisplaySettings, Extraction, LoadedScene, MetadataDraft, Moment, Rendering, SceneInputs,
    Trees, show_moment,
};
use bevy_ecs::prelude::{Entity, World};
use std::sync::Arc;

/// What frames are made of: the scene as it is now. Taken at once, and opened on another thread.
pub struct Reel {
    current: Arc<LoadedScene>,
    description: Description,
    trees: Trees,
    rendering: Rendering,
    display: DisplaySettings,
    rig: Rig,
    fps: f64,
    course: Course,
}

/// Where the camera is.
enum Course {
    /// Where the animation has it; where it was flown to if that does not move it.
    Animated,
    /// Where it was flown to, off the tracks of the animation.
    Flown(Rig),
    /// On a turntable, and the moment that is shown meanwhile, seconds.
    Turntable(Vec<Rig>, Option<f64>),
}

/// A reel that frames can be taken from.
pub struct OpenReel {
    current: Arc<LoadedScene>,
    trees: Trees,
    world: World,
    camera: Option<Entity>,
    course: Course,
    fps: f64,
}

/// Whether the view has left the camera of an animation that moves it; `None` if none does.
pub fn has_left_camera(session: &Session) -> Option<bool> {
    let world = session.world();
    let animation = world.get_resource::<Animation>().filter(|animation| animation.moves_camera())?;
    let seconds = world.get_resource::<Moment>().map_or(0.0, |moment| moment.0);
    let Rig { view, projection, lens } = session.status().rig;
    Some(animation.is_left_by(&view, &projection, &lens, seconds))
}

impl Reel {
    /// The scene of a session, seen as it is in the window: by the camera of the animation, unless the view has left it.
    /// `None` if nothing in it moves.
    pub fn of(session: &mut Session) -> Option<Self> {
        let world = session.world();
        let animation = world.get_resource::<Animation>().filter(|animation| animation.moves())?;
        let fps = animation.fps;
        let course = match has_left_camera(session) {
            Some(true) => Course::Flown(session.status().rig),
            Some(false) | None => Course::Animated,
        };
        Self::with(session, fps, course)
    }

    /// One turn of the camera around its pivot, at the moment that is shown: `n` frames, of 1 / `n` of a second
    /// each. `None` without a scene.
    pub fn turntable_of(session: &mut Session, n: u32) -> Option<Self> {
        let moment = session.world().get_resource::<Moment>().map(|moment| moment.0);
        let rigs = turntable(&session.status().rig, n);
        Self::with(session, f64::from(n), Course::Turntable(rigs, moment))
    }

    fn with(session: &mut Session, fps: f64, course: Course) -> Option<Self> {
        let world = session.world();
        let current = world.get_resource::<CurrentScene>()?.0.clone();
        let (rendering, display) = (*world.resource::<Rendering>(), *world.resource::<DisplaySettings>());
        let (trees, rig) = (world.resource::<RenderState>().trees.clone(), session.status().rig);
        let description = session.describe();
        Some(Self { current, description, trees, rendering, display, rig, fps, course })
    }

    /// Frames per second: frame i is at i / fps.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Makes its world.
    ///
    /// # Errors
    /// If a file of the scene is gone.
    pub fn open(self) -> Result<OpenReel, String> {
        let Self { current, description, trees, rendering, display, rig, fps, course } = self;
        let mut world = World::new();
        let scene = current.described(&description, trees.clone()).map_err(|error| error.to_string())?;
        scene.spawn(&mut world);
        world.insert_resource(rendering);
        world.insert_resource(display);
        // Where no track moves the camera, it stays where it was flown to.
        let camera = SceneInputs::of(&mut world).camera.map(|camera| camera.entity);
        if let Some(camera) = camera {
            world.entity_mut(camera).insert((rig.view, rig.projection, rig.lens));
        }
        Ok(OpenReel { current, trees, world, camera, course, fps })
    }
}

impl OpenReel {
    /// The snapshot at a moment, seconds, and the metadata of its image. They do not depend on the moments before.
    pub fn at(&mut self, seconds: f64) -> (Extraction, MetadataDraft) {
        let (rig, moment) = match &self.course {
            Course::Animated => (None, Some(seconds)),
            Course::Flown(rig) => (Some(rig), Some(seconds)),
            Course::Turntable(rigs, moment) => (rigs.get((seconds * self.fps).round() as usize), *moment),
        };
        moment.iter().for_each(|moment| show_moment(&mut self.world, *moment));
        if let (Some(camera), Some(rig)) = (self.camera, rig) {
            // Its keys may have moved it elsewhere.
            self.world.entity_mut(camera).insert((rig.view, rig.projection, rig.lens));
        }
        shown(&mut self.world, &self.current, &mut self.trees)
    }
}

/// Shows a moment of a world from now on, seconds; returns its snapshot and the metadata of its image.
///
/// - `loaded`: the scene that was opened into the world.
pub fn scene_at(
    world: &mut World,
    loaded: &LoadedScene,
    trees: &mut Trees,
    seconds: f64,
) -> (Extraction, MetadataDraft) {
    show_moment(world, seconds);
    shown(world, loaded, trees)
}

/// The snapshot of what a world shows.
fn shown(world: &mut World, loaded: &LoadedScene, trees: &mut Trees) -> (Extraction, MetadataDraft) {
    let inputs = SceneInputs::of(world);
    // Skins and morph targets have other meshes at each moment.
    trees.keep_used(&inputs);
    for object in &inputs.objects {
        trees.add_or_mark(&object.shape);
    }
    let extraction = Extraction::of_world(world, &inputs, trees);
    (extraction, MetadataDraft::of(world, Some(loaded)))
}
