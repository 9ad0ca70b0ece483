//! Selected objects upright, and on what is below them.

use crate::frame::edit::place::{Change, about_middle, changed};
use crate::frame::navigation::box_around;
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::{OwnBox, Selection, box_of, distance_past};
use crate::scene::{GAP_TO_GROUND, Placement, Shape, lowest_point};
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;

/// Turns the selected objects by a quarter about X, as what has Z upwards needs it, and puts them on what is below.
pub fn turn_upright(world: &mut World) {
    stand(world, |world, entity, placement, middle| {
        let turn = Change::Turn { center: middle, axis: DVec3::X, angle_deg: -90.0 };
        changed(&about_middle(world, entity, placement), &turn, false)
    });
}

/// Puts the lowest point of the selected objects on what is below them.
pub fn stand_on_ground(world: &mut World) {
    stand(world, |_, _, placement, _| *placement);
}

/// Puts the selected objects that have an end on what is below them, as one: they may be the parts of a model.
///
/// - `turned`: the placement of each, up to its height, by the middle of all.
fn stand(world: &mut World, turned: impl Fn(&mut World, Entity, &Placement, DVec3) -> Placement) {
    let mut selected = Vec::new();
    for entity in world.resource::<Selection>().0.clone() {
        if let (Some(shape), Some(&placement)) = (world.get::<Shape>(entity).cloned(), world.get(entity))
            && lowest_point(&shape, &placement).is_some()
            && let Some(own) = box_of(world, entity)
        {
            selected.push((entity, shape, placement, own));
        }
    }
    let ends = |placed: &[Placement]| -> Option<(DVec3, DVec3)> {
        let boxes = selected.iter().zip(placed);
        box_around(boxes.flat_map(|((.., own), now)| OwnBox { world_from_box: now.affine(), ..*own }.corners()))
    };
    let before: Vec<Placement> = selected.iter().map(|(_, _, placement, _)| *placement).collect();
    let Some((low, high)) = ends(&before) else { return };
    let turned: Vec<Placement> = (selected.iter())
        .map(|(entity, _, placement, _)| turned(world, *entity, placement, 0.5 * (low + high)))
        .collect();
    let lows = selected.iter().zip(&turned).filter_map(|((_, shape, ..), placement)| lowest_point(shape, placement));
    let (Some(lowest), Some(ends)) = (lows.min_by(f64::total_cmp), ends(&turned)) else { return };
    let entities: Vec<Entity> = selected.iter().map(|(entity, ..)| *entity).collect();
    // Faces in the plane of the ground would mix with it.
    let gap = GAP_TO_GROUND * (ends.1 - ends.0).length();
    let up = ground(world, &entities, ends, 0.5 * gap) + gap - lowest;
    for (entity, (before, turned)) in entities.into_iter().zip(before.into_iter().zip(turned)) {
        let placed = Placement { translation: turned.translation + DVec3::Y * up, ..turned };
        if placed.check().is_ok() && placed != before {
            world.entity_mut(entity).insert(placed);
        }
    }
}

/// Height of what is below objects, metres: of the highest surface below the middle of their box, or else of the highest
/// level plane, or else of the lowest point of all others.
///
/// - `skin`: what is nearer than this to the objects themselves is not looked for, metres.
fn ground(world: &mut World, entities: &[Entity], (low, high): (DVec3, DVec3), skin: f64) -> f64 {
    /// Of the rays that look for it, as a fraction of the sides of the box.
    const ASIDE: f64 = 0.2;
    let shown = world.resource::<RenderState>();
    let (middle, sides) = (0.5 * (low + high), ASIDE * (high - low));
    let below = shown.extraction.as_ref().and_then(|scene| {
        let asides = [(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let starts = asides.map(|(x, z)| middle + DVec3::new(x, 0.0, z) * sides);
        let falls = starts.iter().filter_map(|start| distance_past(scene, *start, -DVec3::Y, entities, skin));
        falls.min_by(f64::total_cmp)
    });
    if let Some(fall) = below {
        return middle.y - fall;
    }
    let planes = shown.inputs.objects.iter().filter_map(|object| match object.shape {
        Shape::Plane { normal } if normal.x == 0.0 && normal.z == 0.0 => Some(object.placement.translation.y),
        _ => None,
    });
    let highest = planes.max_by(f64::total_cmp);
    highest.or_else(|| lowest(world, entities)).unwrap_or(0.0)
}

/// Height of the lowest point of the boxes of all objects that have an end, but these, metres.
pub fn lowest(world: &mut World, but: &[Entity]) -> Option<f64> {
    let objects = world.resource::<RenderState>().inputs.objects.iter().map(|object| object.entity);
    let objects: Vec<Entity> = objects.filter(|entity| !but.contains(entity)).collect();
    let boxes = objects.into_iter().filter_map(|entity| box_of(world, entity)).filter(|own| own.min != own.max);
    boxes.flat_map(|own| own.corners()).map(|corner| corner.y).min_by(f64::total_cmp)
}
