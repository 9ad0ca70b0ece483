//! A model that joins the open scene: its objects with their materials, in the size of what is there.

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::edit::new_entity::free_name;
use crate::frame::edit::place::{Change, changed};
use crate::frame::state::resources::Clock;
use crate::frame::state::selection::{OwnBox, Selection};
use crate::scene::{
    AddedParts, ExtentCache, GAP_TO_GROUND, LoadedScene, Material, Placement, Shape, SurfaceMaterial, lowest_point,
};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;
use std::path::Path;

/// Adds all objects of a model and selects them. Together they stand at `place`, as wide as twice `size`, metres.
pub fn add_model(world: &mut World, model: &LoadedScene, place: DVec3, size: f64) {
    let now = world.resource::<Clock>().0;
    for warning in model.warnings.iter() {
        world.resource_mut::<Status>().say(now, MessageKind::Note, warning.to_string());
    }
    let AddedParts { materials, objects, .. } = model.add_anew(world);
    materials.iter().for_each(|material| give_free_name(world, *material, true));
    objects.iter().for_each(|object| give_free_name(world, *object, false));
    let factor = stand_at(world, &objects, place, size);
    for &material in &materials {
        with_absorption_of(world, material, factor);
    }
    // Built-in meshes have no size of their own.
    if factor != 1.0 && model.source.path().is_some_and(Path::is_absolute) {
        let title = model.source.title();
        let text = format!("{title} is {} of its size in the file, to fit", percent(factor));
        world.resource_mut::<Status>().say(now, MessageKind::Note, text);
    }
    *world.resource_mut::<Selection>() = Selection(objects);
}

/// Renames an entity that has the name of another one.
fn give_free_name(world: &mut World, entity: Entity, is_material: bool) {
    let Some(name) = world.entity_mut(entity).take::<Name>() else { return };
    let free = free_name(world, name.as_str(), is_material);
    world.entity_mut(entity).insert(Name::new(free));
}

/// Keeps the colour of what light loses inside of glass that is scaled by a factor.
fn with_absorption_of(world: &mut World, material: Entity, factor: f64) {
    let Some(mut surface) = world.get_mut::<SurfaceMaterial>(material) else { return };
    if let Material::Glass { absorption, .. }
    | Material::RoughGlass { absorption, .. }
    | Material::Phong { absorption, .. }
    | Material::Principled { absorption, .. } = &mut surface.0
    {
        *absorption = (absorption.as_dvec3() / factor).as_vec3();
    }
}

fn percent(share: f64) -> String {
    let digits = if share < 0.1 { 2 } else { 0 };
    format!("{:.digits$} %", 100.0 * share)
}

/// Scales the objects together and moves them, the middle of their base to `place`; returns the factor.
fn stand_at(world: &mut World, objects: &[Entity], place: DVec3, size: f64) -> f64 {
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
        return 1.0;
    }
    let factor = 2.0 * size / extent;
    let base = (0.5 * (min + max)).with_y(foot);
    let scale = Change::Scale { center: base, factors: DVec3::splat(factor) };
    // Faces in the plane of the ground would mix with it.
    let place = place + DVec3::Y * (GAP_TO_GROUND * factor * (max - min).length());
    for &entity in objects {
        let Some(placement) = world.get::<Placement>(entity) else { continue };
        let placement = changed(&changed(placement, &scale, true), &Change::Move(place - base), true);
        world.entity_mut(entity).insert(placement);
    }
    factor
}
