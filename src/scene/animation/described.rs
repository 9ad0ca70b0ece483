//! The animation of a world as part of a scene file: names of the animated entities, and what cannot be expressed.

use crate::format::animation::{AnimationPart, EditedPart};
use crate::format::camera::camera_part;
use crate::format::names::Names;
use crate::scene::animation::model::ModelMotion;
use crate::scene::animation::written::to_part;
use crate::scene::animation::{Animation, Channel};
use crate::scene::world::components::SurfaceMaterial;
use crate::scene::world::inputs::{LightInput, ObjectInput, SceneInputs};
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// The animated entities of a world.
#[derive(Default)]
pub(in crate::scene) struct Moved {
    /// Unique names of the animated objects and lights.
    names: HashMap<Entity, String>,
    materials: HashSet<Entity>,
}

impl Moved {
    pub(in crate::scene) fn of(animation: Option<&Animation>, inputs: &SceneInputs) -> Self {
        let (mut objects, mut lights, mut materials) = (HashSet::new(), HashSet::new(), HashSet::new());
        let by_model: HashSet<Entity> =
            animation.iter().filter_map(|it| it.model.as_ref()).flat_map(ModelMotion::moved).collect();
        if !by_model.is_empty() {
            objects.extend(inputs.objects.iter().map(|object| object.entity).filter(|it| by_model.contains(it)));
            lights.extend(inputs.lights.iter().map(|light| light.entity).filter(|it| by_model.contains(it)));
        }
        for track in animation.iter().flat_map(|it| &it.tracks) {
            match track.channel {
                Channel::Camera(_) => continue,
                Channel::Object(entity, _) => objects.insert(entity),
                Channel::Light(entity, _) => lights.insert(entity),
                Channel::Material(entity, _) => materials.insert(entity),
            };
        }
        let mut moved = Self { materials, ..Self::default() };
        if !objects.is_empty() {
            let names = inputs.objects.iter().map(|object| (object.entity, object.name.as_deref()));
            moved.give_names("object", names.collect(), &objects);
        }
        if !lights.is_empty() {
            let names = inputs.lights.iter().map(|light| (light.entity, light.name.as_deref()));
            moved.give_names("light", names.collect(), &lights);
        }
        moved
    }

    /// Assigns names to the animated ones of `things`, all of one kind.
    fn give_names(&mut self, what: &str, things: Vec<(Entity, Option<&str>)>, animated: &HashSet<Entity>) {
        let mut uses: HashMap<&str, usize> = HashMap::new();
        for name in things.iter().filter_map(|(_, name)| *name) {
            *uses.entry(name).or_default() += 1;
        }
        let mut names = Names::taken(uses.keys().map(|name| (*name).to_owned()));
        // A thing without a name gets a number.
        names.take(what);
        for (entity, name) in things.into_iter().filter(|(entity, _)| animated.contains(entity)) {
            let name = name.filter(|name| !name.is_empty());
            let own = match name {
                Some(name) if uses[name] == 1 => name.to_owned(),
                _ => names.free(name.unwrap_or(what)),
            };
            self.names.insert(entity, own);
        }
    }

    /// The unique name of an animated object or light.
    pub(in crate::scene) fn name(&self, entity: Entity) -> Option<&String> {
        self.names.get(&entity)
    }

    /// Whether a material is animated.
    pub(in crate::scene) fn has_material(&self, entity: Entity) -> bool {
        self.materials.contains(&entity)
    }

    /// The animation as in a scene file, with what differs from it. Tracks whose entity has lost the property are added to
    /// `losses`.
    ///
    /// - `at`: the current time of the world, seconds.
    /// - `materials`: their names in the file.
    pub(in crate::scene) fn part(
        &self,
        (animation, at): (&Animation, f64),
        (world, inputs): (&World, &SceneInputs),
        materials: &HashMap<Entity, String>,
        losses: &mut Vec<String>,
    ) -> AnimationPart {
        let edited = self.edited_part(animation, at, (world, inputs), materials);
        let objects = inputs.objects.iter().map(|object| (object.entity, object)).collect();
        let lights = inputs.lights.iter().map(|light| (light.entity, light)).collect();
        let named = |channel: Channel| {
            let name = match channel {
                Channel::Camera(_) => return None,
                Channel::Object(entity, _) | Channel::Light(entity, _) => self.names.get(&entity)?.clone(),
                Channel::Material(entity, _) => materials.get(&entity)?.clone(),
            };
            match has_property(channel, world, &objects, &lights) {
                Some(false) => {
                    let property = channel.property();
                    losses
                        .push(format!("the keys of `{property}` are left out: `{name}` has no `{property}` any more"));
                    None
                }
                _ => Some(name),
            }
        };
        let model = animation.model.as_ref().and_then(|model| model.to_part(|entity| self.names.get(&entity).cloned()));
        AnimationPart { edited, ..to_part(animation, at, named, model) }
    }

    /// What differs from its tracks.
    fn edited_part(
        &self,
        animation: &Animation,
        at: f64,
        (world, inputs): (&World, &SceneInputs),
        materials: &HashMap<Entity, String>,
    ) -> EditedPart {
        let edited = animation.edited(inputs, at);
        let named = |entities: &mut dyn Iterator<Item = Entity>| -> Vec<String> {
            entities.filter(|entity| edited.entities.contains(entity)).filter_map(|it| self.name(it).cloned()).collect()
        };
        // Those that no object uses are not among the inputs.
        let mut of_materials: Vec<String> = (animation.tracks.iter())
            .filter_map(|track| {
                let Channel::Material(entity, property) = track.channel else { return None };
                let now = &world.get::<SurfaceMaterial>(entity)?.0;
                let mut then = now.clone();
                property.set(&mut then, track.at(at));
                (then != *now).then(|| materials.get(&entity).cloned())?
            })
            .collect();
        of_materials.sort();
        of_materials.dedup();
        let seen = inputs.camera.as_ref().filter(|_| edited.camera && animation.moves_camera());
        EditedPart {
            camera: seen.map(|seen| camera_part(&seen.view, &seen.projection, &seen.lens, None)),
            objects: named(&mut inputs.objects.iter().map(|object| object.entity)),
            lights: named(&mut inputs.lights.iter().map(|light| light.entity)),
            materials: of_materials,
        }
    }
}

/// Whether the property of the channel can be set; `None` if its entity does not exist.
fn has_property(
    channel: Channel,
    world: &World,
    objects: &HashMap<Entity, &ObjectInput>,
    lights: &HashMap<Entity, &LightInput>,
) -> Option<bool> {
    use crate::format::property::ObjectProperty::{Rotate, Scale};
    Some(match channel {
        Channel::Camera(_) => true,
        Channel::Object(entity, property) => {
            let object = objects.get(&entity)?;
            let is_sheared = object.placement.linear.rotation_and_scale().is_none();
            !(is_sheared && matches!(property, Rotate | Scale))
        }
        Channel::Light(entity, property) => {
            let light = lights.get(&entity)?;
            property.set(&mut light.light.clone(), &mut light.placement.clone(), DVec3::ONE).is_some()
        }
        Channel::Material(entity, property) => {
            property.set(&mut world.get::<SurfaceMaterial>(entity)?.0.clone(), DVec3::ONE).is_some()
        }
    })
}
