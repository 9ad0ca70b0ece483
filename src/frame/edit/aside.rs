//! Where a copy goes: beside its original, where it is seen.

use crate::frame::edit::spot;
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::{Selection, box_of};
use crate::scene::View;
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;

/// Part of the way to a copy that is in the image if the third of it that is nearest to its original is.
const NEAREST_THIRD: f64 = 0.65;

/// The way from the selection to a copy: along a horizontal axis of the world, by a little more than its width; to its
/// right as it is seen, or to where the copy is seen and touches nothing else.
pub fn step_aside(world: &mut World) -> DVec3 {
    /// A tenth of the width stays free.
    const GAP: f64 = 1.1;
    let selected = world.resource::<Selection>().0.clone();
    let view = world.resource::<RenderState>().inputs.camera.map_or_else(View::default, |camera| camera.view);
    let boxes = selected.iter().filter_map(|&entity| box_of(world, entity));
    let corners: Vec<DVec3> = boxes.flat_map(|own| own.corners()).collect();
    let Some((min, max)) = around(corners) else { return DVec3::ZERO };
    let least_size = 2.0 * spot::find(world, spot::MIDDLE).size;
    let step = |axis: DVec3| {
        let width = (max - min).dot(axis.abs());
        // What has no width, such as a plane or a point of light, is moved as far as a new object is wide.
        axis * if width > 0.0 { GAP * width } else { least_size }
    };
    let right = view.right();
    let aside = if right.x.abs() >= right.z.abs() { DVec3::X * right.x.signum() } else { DVec3::Z * right.z.signum() };
    let behind = if aside.x == 0.0 { DVec3::X } else { DVec3::Z };
    let behind = if behind.dot(view.forward) < 0.0 { -behind } else { behind };
    let steps = [aside, -aside, behind, -behind].map(step);
    let middle = 0.5 * min + 0.5 * max;
    let seen = steps.into_iter().filter(|step| spot::is_seen(world, middle + NEAREST_THIRD * *step));
    let seen: Vec<DVec3> = seen.collect();
    let others = boxes_of_others(world, &selected, (max - min).length());
    let is_free = |step: &&DVec3| {
        let (low, high) = (min + **step, max + **step);
        others.iter().all(|(other_low, other_high)| high.cmplt(*other_low).any() || low.cmpgt(*other_high).any())
    };
    seen.iter().find(is_free).or(seen.first()).copied().unwrap_or(steps[0])
}

/// The boxes of all objects but these, without floors and walls.
///
/// - `size`: from which on flat things are floors and walls, metres.
fn boxes_of_others(world: &mut World, selected: &[Entity], size: f64) -> Vec<(DVec3, DVec3)> {
    let objects: Vec<Entity> = world.resource::<RenderState>().inputs.objects.iter().map(|it| it.entity).collect();
    let others = objects.into_iter().filter(|entity| !selected.contains(entity));
    others
        .filter_map(|entity| box_of(world, entity).filter(|own| !own.is_backdrop(size)))
        .filter_map(|own| around(own.corners()))
        .collect()
}

fn around(points: impl IntoIterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.into_iter().map(|at| (at, at)).reduce(|(low, high), (at, _)| (low.min(at), high.max(at)))
}
