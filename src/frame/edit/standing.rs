//! Selected objects upright, and on the ground.

use crate::frame::edit::place::{Change, about_middle, changed};
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::{OwnBox, Selection, box_of};
use crate::scene::{Placement, Shape};
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;

/// Between object and ground, of the diagonal of the object: too small to be seen. Faces in one plane would mix.
const GAP: f64 = 1.0 / 4096.0;

/// Turns each selected object by a quarter about X, as what has Z upwards needs it, and puts it on the ground.
pub fn turn_upright(world: &mut World) {
    for entity in world.resource::<Selection>().0.clone() {
        let (Some(own), Some(&placement)) = (box_of(world, entity), world.get::<Placement>(entity)) else { continue };
        let turn = Change::Turn { center: own.middle(), axis: DVec3::X, angle_deg: -90.0 };
        let turned = changed(&about_middle(world, entity, &placement), &turn, false);
        let own = OwnBox { world_from_box: turned.affine(), ..own };
        put_on_ground(world, entity, turned, own.corners());
    }
}

/// Puts the lowest point of each selected object on the ground.
pub fn stand_on_ground(world: &mut World) {
    for entity in world.resource::<Selection>().0.clone() {
        let (Some(own), Some(&placement)) = (box_of(world, entity), world.get::<Placement>(entity)) else { continue };
        put_on_ground(world, entity, placement, own.corners());
    }
}

fn put_on_ground(world: &mut World, entity: Entity, placement: Placement, corners: [DVec3; 8]) {
    let lowest = corners.iter().map(|corner| corner.y).fold(f64::INFINITY, f64::min);
    let gap = GAP * (corners[7] - corners[0]).length();
    let up = DVec3::Y * (ground(world, entity) + gap - lowest);
    let placed = Placement { translation: placement.translation + up, ..placement };
    if placed.check().is_ok() && world.get::<Placement>(entity) != Some(&placed) {
        world.entity_mut(entity).insert(placed);
    }
}

/// Height of the ground below an object, metres: of the highest level plane, or else of the lowest point of the others.
fn ground(world: &mut World, entity: Entity) -> f64 {
    let objects = world.resource::<RenderState>().inputs.objects.clone();
    let is_level = |normal: DVec3| normal.x == 0.0 && normal.z == 0.0;
    let planes = objects.iter().filter_map(|object| match object.shape {
        Shape::Plane { normal } if is_level(normal) && object.entity != entity => Some(object.placement.translation.y),
        _ => None,
    });
    let plane = planes.max_by(f64::total_cmp);
    let others =
        objects.iter().filter(|object| object.entity != entity).filter_map(|other| box_of(world, other.entity));
    plane.or_else(|| others.flat_map(|own| own.corners()).map(|corner| corner.y).min_by(f64::total_cmp)).unwrap_or(0.0)
}
