//! A model that joins the open scene: its objects with their materials, in the size of what is there.

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::edit::new_entity::free_name;
use crate::frame::edit::place::{Change, changed};
use crate::frame::state::resources::Clock;
use crate::frame::state::selection::{OwnBox, Selection};
use crate::scene::{AddedParts, ExtentCache, LoadedScene, Placement, Shape, lowest_point};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;

/// Adds all objects of a model and selects them. Together they stand at `place`, as wide as twice `size`, metres.
pub fn add_model(world: &mut World, model: &LoadedScene, place: DVec3, size: f64) {
    let now = world.resource::<Clock>().0;
    for warning in model.warnings.iter() {
        world.resource_mut::<Status>().say(now, MessageKind::Note, warning.to_string());
    }
    let AddedParts { materials, objects, .. } = model.add_anew(world);
    materials.into_iter().for_each(|material| give_free_name(world, material, true));
    objects.iter().for_each(|object| give_free_name(world, *object, false));
    stand_at(world, &objects, place, size);
    *world.resource_mut::<Selection>() = Selection(objects);
}

/// Renames an entity that has the name of another one.
fn give_free_name(world: &mut World, entity: Entity, is_material: bool) {
    let Some(name) = world.entity_mut(entity).take::<Name>() else { return };
    let free = free_name(world, name.as_str(), is_material);
    world.entity_mut(entity).insert(Name::new(free));
}

/// Scales the objects together and moves them, the middle of their base to `place`.
fn stand_at(world: &mut World, objects: &[Entity], place: DVec3, size: f64) {
    let mut extents = ExtentCache::default();
    let (mut min, mut max, mut foot) = (DVec3::INFINITY, DVec3::NEG_INFINITY, f64::INFINITY);
    for &entity in objects {
        let (Some(shape), Some(placement)) = (world.get::<Shape>(entity), world.get::<Placement>(entity)) else {
            continue;
        };
        let Some((low, high)) = extents.own_box(shape) else { continue };
        for corner in (OwnBox { min: low, max: high, world_from_box: placement.affine() }).corners() {
            (min, max) = (min.min(corner), max.max(corner));
        }
        foot = foot.min(lowest_point(shape, placement).unwrap_or(min.y));
    }
    let extent = (max - min).max_element();
    if !(extent > 0.0 && extent.is_finite()) {
        return;
    }
    let base = (0.5 * (min + max)).with_y(foot);
    let scale = Change::Scale { center: base, factors: DVec3::splat(2.0 * size / extent) };
    for &entity in objects {
        let Some(placement) = world.get::<Placement>(entity) else { continue };
        let placement = changed(&changed(placement, &scale, true), &Change::Move(place - base), true);
        world.entity_mut(entity).insert(placement);
    }
}
