//! Conversion between the section `animation` of a scene file, which uses names, and the tracks of a world, which use
//! entities.

use crate::format::animation::{AnimationPart, ModelMotionPart, TrackPart};
use crate::format::camera::CameraPart;
use crate::format::key::Curve;
use crate::import::gltf_motion::GltfMotion;
use crate::scene::animation::model::ModelMotion;
use crate::scene::animation::{Animation, Channel, Shutter, Track};
use bevy_ecs::prelude::Entity;
use std::collections::HashMap;
use std::sync::Arc;

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

/// Which entities the animations of a glTF file move in a scene.
pub(in crate::scene) fn model_of(
    motion: &Arc<GltfMotion>,
    part: Option<&ModelMotionPart>,
    entities: &Entities,
) -> ModelMotion {
    let named = |known: &HashMap<&str, Entity>, list: &[(String, usize)]| -> Vec<Entity> {
        list.iter().map(|(name, _)| known.get(name.as_str()).copied().unwrap_or(Entity::PLACEHOLDER)).collect()
    };
    let (objects, lights) = match part {
        Some(part) => (named(&entities.objects, &part.objects), named(&entities.lights, &part.lights)),
        // Of the scene that was made of the file.
        None => (entities.meshes.clone(), entities.all_lights.clone()),
    };
    let holds_camera = part.is_some_and(|part| part.camera.is_none());
    ModelMotion { motion: motion.clone(), objects, lights, holds_camera }
}

/// The animation as in a scene file.
///
/// - `at`: the current time, seconds.
/// - `name`: of the object, light or material of a channel; `None` if it no longer exists.
/// - `model`: what a glTF file moves.
pub(in crate::scene) fn to_part(
    animation: &Animation,
    at: f64,
    mut name: impl FnMut(Channel) -> Option<String>,
    model: Option<ModelMotionPart>,
) -> AnimationPart {
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
        model,
        ..AnimationPart::default()
    }
}
