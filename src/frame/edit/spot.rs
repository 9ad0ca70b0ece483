//! Where new things go: on what the middle of the picture shows, as large as suits its distance, and inside of nothing.
//!
//! What the camera sees is free up to the first surface. So places are tried along the line of sight, from that surface
//! towards the camera; from each, the thing falls onto what is below it, and stays where it touches nothing else. What is
//! in its way is found by rays, which know what a box does not: that a room is empty inside.

use crate::frame::resources::{PictureSize, RenderState};
use crate::frame::selection::pick;
use crate::geometry::Ray;
use crate::scene::{Extraction, View};
use bevy_ecs::prelude::World;
use glam::DVec3;
use std::f64::consts::TAU;

/// A place for something to stand on, with room for a cube of twice `size` above it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    pub foot: DVec3,
    /// Half of the width of what stands there, metres.
    pub size: f64,
}

/// A tenth of the distance is large enough to see and to grab, and leaves most of the picture as it is.
const SHARE: f64 = 0.1;
/// Steps towards the camera, of half a size, before something smaller is tried.
const STEPS: u32 = 24;
/// What has no room is made smaller so many times.
const SHRINKS: u32 = 5;
/// Rays that look for what is in the way.
const RAYS: u32 = 128;
/// What touches is not in the way.
const TOUCH: f64 = 0.97;

/// Finds it; where nothing is free, it is the place that the middle of the picture shows.
pub fn find(world: &World) -> Spot {
    let shown = world.resource::<RenderState>();
    let view = shown.inputs.camera.map_or_else(View::default, |camera| camera.view);
    let aspect = world.resource::<PictureSize>().aspect();
    let Some(scene) = &shown.extraction else {
        return Spot { foot: view.pivot(), size: SHARE * view.pivot_distance };
    };
    let hit = pick(scene, 0.5, 0.5, aspect);
    // What lies far behind the pivot is a wall or the floor at the horizon.
    let hit = hit.filter(|hit| hit.depth < 4.0 * view.pivot_distance);
    let (place, distance) = hit.map_or((view.pivot(), view.pivot_distance), |hit| (hit.point, hit.depth));
    let mut share = SHARE;
    for _ in 0..SHRINKS {
        let step = 0.5 * share * distance;
        // Not in the face of who looks.
        let depths = (0..STEPS).map(|i| distance - step * f64::from(i)).take_while(|depth| *depth > 0.3 * distance);
        for depth in depths {
            // What is nearer looks larger, and is made smaller for it.
            let size = share * depth;
            if let Some(foot) = stand(scene, &view, place - view.forward * (distance - depth), size) {
                return Spot { foot, size };
            }
        }
        share *= 0.6;
    }
    Spot { foot: place, size: SHARE * distance }
}

/// How far above `foot` something may hang: `wanted`, or less where a ceiling is in the way.
pub fn headroom(world: &World, foot: DVec3, wanted: f64) -> f64 {
    let Some(scene) = &world.resource::<RenderState>().extraction else { return wanted };
    // From a little above, or the ground itself would be found.
    let start = 0.1 * wanted;
    distance(scene, foot + start * DVec3::Y, DVec3::Y).map_or(wanted, |free| wanted.min(0.8 * (start + free)))
}

/// Where a thing stands that is let fall from here, if it has room there.
fn stand(scene: &Extraction, view: &View, place: DVec3, size: f64) -> Option<DVec3> {
    let middle = place + DVec3::Y * size;
    let (to_middle, away) = (middle - view.eye, (middle - view.eye).length());
    // What is not seen may be within something.
    if distance(scene, view.eye, to_middle / away).is_some_and(|free| free < away) {
        return None;
    }
    // Where there is no ground, or one far below the picture, it floats.
    let fall = distance(scene, middle, -DVec3::Y).filter(|fall| *fall < 0.4 * away).unwrap_or(size);
    let middle = middle + DVec3::Y * (size - fall);
    let is_free = |direction: DVec3| {
        // To the surface of a cube of twice the size.
        let reach = size / direction.abs().max_element();
        distance(scene, middle, direction).is_none_or(|free| free > TOUCH * reach)
    };
    directions().all(is_free).then(|| middle - DVec3::Y * size)
}

/// Evenly over all directions: a spiral from pole to pole, whose turns are as far apart as its steps.
fn directions() -> impl Iterator<Item = DVec3> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    (0..RAYS).map(|i| {
        let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(RAYS);
        let (sin, cos) = (TAU * GOLDEN * f64::from(i)).sin_cos();
        let across = (1.0 - y * y).sqrt();
        DVec3::new(cos * across, y, sin * across)
    })
}

/// From a place of the world along a unit direction to what is there, metres.
fn distance(scene: &Extraction, from: DVec3, direction: DVec3) -> Option<f64> {
    let ray = Ray::new((from - scene.origin).as_vec3(), direction.as_vec3());
    scene.prepared.geometry.tree.closest_hit(&ray).map(|hit| f64::from(hit.t))
}
