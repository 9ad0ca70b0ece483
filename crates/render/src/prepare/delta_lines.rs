//! Lines from delta lights towards casters.
//!
//! From a point light the direction is sampled uniformly over the cone of the caster's bounding sphere, or over that of
//! a spot light if it is narrower; for a directional light the origin is sampled uniformly over the disc of the
//! projected sphere. Pdfs are per steradian and per square metre: no camera path could find such a line.

use crate::core::texture::Texture;
use crate::prepare::light::emitter::Light;
use crate::prepare::light::shape::LightShape;
use crate::prepare::outside::Outside;
use crate::sampling::{cone_pdf, one_minus_cos_from_sin2, uniform_cone};
use firstlight_kdtree::geometry::{Frame, Ray, robust};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// A line and its strength.
pub(crate) struct DeltaLine {
    pub ray: Ray,
    /// Pdf per steradian or per square metre, without the choice of light and caster.
    pub density: f32,
    /// W·sr⁻¹ or W·m⁻².
    pub strength: Vec3,
    /// Whether it comes from outside of the scene.
    pub is_far: bool,
}

/// Samples a line; `None` if the light emits nothing in its direction.
///
/// - `center`, `radius`: bounding sphere of the caster, metres, possibly infinite.
/// - `u`: two independent uniform numbers in `[0, 1)`.
pub(crate) fn sample(
    light: &Light,
    textures: &[Texture],
    outside: &Outside,
    (center, radius): (Vec3, f32),
    u: Vec2,
) -> Option<DeltaLine> {
    match light.shape {
        LightShape::Point { position, cone } => {
            let (mut axis, mut one_minus_cos_max) = cone_around(position, (center, radius));
            if let Some(cone) = cone
                && cone.outer < one_minus_cos_max
            {
                (axis, one_minus_cos_max) = (cone.axis, cone.outer);
            }
            let dir = sample_cone((axis, one_minus_cos_max), u);
            let strength = strength_towards(light, textures, dir);
            // There may be a surface at the position of the light.
            let origin = robust::offset_ray_origin(position, robust::gamma(6) * position.abs(), dir, dir);
            let density = cone_pdf(one_minus_cos_max);
            Some(DeltaLine { ray: Ray::new(origin, dir), density, strength, is_far: false })
        }
        LightShape::Directional { to_light, .. } if radius.is_finite() => {
            let ray = outside.ray_from(to_light, (center, radius), u)?;
            let density = FRAC_1_PI / (radius * radius);
            Some(DeltaLine { ray, density, strength: strength_towards(light, textures, -to_light), is_far: true })
        }
        _ => None,
    }
}

/// The cone of directions from a point towards a sphere, all from inside of it: its axis, unit, and 1 − cos of its half
/// angle.
///
/// - `center`, `radius`: metres.
pub(crate) fn cone_around(position: Vec3, (center, radius): (Vec3, f32)) -> (Vec3, f32) {
    let to_center = center - position;
    let distance2 = to_center.length_squared();
    if distance2 > radius * radius {
        (to_center / distance2.sqrt(), one_minus_cos_from_sin2(radius * radius / distance2))
    } else {
        (Vec3::Z, 2.0)
    }
}

/// Samples a unit direction uniformly over the solid angle of a cone, as of [`cone_around`].
pub(crate) fn sample_cone((axis, one_minus_cos_max): (Vec3, f32), u: Vec2) -> Vec3 {
    let local = uniform_cone(u.to_array(), one_minus_cos_max).0.into();
    Frame::around(axis).to_world(local).normalize()
}

/// Strength of a delta light in a unit direction away from it: W·sr⁻¹, or W·m⁻² if it is far away.
pub(crate) fn strength_towards(light: &Light, textures: &[Texture], dir: Vec3) -> Vec3 {
    let share = match light.shape {
        LightShape::Point { cone: Some(cone), .. } => cone.falloff(dir),
        _ => 1.0,
    };
    share * light.radiance(textures, dir, Vec2::ZERO)
}

/// Estimates flux over strength of the light, zero only if none of it reaches the sphere; 0 for lights that are not
/// delta lights.
pub(crate) fn coupling(shape: &LightShape, center: Vec3, radius: f32) -> f64 {
    match shape {
        LightShape::Point { position, cone } => {
            let to_center = center - *position;
            let distance = to_center.length();
            let sin2 = (radius * radius / (distance * distance)).min(1.0);
            let sphere = if radius < distance { PI * sin2 } else { 4.0 * PI };
            let Some(cone) = cone else { return f64::from(sphere) };
            let beside = match radius < distance {
                // The angle from the axis to the edge of the sphere, with a margin.
                true => (cone.axis.angle_between(to_center) - sin2.sqrt().asin() - 1e-3).max(0.0),
                false => 0.0,
            };
            let share = cone.falloff_at(2.0 * (0.5 * beside).sin().powi(2));
            f64::from((TAU * cone.outer).min(sphere) * share)
        }
        LightShape::Directional { .. } if radius.is_finite() => f64::from(PI * radius * radius),
        _ => 0.0,
    }
}
