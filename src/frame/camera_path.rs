//! Camera paths, one view per frame: a turntable, or an interpolation of bookmarks.

use crate::format::view::by_factor;
use crate::frame::core::rig::{Rig, Turning};
use crate::frame::navigation::orbit;
use crate::scene::View;
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::TAU;

/// Returns `n` views of one orbit around the pivot, the first unchanged; the horizon stays level, and the sequence
/// loops without a jump.
pub fn turntable(start: &Rig, n: u32) -> Vec<Rig> {
    let view = |i: u32| orbit(&start.view, TAU * f64::from(i) / f64::from(n), 0.0, Turning::Turntable);
    // Even a rotation by zero would round.
    (0..n).map(|i| if i == 0 { *start } else { Rig { view: view(i), ..*start } }).collect()
}

/// Returns `n` views from the first stop through all others to the last, with the same time between stops.
///
/// The camera position follows a Catmull-Rom spline, directions are interpolated by slerp, distances and the field of
/// view geometrically, and the focus distance linearly in its reciprocal, so that it may be infinite.
pub fn along(stops: &[Rig], n: u32) -> Vec<Rig> {
    let Some(last) = stops.len().checked_sub(1) else { return Vec::new() };
    (0..n)
        .map(|i| {
            let t = if n > 1 { f64::from(i) * last as f64 / f64::from(n - 1) } else { 0.0 };
            let leg = (t as usize).min(last.saturating_sub(1));
            between(stops, leg, t - leg as f64)
        })
        .collect()
}

/// Interpolates from stop `leg` to the next, `t` in 0..=1.
fn between(stops: &[Rig], leg: usize, t: f64) -> Rig {
    let (a, b) = (&stops[leg], &stops[(leg + 1).min(stops.len() - 1)]);
    // Stops are returned exactly.
    if t == 0.0 || t == 1.0 {
        return if t == 0.0 { *a } else { *b };
    }
    let before = stops[leg.saturating_sub(1)].view.eye;
    let after = stops[(leg + 2).min(stops.len() - 1)].view.eye;
    let (turned_a, turned_b) = (rotation(&a.view), rotation(&b.view));
    let turned = turned_a.slerp(turned_b, t);
    let view = View {
        eye: catmull_rom(before, a.view.eye, b.view.eye, after, t),
        forward: turned * DVec3::NEG_Z,
        up: turned * DVec3::Y,
        pivot_distance: by_factor(a.view.pivot_distance, b.view.pivot_distance, t),
    };
    let (projection, lens) = (a.projection.between(&b.projection, t), a.lens.between(&b.lens, t));
    Rig { view: view.orthonormalized(), projection, lens }
}

/// Rotation of a view relative to one along −Z with +Y up.
fn rotation(view: &View) -> DQuat {
    DQuat::from_mat3(&DMat3::from_cols(view.right(), view.up, -view.forward)).normalize()
}

/// Catmull-Rom interpolation from `b` to `c` (Catmull and Rom 1974); the tangents at both ends come from their
/// neighbours.
fn catmull_rom(a: DVec3, b: DVec3, c: DVec3, d: DVec3, t: f64) -> DVec3 {
    let (out, into) = (0.5 * (c - a), 0.5 * (d - b));
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * b + (t3 - 2.0 * t2 + t) * out + (3.0 * t2 - 2.0 * t3) * c + (t3 - t2) * into
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Lens, Projection};

    fn stop(eye: DVec3, look_at: DVec3) -> Rig {
        let view = View::look_at(eye, look_at, DVec3::Y).unwrap();
        Rig { view, projection: Projection::perspective(40.0), lens: Lens::pinhole(view.pivot_distance) }
    }

    #[test]
    fn a_turntable_keeps_its_distance_and_comes_round() {
        let start = stop(DVec3::new(3.0, 2.0, 4.0), DVec3::new(1.0, 0.5, -1.0));
        let views = turntable(&start, 8);
        assert_eq!((views.len(), views[0]), (8, start));
        for view in views.iter().map(|bookmark| bookmark.view) {
            assert!((view.pivot() - start.view.pivot()).length() < 1e-12);
            assert!((view.eye.y - 2.0).abs() < 1e-12 && view.right().y.abs() < 1e-12, "{view:?}");
        }
        // After half of the orbit, the camera is on the opposite side.
        let opposite = 2.0 * start.view.pivot() - start.view.eye;
        assert!((views[4].view.eye - DVec3::new(opposite.x, 2.0, opposite.z)).length() < 1e-12);
    }

    #[test]
    fn a_way_goes_through_its_stops_smoothly() {
        let mut stops = vec![
            stop(DVec3::new(0.0, 1.0, 5.0), DVec3::ZERO),
            stop(DVec3::new(5.0, 1.0, 0.0), DVec3::ZERO),
            stop(DVec3::new(0.0, 3.0, -5.0), DVec3::new(0.0, 1.0, 0.0)),
        ];
        stops[2].lens.focus_distance = f64::INFINITY;
        let views = along(&stops, 41);
        assert_eq!((views[0], views[20], views[40]), (stops[0], stops[1], stops[2]));
        for pair in views.windows(2) {
            let [a, b] = [pair[0].view, pair[1].view];
            assert!((a.eye - b.eye).length() < 0.8 && a.forward.dot(b.forward) > 0.99, "{a:?} {b:?}");
            assert!((b.forward.length() - 1.0).abs() < 1e-12 && b.forward.dot(b.up).abs() < 1e-12);
        }
        assert!(views[30].lens.focus_distance > views[20].lens.focus_distance && views[30].lens.focus_distance < 1e3);
        assert_eq!((along(&stops[..1], 3), along(&stops, 1)), (vec![stops[0]; 3], vec![stops[0]]));
        assert!(along(&[], 5).is_empty());
    }
}
