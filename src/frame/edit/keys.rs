//! Keys of the animation, and its settings: shutter, duration, frames per second.
//!
//! An animation that a scene file could not hold is not taken: every change is checked as a file is.

use crate::format::CameraPart;
use crate::frame::core::status::{MessageKind, Status};
use crate::frame::edit::place::about_middle;
use crate::frame::edit::property::Property;
use crate::frame::state::history::History;
use crate::frame::state::resources::{Clock, CurrentScene};
use crate::frame::state::selection::Selection;
use crate::scene::animation::{
    Channel, Interpolation, KeysOf, Shutter, animation_or_new, delete_keys, follow_tracks, off_their_tracks, set_keys,
};
use crate::scene::{Animation, Description, LoadedScene, Moment, Placement, SceneInputs};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use std::sync::Arc;

/// Sets keys at the current time.
///
/// - `camera`: of the camera only; otherwise of what has been changed, of the selection, or else of the camera; until
///   something has keys, changes of what is not selected do not count beside a selection.
pub fn set(world: &mut World, camera: bool) -> Result<(), String> {
    check_pose(world)?;
    let (mut before, written) = before(world);
    let selected = world.resource::<Selection>().0.clone();
    if !camera {
        turn_about_middle(world, &mut before, &selected);
    }
    let of = if camera { KeysOf::Camera } else { KeysOf::Changes(&selected) };
    let earlier = world.get_resource::<Animation>().cloned();
    let channels = checked(world, |world| set_keys(world, &before, written.as_ref(), of))?;
    let single = match is_single(world, &channels) {
        true => ": set another one at another time",
        false => "",
    };
    let is_held = earlier.is_some_and(|earlier| channels.iter().any(|channel| earlier.follows_model(*channel)));
    let held = if is_held { "; it moves by its keys from now on, no longer as its file says" } else { "" };
    let text = format!("keys at {}: {}{single}{held}", moment(world), named(world, &channels));
    say(world, text);
    Ok(())
}

/// Between its keys, what has none yet turns about its middle.
///
/// - `before`: the scene when its time was set; its placements get the same pivot, which is no change.
fn turn_about_middle(world: &mut World, before: &mut SceneInputs, entities: &[Entity]) {
    for &entity in entities {
        let Some(&placement) = world.get::<Placement>(entity) else { continue };
        let turned = about_middle(world, entity, &placement);
        if turned != placement {
            world.entity_mut(entity).insert(turned);
            let object = before.objects.iter_mut().find(|object| object.entity == entity);
            object.into_iter().for_each(|object| object.placement = object.placement.with_pivot(turned.pivot));
        }
    }
}

/// Tells that a change is not kept at other times, unless a key keeps it.
///
/// - `known`: what was [off its tracks](off_their_tracks) before, of which that has been told.
pub fn tell_what_needs_keys(world: &mut World, known: &[Entity]) {
    let new = off_their_tracks(world).into_iter().find(|entity| !known.contains(entity));
    let Some(entity) = new else { return };
    let name = world.get::<Name>(entity).map_or("this".to_owned(), |name| format!("`{name}`"));
    say(world, format!("{name} changes by its animation: Set key (Ctrl+K) keeps what you have changed at this frame"));
}

/// Deletes the keys at the current time: of the selection, or of everything if nothing is selected.
pub fn delete(world: &mut World) -> Result<(), String> {
    let selected = world.resource::<Selection>().0.clone();
    let n = checked(world, |world| Ok(delete_keys(world, &selected)))?;
    let at = moment(world);
    let of = if selected.is_empty() { "" } else { " of the selection" };
    let text = match n {
        0 => return Err(format!("there are no keys{of} at {at}")),
        1 => format!("key{of} at {at} deleted"),
        n => format!("{n} keys{of} at {at} deleted"),
    };
    say(world, text);
    Ok(())
}

/// Sets the interpolation of the tracks of the selection, or of all tracks if nothing is selected.
pub fn interpolate(world: &mut World, how: Interpolation) -> Result<(), String> {
    let selected = world.resource::<Selection>().0.clone();
    let Some(mut animation) = world.get_resource::<Animation>().cloned() else { return Err(no_tracks()) };
    let mut n = 0;
    for track in &mut animation.tracks {
        if selected.is_empty() || track.channel.entity().is_some_and(|entity| selected.contains(&entity)) {
            track.curve.interpolation = how;
            n += 1;
        }
    }
    if n == 0 {
        return Err(no_tracks());
    }
    checked(world, |world| {
        world.insert_resource(animation);
        Ok(())
    })
}

/// Sets the shutter, the duration or the frames per second; they are limited to what a scene file may have.
pub fn set_property(world: &mut World, property: Property, value: f64) -> Result<(), String> {
    check_pose(world)?;
    let (before, written) = before(world);
    let mut animation = animation_or_new(world, &before, written.as_ref());
    match property {
        Property::Shutter => animation.shutter = Shutter::Share(value.clamp(0.0, 1.0)),
        Property::Duration => animation.duration = (value > 0.0).then_some(value.min(1e6)),
        Property::FramesPerSecond => animation.fps = value.clamp(1e-3, 1e4),
        _ => return Err(format!("an animation has no {property:?}")),
    }
    if world.get_resource::<Animation>() == Some(&animation) {
        return Ok(());
    }
    world.insert_resource(animation);
    Ok(())
}

fn no_tracks() -> String {
    "nothing here has keys: set one first".to_owned()
}

/// The scene when its time was set, and the camera of its file.
fn before(world: &mut World) -> (SceneInputs, Option<CameraPart>) {
    History::content(world);
    let now = SceneInputs::of(world);
    let before = world.resource::<History>().inputs_at_moment(now);
    (before, current(world).map(|current| current.file.camera.clone()))
}

fn current(world: &World) -> Option<Arc<LoadedScene>> {
    world.get_resource::<CurrentScene>().map(|current| current.0.clone())
}

/// The stored pose of a model that has animations is at no time.
fn check_pose(world: &World) -> Result<(), String> {
    match world.get_resource::<Animation>() {
        None if current(world).is_some_and(|it| it.model_length().is_some()) => {
            Err("the stored pose of the model has no time: show its animation first".to_owned())
        }
        _ => Ok(()),
    }
}

/// Changes the animation, and takes the change back if a scene file could not hold the result.
fn checked<T>(world: &mut World, change: impl FnOnce(&mut World) -> Result<T, String>) -> Result<T, String> {
    let old = world.get_resource::<Animation>().cloned();
    let done = change(world).and_then(|done| {
        let description = Description::of(world, current(world).as_deref());
        match description.file.check() {
            Err(error) => {
                let problem = error.problems.first().map(|problem| problem.message.clone());
                Err(format!("not possible: {}", problem.unwrap_or_else(|| error.to_string())))
            }
            Ok(()) => Ok(done),
        }
    });
    match done {
        Ok(done) => {
            follow_tracks(world);
            Ok(done)
        }
        Err(problem) => {
            match old {
                Some(old) => world.insert_resource(old),
                None => drop(world.remove_resource::<Animation>()),
            }
            Err(problem)
        }
    }
}

/// Whether each of these has one key, so that nothing moves yet.
fn is_single(world: &World, channels: &[Channel]) -> bool {
    let animation = world.resource::<Animation>();
    let mut tracks = animation.tracks.iter().filter(|track| channels.contains(&track.channel));
    tracks.all(|track| track.curve.keys.len() == 1)
}

/// Such as `translate, rotate of ball; alpha of gold`, without the last ones of many.
fn named(world: &World, channels: &[Channel]) -> String {
    const MOST: usize = 3;
    let mut groups: Vec<(Option<Entity>, Vec<&'static str>)> = Vec::new();
    for channel in channels {
        match groups.last_mut() {
            Some((entity, properties)) if *entity == channel.entity() => properties.push(channel.property()),
            _ => groups.push((channel.entity(), vec![channel.property()])),
        }
    }
    let name = |entity: Option<Entity>| match entity {
        None => "the camera".to_owned(),
        Some(entity) => world.get::<Name>(entity).map_or("something".to_owned(), |name| format!("`{name}`")),
    };
    let group =
        |(entity, properties): &(Option<Entity>, Vec<&str>)| format!("{} of {}", properties.join(", "), name(*entity));
    let mut text = groups.iter().take(MOST).map(group).collect::<Vec<_>>().join("; ");
    if groups.len() > MOST {
        text += &format!(" and {} more", groups.len() - MOST);
    }
    text
}

/// The current time, as the time line counts it: its frame, or between two of them seconds.
fn moment(world: &World) -> String {
    let seconds = world.resource::<Moment>().0;
    let frame = world.get_resource::<Animation>().map(|animation| seconds * animation.fps);
    match frame.map(|frame| (frame.round(), (frame - frame.round()).abs())) {
        Some((frame, away)) if away < 1e-6 * (1.0 + frame) => format!("frame {frame}"),
        _ => format!("{} s", (seconds * 1e3).round() / 1e3),
    }
}

/// Notes what has been done.
pub(super) fn say(world: &mut World, text: String) {
    let now = world.resource::<Clock>().0;
    world.resource_mut::<Status>().say(now, MessageKind::Note, text);
}
