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

/// Whether the camera sees any surface.
pub(super) fn sees_anything(scene: &Extraction) -> bool {
    let seen = gather_features(&scene.prepared, &RenderSettings::default(), SIZE, 1, &|| false);
    seen.is_some_and(|seen| seen.coverage.iter().any(|share| *share > 0.0))
}

/// Finds the place from which most of the visible surfaces are seen; `None` if the camera sees none, or none that faces
/// another one.
pub(super) fn middle_of_room(scene: &Extraction) -> Option<RoomInside> {
    let tree = &scene.prepared.geometry.tree;
    let settings = RenderSettings::default();
    let seen = gather_features(&scene.prepared, &settings, SIZE, 1, &|| false)?;
    let points: Vec<(Vec3, Vec3)> = (seen.coverage.iter().zip(&seen.position).zip(&seen.normal))
        .filter(|((share, _), normal)| **share == 1.0 && **normal != Vec3::ZERO)
        .map(|((_, position), normal)| (*position, normal.normalize()))
        .collect();
    // Halfway to what lies opposite.
    let opposite = |&(point, normal): &(Vec3, Vec3)| {
        let reach = tree.bounds().size().length();
        let start = point + NEAR * reach * normal;
        let hit = tree.closest_hit(&Ray::new(start, normal)).filter(|hit| hit.t.is_finite() && hit.t < reach)?;
        Some((hit.t, start + 0.5 * hit.t * normal))
    };
    let mut places: Vec<(f32, Vec3)> = points.iter().filter_map(opposite).collect();
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    let step = places.len().div_ceil(PLACES).max(1);
    let lit = |place: Vec3| {
        let mut distances: Vec<f32> = (points.iter())
            .filter_map(|&(point, normal)| {
                let to_point = point - place;
                let hit = tree.closest_hit(&Ray::new(place, to_point));
                let is_seen = normal.dot(to_point) < 0.0 && hit.is_none_or(|hit| hit.t > 1.0 - NEAR);
                is_seen.then(|| to_point.length())
            })
            .collect();
        distances.sort_by(f32::total_cmp);
        distances
    };
    let all = places.iter().step_by(step).map(|&(_, place)| (lit(place), place));
    let (distances, place) = all.max_by_key(|(distances, _)| distances.len())?;
    let distance = f64::from(*distances.get(distances.len() / 2)?);
    Some(RoomInside { position: scene.origin + place.as_dvec3(), distance })
}
