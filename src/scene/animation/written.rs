//! Conversion between the section `animation` of a scene file, which uses names, and the tracks of a world, which use
//! entities.

use crate::format::animation::{AnimationPart, TrackPart};
use crate::format::camera::CameraPart;
use crate::format::key::Curve;
use crate::scene::animation::{Animation, Channel, Shutter, Track};
use bevy_ecs::prelude::Entity;
use std::collections::HashMap;

/// The entities of a scene by name. If several have the same name, it refers to the last one.
#[derive(Default)]
pub(in crate::scene) struct Entities<'a> {
    pub objects: HashMap<&'a str, Entity>,
    pub lights: HashMap<&'a str, Entity>,
    pub materials: HashMap<&'a str, Entity>,
    /// Meshes of glTF files, in the order of the scene.
    pub meshes: Vec<Entity>,
    /// In the order of the scene.
    pub all_lights: Vec<Entity>,
}

/// The tracks of a checked file; those whose name does not exist are omitted.
pub(in crate::scene) fn of_part(part: &AnimationPart, camera: &CameraPart, entities: &Entities) -> Animation {
    let track = |track: &TrackPart| {
        let find = |known: &HashMap<&str, Entity>, name: &str| known.get(name).copied();
        let channel = match track {
            TrackPart::Camera { property, .. } => Channel::Camera(*property),
            TrackPart::Object { name, property, .. } => Channel::Object(find(&entities.objects, name)?, *property),
            TrackPart::Light { name, property, .. } => Channel::Light(find(&entities.lights, name)?, *property),
            TrackPart::Material { name, property, .. } => {
                Channel::Material(find(&entities.materials, name)?, *property)
            }
        };
        let curve = Curve { interpolation: track.interpolation(), keys: track.keys().to_vec() };
        Some(Track { channel, curve })
    };
    Animation {
        fps: part.fps,
        duration: part.duration,
        shutter: part.shutter_seconds.map_or(Shutter::Share(part.shutter.unwrap_or(0.0)), Shutter::Seconds),
        camera: camera.clone(),
        tracks: part.tracks.iter().filter_map(track).collect(),
        model: None,
    }
}

/// The animation as in a scene file.
///
/// - `at`: the current time, seconds.
/// - `name`: of the object, light or material of a channel; `None` if it no longer exists.
pub(in crate::scene) fn to_part(
    animation: &Animation,
    at: f64,
    mut name: impl FnMut(Channel) -> Option<String>,
) -> AnimationPart {
    // What a glTF file moves cannot be written: a scene that is made from it shows a moment.
    if animation.tracks.is_empty() && animation.model.is_some() && animation.shutter == Shutter::default() {
        return AnimationPart::default();
    }
    let (shutter, shutter_seconds) = match animation.shutter {
        Shutter::Share(share) => ((share != 0.0).then_some(share), None),
        Shutter::Seconds(seconds) => (None, Some(seconds)),
    };
    let track = |Track { channel, curve }: &Track| {
        let Curve { interpolation, keys } = curve.clone();
        Some(match *channel {
            Channel::Camera(property) => TrackPart::Camera { property, interpolation, keys },
            Channel::Object(_, property) => TrackPart::Object { name: name(*channel)?, property, interpolation, keys },
            Channel::Light(_, property) => TrackPart::Light { name: name(*channel)?, property, interpolation, keys },
            Channel::Material(_, property) => {
                TrackPart::Material { name: name(*channel)?, property, interpolation, keys }
            }
        })
    };
    let tracks = animation.tracks.iter().filter_map(track).collect();
    AnimationPart {
        at,
        fps: animation.fps,
        duration: animation.duration,
        shutter,
        shutter_seconds,
        tracks,
        ..AnimationPart::default()
    }
}
