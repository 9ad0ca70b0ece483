//! The state of a scene at a given time.

use crate::format::camera::CameraPart;
use crate::format::camera::{camera, camera_part};
use crate::format::placement::Placement;
use crate::format::property::CameraProperty;
use crate::format::view::{Lens, Projection, View};
use crate::scene::animation::model::{ModelMotion, Moved};
use crate::scene::animation::{Animation, Channel};
use crate::scene::world::components::put;
use crate::scene::world::components::{Shape, SurfaceMaterial};
use crate::scene::world::inputs::{CameraInput, SceneInputs};
use crate::scene::world::lights::{light_of, put_light};
use bevy_ecs::prelude::{Entity, Mut, Resource, World};
use std::collections::HashMap;

/// Tolerance for a camera that is upright but for rounding.
const ROUNDING: f64 = 1e-9;

/// Current time of a world, seconds.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment(pub f64);

impl Animation {
    /// The inputs of a snapshot at a time; the result does not depend on the time that `inputs` are of.
    pub fn inputs_at(&self, inputs: &SceneInputs, seconds: f64) -> SceneInputs {
        let mut inputs = inputs.clone();
        if let Some(model) = &self.model {
            model.set_inputs(&mut inputs, seconds);
        }
        let objects: HashMap<Entity, usize> = of_entities(inputs.objects.iter().map(|object| object.entity));
        let lights: HashMap<Entity, usize> = of_entities(inputs.lights.iter().map(|light| light.entity));
        let materials: HashMap<Entity, usize> = of_entities(inputs.materials.iter().map(|material| material.entity));
        for track in &self.tracks {
            match track.channel {
                Channel::Camera(_) => {}
                Channel::Object(entity, property) => {
                    if let Some(object) = objects.get(&entity).map(|&i| &mut inputs.objects[i]) {
                        object.placement = property.set(object.placement, track.at(seconds));
                    }
                }
                Channel::Light(entity, property) => {
                    if let Some(light) = lights.get(&entity).map(|&i| &mut inputs.lights[i]) {
                        property.set(&mut light.light, &mut light.placement, track.at(seconds));
                    }
                }
                Channel::Material(entity, property) => {
                    if let Some(material) = materials.get(&entity).map(|&i| &mut inputs.materials[i]) {
                        property.set(&mut material.material, track.at(seconds));
                    }
                }
            }
        }
        if let (true, Some(seen)) = (self.moves_camera(), &mut inputs.camera) {
            let (view, projection, lens) = camera(&self.camera_at(seconds));
            *seen = CameraInput { entity: seen.entity, view, projection, lens };
        }
        inputs
    }

    /// Whether it moves the camera.
    pub fn moves_camera(&self) -> bool {
        self.model.as_ref().is_some_and(ModelMotion::moves_camera) || self.has_camera_track()
    }

    /// Whether it moves the camera, but this one is not where its tracks have it at this time. What has no track may be
    /// anything, such as the aperture.
    pub fn is_left_by(&self, view: &View, projection: &Projection, lens: &Lens, seconds: f64) -> bool {
        if !self.moves_camera() {
            return false;
        }
        let rest = rest_camera(self, seconds, view, projection, lens);
        let (on_track, wide, _) = camera(&Self { camera: rest, ..self.clone() }.camera_at(seconds));
        let reach = ROUNDING * (1.0 + view.eye.length() + view.pivot_distance);
        let turned = on_track.forward.distance(view.forward).max(on_track.up.distance(view.up));
        let is_near = on_track.eye.distance(view.eye) <= reach
            && (on_track.pivot_distance - view.pivot_distance).abs() <= reach
            && turned <= ROUNDING.sqrt()
            && wide.shows_the_same(projection);
        !is_near
    }

    /// The camera at a time, as in a scene file.
    pub fn camera_at(&self, seconds: f64) -> CameraPart {
        let mut part = self.camera.clone();
        if let Some(model) = self.model.as_ref().filter(|model| model.moves_camera()) {
            part = model.camera_at(part, seconds);
        }
        for track in &self.tracks {
            if let Channel::Camera(property) = track.channel {
                property.set(&mut part, track.at(seconds));
            }
        }
        part
    }
}

fn of_entities(entities: impl Iterator<Item = Entity>) -> HashMap<Entity, usize> {
    entities.enumerate().map(|(i, entity)| (entity, i)).collect()
}

/// Sets the current time: changes only the components that differ.
pub fn show_moment(world: &mut World, seconds: f64) {
    keep_changes(world);
    place(world, seconds);
}

/// Like [`show_moment`], but a camera that somebody has flown away from its tracks stays where it is.
pub fn show_moment_from_here(world: &mut World, seconds: f64) {
    let Some(CameraInput { entity, view, projection, lens }) = flown_camera(world) else {
        return show_moment(world, seconds);
    };
    place(world, seconds);
    put(world, entity, view);
    put(world, entity, projection);
    put(world, entity, lens);
}

/// Sets the time without first storing changes of the camera.
pub(super) fn place(world: &mut World, seconds: f64) {
    if !world.contains_resource::<Animation>() {
        return world.insert_resource(Moment(seconds));
    }
    // The animation itself does not change.
    world.resource_scope(|world, animation: Mut<Animation>| place_as(world, &animation, seconds));
    world.insert_resource(Moment(seconds));
}

/// Sets the animation and the time of a new scene.
///
/// - `shown`: the animation of what was not edited.
pub(in crate::scene) fn show_first(world: &mut World, animation: Animation, shown: &Animation, seconds: f64) {
    place_as(world, shown, seconds);
    world.insert_resource(animation);
    world.insert_resource(Moment(seconds));
}

/// Sets everything that has a track.
fn place_as(world: &mut World, animation: &Animation, seconds: f64) {
    if let Some(model) = &animation.model {
        model.set_world(world, seconds);
    }
    for track in &animation.tracks {
        let value = track.at(seconds);
        match track.channel {
            Channel::Camera(_) => {}
            Channel::Object(entity, property) => {
                // A deleted entity may be restored by undo.
                if let (Some(_), Some(&placement)) = (world.get::<Shape>(entity), world.get::<Placement>(entity)) {
                    put(world, entity, property.set(placement, value));
                }
            }
            Channel::Light(entity, property) => {
                let (light, placement) = (light_of(world, entity), world.get::<Placement>(entity).copied());
                if let (Some(mut light), Some(mut placement)) = (light, placement) {
                    property.set(&mut light, &mut placement, value);
                    put_light(world, entity, light);
                    put(world, entity, placement);
                }
            }
            Channel::Material(entity, property) => {
                if let Some(mut material) = world.get::<SurfaceMaterial>(entity).cloned() {
                    property.set(&mut material.0, value);
                    put(world, entity, material);
                }
            }
        }
    }
    let seen = SceneInputs::of(world).camera.filter(|_| animation.moves_camera());
    if let Some(CameraInput { entity, .. }) = seen {
        let (view, projection, lens) = camera(&animation.camera_at(seconds));
        put(world, entity, view);
        put(world, entity, projection);
        put(world, entity, lens);
    }
}

/// Stores changes of the camera since the time was set, for its properties without tracks.
fn keep_changes(world: &mut World) {
    let Some(CameraInput { view, projection, lens, .. }) = SceneInputs::of(world).camera else { return };
    let shown = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    let is_kept = world.get_resource::<Animation>().is_none_or(|animation| !animation.moves_camera());
    if !is_kept && !camera_follows(world) {
        let mut animation = world.resource_mut::<Animation>();
        animation.camera = rest_camera(&animation, shown, &view, &projection, &lens);
    }
}

/// The camera, if somebody has flown it away from its tracks.
fn flown_camera(world: &mut World) -> Option<CameraInput> {
    let seen = SceneInputs::of(world).camera?;
    let shown = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    let animation = world.get_resource::<Animation>()?;
    animation.is_left_by(&seen.view, &seen.projection, &seen.lens, shown).then_some(seen)
}

/// Objects, lights and materials that are not as the animation has them at the current time: another time loses that.
pub fn off_their_tracks(world: &World) -> Vec<Entity> {
    let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    let Some(animation) = world.get_resource::<Animation>() else { return Vec::new() };
    let mut found = Vec::new();
    let mut see = |entity: Entity, differs: bool| {
        if differs {
            found.push(entity);
        }
    };
    let place = |entity: Entity| world.get::<Shape>(entity).and(world.get::<Placement>(entity)).copied();
    let lit = |entity: Entity| Some((light_of(world, entity)?, *world.get::<Placement>(entity)?));
    // What tracks and a model move together is compared as a whole.
    let by_model = animation.model.as_ref().map(|model| model.at(seconds));
    let Moved { mut objects, mut lights } = by_model.unwrap_or_default();
    for track in &animation.tracks {
        let value = track.at(seconds);
        match track.channel {
            Channel::Camera(_) => {}
            Channel::Object(entity, property) => {
                let Some(now) = place(entity) else { continue };
                match objects.get_mut(&entity) {
                    Some(then) => *then = property.set(*then, value),
                    None => see(entity, property.set(now, value) != now),
                }
            }
            Channel::Light(entity, property) => {
                let Some(now) = lit(entity) else { continue };
                match lights.get_mut(&entity) {
                    Some((light, placement)) => drop(property.set(light, placement, value)),
                    None => {
                        let (mut light, mut placement) = now;
                        property.set(&mut light, &mut placement, value);
                        see(entity, (light, placement) != now);
                    }
                }
            }
            Channel::Material(entity, property) => {
                let Some(now) = world.get::<SurfaceMaterial>(entity) else { continue };
                let mut then = now.clone();
                property.set(&mut then.0, value);
                see(entity, then != *now);
            }
        }
    }
    objects.iter().for_each(|(&entity, then)| see(entity, place(entity).is_some_and(|now| now != *then)));
    lights.iter().for_each(|(&entity, then)| see(entity, lit(entity).is_some_and(|now| now != *then)));
    found.dedup();
    found
}

/// Whether the animation moves the camera, and it is where that has it at the present time.
pub fn camera_follows(world: &mut World) -> bool {
    let seen = SceneInputs::of(world).camera;
    let shown = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    let animation = world.get_resource::<Animation>().filter(|animation| animation.moves_camera());
    animation.zip(seen).is_some_and(|(animation, seen)| {
        let (view, projection, lens) = camera(&animation.camera_at(shown));
        seen.shows_the_same(&CameraInput { view, projection, lens, ..seen })
    })
}

/// The camera for the properties without tracks: the one from the file, updated by what has changed.
pub(super) fn rest_camera(
    animation: &Animation,
    seconds: f64,
    view: &View,
    projection: &Projection,
    lens: &Lens,
) -> CameraPart {
    let written = animation.camera_at(seconds);
    let mut part = camera_part(view, projection, lens, Some(&written));
    if animation.tracks.iter().any(|track| track.channel == Channel::Camera(CameraProperty::FStop)) {
        (part.lens_radius, part.f_stop) = (None, written.f_stop);
    }
    // The tracks need the same form (`look_at` or `forward`) as in the file.
    (part.look_at, part.forward, part.pivot_distance) = match written.look_at.is_some() || written.forward.is_none() {
        true => (Some(view.pivot()), None, None),
        false => (None, Some(view.forward), Some(view.pivot_distance)),
    };
    // A camera that is upright stays so on its way.
    let upright = camera(&CameraPart { up: written.up, ..part.clone() }).0;
    if upright.up.is_finite() && upright.up.distance(view.up) < ROUNDING {
        part.up = written.up;
    }
    part
}
