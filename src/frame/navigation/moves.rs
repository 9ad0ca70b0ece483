//! Changes of a view: turning, orbiting, flying, framing.
//!
//! There are two modes of turning: on a turntable, which preserves the roll and stops short of straight up and down,
//! and freely about the image axes.

use crate::frame::core::rig::{Rig, Side, Turning};
use crate::scene::{Projection, View};
use glam::{DQuat, DVec3};
use std::f64::consts::FRAC_PI_2;

/// The axis of a turntable: scenes are Y up.
pub const VERTICAL: DVec3 = DVec3::Y;

/// Maximum elevation on a turntable, radians: closer to the vertical, yaw would spin the image in place.
const MAX_ELEVATION: f64 = 89.0 * (FRAC_PI_2 / 90.0);

/// Limits of the field of view for zooming, degrees: a strong telescope, and the widest useful planar projection.
const VFOV_RANGE_DEG: (f64, f64) = (0.1, 150.0);

/// Margin around framed objects, relative to half the image: the bar and the time line cover less.
const ROOM: f64 = 0.16;

/// Turns the camera about its position; radians to the right and upwards in the image.
pub fn turn(view: &View, yaw: f64, pitch: f64, turning: Turning) -> View {
    finite_or(view, rotated(view, yaw, pitch, turning))
}

/// Moves the camera around the pivot at constant distance; radians to the right and upwards in the image.
pub fn orbit(view: &View, yaw: f64, pitch: f64, turning: Turning) -> View {
    // The camera moves right when its direction turns left.
    let turned = rotated(view, -yaw, -pitch, turning);
    finite_or(view, View { eye: view.pivot() - turned.forward * view.pivot_distance, ..turned })
}

/// Like [`orbit`], but a camera above `ground` stays above it: below, the image would show nothing but its back.
///
/// - `ground`: height of a horizontal plane, metres.
pub fn orbit_above(view: &View, yaw: f64, pitch: f64, turning: Turning, ground: Option<f64>) -> View {
    let whole = orbit(view, yaw, pitch, turning);
    let Some(ground) = ground.filter(|ground| view.eye.y > *ground) else { return whole };
    let least = (ground + CLEARANCE * view.pivot_distance).min(view.eye.y);
    if whole.eye.y >= least {
        return whole;
    }
    let part = |pitch: f64| orbit(view, yaw, pitch, turning);
    let (possible, _) = divided(pitch, |pitch| part(pitch).eye.y >= least);
    let stopped = part(possible);
    // A view that leans may lose height by its yaw alone.
    if stopped.eye.y > ground { stopped } else { *view }
}

/// Height that remains above the ground, relative to the distance to the pivot: the ground still looks like one.
const CLEARANCE: f64 = 1.0 / 64.0;

/// Where a condition changes between 0 and `end`: the nearest angles at which it holds and no longer holds.
fn divided(end: f64, holds: impl Fn(f64) -> bool) -> (f64, f64) {
    const HALVINGS: u32 = 32;
    (0..HALVINGS).fold((0.0, end), |(start, end), _| {
        let middle = 0.5 * (start + end);
        if holds(middle) { (middle, end) } else { (start, middle) }
    })
}

/// Moves along the view's axes: x right, y up, z forward, metres.
pub fn fly(view: &View, step: DVec3) -> View {
    finite_or(view, View { eye: view.eye + view.right() * step.x + view.up * step.y + view.forward * step.z, ..*view })
}

/// Moves sideways, in image heights at the pivot's depth.
pub fn pan(view: &View, projection: &Projection, right: f64, up: f64) -> View {
    let height = 2.0 * projection.half_height(view.pivot_distance);
    fly(view, DVec3::new(right * height, up * height, 0.0))
}

/// Multiplies the distance to the pivot, which stays where it is.
pub fn dolly(view: &View, factor: f64) -> View {
    let pivot_distance = view.pivot_distance * factor;
    if !(pivot_distance.is_normal() && pivot_distance > 0.0) {
        return *view;
    }
    finite_or(view, View { eye: view.pivot() - view.forward * pivot_distance, pivot_distance, ..*view })
}

/// Multiplies the distance to the pivot, which stays where it is. A camera above `ground` stays above it: where it would
/// sink below, it rises about the pivot.
///
/// - `ground`: height of a horizontal plane, metres.
pub fn dolly_above(view: &View, factor: f64, turning: Turning, ground: Option<f64>) -> View {
    let whole = dolly(view, factor);
    let Some(ground) = ground.filter(|ground| view.eye.y > *ground) else { return whole };
    let least = ground + CLEARANCE * whole.pivot_distance;
    // What is lower already may come nearer as it is.
    let least = if factor > 1.0 { least } else { least.min(view.eye.y) };
    if whole.eye.y >= least {
        return whole;
    }
    let risen = |angle: f64| orbit(&whole, 0.0, angle, turning);
    let (_, enough) = divided(FRAC_PI_2, |angle| risen(angle).eye.y < least);
    let risen = risen(enough);
    if risen.eye.y > ground { risen } else { *view }
}

/// Multiplies the visible height at a given distance, within the limits of `VFOV_RANGE_DEG`.
pub fn zoom(projection: &Projection, factor: f64) -> Projection {
    if !(factor.is_finite() && factor > 0.0) {
        return *projection;
    }
    if let Some(height) = projection.orthographic_height {
        let wanted = Projection { orthographic_height: Some(height * factor), ..*projection };
        return if wanted.check().is_ok() { wanted } else { *projection };
    }
    let (lowest, highest) = VFOV_RANGE_DEG;
    let wanted = 2.0 * (projection.tan_half_vfov() * factor).atan().to_degrees();
    // A scene may start outside of the limits; then only changes towards them are possible.
    let vfov_deg = wanted.clamp(lowest.min(projection.vfov_deg), highest.max(projection.vfov_deg));
    Projection { vfov_deg, ..*projection }
}

/// Rolls the camera to the right, radians.
pub fn roll(view: &View, angle: f64) -> View {
    let up = DQuat::from_axis_angle(view.forward, angle) * view.up;
    finite_or(view, View { up, ..*view }.orthonormalized())
}

/// Removes the roll. A view straight up or down has no horizon and is unchanged, and so is a view without roll, bit for
/// bit.
pub fn level(view: &View) -> View {
    /// Sine of the angle; a thousandth of a pixel over the widest film.
    const NONE: f64 = 1e-8;
    let right = view.forward.cross(VERTICAL).normalize_or_zero();
    let is_level = view.up.dot(right).abs() <= NONE && view.up.dot(VERTICAL) > 0.0;
    if is_level || elevation(view).abs() > MAX_ELEVATION {
        return *view;
    }
    View { up: VERTICAL, ..*view }.orthonormalized()
}

/// Looks at the pivot from a side of the scene, at the same distance.
pub fn view_from(view: &View, side: Side) -> View {
    let (forward, up) = match side {
        Side::Front => (-DVec3::Z, DVec3::Y),
        Side::Back => (DVec3::Z, DVec3::Y),
        Side::Right => (-DVec3::X, DVec3::Y),
        Side::Left => (DVec3::X, DVec3::Y),
        Side::Top => (-DVec3::Y, -DVec3::Z),
        Side::Bottom => (DVec3::Y, DVec3::Z),
    };
    about_pivot(view, forward, up)
}

/// Parallel rays that show as much at this distance, metres.
pub fn in_parallel(projection: &Projection, distance: f64) -> Projection {
    Projection { orthographic_height: Some(2.0 * projection.half_height(distance)), ..*projection }
}

/// Shows what parallel rays show around the pivot in perspective, from where that is as large.
pub fn in_perspective(rig: &Rig) -> Rig {
    let Some(height) = rig.projection.orthographic_height else { return *rig };
    let projection = Projection { orthographic_height: None, ..rig.projection };
    let pivot_distance = 0.5 * height / projection.tan_half_vfov();
    let eye = rig.view.pivot() - pivot_distance * rig.view.forward;
    Rig { view: finite_or(&rig.view, View { eye, pivot_distance, ..rig.view }), projection, ..*rig }
}

/// Looks at the pivot from the opposite side; a level view stays level.
pub fn view_from_behind(view: &View) -> View {
    // From above, right stays to the right.
    let is_vertical = elevation(view).abs() > MAX_ELEVATION;
    about_pivot(view, -view.forward, if is_vertical { -view.up } else { view.up })
}

fn about_pivot(view: &View, forward: DVec3, up: DVec3) -> View {
    finite_or(view, View { eye: view.pivot() - forward * view.pivot_distance, forward, up, ..*view })
}

/// The lowest and the highest coordinates of points; `None` without any.
pub fn box_around(points: impl IntoIterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.into_iter().map(|point| (point, point)).reduce(|(a, b), (c, _)| (a.min(c), b.max(c)))
}

/// Like [`frame_points`], for both kinds of cameras: an orthographic one gets the height that the points need, and is
/// placed in front of all of them.
pub fn frame_rig(rig: &Rig, aspect: f64, points: &[DVec3]) -> Rig {
    let Rig { view, projection, .. } = *rig;
    let (Some(_), Some((min, max))) = (projection.orthographic_height, box_around(points.iter().copied())) else {
        return Rig { view: frame_points(&view, &projection, aspect, points), ..*rig };
    };
    let middle = 0.5 * min + 0.5 * max;
    let span = |axis: DVec3| {
        let along = points.iter().map(|point| (*point - middle).dot(axis));
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let [(left, right), (low, high), (near, _)] = [view.right(), view.up, view.forward].map(span);
    let height = (high - low).max((right - left) / aspect) / (1.0 - ROOM);
    let wanted = Projection { orthographic_height: Some(height), ..projection };
    let projection = if wanted.check().is_ok() { wanted } else { projection };
    let across = 0.5 * (left + right) * view.right() + 0.5 * (low + high) * view.up;
    let distance = (height - near).max(view.pivot_distance);
    let eye = middle + across - distance * view.forward;
    Rig { view: finite_or(&view, View { eye, pivot_distance: distance, ..view }), projection, ..*rig }
}

/// Keeps the direction and moves the camera as close as possible with all points in an image of this `aspect` (width
/// over height), with a margin; the pivot gets the depth of the centre of their box. For a single point the distance is
/// kept; without points, the view.
pub fn frame_points(view: &View, projection: &Projection, aspect: f64, points: &[DVec3]) -> View {
    let Some((min, max)) = box_around(points.iter().copied()) else { return *view };
    let middle = 0.5 * min + 0.5 * max;
    if min == max {
        return finite_or(view, View { eye: middle - view.forward * view.pivot_distance, ..*view });
    }
    let tan_v = projection.tan_half_vfov() * (1.0 - ROOM);
    // Per axis: lines at the edge of the image through the outermost points meet at the closest camera position.
    let fit = |axis: DVec3, tan: f64| {
        let most = |sign: f64| {
            let edge = |point: &DVec3| {
                let offset = *point - middle;
                sign * offset.dot(axis) - tan * offset.dot(view.forward)
            };
            points.iter().map(edge).fold(f64::NEG_INFINITY, f64::max)
        };
        let (right, left) = (most(1.0), most(-1.0));
        (0.5 * (right - left), -0.5 * (right + left) / tan)
    };
    let (across, depth_h) = fit(view.right(), tan_v * aspect);
    let (upwards, depth_v) = fit(view.up, tan_v);
    let depth = depth_h.min(depth_v);
    let eye = middle + across * view.right() + upwards * view.up + depth * view.forward;
    finite_or(view, View { eye, pivot_distance: -depth, ..*view })
}

/// Turns the view about its position by radians to the right and upwards in the image.
fn rotated(view: &View, yaw: f64, pitch: f64, turning: Turning) -> View {
    let rotation = match turning {
        Turning::Free => DQuat::from_axis_angle(view.right(), pitch) * DQuat::from_axis_angle(view.up, -yaw),
        Turning::Turntable => turntable_rotation(view, yaw, pitch),
    };
    let turned = View { forward: rotation * view.forward, up: rotation * view.up, ..*view };
    // Non-finite values are left to the caller, since normalising them is meaningless.
    if turned.is_finite() { turned.orthonormalized() } else { turned }
}

fn turntable_rotation(view: &View, yaw: f64, pitch: f64) -> DQuat {
    let now = elevation(view);
    // Beyond the limit (a scene may start there) the horizon is undefined, and the image's own right axis replaces it.
    let level_right = if now.abs() > MAX_ELEVATION { view.right() } else { view.forward.cross(VERTICAL).normalize() };
    // With roll, amounts are along the image axes, not along the horizon.
    let (sin_lean, cos_lean) = (view.right().dot(level_right.cross(view.forward)), view.right().dot(level_right));
    let (yaw, pitch) = (yaw * cos_lean - pitch * sin_lean, yaw * sin_lean + pitch * cos_lean);
    let wanted = (now + pitch).clamp(now.min(-MAX_ELEVATION), now.max(MAX_ELEVATION));
    DQuat::from_axis_angle(VERTICAL, -yaw) * DQuat::from_axis_angle(level_right, wanted - now)
}

/// Angle of the view direction above the horizontal, radians in [-π/2, π/2].
fn elevation(view: &View) -> f64 {
    // Accurate near the poles, unlike the arc sine.
    view.forward.dot(VERTICAL).atan2(view.forward.cross(VERTICAL).length())
}

fn finite_or(view: &View, candidate: View) -> View {
    if candidate.is_finite() { candidate } else { *view }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn start() -> View {
        View::look_at(DVec3::new(3.0, 2.0, 4.0), DVec3::new(0.5, 0.25, -0.5), DVec3::Y).unwrap()
    }

    #[test]
    fn what_is_level_stays_bit_by_bit_and_what_leans_is_levelled() {
        for (yaw, pitch) in [(0.0, 0.0), (0.3, -0.4), (2.0, 0.9), (-1.1, -1.2)] {
            let view = turn(&start(), yaw, pitch, Turning::default());
            let level_view = level(&view);
            assert_eq!(level_view, level(&level_view));
            assert_eq!(level(&start()), start());
            for angle in [1e-3, -0.5, 3.0] {
                let leaning = roll(&level_view, angle);
                let again = level(&leaning);
                assert!(again != leaning && close(again.up, level_view.up, 1e-12), "{angle}");
            }
        }
    }

    fn close(a: DVec3, b: DVec3, tolerance: f64) -> bool {
        (a - b).length() <= tolerance
    }

    /// A fixed sequence in [-1, 1), sufficient to move a camera.
    fn wander(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    #[test]
    fn signs_follow_the_picture() {
        let view = View::default();
        for turning in [Turning::Turntable, Turning::Free] {
            assert!(turn(&view, 0.1, 0.0, turning).forward.x > 0.0, "yaw looks right");
            assert!(turn(&view, 0.0, 0.1, turning).forward.y > 0.0, "pitch looks up");
            assert!(orbit(&view, 0.1, 0.0, turning).eye.x > 0.0, "the eye moves right");
            assert!(orbit(&view, 0.0, 0.1, turning).eye.y > 0.0, "the eye moves up");
        }
        assert_eq!(fly(&view, DVec3::new(1.0, 2.0, 3.0)).eye, view.eye + DVec3::new(1.0, 2.0, -3.0));
        assert!(roll(&view, 0.1).up.x > 0.0, "the head leans right");
        assert!(pan(&view, &Projection::default(), 0.5, 0.0).eye.x > 0.0);
        assert!(zoom(&Projection::default(), 0.5).vfov_deg < Projection::default().vfov_deg);
        assert!(dolly(&view, 0.5).eye.z < view.eye.z);
    }

    #[test]
    fn a_million_steps_leave_the_axes_clean_and_the_pivot_where_it_was() {
        for (turning, offset) in [(Turning::Turntable, 0.0), (Turning::Free, 5e6)] {
            let first = View { eye: start().eye + DVec3::splat(offset), ..start() };
            let (mut view, mut state) = (first, 7);
            for _ in 0..1_000_000 {
                view = orbit(&view, wander(&mut state), wander(&mut state), turning);
                view = roll(&view, 0.01 * wander(&mut state));
            }
            assert!((view.forward.length() - 1.0).abs() < 1e-15, "{view:?}");
            assert!((view.up.length() - 1.0).abs() < 1e-15, "{view:?}");
            assert!(view.forward.dot(view.up).abs() < 1e-15, "{view:?}");
            assert_eq!(view.pivot_distance, first.pivot_distance);
            // Each step rounds the camera once or twice: a random walk of a thousand times that, with a margin.
            let rounding = f64::EPSILON * first.eye.length().max(1.0);
            assert!(
                close(view.pivot(), first.pivot(), 20_000.0 * rounding),
                "{} away",
                (view.pivot() - first.pivot()).length()
            );
        }
    }

    #[test]
    fn a_full_circle_comes_back() {
        let view = start();
        for turning in [Turning::Turntable, Turning::Free] {
            let (mut orbited, mut turned, mut rolled) = (view, view, view);
            for _ in 0..720 {
                orbited = orbit(&orbited, TAU / 720.0, 0.0, turning);
                turned = turn(&turned, -TAU / 720.0, 0.0, turning);
                rolled = roll(&rolled, TAU / 720.0);
                let distance = (orbited.eye - view.pivot()).length();
                assert!((distance - view.pivot_distance).abs() < 1e-12, "orbiting keeps the distance");
            }
            for back in [orbited, turned, rolled] {
                assert!(close(back.eye, view.eye, 1e-12) && close(back.up, view.up, 1e-12), "{back:?}");
            }
        }
        let half = orbit(&view, PI, 0.0, Turning::Turntable);
        assert!((half.eye.y - view.eye.y).abs() < 1e-14, "a turntable keeps the height");
    }

    #[test]
    fn a_turntable_keeps_the_lean_and_stops_before_the_pole() {
        let lean = |view: &View| view.right().y.atan2(view.up.y);
        let mut view = roll(&start(), 0.3);
        let before = lean(&view);
        for _ in 0..50 {
            view = turn(&view, 0.07, 0.0, Turning::Turntable);
            view = orbit(&view, -0.11, 0.02, Turning::Turntable);
        }
        assert!((lean(&view) - before).abs() < 1e-9, "{} then {}", before, lean(&view));

        let up = turn(&level(&view), 0.0, 10.0, Turning::Turntable);
        assert!((elevation(&up) - MAX_ELEVATION).abs() < 1e-12);
        assert!(up.up.y > 0.0 && up.right().y.abs() < 1e-12, "neither upside down nor leaning: {up:?}");
        let free = turn(&start(), 0.0, PI, Turning::Free);
        assert!(free.up.y < 0.0, "free turning goes over the top");
    }

    #[test]
    fn an_orbit_stops_above_the_ground_and_slides_along_it() {
        let (ground, down) = (-0.75, (0.0, -0.4));
        let mut view = start();
        for _ in 0..20 {
            view = orbit_above(&view, down.0, down.1, Turning::Turntable, Some(ground));
        }
        let height = view.eye.y - ground;
        assert!(height > 0.0 && height < 0.02 * view.pivot_distance, "{height}");
        assert!(close(view.pivot(), start().pivot(), 1e-12) && view.pivot_distance == start().pivot_distance);
        let along = orbit_above(&view, 0.3, -0.2, Turning::Turntable, Some(ground));
        assert!(close(along.eye, orbit(&view, 0.3, 0.0, Turning::Turntable).eye, 1e-6), "it does not stick");
        assert_eq!(
            orbit_above(&view, 0.3, 0.2, Turning::Turntable, Some(ground)),
            orbit(&view, 0.3, 0.2, Turning::Turntable)
        );
        for (turning, lean) in [(Turning::Free, 0.0), (Turning::Free, 0.8), (Turning::Turntable, 0.8)] {
            let (mut view, mut state) = (roll(&start(), lean), 3);
            for _ in 0..1000 {
                view = orbit_above(&view, wander(&mut state), wander(&mut state), turning, Some(ground));
                assert!(view.eye.y > ground, "{turning:?}: {view:?}");
            }
        }
        // Without a ground, and from below one.
        let below = orbit(&start(), 0.0, -1.2, Turning::Turntable);
        assert!(below.eye.y < ground);
        assert_eq!(orbit_above(&start(), 0.0, -1.2, Turning::Turntable, None), below);
        let on = orbit(&below, 0.1, 0.2, Turning::Turntable);
        assert_eq!(orbit_above(&below, 0.1, 0.2, Turning::Turntable, Some(ground)), on);
    }

    #[test]
    fn going_back_stays_above_the_ground() {
        let ground = -0.75;
        // Looks up from near the ground.
        let low = View::look_at(DVec3::new(0.0, -0.7, 3.0), DVec3::new(0.5, 0.25, -0.5), DVec3::Y).unwrap();
        for turning in [Turning::Turntable, Turning::Free] {
            let mut view = low;
            for n in 1..=60 {
                view = dolly_above(&view, 1.1, turning, Some(ground));
                let distance = low.pivot_distance * 1.1_f64.powi(n);
                assert!(view.eye.y > ground && close(view.pivot(), low.pivot(), 1e-9 * distance), "{view:?}");
                assert!((view.pivot_distance / distance - 1.0).abs() < 1e-9, "it goes as far");
            }
            assert!(view.eye.y - ground > 0.01 * view.pivot_distance);
            let mut state = 5;
            let mut view = roll(&low, 0.8);
            for _ in 0..1000 {
                view = dolly_above(&view, wander(&mut state).exp(), turning, Some(ground));
                assert!(view.eye.y > ground, "{view:?}");
            }
        }
        assert_eq!(dolly_above(&low, 3.0, Turning::Turntable, None), dolly(&low, 3.0));
        assert_eq!(dolly_above(&low, 0.5, Turning::Turntable, Some(ground)), dolly(&low, 0.5));
    }

    #[test]
    fn a_leaning_picture_still_moves_with_the_mouse() {
        let view = roll(&View::default(), 0.5);
        for (yaw, pitch) in [(1e-4, 0.0), (0.0, 1e-4), (2e-4, -1e-4)] {
            let turned = turn(&view, yaw, pitch, Turning::Turntable);
            let (x, y) = (turned.forward.dot(view.right()), turned.forward.dot(view.up));
            assert!((x - yaw).abs() < 1e-7 && (y - pitch).abs() < 1e-7, "asked ({yaw}, {pitch}), moved ({x}, {y})");
        }
    }

    #[test]
    fn a_view_that_starts_straight_down_can_be_turned_away() {
        let down = View::look_at(DVec3::new(0.0, 5.0, 0.0), DVec3::ZERO, DVec3::NEG_Z).unwrap();
        assert_eq!(level(&down), down);
        let turned = orbit(&down, 0.0, -0.5, Turning::Turntable);
        assert!((turned.eye - DVec3::new(0.0, 5.0 * 0.5f64.cos(), 5.0 * 0.5f64.sin())).length() < 1e-12, "{turned:?}");
        assert!(close(orbit(&down, 0.0, 0.5, Turning::Turntable).eye, down.eye, 1e-12), "and not over the pole");
        let spun = orbit(&down, 0.25, 0.0, Turning::Turntable);
        assert!(close(spun.eye, down.eye, 1e-12) && !close(spun.up, down.up, 0.2), "{spun:?}");
    }

    #[test]
    fn panning_moves_what_is_at_the_pivot_by_the_amount_asked() {
        let (view, projection) = (start(), Projection::perspective(50.0));
        let panned = pan(&view, &projection, 0.25, -0.5);
        let seen = view.pivot() - panned.eye;
        let depth = seen.dot(panned.forward);
        let height = 2.0 * projection.tan_half_vfov() * depth;
        assert!((seen.dot(panned.right()) / height + 0.25).abs() < 1e-14);
        assert!((seen.dot(panned.up) / height - 0.5).abs() < 1e-14);
    }

    #[test]
    fn framing_is_as_near_as_everything_is_in_the_picture() {
        let points: Vec<DVec3> =
            (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 3.0, f64::from(i >> 2))).collect();
        for (aspect, offset) in [(0.4, 0.0), (1.0, 1e6), (2.5, 0.0)] {
            let projection = Projection::perspective(60.0);
            let points: Vec<DVec3> = points.iter().map(|point| *point + DVec3::splat(offset)).collect();
            let view = frame_points(&start(), &projection, aspect, &points);
            assert_eq!(view.forward, start().forward);
            let largest = points.iter().map(|point| {
                let seen = *point - view.eye;
                let height = projection.tan_half_vfov() * seen.dot(view.forward);
                (seen.dot(view.right()).abs() / (height * aspect)).max(seen.dot(view.up).abs() / height)
            });
            let largest = largest.fold(0.0, f64::max);
            assert!((largest - (1.0 - ROOM)).abs() < 1e-6, "aspect {aspect}: {largest}");
            let middle = DVec3::new(0.5, 1.5, 0.5) + DVec3::splat(offset);
            assert!(((middle - view.eye).dot(view.forward) - view.pivot_distance).abs() < 1e-6);
        }
        let one = frame_points(&start(), &Projection::default(), 1.0, &[DVec3::ZERO]);
        assert!(close(one.pivot(), DVec3::ZERO, 1e-12) && one.pivot_distance == start().pivot_distance);
        assert_eq!(frame_points(&start(), &Projection::default(), 1.0, &[]), start());
    }

    #[test]
    fn sides_are_looked_at_from_where_they_face_and_from_behind() {
        use Side::{Back, Bottom, Front, Left, Right, Top};
        for (side, behind, eye) in
            [(Front, Back, DVec3::Z), (Right, Left, DVec3::X), (Top, Bottom, DVec3::Y), (Back, Front, -DVec3::Z)]
        {
            let view = view_from(&start(), side);
            assert!(close(view.pivot(), start().pivot(), 1e-12) && view.pivot_distance == start().pivot_distance);
            assert!(close(view.eye, view.pivot() + view.pivot_distance * eye, 1e-12), "{side:?}");
            let other = view_from_behind(&view);
            assert!(close(other.eye, view_from(&start(), behind).eye, 1e-12), "{side:?}");
            assert!(close(other.up, view_from(&start(), behind).up, 1e-12), "{side:?}");
        }
        assert!(close(view_from(&start(), Top).right(), DVec3::X, 1e-12), "as a map");
        let turned = view_from_behind(&start());
        assert!(turned.up == start().up && close(turned.pivot(), start().pivot(), 1e-12));
    }

    #[test]
    fn zoom_scales_the_picture_and_stays_in_range() {
        let halved = zoom(&Projection::perspective(40.0), 0.5);
        assert!((halved.tan_half_vfov() * 2.0 - 20f64.to_radians().tan()).abs() < 1e-15);
        let mut projection = Projection::default();
        for _ in 0..10_000 {
            projection = zoom(&projection, 1.1);
        }
        assert_eq!(projection.vfov_deg, VFOV_RANGE_DEG.1);
        let fisheye = Projection::perspective(170.0);
        assert!((zoom(&fisheye, 2.0).vfov_deg - 170.0).abs() < 1e-9, "outside of the range it does not jump");
    }

    #[test]
    fn amounts_that_are_not_numbers_change_nothing() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for turning in [Turning::Turntable, Turning::Free] {
                assert_eq!(turn(&start(), bad, 0.0, turning), start());
                assert_eq!(orbit(&start(), 0.0, bad, turning), start());
            }
            assert_eq!(fly(&start(), DVec3::new(0.0, bad, 0.0)), start());
            assert_eq!(roll(&start(), bad), start());
            assert_eq!(pan(&start(), &Projection::default(), bad, 0.0), start());
        }
        for nonsense in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            assert_eq!(zoom(&Projection::default(), nonsense), Projection::default());
            assert_eq!(dolly(&start(), nonsense), start());
        }
        let (mut near, mut far) = (start(), start());
        for _ in 0..5000 {
            near = dolly(&near, 0.5);
            far = dolly(&far, 2.0);
            assert!(near.pivot_distance > 0.0 && near.is_finite() && far.is_finite());
        }
    }
}
