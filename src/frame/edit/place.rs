//! Moving, rotating and scaling the selection.
//!
//! Amounts are relative to the start of a change ([`crate::frame::edit::Edit::Begin`]), not to the previous frame, so that a long
//! drag rounds no more than a short one, and dragging back restores the same bits.

use crate::format::placement::tidy_degrees;
use crate::frame::state::history::History;
use crate::frame::state::selection::{OwnBox, Selection, box_of};
use crate::scene::{Animation, Linear, Placement, Shape, lowest_point};
use bevy_ecs::prelude::{Entity, World};
use glam::{DMat3, DQuat, DVec3, EulerRot};

/// A change of a placement.
pub enum Change {
    Move(DVec3),
    /// `axis` is a unit vector.
    Turn {
        center: DVec3,
        axis: DVec3,
        angle_deg: f64,
    },
    Scale {
        center: DVec3,
        factors: DVec3,
    },
}

/// Changes the placements of the selection; `change` gets the centre of the active entity.
pub fn displace(world: &mut World, change: impl Fn(DVec3) -> Change) {
    let selected = world.resource::<Selection>().0.clone();
    // Several objects would be sheared along the axes of one, and spheres must stay spheres.
    let round = |entity: &Entity| matches!(world.get(*entity), Some(Shape::Sphere { .. } | Shape::Spheres(_)));
    let evenly = selected.len() > 1 || selected.iter().any(round);
    let before: Vec<_> = selected
        .into_iter()
        .filter_map(|entity| {
            let begun = world.resource::<History>().placement_at_begin(entity);
            Some((entity, begun.or_else(|| world.get::<Placement>(entity).copied())?))
        })
        .collect();
    let Some(&(active, last)) = before.last() else { return };
    let is_alone = before.len() == 1;
    let own_box = box_of(world, active).map(|own| OwnBox { world_from_box: last.affine(), ..own });
    let change = change(own_box.map_or(last.translation, |own| own.middle()));
    let mut after = Vec::new();
    for (entity, placement) in &before {
        let turns = is_alone && !matches!(change, Change::Move(_));
        let placement = if turns { about_middle(world, *entity, placement) } else { *placement };
        after.push((*entity, changed(&placement, &change, evenly)));
    }
    if matches!(change, Change::Scale { .. }) {
        stay_standing(world, &before, &mut after);
    }
    for (entity, changed) in after {
        // Compared first: a mutable borrow alone would mark a change. What no scene file could have stays as it was.
        if changed.check().is_ok() && world.get::<Placement>(entity) != Some(&changed) {
            world.entity_mut(entity).insert(changed);
        }
    }
}

/// Moves what was scaled up or down, so that its lowest point stays where it was: what stands on a table stays there.
/// What has keys stays, so that no position becomes a key.
pub fn stay_standing(world: &World, before: &[(Entity, Placement)], after: &mut [(Entity, Placement)]) {
    if before.iter().any(|(entity, _)| has_keys(world, *entity)) {
        return;
    }
    let lowest = |placed: &[(Entity, Placement)]| {
        let low = |(entity, placement): &(Entity, Placement)| lowest_point(world.get(*entity)?, placement);
        placed.iter().filter_map(low).min_by(f64::total_cmp)
    };
    if let (Some(was), Some(is)) = (lowest(before), lowest(after)) {
        after.iter_mut().for_each(|(_, placement)| placement.translation.y += was - is);
    }
}

/// The same placement, with the middle of the object as its pivot, unless keys have its position.
pub fn about_middle(world: &mut World, entity: Entity, placement: &Placement) -> Placement {
    match box_of(world, entity) {
        Some(own) if !has_keys(world, entity) && matches!(placement.linear, Linear::Turned { .. }) => {
            placement.with_pivot(0.5 * own.min + 0.5 * own.max)
        }
        _ => *placement,
    }
}

fn has_keys(world: &World, entity: Entity) -> bool {
    let is_moved = |animation: &Animation| animation.tracks.iter().any(|track| track.channel.entity() == Some(entity));
    world.get_resource::<Animation>().is_some_and(is_moved)
}

/// Returns the changed placement; with `evenly`, scales by the factor that differs most from 1.
pub fn changed(placement: &Placement, change: &Change, evenly: bool) -> Placement {
    let Placement { translation, linear, pivot } = *placement;
    // Where the pivot is in the world.
    let at = translation + pivot;
    match *change {
        Change::Move(by) => Placement { translation: translation + by, ..*placement },
        Change::Turn { center, axis, angle_deg } => {
            let turn = DQuat::from_axis_angle(axis, angle_deg.to_radians());
            Placement { translation: center + turn * (at - center) - pivot, linear: turned(&linear, turn), pivot }
        }
        Change::Scale { center, factors } => {
            let most = |a: f64, b: f64| if b.ln().abs() > a.ln().abs() { b } else { a };
            let even = most(most(factors.x, factors.y), factors.z);
            let factors = if evenly { DVec3::splat(even) } else { factors };
            let linear = match linear {
                Linear::Turned { rotation_deg, scale } => Linear::Turned { rotation_deg, scale: scale * factors },
                Linear::Matrix(matrix) => Linear::Matrix(matrix * DMat3::from_diagonal(factors)),
            };
            Placement { translation: center + factors * (at - center) - pivot, linear, pivot }
        }
    }
}

/// Rotates in world space and keeps the representation, so that its numbers stay readable.
fn turned(linear: &Linear, turn: DQuat) -> Linear {
    match *linear {
        Linear::Turned { rotation_deg, scale } => {
            let DVec3 { x, y, z } = rotation_deg.map(f64::to_radians);
            let (z, y, x) = (turn * DQuat::from_euler(EulerRot::ZYX, z, y, x)).to_euler(EulerRot::ZYX);
            Linear::Turned { rotation_deg: DVec3::new(x, y, z).map(tidy_degrees), scale }
        }
        Linear::Matrix(matrix) => Linear::Matrix(DMat3::from_quat(turn) * matrix),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_in_the_world_is_what_matrices_say() {
        let placement = Placement {
            translation: DVec3::new(1.0, 2.0, 3.0),
            linear: Linear::Turned { rotation_deg: DVec3::new(20.0, -70.0, 130.0), scale: DVec3::new(1.0, 2.0, 0.5) },
            pivot: DVec3::new(-0.3, 0.5, 0.1),
        };
        let (center, axis) = (DVec3::new(0.5, 0.0, -1.0), DVec3::new(1.0, 2.0, -0.5).normalize());
        let change = Change::Turn { center, axis, angle_deg: 77.0 };
        let expected = DMat3::from_axis_angle(axis, 77f64.to_radians());
        let result = changed(&placement, &change, false);
        assert!(result.linear().abs_diff_eq(expected * placement.linear(), 1e-10));
        let matrix = Placement { linear: Linear::Matrix(placement.linear()), ..placement };
        assert!(placement.with_pivot(DVec3::ONE).affine().abs_diff_eq(placement.affine(), 1e-12));
        assert!(changed(&matrix, &change, false).affine().abs_diff_eq(result.affine(), 1e-10));
        let back = changed(&result, &Change::Turn { center, axis, angle_deg: -77.0 }, false);
        assert!(back.affine().abs_diff_eq(placement.affine(), 1e-9));
    }

    #[test]
    fn one_is_scaled_along_its_axes_and_several_evenly() {
        let placement = Placement::at(DVec3::X);
        let change = Change::Scale { center: DVec3::ZERO, factors: DVec3::new(1.0, 3.0, 1.0) };
        assert_eq!(changed(&placement, &change, false).linear(), DMat3::from_diagonal(DVec3::new(1.0, 3.0, 1.0)));
        let evenly = changed(&placement, &change, true);
        assert_eq!((evenly.translation, evenly.even_scale()), (3.0 * DVec3::X, Some(3.0)));
        let smaller = Change::Scale { center: DVec3::ZERO, factors: DVec3::new(0.5, 1.0, 1.0) };
        assert_eq!(changed(&placement, &smaller, true).even_scale(), Some(0.5), "smaller along one axis is smaller");
    }
}
