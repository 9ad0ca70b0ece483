//! Selected objects upright, and on the ground.

use crate::frame::edit::place::{Change, about_middle, changed};
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::{OwnBox, Selection, box_of};
use crate::scene::{GAP_TO_GROUND, Placement, Shape, lowest_point};
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;

/// Turns each selected object by a quarter about X, as what has Z upwards needs it, and puts it on the ground.
pub fn turn_upright(world: &mut World) {
    stand(world, |world, entity, own, placement| {
        let turn = Change::Turn { center: own.middle(), axis: DVec3::X, angle_deg: -90.0 };
        changed(&about_middle(world, entity, placement), &turn, false)
    });
}

/// Puts the lowest point of each selected object on the ground.
pub fn stand_on_ground(world: &mut World) {
    stand(world, |_, _, _, placement| *placement);
}

/// Puts the selected objects that have an end on the ground.
///
/// - `turned`: the placement of each, up to its height.
fn stand(world: &mut World, turned: impl Fn(&mut World, Entity, &OwnBox, &Placement) -> Placement) {
    for entity in world.resource::<Selection>().0.clone() {
        let (Some(shape), Some(&placement)) = (world.get::<Shape>(entity).cloned(), world.get(entity)) else {
            continue;
        };
        let Some(own) = box_of(world, entity) else { continue };
        let turned = turned(world, entity, &own, &placement);
        let Some(lowest) = lowest_point(&shape, &turned) else { continue };
        let [low, .., high] = own.corners();
        // Faces in the plane of the ground would mix with it.
        let up = ground(world, entity) + GAP_TO_GROUND * (high - low).length() - lowest;
        let placed = Placement { translation: turned.translation + DVec3::Y * up, ..turned };
        if placed.check().is_ok() && placed != placement {
            world.entity_mut(entity).insert(placed);
        }
    }
}

/// Height of the ground below an object, metres: of the highest level plane, or else of the lowest point of the others.
fn ground(world: &mut World, entity: Entity) -> f64 {
    let planes = world.resource::<RenderState>().inputs.objects.iter().filter_map(|object| match object.shape {
        Shape::Plane { normal } if normal.x == 0.0 && normal.z == 0.0 => Some(object.placement.translation.y),
        _ => None,
    });
    let highest = planes.max_by(f64::total_cmp);
    highest.or_else(|| lowest(world, Some(entity))).unwrap_or(0.0)
}

/// Height of the lowest point of the boxes of all objects that have an end, but one, metres.
pub fn lowest(world: &mut World, but: Option<Entity>) -> Option<f64> {
    let objects = world.resource::<RenderState>().inputs.objects.iter().map(|object| object.entity);
    let objects: Vec<Entity> = objects.filter(|entity| Some(*entity) != but).collect();
    let boxes = objects.into_iter().filter_map(|entity| box_of(world, entity)).filter(|own| own.min != own.max);
    boxes.flat_map(|own| own.corners()).map(|corner| corner.y).min_by(f64::total_cmp)
}
