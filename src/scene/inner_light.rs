//! Where a light inside of a closed model shows most of what the camera sees: in the middle of its widest room.

use crate::geometry::Ray;
use crate::render::{RenderSettings, gather_features};
use crate::scene::extract::Extraction;
use glam::{DVec3, UVec2, Vec3};

/// Points of the image that are looked at.
const SIZE: UVec2 = UVec2::new(32, 18);

/// Places that are compared.
const PLACES: usize = 24;

/// Part of a distance within which a hit counts as its end.
const NEAR: f32 = 1e-3;

/// A place of a light.
pub(super) struct RoomInside {
    /// World position, metres.
    pub position: DVec3,
    /// Median distance of the surfaces that it lights, metres.
    pub distance: f64,
}

/// A visible point that another surface faces: one without lies outside, in the light.
struct InnerPoint {
    position: Vec3,
    normal: Vec3,
    /// Distance of what lies opposite, metres.
    width: f32,
    /// Halfway to it.
    middle: Vec3,
}

/// Whether the camera sees any surface.
pub(super) fn sees_anything(scene: &Extraction) -> bool {
    let seen = gather_features(&scene.prepared, &RenderSettings::default(), SIZE, 1, &|| false);
    seen.is_some_and(|seen| seen.coverage.iter().any(|share| *share > 0.0))
}

/// Finds the place from which most of the visible surfaces that face others are seen; `None` if the camera sees none of
/// these.
pub(super) fn middle_of_room(scene: &Extraction) -> Option<RoomInside> {
    let tree = &scene.prepared.geometry.tree;
    let settings = RenderSettings::default();
    let seen = gather_features(&scene.prepared, &settings, SIZE, 1, &|| false)?;
    let points = (seen.coverage.iter().zip(&seen.position).zip(&seen.normal))
        .filter(|((share, _), normal)| **share == 1.0 && **normal != Vec3::ZERO)
        .map(|((_, position), normal)| (*position, normal.normalize()));
    let mut points: Vec<InnerPoint> = points
        .filter_map(|(position, normal)| {
            let reach = tree.bounds().size().length();
            let start = position + NEAR * reach * normal;
            let hit = tree.closest_hit(&Ray::new(start, normal)).filter(|hit| hit.t.is_finite() && hit.t < reach)?;
            Some(InnerPoint { position, normal, width: hit.t, middle: start + 0.5 * hit.t * normal })
        })
        .collect();
    points.sort_by(|a, b| b.width.total_cmp(&a.width));
    let step = points.len().div_ceil(PLACES).max(1);
    let lit = |place: Vec3| {
        let mut distances: Vec<f32> = (points.iter())
            .filter_map(|point| {
                let to_point = point.position - place;
                let hit = tree.closest_hit(&Ray::new(place, to_point));
                let is_seen = point.normal.dot(to_point) < 0.0 && hit.is_none_or(|hit| hit.t > 1.0 - NEAR);
                is_seen.then(|| to_point.length())
            })
            .collect();
        distances.sort_by(f32::total_cmp);
        distances
    };
    let all = points.iter().step_by(step).map(|point| (lit(point.middle), point.middle));
    let (distances, place) = all.max_by_key(|(distances, _)| distances.len())?;
    let distance = f64::from(*distances.get(distances.len() / 2)?);
    Some(RoomInside { position: scene.origin + place.as_dvec3(), distance })
}
