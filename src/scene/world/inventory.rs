//! The contents of a scene as lists for the user interface: objects, materials with their users, and everything that
//! emits light.
//!
//! Created when a list is shown, and again only after the scene has changed; values are read from the world on display,
//! since they change more often than the lists.

use crate::files::printable;
use crate::scene::world::components::{ColorParam, Material, MaterialSlots, Ordinal, Shape, SurfaceMaterial};
use crate::scene::world::inputs::SceneInputs;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// All lists, in the order of the scene file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inventory {
    /// Objects, and lights that are not objects, hidden ones too.
    pub objects: Vec<ObjectEntry>,
    /// All materials, used or not.
    pub materials: Vec<MaterialEntry>,
    /// Everything that emits light, except the environment.
    pub lights: Vec<LightEntry>,
}

/// An entry of the list of objects.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectEntry {
    /// The entity in the world.
    pub entity: Entity,
    /// Its name, or its kind and a number.
    pub label: String,
    /// Kind of its shape, as in [`Shape::kind`], or of the light, as in [`LightKind::name`](crate::format::light::LightKind::name).
    pub kind: &'static str,
    /// The name of its material, if it has a single one: it tells what `Mesh018` is.
    pub material: Option<String>,
}

/// An entry of the list of materials.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialEntry {
    /// The entity in the world.
    pub entity: Entity,
    /// Its name, or that of its user.
    pub label: String,
    /// The objects that use it, directly or in a blend, each once.
    pub users: Vec<Entity>,
    /// The blends that have it as a part.
    pub blends: Vec<Entity>,
}

/// An entry of the list of lights.
#[derive(Clone, Debug, PartialEq)]
pub struct LightEntry {
    /// The object or light; can be selected.
    pub entity: Entity,
    /// Its name, or its kind and a number.
    pub label: String,
    /// As in [`LightKind::name`](crate::format::light::LightKind::name), or by the shape of the emissive object.
    pub kind: &'static str,
    /// The emissive material, which may be a part of a blend; `None` for a light that is not an object.
    pub material: Option<Entity>,
}

impl Inventory {
    /// - `inputs`: those of `world`.
    pub fn of(world: &World, inputs: &SceneInputs) -> Self {
        let mut users: BTreeMap<Entity, Vec<Entity>> = BTreeMap::new();
        let mut parts: BTreeMap<Entity, BTreeSet<Entity>> = BTreeMap::new();
        let (mut objects, mut lights) = (Vec::new(), Vec::new());
        let inputs = &inputs.with_hidden();
        for (i, object) in inputs.objects.iter().enumerate() {
            let kind = object.shape.kind();
            let label = shown(&object.name).unwrap_or_else(|| format!("{kind} {i}"));
            let mut of_object = BTreeSet::new();
            for slot in &object.slots {
                of_object.extend(parts.entry(*slot).or_insert_with(|| parts_of(world, *slot)).iter().copied());
            }
            for &material in &of_object {
                users.entry(material).or_default().push(object.entity);
                if SurfaceMaterial::of(world, material).is_some_and(emits) {
                    let kind = light_kind(&object.shape);
                    let (entity, label) = (object.entity, label.clone());
                    lights.push(LightEntry { entity, label, kind, material: Some(material) });
                }
            }
            let material = match object.slots[..] {
                [slot] => world.get::<Name>(slot).and_then(|name| shown(&Some(name.to_string()))),
                _ => None,
            };
            objects.push(ObjectEntry { entity: object.entity, label, kind, material });
        }
        for (i, light) in inputs.lights.iter().enumerate() {
            let (entity, kind) = (light.entity, light.light.name());
            let label = shown(&light.name).unwrap_or_else(|| format!("{kind} {i}"));
            lights.push(LightEntry { entity, label: label.clone(), kind, material: None });
            objects.push(ObjectEntry { entity, label, kind, material: None });
        }
        let labels: BTreeMap<Entity, &str> = objects.iter().map(|entry| (entry.entity, entry.label.as_str())).collect();
        let mut blends: BTreeMap<Entity, Vec<Entity>> = BTreeMap::new();
        let all = materials_of(world);
        for (entity, _) in &all {
            if let Some(SurfaceMaterial(Material::Blend { a, b, .. })) = world.get(*entity) {
                blends.entry(*a).or_default().push(*entity);
                blends.entry(*b).or_default().push(*entity);
            }
        }
        let materials = all.into_iter().map(|(entity, name)| {
            let users = users.remove(&entity).unwrap_or_default();
            let label = shown(&name).unwrap_or_else(|| match users.first().and_then(|user| labels.get(user)) {
                Some(user) => format!("of {user}"),
                None => "no name".to_owned(),
            });
            MaterialEntry { entity, label, users, blends: blends.remove(&entity).unwrap_or_default() }
        });
        Self { materials: materials.collect(), objects, lights }
    }

    /// The entry of a material; `None` if the entity is not a material.
    pub fn material(&self, entity: Entity) -> Option<&MaterialEntry> {
        self.materials.iter().find(|entry| entry.entity == entity)
    }
}

/// Whether an object emits light by one of its materials.
pub(crate) fn is_emitter(world: &World, object: Entity) -> bool {
    let slots = world.get::<MaterialSlots>(object);
    let mut materials = slots.iter().flat_map(|slots| &slots.0).flat_map(|&slot| parts_of(world, slot));
    materials.any(|material| SurfaceMaterial::of(world, material).is_some_and(emits))
}

/// Whether a plain material is emissive.
pub(crate) fn emits(material: &Material) -> bool {
    match material {
        Material::Emissive { .. } => true,
        Material::Principled { emission, .. } => *emission != ColorParam::Rgb(Vec3::ZERO),
        _ => false,
    }
}

/// As shown in lists.
fn shown(name: &Option<String>) -> Option<String> {
    name.as_ref().map(|name| printable::name(name).into_owned())
}

/// The objects that use a material, directly or in a blend.
pub fn users_of(world: &World, inputs: &SceneInputs, material: Entity) -> Vec<Entity> {
    let mut uses: BTreeMap<Entity, bool> = BTreeMap::new();
    let mut uses = |slot: &Entity| *uses.entry(*slot).or_insert_with(|| parts_of(world, *slot).contains(&material));
    inputs.objects.iter().filter(|object| object.slots.iter().any(&mut uses)).map(|object| object.entity).collect()
}

/// A material and, if it is a blend, all of its parts, recursively.
fn parts_of(world: &World, material: Entity) -> BTreeSet<Entity> {
    let (mut found, mut open) = (BTreeSet::new(), vec![material]);
    while let Some(entity) = open.pop() {
        if found.insert(entity)
            && let Some(SurfaceMaterial(Material::Blend { a, b, .. })) = world.get(entity)
        {
            open.extend([*a, *b]);
        }
    }
    found
}

/// All materials of the world with their names, in the order of the scene file.
fn materials_of(world: &World) -> Vec<(Entity, Option<String>)> {
    // Before the first frame of a session no component is registered, and there is nothing to list.
    let Some(mut query) = world.try_query::<(Entity, Option<&Ordinal>, Option<&Name>, &SurfaceMaterial)>() else {
        return Vec::new();
    };
    let mut all: Vec<_> = (query.iter(world))
        .map(|(entity, rank, name, _)| {
            (rank.map_or(u32::MAX, |rank| rank.0), entity, name.map(|name| name.as_str().to_owned()))
        })
        .collect();
    all.sort_unstable_by_key(|(rank, entity, _)| (*rank, *entity));
    all.into_iter().map(|(_, entity, name)| (entity, name)).collect()
}

fn light_kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "sphere light",
        Shape::Quad { .. } | Shape::Triangle { .. } | Shape::Plane { .. } => "area light",
        Shape::Mesh(_) => "mesh light",
        Shape::Spheres(_) => "sphere lights",
    }
}
