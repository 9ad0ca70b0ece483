//! Replaces the open scene by one that was loaded: another scene, the same after a change of its files, or the same
//! model at another time of its animations.

use crate::frame::core::reset::SCENE_OPENED;
use crate::frame::core::status::{MessageKind, Status};
use crate::frame::focus::Focus;
use crate::frame::navigation;
use crate::frame::saving::SavedAs;
use crate::frame::scene_bounds::SceneBounds;
use crate::frame::state::history::History;
use crate::frame::state::resources::{Clock, CurrentScene, PlayRange, RenderState, SceneGeneration, ViewMode};
use crate::frame::views::ViewTrail;
use crate::scene::{
    Animation, DisplaySettings, Lens, LoadedScene, Moment, Projection, Rendering, SceneInputs, View, camera_follows,
    show_moment_from_here,
};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::World;
use std::sync::Arc;
use std::time::Duration;

/// Makes `scene` the open scene of `world`.
pub fn adopt(world: &mut World, scene: LoadedScene, now: Duration) {
    scene.spawn(world);
    let home = world.query::<(&View, &Projection, &Lens)>().iter(world).next().map_or_else(
        navigation::Rig::default,
        |(view, projection, lens)| navigation::Rig { view: *view, projection: *projection, lens: *lens },
    );
    world.resource_mut::<SceneBounds>().home = home;
    world.resource_mut::<History>().forget();
    world.resource_mut::<ViewTrail>().forget();
    world.insert_resource(Focus::default());
    world.resource_mut::<ViewMode>().0.sharp_zone = false;
    world.insert_resource(PlayRange::default());
    world.insert_resource(crate::frame::state::selection::Selection::default());
    world.resource_mut::<crate::frame::state::explain::Explaining>().forget();
    let mut shown = world.resource_mut::<RenderState>();
    shown.trees.extend(scene.trees.clone());
    shown.adopted = Some(SCENE_OPENED.to_owned());
    let mut status = world.resource_mut::<Status>();
    status.scene = scene.source.title();
    // What was said of another scene; what was said just now may be of this one.
    status.messages.retain(|message| message.kind == MessageKind::Saved || message.at == now);
    status.say_warnings(now, &scene.warnings);
    if scene.shot.is_some() {
        let text = format!("an image of this program holds its scene: {} is open as the image shows it", status.scene);
        status.say(now, MessageKind::Note, text);
    }
    world.insert_resource(CurrentScene(Arc::new(scene)));
    world.insert_resource(SavedAs::default());
    world.resource_mut::<SceneGeneration>().0 += 1;
}

/// Replaces a scene by another state of it. User settings stay, unless the file has changed them.
///
/// - `moment`: time of the animation to show, seconds; that of the scene if not given.
/// - `cause`: of the restart, for messages.
pub fn adopt_again(
    world: &mut World,
    old: &LoadedScene,
    mut scene: LoadedScene,
    moment: Option<f64>,
    cause: String,
    now: Duration,
) {
    let same_camera =
        scene.file.camera == old.file.camera && scene.file.animation.edited.camera == old.file.animation.edited.camera;
    // One that follows its tracks follows the new ones.
    let is_kept = same_camera && !camera_follows(world);
    let camera = SceneInputs::of(world).camera.filter(|_| is_kept);
    let display_settings = (scene.file.display == old.file.display).then(|| *world.resource::<DisplaySettings>());
    let same_settings = (scene.file.integrator, scene.file.max_depth, scene.file.film.filter)
        == (old.file.integrator, old.file.max_depth, old.file.film.filter);
    let rendering = same_settings.then(|| *world.resource::<Rendering>());
    let range = *world.resource::<PlayRange>();
    scene.shot = None;
    let trees = scene.trees.clone();
    adopt(world, scene, now);
    let mut shown = world.resource_mut::<RenderState>();
    shown.trees.extend(trees);
    shown.adopted = Some(cause);
    world.insert_resource(range);
    if let Some(seconds) = moment.filter(|_| world.contains_resource::<Animation>()) {
        set_moment(world, seconds);
    }
    if let Some(camera) = camera
        && let Some(new) = SceneInputs::of(world).camera
    {
        world.entity_mut(new.entity).insert((camera.view, camera.projection, camera.lens));
    }
    if let Some(display_settings) = display_settings {
        world.insert_resource(display_settings);
    }
    if let Some(rendering) = rendering {
        world.insert_resource(rendering);
    }
}

/// Replaces the open model by its state at another time: user settings stay, and warnings are not repeated.
pub fn adopt_moment(world: &mut World, mut scene: LoadedScene, now: Duration) {
    let Some(old) = world.get_resource::<CurrentScene>().map(|current| current.0.clone()) else {
        return adopt(world, scene, now);
    };
    scene.warnings = scene.warnings.iter().filter(|warning| !old.warnings.contains(warning)).cloned().collect();
    let at = scene.choice.at.map_or_else(|| "stored pose".to_owned(), |at| format!("moment {at:.3} s"));
    adopt_again(world, &old, scene, None, at, now);
}

/// Shows another time of an animation whose scene is in the world. That is no change of the scene, though it can be undone.
pub(super) fn set_moment(world: &mut World, seconds: f64) {
    let shown = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    if shown == seconds {
        return;
    }
    // Edits of this frame count.
    History::content(world);
    let taken_back = crate::scene::animation::off_their_tracks(world);
    let mut was_saved = !world.resource::<History>().is_unsaved();
    if !was_saved {
        // What tracks take back is not there to be saved.
        show_moment_from_here(world, shown);
        was_saved = History::is_clean_as_it_is(world);
    }
    show_moment_from_here(world, seconds);
    let content = History::content(world);
    if was_saved {
        world.resource_mut::<History>().mark_clean(content);
    }
    if let Some(entity) = taken_back.first() {
        let name = world.get::<Name>(*entity).map_or("it".to_owned(), |name| format!("`{name}`"));
        let text =
            format!("{name} follows its animation again: Ctrl+Z brings your change back, Set key (Ctrl+K) keeps it");
        let now = world.resource::<Clock>().0;
        world.resource_mut::<Status>().say(now, MessageKind::Note, text);
    }
}
