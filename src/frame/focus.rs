//! Focus: the zone of acceptable sharpness, and a focal plane that follows a point.

use crate::frame::navigation::focus_at;
use crate::frame::state::resources::{PictureSize, RenderState};
use crate::frame::state::selection::pick_along;
use crate::scene::{Lens, Ordinal, Placement, Projection, View};
use bevy_ecs::prelude::{Entity, Resource, World};
use glam::DVec3;

/// Range of depths with acceptable sharpness, metres along the view axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharpZone {
    /// Nearest sharp depth.
    pub near: f64,
    /// Farthest sharp depth; may be infinite.
    pub far: f64,
}

/// Returns the depths at which the circle of confusion is at most one pixel of an image that is `height` pixels high;
/// `None` without depth of field.
///
/// A point at depth z is projected from a point o of the lens to x + o (1/f − 1/z), in units of the plane at 1 m, so a
/// lens of radius R spreads it over a circle of diameter 2 R |1/f − 1/z|; an orthographic camera projects it to x + o
/// (1 − z/f), in metres.
pub fn sharp_zone(lens: &Lens, projection: &Projection, height: u32) -> Option<SharpZone> {
    let radius = lens.effective_radius();
    if !(radius > 0.0) {
        return None;
    }
    if let Some(seen) = projection.orthographic_height {
        let tolerance = seen / (2.0 * f64::from(height.max(1)) * radius);
        let (near, far) = match lens.focus_distance {
            f64::INFINITY => (0.0, f64::INFINITY),
            focus => (focus * (1.0 - tolerance).max(0.0), focus * (1.0 + tolerance)),
        };
        return Some(SharpZone { near, far });
    }
    let pixel = 2.0 * projection.tan_half_vfov() / f64::from(height.max(1));
    let (focus, tolerance) = (lens.focus_distance.recip(), pixel / (2.0 * radius));
    let far = if focus > tolerance { (focus - tolerance).recip() } else { f64::INFINITY };
    Some(SharpZone { near: (focus + tolerance).recip(), far })
}

/// Returns the f-number of a lens radius in metres, for a film 24 mm high and the field of view in perspective.
pub fn f_stop(lens_radius: f64, projection: &Projection) -> f64 {
    focal_length(projection) / (2.0 * lens_radius)
}

/// How the size of an aperture is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aperture {
    /// As an f-number.
    FNumber(f64),
    /// As a diameter in metres, or what the scene has in their place: no photographer knows such an f-number.
    Diameter(f64),
}

/// F-numbers from the fastest lenses to a pinhole. Others come from scenes that are not in metres.
const F_NUMBERS: std::ops::RangeInclusive<f64> = 0.5..=128.0;

impl Aperture {
    /// That of a lens with this radius, metres. Parallel rays have no f-number.
    pub fn of(lens_radius: f64, projection: &Projection) -> Self {
        let stop = f_stop(lens_radius, projection);
        let is_usual = projection.orthographic_height.is_none() && F_NUMBERS.contains(&stop);
        if is_usual { Self::FNumber(stop) } else { Self::Diameter(2.0 * lens_radius) }
    }
}

/// Formats an f-number with two significant digits.
pub fn f_number(stop: f64) -> String {
    format!("f/{stop:.0$}", f_number_decimals(stop))
}

/// Number of decimals for two significant digits of an f-number.
pub fn f_number_decimals(stop: f64) -> usize {
    if stop > 0.0 { (1.0 - stop.log10().floor()).clamp(0.0, 6.0) as usize } else { 0 }
}

/// Returns the lens radius in metres of an f-number.
pub fn radius_of_f_stop(f_stop: f64, projection: &Projection) -> f64 {
    focal_length(projection) / (2.0 * f_stop)
}

/// Focal length in metres, for a film 24 mm high.
pub fn focal_length(projection: &Projection) -> f64 {
    0.012 / projection.tan_half_vfov()
}

/// Vertical field of view in degrees of a focal length in metres, for a film 24 mm high.
pub fn vfov_of_focal_length(metres: f64) -> f64 {
    2.0 * (0.012 / metres).atan().to_degrees()
}

/// What the focal plane follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FocusTarget {
    /// The camera: the focus distance is constant.
    #[default]
    Camera,
    /// A point in world space.
    Point(DVec3),
    /// A point of an object, in object space.
    Object(Entity, DVec3),
    /// Whatever is at this position in the image, in fractions of its size (the mouse).
    Cursor([f64; 2]),
}

/// State of focus tracking.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Focus {
    /// What the focal plane follows.
    pub target: FocusTarget,
    /// The object and the point that were focused on last.
    pub last: Option<(Entity, DVec3)>,
}

/// Moves the focal plane to its target.
///
/// Reads [`Focus`], placements and the rendered scene; writes the lens of the first camera.
pub fn hold_focus(world: &mut World) {
    let point = match world.resource::<Focus>().target {
        FocusTarget::Camera => return,
        FocusTarget::Cursor(place) => match under(world, place) {
            Some(point) => point,
            // The environment has no distance: the focus stays.
            None => return,
        },
        FocusTarget::Point(point) => point,
        FocusTarget::Object(entity, local) => match world.get::<Placement>(entity) {
            Some(placement) => placement.affine().transform_point3(local),
            None => {
                world.resource_mut::<Focus>().target = FocusTarget::Camera;
                return;
            }
        },
    };
    let cameras: Vec<(Entity, View, Lens)> = world
        .query::<(Entity, &View, &Lens)>()
        .iter(world)
        .map(|(entity, view, lens)| (entity, *view, *lens))
        .collect();
    for (entity, view, lens) in cameras {
        let held = focus_at(&lens, (point - view.eye).dot(view.forward));
        if held != lens {
            world.entity_mut(entity).insert(held);
        }
    }
}

/// The point at this position in the image, for the current camera.
fn under(world: &mut World, [x, y]: [f64; 2]) -> Option<DVec3> {
    let aspect = world.resource::<PictureSize>().aspect();
    let mut cameras = world.query::<(Entity, Option<&Ordinal>, &View, &Projection)>();
    let first = cameras.iter(world).min_by_key(|(entity, rank, ..)| (rank.map_or(u32::MAX, |rank| rank.0), *entity));
    let (view, projection) = first.map(|(_, _, view, projection)| (*view, *projection))?;
    let scene = world.resource::<RenderState>().extraction.as_ref()?;
    pick_along(scene, &view, &projection, x, y, aspect).map(|picked| picked.point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_limits_the_circle_of_confusion_is_one_pixel() {
        let projection = Projection::perspective(40.0);
        for (radius, focus, height) in [(0.05, 3.0, 720), (0.002, 12.0, 1080), (0.3, 0.5, 90)] {
            let zone = sharp_zone(&Lens::thin(radius, focus), &projection, height).unwrap();
            assert!(zone.near < focus && focus < zone.far);
            for limit in [zone.near, zone.far].into_iter().filter(|limit| limit.is_finite()) {
                // Two rays from opposite ends of the lens through one point of the focal plane, at that depth.
                let apart = 2.0 * radius * (1.0 - limit / focus).abs();
                let pixels = apart / limit / (2.0 * projection.tan_half_vfov()) * f64::from(height);
                assert!((pixels - 1.0).abs() < 1e-9, "{pixels} pixels at {limit}");
            }
        }
        assert_eq!(sharp_zone(&Lens::pinhole(1.0), &projection, 720), None);
        assert_eq!(sharp_zone(&Lens::thin(1e-6, 3.0), &projection, 720).unwrap().far, f64::INFINITY);
        let infinite = sharp_zone(&Lens::thin(0.01, f64::INFINITY), &projection, 720).unwrap();
        assert!(infinite.near > 1.0 && infinite.far == f64::INFINITY);
    }

    #[test]
    fn f_stops_and_radii_say_the_same() {
        // A lens of 50 mm at f/2 has a diameter of 25 mm.
        let projection = Projection::perspective(2.0 * (12.0_f64 / 50.0).atan().to_degrees());
        assert!((f_stop(0.0125, &projection) - 2.0).abs() < 1e-12);
        assert!((radius_of_f_stop(2.0, &projection) - 0.0125).abs() < 1e-12);
    }

    #[test]
    fn what_no_lens_has_is_told_as_a_diameter() {
        let projection = Projection::perspective(40.0);
        assert!(matches!(Aperture::of(0.01, &projection), Aperture::FNumber(stop) if (1.6..1.7).contains(&stop)));
        // A model in millimetres, from 300 of them away; and one in kilometres.
        assert_eq!(Aperture::of(3.0, &projection), Aperture::Diameter(6.0));
        assert_eq!(Aperture::of(1e-5, &projection), Aperture::Diameter(2e-5));
        let plan = Projection { orthographic_height: Some(4.0), ..projection };
        assert_eq!(Aperture::of(0.01, &plan), Aperture::Diameter(0.02));
    }
}
