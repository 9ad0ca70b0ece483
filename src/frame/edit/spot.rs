//! Positions of new things. Objects go on the surface at a place of the image, usually its middle, of a size that suits
//! its distance, and without overlap; lights go beside what they are to light.
//!
//! The space in front of the camera is free up to the first visible surface. So positions are tried along the line of
//! sight, from that surface towards the camera; from each, the object drops onto the surface below, and stays where it
//! touches nothing else. Obstacles are found by rays, which unlike boxes detect that a room is empty inside.

use crate::frame::navigation::{Rig, box_around};
use crate::frame::state::resources::{PictureSize, RenderState};
use crate::frame::state::selection::{Picked, Projector, Selection, box_of, directions, distance, pick};
use crate::scene::{Extraction, Shape, View, is_emitter};
use bevy_ecs::prelude::{Entity, World};
use glam::{DMat3, DVec2, DVec3};

/// A position for an object, with free space for a cube of side `2 * size` above it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    pub foot: DVec3,
    /// Half of the width of the object, metres.
    pub size: f64,
}

/// Size relative to the distance: large enough to see and to grab, and most of the image stays unchanged.
const SHARE: f64 = 0.1;
/// Number of steps towards the camera, of half a size each, before a smaller size is tried.
const STEPS: u32 = 24;
/// Maximum number of smaller sizes.
const SHRINKS: u32 = 5;
/// Number of rays that look for obstacles.
const RAYS: u32 = 128;
/// Relative distance below which something is an obstacle; touching is allowed.
const TOUCH: f64 = 0.97;

/// The middle of the image.
pub const MIDDLE: [f64; 2] = [0.5; 2];

/// Finds a position in view; if nothing is free, it is the surface at `at` in the image, 0..1 from its upper left corner.
pub fn find(world: &World, at: [f64; 2]) -> Spot {
    let shown = world.resource::<RenderState>();
    let (view, projection) = shown.inputs.camera.map(|camera| (camera.view, camera.projection)).unwrap_or_default();
    let (place, _) = seen(world, &view, at);
    let (distance, forward) = match projection.orthographic_height {
        None => ((place - view.eye).length(), (place - view.eye).normalize_or(view.forward)),
        Some(_) => ((place - view.eye).dot(view.forward), view.forward),
    };
    let Some(scene) = &shown.extraction else { return Spot { foot: place, size: SHARE * distance } };
    let mut share = SHARE;
    for _ in 0..SHRINKS {
        let step = 0.5 * share * distance;
        // Not too close to the camera.
        let depths = (0..STEPS).map(|i| distance - step * f64::from(i)).take_while(|depth| *depth > 0.3 * distance);
        for depth in depths {
            // Closer objects look larger, so they are made smaller.
            let size = share * depth;
            if let Some(foot) = stand(scene, &view, place - forward * (distance - depth), size)
                && is_seen(world, foot + size * DVec3::Y)
            {
                return Spot { foot, size };
            }
        }
        share *= 0.6;
    }
    // On top of what is there, even if something is in the way; or in the air, where one would not see it.
    let size = SHARE * distance;
    let before = place - (1.0 - TOUCH) * size * forward;
    let height = self::distance(scene, before, DVec3::Y).map_or(2.0 * size, |free| (TOUCH * free).min(2.0 * size));
    let above = before + height * DVec3::Y;
    let fall = self::distance(scene, above, -DVec3::Y).filter(|fall| *fall < distance + height).unwrap_or(height);
    let foot = above - fall * DVec3::Y;
    Spot { foot: if is_seen(world, foot + size * DVec3::Y) { foot } else { place }, size }
}

/// Whether a point is in the image.
pub fn is_seen(world: &World, point: DVec3) -> bool {
    let Some(camera) = &world.resource::<RenderState>().inputs.camera else { return false };
    let rig = Rig { view: camera.view, projection: camera.projection, lens: camera.lens };
    let aspect = world.resource::<PictureSize>().aspect();
    let place = Projector::new(&rig, DVec2::new(aspect, 1.0)).place(point);
    place.is_some_and(|at| (0.0..aspect).contains(&at.x) && (0.0..1.0).contains(&at.y))
}

/// A position for a light, and what it is to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSpot {
    pub place: DVec3,
    /// Centre of what is to be lit.
    pub subject: DVec3,
    /// Half of its width, metres.
    pub radius: f64,
}

impl LightSpot {
    /// From the light to what it lights.
    pub fn way(&self) -> DVec3 {
        self.subject - self.place
    }
}

/// Finds a position for a light: beside and above the selected objects, or else what is at a place of the image, and in
/// view with them. The way to it from the camera is free of walls and ceilings. From a ceiling, it hangs.
///
/// - `shows_front`: it is as far from the camera as what it lights, in whatever direction that is seen. So an emissive
///   square that faces it shows the camera its front, from the side, and its dark back hides nothing.
pub fn find_for_light(world: &mut World, shows_front: bool, at: [f64; 2]) -> LightSpot {
    /// To the right, up, and to the camera, relative to the size of what is lit.
    const OFFSET: DVec3 = DVec3::new(1.0, 0.5, 0.2);
    /// Of a square: from above where there is room, else from a side.
    const ASIDE: [DVec3; 4] =
        [DVec3::new(0.6, 1.2, 0.0), DVec3::new(-0.6, 1.2, 0.0), DVec3::new(1.2, 0.6, 0.0), DVec3::new(-1.2, 0.6, 0.0)];
    /// Shares of these that are tried until it is in view.
    const NEARER: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.25];
    /// Part of the way to an obstacle.
    const SHORT_OF: f64 = 0.8;
    let shown = world.resource::<RenderState>();
    let (view, projection) = shown.inputs.camera.map(|camera| (camera.view, camera.projection)).unwrap_or_default();
    let depth_of = |place: DVec3| (place - view.eye).dot(view.forward);
    // A wall or the ground is lit where it is seen, and so is what is all around.
    let is_thing = |(center, radius): &(DVec3, f64)| *radius < 0.5 * depth_of(*center);
    let chosen = world.resource::<Selection>().0.clone();
    let (subject, radius) = match ball_around(world, &chosen).filter(is_thing) {
        Some(thing) => thing,
        None => {
            let (place, picked) = seen(world, &view, at);
            let radius = 0.6 * projection.half_height(depth_of(place));
            let thing = picked.and_then(|picked| ball_around(world, &[picked.entity])).filter(is_thing);
            let ceiling = picked.filter(|picked| thing.is_none() && picked.normal.y < -0.5);
            if let Some(Picked { normal, .. }) = ceiling {
                return below(world, place, normal, radius, shows_front);
            }
            thing.unwrap_or((place, radius))
        }
    };
    // Level, whatever the camera does.
    let right = DVec3::new(view.right().x, 0.0, view.right().z).try_normalize().unwrap_or(DVec3::X);
    let level = DMat3::from_cols(right, DVec3::Y, right.cross(DVec3::Y));
    let (axes, offsets) = match (view.eye - subject).try_normalize().filter(|_| shows_front) {
        Some(back) => {
            let right = view.up.cross(back).try_normalize().unwrap_or(right);
            (DMat3::from_cols(right, back.cross(right), back), &ASIDE[..])
        }
        None => (level, &[OFFSET][..]),
    };
    let scene = world.resource::<RenderState>().extraction.as_ref();
    // How much of the way to a place is free.
    let free_share = |place: DVec3| {
        let (way, away) = (place - view.eye, (place - view.eye).length());
        let free = scene.and_then(|scene| distance(scene, view.eye, way / away));
        match free {
            // Beside what it lights, the ground may be close behind it.
            Some(free) if !(shows_front && free > away + 0.5 * radius) => (SHORT_OF * free / away).min(1.0),
            _ => 1.0,
        }
    };
    let freest = |nearer: f64| {
        let places = offsets.iter().map(|offset| subject + nearer * radius * (axes * *offset));
        let (place, share) = places
            .map(|place| (place, free_share(place)))
            .reduce(|best, other| if other.1 > best.1 { other } else { best })
            .unwrap_or((subject, 1.0));
        view.eye + share * (place - view.eye)
    };
    let place = NEARER.into_iter().map(freest).find(|place| is_seen(world, *place)).unwrap_or_else(|| freest(1.0));
    LightSpot { place, subject, radius }
}

/// A position below a point of a ceiling, for a light that shines away from it.
///
/// - `is_flat`: it is a square, which hangs close to it.
fn below(world: &World, ceiling: DVec3, normal: DVec3, radius: f64, is_flat: bool) -> LightSpot {
    /// Relative to the size of what is lit.
    const DISTANCE: f64 = 0.1;
    /// Of the way to what is below.
    const PENDANT: f64 = 0.25;
    let close = ceiling + DISTANCE * radius * normal;
    let scene = world.resource::<RenderState>().extraction.as_ref();
    let free = scene.and_then(|scene| distance(scene, close, normal)).unwrap_or(radius);
    let place = close + if is_flat { 0.0 } else { PENDANT * free } * normal;
    LightSpot { place, subject: close + free * normal, radius }
}

/// The longest edge, metres, of a square about a place that no surface cuts.
///
/// - `u`, `v`: unit vectors along its edges; `most`: that is wanted.
pub fn free_edge(world: &World, place: DVec3, [u, v]: [DVec3; 2], most: f64) -> f64 {
    let Some(scene) = &world.resource::<RenderState>().extraction else { return most };
    let ways = [u, -u, v, -v, u + v, u - v, v - u, -u - v];
    // The border of a square of two metres is as far away as they are long.
    let free = ways.into_iter().filter_map(|way| Some(distance(scene, place, way.normalize())? / way.length()));
    free.map(|free| 2.0 * TOUCH * free).fold(most, f64::min)
}

/// The distance of the nearest quarter of what a light at a place in a room shines on; `None` in the open.
///
/// - `front`: where it shines; in all directions without.
pub fn room_around(world: &World, place: DVec3, front: Option<DVec3>) -> Option<f64> {
    let scene = world.resource::<RenderState>().extraction.as_ref()?;
    let around: Vec<(DVec3, f64)> =
        directions(RAYS, -1.0).filter_map(|direction| Some((direction, distance(scene, place, direction)?))).collect();
    let is_lit = |(direction, _): &&(DVec3, f64)| front.is_none_or(|front| front.dot(*direction) > 0.0);
    let mut lit: Vec<f64> = around.iter().filter(is_lit).map(|(_, distance)| *distance).collect();
    lit.sort_by(f64::total_cmp);
    lit.get(lit.len() / 4).copied().filter(|_| around.len() >= RAYS as usize * 3 / 4)
}

/// Centre and radius of a ball around the boxes of objects that are to be lit; `None` without any that has an end. An
/// area light, such as one that was just added, needs no light.
fn ball_around(world: &mut World, entities: &[Entity]) -> Option<(DVec3, f64)> {
    let objects = entities.iter().filter_map(|&entity| {
        world.get::<Shape>(entity)?;
        if is_emitter(world, entity) { None } else { box_of(world, entity) }
    });
    let (min, max) = box_around(objects.flat_map(|own| own.corners()))?;
    (min != max).then_some((0.5 * (min + max), 0.5 * (max - min).length()))
}

/// The surface that is seen at a place of the image; `None` if there is none.
pub fn surface_at(world: &World, [x, y]: [f64; 2]) -> Option<DVec3> {
    let scene = world.resource::<RenderState>().extraction.as_ref()?;
    pick(scene, x, y, world.resource::<PictureSize>().aspect()).map(|hit| hit.point)
}

/// The point at a place of the image and its surface: a point as far as the pivot where nothing near is seen.
fn seen(world: &World, view: &View, [x, y]: [f64; 2]) -> (DVec3, Option<Picked>) {
    let aspect = world.resource::<PictureSize>().aspect();
    let projection = world.resource::<RenderState>().inputs.camera.map(|camera| camera.projection).unwrap_or_default();
    let up = projection.half_height(view.pivot_distance);
    let aside = 2.0 * up * (aspect * (x - 0.5) * view.right() + (0.5 - y) * view.up);
    let pivot = (view.pivot() + aside, None);
    let Some(scene) = &world.resource::<RenderState>().extraction else { return pivot };
    // A surface far behind the pivot is a wall, or the ground near the horizon.
    let hit = pick(scene, x, y, aspect).filter(|hit| hit.depth < 4.0 * view.pivot_distance);
    hit.map_or(pivot, |hit| (hit.point, Some(hit)))
}

/// Returns the position of an object after dropping it from here, if there is space for it.
fn stand(scene: &Extraction, view: &View, place: DVec3, size: f64) -> Option<DVec3> {
    let middle = place + DVec3::Y * size;
    let away = (middle - view.eye).length();
    let is_hidden = |place: DVec3| {
        let way = place - view.eye;
        distance(scene, view.eye, way / way.length()).is_some_and(|free| free < way.length())
    };
    // An invisible position may be inside of an object.
    if is_hidden(middle) {
        return None;
    }
    // Without a ground, or far above it, the object floats.
    let fall = distance(scene, middle, -DVec3::Y).filter(|fall| *fall < away).unwrap_or(size);
    let middle = middle + DVec3::Y * (size - fall);
    if is_hidden(middle) {
        return None;
    }
    let is_free = |direction: DVec3| {
        // Distance to the surface of a cube of side 2 · `size`.
        let reach = size / direction.abs().max_element();
        distance(scene, middle, direction).is_none_or(|free| free > TOUCH * reach)
    };
    directions(RAYS, -1.0).all(is_free).then(|| middle - DVec3::Y * size)
}
