//! Lights without a surface, as they are marked in the image.

use crate::frame::navigation::Rig;
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::{Projector, distance};
use crate::scene::{LightInput, LightKind};
use bevy_ecs::prelude::Entity;
use glam::{DVec2, DVec3};

/// How far from its mark a click still means a light, of the height of the image.
const REACH: f64 = 0.018;

/// Part of the way to a light that must be free for it to be seen: it may stand on a surface.
const NEARLY: f64 = 0.98;

/// Returns the light at a position in the image, fractions from the upper left corner, if nothing is in front of it.
///
/// - `aspect`: width over height of the image.
pub fn light_at(shown: &RenderState, [x, y]: [f64; 2], aspect: f64) -> Option<Entity> {
    let camera = shown.inputs.camera.as_ref()?;
    let scene = shown.extraction.as_ref()?;
    let rig = Rig { view: camera.view, projection: camera.projection, lens: camera.lens };
    let projector = Projector::new(&rig, DVec2::new(aspect, 1.0));
    let at = DVec2::new(x * aspect, y);
    let is_free = |light: &LightInput| {
        let way = light.placement.translation - camera.view.eye;
        let free = distance(scene, camera.view.eye, way.normalize());
        camera.projection.orthographic_height.is_some() || free.is_none_or(|free| free > NEARLY * way.length())
    };
    let places = shown.inputs.lights.iter().filter(|light| light.light.has_position()).filter_map(|light| {
        let off = projector.place(light.placement.translation)?.distance(at);
        (off < REACH).then_some((off, light))
    });
    let mut near: Vec<_> = places.collect();
    near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    near.into_iter().find(|(_, light)| is_free(light)).map(|(_, light)| light.entity)
}

/// Returns the axis of a spot light, from the light to what it hits; `None` for other lights.
pub fn axis_of(shown: &RenderState, entity: Entity) -> Option<[DVec3; 2]> {
    let input = shown.inputs.lights.iter().find(|light| light.entity == entity)?;
    let LightKind::Spot(spot) = &input.light else { return None };
    let way = (input.placement.linear() * spot.direction).try_normalize()?;
    let from = input.placement.translation;
    let camera = shown.inputs.camera.as_ref()?;
    let reach = shown.extraction.as_ref().and_then(|scene| distance(scene, from, way));
    Some([from, from + reach.unwrap_or(camera.view.pivot_distance) * way])
}
