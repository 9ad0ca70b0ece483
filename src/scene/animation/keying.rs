//! Setting and deleting keys: the present state of a world becomes keys at its current time.

use crate::format::animation::AnimationPart;
use crate::format::camera::CameraPart;
use crate::format::camera::{camera, camera_part};
use crate::format::key::{Curve, Interpolation};
use crate::format::material_property::MaterialProperty;
use crate::format::property::{CameraProperty, LightProperty, ObjectProperty};
use crate::scene::animation::moment::{Moment, place, rest_camera};
use crate::scene::animation::{Animation, Channel, Shutter, Track};
use crate::scene::world::components::MaterialSlots;
use crate::scene::world::inputs::{CameraInput, SceneInputs};
use crate::scene::world::material_value::material_value;
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Keys this near to each other are one, seconds: frames are at least 1e-4 s apart.
const SAME_TIME: f64 = 1e-6;
/// Tolerance of a focus distance that is that of `look_at` but for rounding.
const ROUNDING: f64 = 1e-9;

/// What new keys are of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeysOf<'a> {
    /// All objects, lights and materials that differ from their tracks, or from what they were when the time was set.
    /// If nothing differs: these objects and lights; if there are none: the camera.
    Changes(&'a [Entity]),
    /// The camera.
    Camera,
}

/// A value that becomes a key.
struct NewKey {
    channel: Channel,
    /// The value without the change, for a property without a track.
    before: Option<DVec3>,
    value: DVec3,
}

impl Animation {
    /// An animation without tracks, and with the rate of a scene file that states none.
    pub fn new(camera: CameraPart) -> Self {
        let AnimationPart { fps, duration, .. } = AnimationPart::default();
        Self { fps, duration, shutter: Shutter::default(), camera, tracks: Vec::new(), model: None }
    }

    /// The times of all keys, ascending, each once.
    pub fn key_times(&self) -> Vec<f64> {
        let mut times: Vec<f64> =
            self.tracks.iter().flat_map(|track| track.curve.keys.iter().map(|&(time, _)| time)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup_by(|a, b| *a - *b <= SAME_TIME);
        times
    }

    /// Whether both have the same keys and settings; the camera for properties without tracks does not count.
    pub fn has_same_keys(&self, other: &Self) -> bool {
        let settings = |it: &Self| (it.fps, it.duration, it.shutter);
        settings(self) == settings(other) && self.tracks == other.tracks && self.model == other.model
    }

    fn track(&self, channel: Channel) -> Option<&Track> {
        self.tracks.iter().find(|track| track.channel == channel)
    }

    /// Adds a key, or replaces the one at this time. The first key of a property that has been changed comes with one of
    /// its old value at 0 s.
    fn set_key(&mut self, NewKey { channel, before, value }: &NewKey, seconds: f64) {
        let quantity = channel.quantity();
        let key = (seconds, quantity.key_value(*value));
        let Some(track) = self.tracks.iter_mut().find(|track| track.channel == *channel) else {
            let first = before.filter(|before| seconds > SAME_TIME && before != value);
            let keys = first.map(|value| (0.0, quantity.key_value(value))).into_iter().chain([key]).collect();
            let curve = Curve { interpolation: Interpolation::default(), keys };
            return self.tracks.push(Track { channel: *channel, curve });
        };
        let keys = &mut track.curve.keys;
        keys.retain(|(time, _)| (time - seconds).abs() > SAME_TIME);
        keys.insert(keys.partition_point(|(time, _)| *time < seconds), key);
    }
}

/// Adds keys to the animation of a world, which gets one if it has none. The world itself is not changed; call
/// [`follow_tracks`] afterwards.
///
/// - `before`: the world as it was when its time was set.
/// - `written`: the camera of its scene file.
///
/// Returns what has got a key. Nothing is checked: values between the keys may be invalid.
pub fn set_keys(
    world: &mut World,
    before: &SceneInputs,
    written: Option<&CameraPart>,
    of: KeysOf,
) -> Result<Vec<Channel>, String> {
    let now = SceneInputs::of(world);
    let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    let mut animation = animation_or_new(world, before, written);
    let expected = animation.inputs_at(before, seconds);
    let mut new = Vec::new();
    if let KeysOf::Changes(selected) = of {
        new = changes(&animation, [&animation.inputs_at(before, 0.0), &expected], &now);
        if animation.tracks.is_empty() && !selected.is_empty() {
            // Until something moves, a change may be as old as the scene: what is selected is meant.
            let with_materials = with_materials(world, selected);
            new.retain(|key| key.channel.entity().is_some_and(|entity| with_materials.contains(&entity)));
        }
        if new.is_empty() {
            new = transforms(&animation, &now, selected);
        }
    }
    if new.is_empty() {
        let camera = now.camera.ok_or("there is no camera")?;
        new = keys_of_camera(&mut animation, &camera, seconds);
    }
    for key in &new {
        animation.set_key(key, seconds);
    }
    world.insert_resource(animation);
    Ok(new.into_iter().map(|key| key.channel).collect())
}

/// Entities, and the materials of those that are objects.
fn with_materials(world: &World, entities: &[Entity]) -> HashSet<Entity> {
    let slots = entities.iter().filter_map(|entity| world.get::<MaterialSlots>(*entity));
    entities.iter().chain(slots.flat_map(|slots| &slots.0)).copied().collect()
}

/// Deletes the keys at the current time: of these objects and lights, or of everything if there are none. A track
/// without keys is removed. Returns the number of deleted keys.
pub fn delete_keys(world: &mut World, selected: &[Entity]) -> usize {
    let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    let Some(mut animation) = world.get_resource::<Animation>().cloned() else { return 0 };
    // What has no track any more stays as it is.
    animation.camera = animation.camera_at(seconds);
    let mut n = 0;
    for track in &mut animation.tracks {
        let is_meant = selected.is_empty() || track.channel.entity().is_some_and(|it| selected.contains(&it));
        if is_meant {
            let keys = track.curve.keys.len();
            track.curve.keys.retain(|(time, _)| (time - seconds).abs() > SAME_TIME);
            n += keys - track.curve.keys.len();
        }
    }
    animation.tracks.retain(|track| !track.curve.keys.is_empty());
    if n > 0 {
        world.insert_resource(animation);
    }
    n
}

/// Sets everything that has a track to what that says at the current time.
pub fn follow_tracks(world: &mut World) {
    let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
    place(world, seconds);
}

/// The animation of a world, or one without tracks, with the camera of `before` where no track moves it.
pub fn animation_or_new(world: &World, before: &SceneInputs, written: Option<&CameraPart>) -> Animation {
    let known = world.get_resource::<Animation>();
    if let Some(known) = known.filter(|known| known.moves_camera()) {
        return known.clone();
    }
    let part = |old: Option<&CameraPart>| match &before.camera {
        Some(camera) => camera_part(&camera.view, &camera.projection, &camera.lens, old),
        None => old.cloned().unwrap_or_else(|| CameraPart::looking_at(DVec3::Z, DVec3::ZERO)),
    };
    match known {
        Some(known) => Animation { camera: part(Some(&known.camera)), ..known.clone() },
        None => Animation::new(part(written)),
    }
}

/// What differs from what is expected.
///
/// - `then`: what is expected at 0 s and now.
fn changes(animation: &Animation, then: [&SceneInputs; 2], now: &SceneInputs) -> Vec<NewKey> {
    let [first, expected] = then;
    let mut new = Vec::new();
    let mut compare = |channel: Channel, [first, before]: [Option<DVec3>; 2], value: Option<DVec3>| {
        if let Some(value) = value.filter(|value| before != Some(*value)) {
            let before = first.filter(|_| animation.track(channel).is_none());
            new.push(NewKey { channel, before, value });
        }
    };
    let objects: HashMap<_, _> =
        first.objects.iter().zip(&expected.objects).map(|(first, old)| (old.entity, [first, old])).collect();
    for object in &now.objects {
        let Some(old) = objects.get(&object.entity) else { continue };
        if old[1].placement == object.placement {
            continue;
        }
        for &property in ObjectProperty::ALL {
            let channel = Channel::Object(object.entity, property);
            compare(channel, old.map(|old| property.get(&old.placement)), property.get(&object.placement));
        }
    }
    let lights: HashMap<_, _> =
        first.lights.iter().zip(&expected.lights).map(|(first, old)| (old.entity, [first, old])).collect();
    for light in &now.lights {
        let Some(old) = lights.get(&light.entity) else { continue };
        for &property in LightProperty::ALL {
            let channel = Channel::Light(light.entity, property);
            let old = old.map(|old| property.get(&old.light, &old.placement));
            compare(channel, old, property.get(&light.light, &light.placement));
        }
    }
    let materials: HashMap<_, _> = expected.materials.iter().map(|old| (old.entity, old)).collect();
    for material in &now.materials {
        let Some(old) = materials.get(&material.entity) else { continue };
        if old.material == material.material {
            continue;
        }
        for property in MaterialProperty::animatable(&material.material) {
            let channel = Channel::Material(material.entity, property);
            let old = material_value(property, &old.material);
            compare(channel, [old, old], material_value(property, &material.material));
        }
    }
    new
}

/// Of objects and lights: what has tracks, or else where they are.
fn transforms(animation: &Animation, now: &SceneInputs, selected: &[Entity]) -> Vec<NewKey> {
    let mut new = Vec::new();
    for &entity in selected {
        let object = now.objects.iter().find(|object| object.entity == entity);
        let light = now.lights.iter().find(|light| light.entity == entity);
        let objects = ObjectProperty::ALL
            .iter()
            .filter_map(|property| Some((Channel::Object(entity, *property), property.get(&object?.placement)?, true)));
        let lights = LightProperty::ALL.iter().filter_map(|property| {
            let value = property.get(&light?.light, &light?.placement)?;
            let is_place = matches!(property, LightProperty::Position | LightProperty::Rotate);
            Some((Channel::Light(entity, *property), value, is_place))
        });
        let all: Vec<_> = objects.chain(lights).collect();
        let is_animated = all.iter().any(|(channel, ..)| animation.track(*channel).is_some());
        let wanted = all.into_iter().filter(|(channel, _, is_place)| match is_animated {
            true => animation.track(*channel).is_some(),
            false => *is_place,
        });
        new.extend(wanted.map(|(channel, value, _)| NewKey { channel, before: None, value }));
    }
    new
}

/// Position and aim of the camera, and what else has a track or has been changed. The camera becomes the one for the
/// properties without tracks.
fn keys_of_camera(animation: &mut Animation, now: &CameraInput, seconds: f64) -> Vec<NewKey> {
    let CameraInput { view, projection, lens, .. } = now;
    let old = animation.camera_at(seconds);
    let (old_view, old_projection, old_lens) = camera(&old);
    let has_track =
        |animation: &Animation, property: CameraProperty| animation.track(Channel::Camera(property)).is_some();
    let mut part = rest_camera(animation, seconds, view, projection, lens);
    let at_a_point = part.look_at.is_some();
    // A focus that follows `look_at`, if it still does.
    let follows = old.focus_distance.is_none() && lens.focus_distance == old_lens.focus_distance;
    if follows && (lens.focus_distance - view.pivot_distance).abs() <= ROUNDING * view.pivot_distance {
        part.focus_distance = None;
    }
    let keys = CameraProperty::ALL.iter().filter_map(|&property| {
        let before = property.get(&old_view, &old_projection, &old_lens);
        let value = match property {
            CameraProperty::Up => part.up,
            CameraProperty::LookAt if !at_a_point => return None,
            CameraProperty::Forward if at_a_point => return None,
            // An animated f-stop states the aperture.
            CameraProperty::LensRadius if has_track(animation, CameraProperty::FStop) => return None,
            CameraProperty::FStop => DVec3::splat(part.f_stop.filter(|_| has_track(animation, property))?),
            property => property.get(view, projection, lens)?,
        };
        let before = if property == CameraProperty::Up { Some(old.up) } else { before };
        let is_place = matches!(property, CameraProperty::Eye | CameraProperty::LookAt | CameraProperty::Forward);
        let is_wanted = is_place || has_track(animation, property) || before != Some(value);
        is_wanted.then_some(NewKey { channel: Channel::Camera(property), before, value })
    });
    let keys = keys.collect();
    animation.camera = part;
    keys
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::key::KeyValue;
    use crate::format::placement::Placement;
    use crate::format::view::View;
    use crate::scene::SceneSource;
    use crate::scene::describe::Description;
    use crate::scene::load;
    use crate::scene::load::LoadOptions;
    use crate::scene::world::components::SurfaceMaterial;

    const SCENE: &str = r#"(
        camera: (eye: (0, 1, 5), look_at: (0, 0, 0)),
        materials: {"m": diffuse(albedo: 0.7), "k": metal(reflectance: 0.9, alpha: 0.2)},
        objects: [
            sphere(name: "a", center: (0, 0, 0), radius: 1, material: "m"),
            sphere(name: "b", center: (3, 0, 0), radius: 1, material: "k"),
        ],
        lights: [spot(name: "l", position: (0, 5, 0), direction: (0, -1, 0), intensity: 20)],
    )"#;

    fn world(text: &str) -> (World, CameraPart) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.ron");
        std::fs::write(&path, text).unwrap();
        let loaded = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let mut world = World::new();
        loaded.spawn(&mut world);
        (world, loaded.file.camera)
    }

    /// Sets keys, and returns their properties; the file that describes the world is valid.
    fn set(world: &mut World, before: &SceneInputs, written: &CameraPart, of: KeysOf) -> Vec<&'static str> {
        let channels = set_keys(world, before, Some(written), of).unwrap();
        let seen = SceneInputs::of(world);
        follow_tracks(world);
        let now = SceneInputs::of(world);
        assert_eq!((now.objects, now.lights, now.materials), (seen.objects, seen.lights, seen.materials));
        let (a, b) = (now.camera.unwrap().view, seen.camera.unwrap().view);
        assert!(a.eye == b.eye && a.forward.distance(b.forward) < 1e-9 && a.up.distance(b.up) < 1e-9, "{a:?} {b:?}");
        Description::of(world, None).file.check().unwrap_or_else(|error| panic!("{error}"));
        channels.into_iter().map(Channel::property).collect()
    }

    fn go_to(world: &mut World, seconds: f64) -> SceneInputs {
        crate::scene::animation::moment::show_moment(world, seconds);
        SceneInputs::of(world)
    }

    fn keys(world: &World, channel: Channel) -> Vec<(f64, KeyValue)> {
        world.resource::<Animation>().track(channel).map_or_else(Vec::new, |track| track.curve.keys.clone())
    }

    #[test]
    fn what_was_changed_gets_a_key_and_its_old_value_stays_at_the_start() {
        let (mut world, written) = world(SCENE);
        let before = go_to(&mut world, 2.0);
        let (ball, material) = (before.objects[0].entity, before.objects[1].slots[0]);
        world.get_mut::<Placement>(ball).unwrap().translation.y = 3.0;
        let property = MaterialProperty::named("alpha").unwrap();
        property.set(&mut world.get_mut::<SurfaceMaterial>(material).unwrap().0, DVec3::splat(0.6)).unwrap();
        assert_eq!(set(&mut world, &before, &written, KeysOf::Changes(&[])), ["translate", "alpha"]);
        let moved = Channel::Object(ball, ObjectProperty::Translate);
        let there = KeyValue::Three(DVec3::new(0.0, 3.0, 0.0));
        assert_eq!(keys(&world, moved), [(0.0, KeyValue::Three(DVec3::ZERO)), (2.0, there)]);
        let shine = Channel::Material(material, property);
        assert_eq!(keys(&world, shine), [(0.0, KeyValue::Number(0.2)), (2.0, KeyValue::Number(0.6))]);
        // Half way at half of the time; a change there is a third key, and one at the same time replaces it.
        for (height, n) in [(7.0, 3), (8.0, 3)] {
            let before = go_to(&mut world, 1.0);
            world.get_mut::<Placement>(ball).unwrap().translation.y = height;
            assert_eq!(set(&mut world, &before, &written, KeysOf::Changes(&[])), ["translate"]);
            assert_eq!(keys(&world, moved).len(), n);
        }
        assert_eq!(go_to(&mut world, 0.5).objects[0].placement.translation.y, 4.0);
        assert_eq!(world.resource::<Animation>().key_times(), [0.0, 1.0, 2.0]);
    }

    #[test]
    fn what_is_selected_gets_keys_where_nothing_was_changed() {
        let (mut world, written) = world(SCENE);
        let before = go_to(&mut world, 1.0);
        let (ball, light) = (before.objects[0].entity, before.lights[0].entity);
        assert_eq!(set(&mut world, &before, &written, KeysOf::Changes(&[ball])), ["translate", "rotate", "scale"]);
        assert_eq!(set(&mut world, &before, &written, KeysOf::Changes(&[light])), ["position", "rotate"]);
        assert_eq!(world.resource::<Animation>().key_times(), [1.0]);
        assert_eq!(delete_keys(&mut world, &[light]), 2);
        assert_eq!(delete_keys(&mut world, &[]), 3);
        assert!(!world.resource::<Animation>().moves() && delete_keys(&mut world, &[]) == 0);
    }

    #[test]
    fn the_camera_gets_keys_of_where_it_is_and_of_what_was_changed() {
        for text in [SCENE.to_owned(), SCENE.replace("look_at: (0, 0, 0)", "forward: (0, 0, -1)")] {
            let (mut world, written) = world(&text);
            let aim = if text.contains("look_at") { "look_at" } else { "forward" };
            let before = go_to(&mut world, 0.0);
            assert_eq!(set(&mut world, &before, &written, KeysOf::Changes(&[])), ["eye", aim]);
            let before = go_to(&mut world, 2.0);
            let entity = before.camera.unwrap().entity;
            let view = View::look_at(DVec3::new(4.0, 1.0, 3.0), DVec3::ZERO, DVec3::Y);
            *world.get_mut::<View>(entity).unwrap() = view.unwrap();
            world.get_mut::<crate::format::view::Projection>(entity).unwrap().vfov_deg = 20.0;
            assert_eq!(set(&mut world, &before, &written, KeysOf::Camera), ["eye", aim, "vfov"], "{aim}");
            let half = go_to(&mut world, 1.0).camera.unwrap();
            assert!(half.view.eye.distance(DVec3::new(2.0, 1.0, 4.0)) < 1e-12, "{half:?}");
            assert!(20.0 < half.projection.vfov_deg && half.projection.vfov_deg < 60.0, "{half:?}");
            // Without keys the camera stays where it is.
            let there = go_to(&mut world, 2.0).camera;
            delete_keys(&mut world, &[]);
            crate::scene::animation::moment::show_moment(&mut world, 0.0);
            delete_keys(&mut world, &[]);
            assert!(!world.resource::<Animation>().moves() && there.is_some());
        }
    }
}
