//! What differs from its tracks at the present time, since it was edited, or the camera flown, without setting a key.
//!
//! It stays as it is until another time is shown, and stands still during the exposure. Scene files and images hold it
//! ([`EditedPart`]), so that they show what was seen.

use crate::format::animation::EditedPart;
use crate::format::camera::CameraPart;
use crate::format::camera::camera;
use crate::format::scene_file::SceneFile;
use crate::scene::animation::moment::rest_camera;
use crate::scene::animation::written::{Entities, of_part};
use crate::scene::animation::{Animation, Channel};
use crate::scene::world::inputs::SceneInputs;
use bevy_ecs::prelude::Entity;
use std::collections::HashSet;

/// The edited part of a world.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::scene) struct Edited {
    /// Whether the camera is among it.
    pub camera: bool,
    /// Objects, lights and materials.
    pub entities: HashSet<Entity>,
}

impl Edited {
    /// The entities of a checked file.
    pub(in crate::scene) fn of_part(part: &EditedPart, entities: &Entities) -> Self {
        let kinds = [
            (&part.objects, &entities.objects),
            (&part.lights, &entities.lights),
            (&part.materials, &entities.materials),
        ];
        let found = kinds
            .into_iter()
            .flat_map(|(names, known)| names.iter().filter_map(|name| known.get(name.as_str()).copied()));
        Self { camera: part.camera.is_some(), entities: found.collect() }
    }
}

impl Animation {
    /// What differs in `inputs` from what the animation says at this time.
    pub(in crate::scene) fn edited(&self, inputs: &SceneInputs, seconds: f64) -> Edited {
        let then = self.inputs_at(inputs, seconds);
        let objects = inputs.objects.iter().zip(&then.objects).filter(|(a, b)| a != b).map(|(a, _)| a.entity);
        let lights = inputs.lights.iter().zip(&then.lights).filter(|(a, b)| a != b).map(|(a, _)| a.entity);
        let materials = inputs.materials.iter().zip(&then.materials).filter(|(a, b)| a != b).map(|(a, _)| a.entity);
        let entities = objects.chain(lights).chain(materials).collect();
        let stays = match (&inputs.camera, &then.camera) {
            (Some(now), Some(then)) => now.shows_the_same(then),
            (now, then) => now.is_none() && then.is_none(),
        };
        Edited { camera: !stays, entities }
    }

    /// The animation of everything else.
    pub(in crate::scene) fn without(&self, edited: &Edited) -> Self {
        let mut animation = self.clone();
        animation.tracks.retain(|track| match track.channel {
            Channel::Camera(_) => !edited.camera,
            Channel::Object(entity, _) | Channel::Light(entity, _) | Channel::Material(entity, _) => {
                !edited.entities.contains(&entity)
            }
        });
        if let Some(model) = &mut animation.model {
            model.hold(edited.camera, &edited.entities);
        }
        animation
    }

    /// Whether the camera has a track.
    pub(in crate::scene) fn has_camera_track(&self) -> bool {
        self.tracks.iter().any(|track| matches!(track.channel, Channel::Camera(_)))
    }
}

/// The camera that is shown, in a file that describes a world.
pub(in crate::scene) fn shown_camera(file: &SceneFile) -> CameraPart {
    let edited = file.animation.edited.camera.clone();
    edited.unwrap_or_else(|| animation_of_camera(file).camera_at(file.animation.at))
}

/// Shows this camera at the time of the file, whatever its tracks say.
pub(in crate::scene) fn show_camera(file: &mut SceneFile, shown: CameraPart) {
    let animation = animation_of_camera(file);
    file.animation.edited.camera = None;
    let by_model = file.animation.model.as_ref().is_some_and(|model| model.camera.is_some());
    if by_model {
        // Where the file has it is not known here.
        file.animation.edited.camera = Some(shown);
    } else if !animation.has_camera_track() {
        file.camera = shown;
    } else if camera(&animation.camera_at(file.animation.at)) != camera(&shown) {
        file.animation.edited.camera = Some(shown);
    }
}

/// Shows another time: of what was edited only properties of the camera without tracks stay.
pub(in crate::scene) fn show_time(file: &mut SceneFile, seconds: f64) {
    if let Some(shown) = std::mem::take(&mut file.animation.edited).camera {
        let (view, projection, lens) = camera(&shown);
        file.camera = rest_camera(&animation_of_camera(file), file.animation.at, &view, &projection, &lens);
    }
    file.animation.at = seconds;
}

fn animation_of_camera(file: &SceneFile) -> Animation {
    of_part(&file.animation, &file.camera, &Entities::default())
}
