//! Rooms: whether a camera is in one, its floor, and movements that stay there.

use crate::frame::core::rig::{Rig, Turning};
use crate::frame::navigation::{box_around, frame_rig, orbit};
use crate::frame::state::selection::{directions, distance};
use crate::scene::{Extraction, View};
use glam::DVec3;

/// Part of the way to a wall.
const SHORT_OF: f64 = 0.95;

/// Moves a view of the same pivot from another side, `to`, nearer to it where the camera would leave the room: behind a
/// wall, it would show nothing but its back. In a room, a camera has walls on both sides.
pub fn within_walls(scene: &Extraction, from: &View, to: View) -> View {
    let outwards = -to.forward;
    let wall = distance(scene, from.eye, outwards).filter(|_| distance(scene, from.eye, -outwards).is_some());
    // What is in front of the pivot is a thing in the room.
    let room = wall.map(|wall| wall + (from.eye - to.pivot()).dot(outwards)).filter(|room| *room > 0.0);
    let pivot_distance = room.map_or(to.pivot_distance, |room| to.pivot_distance.min(SHORT_OF * room));
    View { eye: to.pivot() + pivot_distance * outwards, pivot_distance, ..to }
}

/// Moves a view that orbits in a room, `to`, as far towards its pivot as is needed for the way to it to be free; back to
/// `reach`, the distance that it came from, where that is.
pub fn around_walls(scene: &Extraction, from: &View, to: View, reach: f64) -> View {
    /// Distances that are tried, and halvings of the one between the last two.
    const STEPS: u32 = 16;
    const HALVINGS: u32 = 12;
    let pivot = to.pivot();
    let at = |distance: f64| View { eye: pivot - distance * to.forward, pivot_distance: distance, ..to };
    let is_free = |to: f64| {
        let way = at(to).eye - from.eye;
        let direction = way.try_normalize();
        direction
            .and_then(|direction| distance(scene, from.eye, direction))
            .is_none_or(|hit| SHORT_OF * hit > way.length())
    };
    if is_free(reach) || !is_in_room(scene, from) {
        return at(reach);
    }
    let mut nearer = (1..STEPS).map(|i| reach * (1.0 - f64::from(i) / f64::from(STEPS)));
    let Some(first) = nearer.find(|to| is_free(*to)) else { return *from };
    let (free, _) = (0..HALVINGS).fold((first, first + reach / f64::from(STEPS)), |(free, blocked), _| {
        let middle = 0.5 * (free + blocked);
        if is_free(middle) { (middle, blocked) } else { (free, middle) }
    });
    at(free)
}

/// Moves a view that goes away from its pivot, in a room, only as far as the wall behind it, and not up to that: its lens
/// would be in the wall.
pub fn before_wall(scene: &Extraction, from: &View, to: View) -> View {
    let is_away = to.pivot_distance > from.pivot_distance;
    let wall = if is_away { distance(scene, from.eye, -from.forward) } else { None };
    let most = wall.map(|wall| (SHORT_OF * (from.pivot_distance + wall)).max(from.pivot_distance));
    let Some(most) = most.filter(|most| *most < to.pivot_distance && is_in_room(scene, from)) else { return to };
    View { eye: from.pivot() - most * from.forward, pivot_distance: most, ..to }
}

/// Frames the outermost points of something from the present side, or from the nearest side on which it is not hidden
/// behind other things. Returns whether it is from another side.
///
/// - `aspect`: of the image, width over height.
pub fn frame_in_sight(scene: &Extraction, rig: &Rig, aspect: f64, points: &[DVec3]) -> (Rig, bool) {
    /// Yaw and pitch of the sides, degrees, the nearest first.
    const SIDES: [(f64, f64); 10] = [
        (0.0, 25.0),
        (-35.0, 10.0),
        (35.0, 10.0),
        (0.0, 50.0),
        (-75.0, 20.0),
        (75.0, 20.0),
        (-130.0, 20.0),
        (130.0, 20.0),
        (180.0, 20.0),
        (0.0, 80.0),
    ];
    /// Shares that are to be seen: of the present side, which is kept, and of another one.
    const ENOUGH: [f64; 2] = [0.25, 0.7];
    let here = frame_rig(rig, aspect, points);
    let seen = share_in_sight(scene, &here.view, points);
    if seen >= ENOUGH[0] || rig.projection.orthographic_height.is_some() {
        return (here, false);
    }
    let sides = SIDES.iter().map(|(yaw, pitch)| {
        let view = orbit(&rig.view, yaw.to_radians(), pitch.to_radians(), Turning::default());
        let there = frame_rig(&Rig { view, ..*rig }, aspect, points);
        (there, share_in_sight(scene, &there.view, points))
    });
    let mut best = (here, seen);
    for side in sides {
        if side.1 > best.1 {
            best = side;
        }
        if best.1 >= ENOUGH[1] {
            break;
        }
    }
    (best.0, best.1 > seen)
}

/// Share of the directions to some of the points in which nothing else is nearer.
fn share_in_sight(scene: &Extraction, view: &View, points: &[DVec3]) -> f64 {
    const MOST: usize = 64;
    let Some((min, max)) = box_around(points.iter().copied()) else { return 1.0 };
    let middle = 0.5 * (min + max);
    let radius = points.iter().map(|point| point.distance(middle)).fold(0.0, f64::max);
    let nearest = (view.eye.distance(middle) - radius).max(0.0);
    let some = points.iter().step_by(points.len().div_ceil(MOST));
    let (mut n, mut free) = (0.0, 0.0);
    for point in some {
        // Within its outline.
        let way = point.lerp(middle, 0.25) - view.eye;
        let hit = way.try_normalize().and_then(|direction| distance(scene, view.eye, direction));
        n += 1.0;
        free += if hit.is_none_or(|hit| hit >= SHORT_OF * nearest) { 1.0 } else { 0.0 };
    }
    free / n
}

/// Height of what a view stands on: something level below the camera, and not above what it looks at.
pub fn floor_below(scene: &Extraction, view: &View) -> Option<f64> {
    /// Distance of the rays that tell whether it is level, and its roughness, relative to the height of the camera.
    const ASIDE: f64 = 0.05;
    const UNEVEN: f64 = 1e-3;
    let down = |from: DVec3| distance(scene, from, DVec3::NEG_Y);
    let height = down(view.eye)?;
    let is_level = [(1.0, 0.0), (-0.5, 0.866), (-0.5, -0.866)].iter().all(|(x, z)| {
        let beside = view.eye + ASIDE * height * DVec3::new(*x, 0.0, *z);
        down(beside).is_some_and(|found| (found - height).abs() < UNEVEN * height)
    });
    let floor = view.eye.y - height;
    (is_level && floor < view.pivot().y).then_some(floor)
}

/// Directions that are looked into for a ceiling.
const N_DIRECTIONS: u32 = 200;

/// The least height of their end, for directions of length 1: what is level may go out through a window.
const LEAST_RISE: f64 = 0.25;

/// Part of the directions in which there is a ceiling above a camera in a room: 0.88 to 1 in twelve rooms of the field;
/// 0.7 and less before things.
const ROOFED: f64 = 0.8;

/// A ceiling is not farther away than so many times what is in the middle of the image: else it is a sky around things.
const MOST_HEIGHT: f64 = 10.0;

/// Whether a camera is in a room: wherever it looks upwards there is something.
pub fn is_in_room(scene: &Extraction, view: &View) -> bool {
    let reach = MOST_HEIGHT * distance(scene, view.eye, view.forward).unwrap_or(view.pivot_distance);
    let is_roofed = |direction: &DVec3| distance(scene, view.eye, *direction).is_some_and(|away| away < reach);
    let n_roofed = directions(N_DIRECTIONS, LEAST_RISE).filter(is_roofed).count();
    n_roofed as f64 >= ROOFED * f64::from(N_DIRECTIONS)
}
