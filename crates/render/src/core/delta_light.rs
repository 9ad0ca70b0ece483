//! Delta lights: point, spot and directional lights. No ray ever hits one.

use crate::core::texture::TextureId;
use firstlight_simd::{Elementary, Truth, select};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// A light that emits from a single point or in a single direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeltaLight {
    /// Uniform in all directions.
    Point {
        /// Position in metres.
        position: Vec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Vec3,
    },
    /// Into a cone.
    Spot {
        /// Position in metres.
        position: Vec3,
        /// Radiant intensity within the inner cone, W·sr⁻¹.
        intensity: Vec3,
        /// The cone.
        cone: Cone,
        /// The image that it projects.
        image: Option<LightImage>,
    },
    /// From infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, W·m⁻².
        irradiance: Vec3,
    },
}

/// How the intensity of a spot light falls off between its inner and its outer angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Falloff {
    /// t², with t = (cos a − cos outer) / (cos inner − cos outer) at the angle a (glTF 2.0, KHR_lights_punctual).
    #[default]
    Quadratic,
    /// t² (3 − 2t), with the same t (pbrt-v4).
    Smooth,
    /// (outer − a) / (outer − inner) (Mitsuba 3).
    Linear,
}

/// Cone of a spot light.
///
/// Angles are stored as 1 − cos, which distinguishes narrow cones whose cosine is 1 in `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit, away from the tip.
    pub axis: Vec3,
    /// 1 − cos of the angle beyond which there is no light, 0..1.
    pub outer: f32,
    /// Reciprocal of the difference between `outer` and 1 − cos of the angle up to which the intensity is constant, or
    /// for [`Falloff::Linear`] of the difference between both angles, radians; finite.
    pub slope: f32,
    /// From `outer` inwards.
    pub falloff: Falloff,
}

/// An image that a spot light projects: it multiplies the intensity, and nothing shines beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightImage {
    /// The image, over texture coordinates from 0 to 1; `None`: white.
    pub texture: Option<TextureId>,
    /// Unit vectors to the right and upwards in the image, as seen from the light, and along its middle; orthonormal.
    pub axes: [Vec3; 3],
    /// Tangents of half the angles that it fills, horizontally and vertically; above 0.
    pub half: Vec2,
    /// Whether a wall that faces the light is lit evenly, so that the intensity is over cos³ of the angle from the axis.
    pub even: bool,
}

impl LightImage {
    /// Texture coordinates in a unit direction, and the factor of the intensity there; `None` beside the image.
    #[inline]
    pub fn at(&self, dir: Vec3) -> Option<(Vec2, f32)> {
        let [right, up, axis] = self.axes;
        let cos = dir.dot(axis);
        let uv = 0.5 + 0.5 * Vec2::new(dir.dot(right), dir.dot(up)) / (cos * self.half);
        let is_inside = cos > 0.0 && uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
        is_inside.then(|| (uv, if self.even { cos.powi(-3) } else { 1.0 }))
    }
}

impl Falloff {
    /// Coefficients of t and of t³; that of t² is the rest of 1.
    pub(crate) fn coefficients(self) -> [f32; 2] {
        match self {
            Self::Quadratic => [0.0, 0.0],
            Self::Smooth => [0.0, -2.0],
            Self::Linear => [1.0, 0.0],
        }
    }
}

/// Returns the share of the intensity of a spot light at an angle given as 1 − cos; `outer`, `slope`: as in [`Cone`];
/// `falloff`: [`Falloff::coefficients`].
#[inline(always)]
pub(crate) fn share_in_cone<R: Elementary>(one_minus_cos: R, outer: R, slope: R, falloff: [R; 2]) -> R {
    let [linear, cube] = falloff;
    let is_linear = linear.equals(linear.all(1.0));
    let mut below = outer - one_minus_cos;
    if is_linear.any() {
        let angle = |x: R| (x * (-x + 2.0)).at_least(0.0).sqrt().atan2(-x + 1.0);
        // Sixteen lanes have no angle of 0.
        let inside = select(one_minus_cos.is_positive(), angle(one_minus_cos), one_minus_cos);
        below = select(is_linear, angle(outer) - inside, below);
    }
    let t = (below * slope).at_least(0.0).at_most(1.0);
    t * (t * (-(linear + cube) + 1.0 + t * cube) + linear)
}

impl Cone {
    /// - `axis`: unit.
    /// - `inner`, `outer`: radians from the axis, 0 ≤ `inner` ≤ `outer` ≤ π/2.
    pub fn new(axis: Vec3, inner: f64, outer: f64, falloff: Falloff) -> Self {
        // 1 − cos a = 2 sin² (a/2)
        let one_minus_cos = |angle: f64| (2.0 * (0.5 * angle).sin().powi(2)) as f32;
        let width = match falloff {
            Falloff::Linear => (outer - inner) as f32,
            Falloff::Quadratic | Falloff::Smooth => one_minus_cos(outer) - one_minus_cos(inner),
        };
        Self { axis, outer: one_minus_cos(outer), slope: 1.0 / width.max(1e-30), falloff }
    }

    /// Returns the share of the intensity in direction `dir`, 0..1.
    ///
    /// - `dir`: unit, away from the tip.
    #[inline]
    pub fn falloff(&self, dir: Vec3) -> f32 {
        self.falloff_at(0.5 * (dir - self.axis).length_squared())
    }

    /// Like [`Self::falloff`], at an angle given as 1 − cos.
    #[inline]
    pub fn falloff_at(&self, one_minus_cos: f32) -> f32 {
        share_in_cone(one_minus_cos, self.outer, self.slope, self.falloff.coefficients())
    }
}

/// Where a delta light is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// At a point in metres, within its cone if it has one.
    At(Vec3, Option<Cone>),
    /// Infinitely far away: the unit direction in which its light travels.
    Far(Vec3),
}

impl DeltaLight {
    /// Where it is.
    pub fn origin(&self) -> Origin {
        match *self {
            Self::Point { position, .. } => Origin::At(position, None),
            Self::Spot { position, cone, .. } => Origin::At(position, Some(cone)),
            Self::Directional { direction, .. } => Origin::Far(direction),
        }
    }

    /// The image that it projects.
    pub fn image(&self) -> Option<LightImage> {
        match *self {
            Self::Spot { image, .. } => image,
            Self::Point { .. } | Self::Directional { .. } => None,
        }
    }

    /// Radiant intensity, W·sr⁻¹, or for a directional light its irradiance, W·m⁻².
    pub fn strength(&self) -> Vec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_falls_off_as_gltf_pbrt_and_mitsuba_say() {
        for (inner, outer) in [(0.0, 45.0), (20.0, 30.0), (0.05, 0.1), (89.0, 90.0)] {
            let (inner, outer): (f64, f64) = (f64::to_radians(inner), f64::to_radians(outer));
            for falloff in [Falloff::Quadratic, Falloff::Smooth, Falloff::Linear] {
                let cone = Cone::new(Vec3::Z, inner, outer, falloff);
                for i in 0..=60 {
                    let angle = outer * 1.1 * f64::from(i) / 60.0;
                    let t = ((angle.cos() - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
                    let expected = match falloff {
                        Falloff::Quadratic => t * t,
                        Falloff::Smooth => t * t * (3.0 - 2.0 * t),
                        Falloff::Linear => ((outer - angle) / (outer - inner)).clamp(0.0, 1.0),
                    };
                    let dir = Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32);
                    let found = f64::from(cone.falloff(dir));
                    let name = format!("{inner} {outer} {falloff:?} {angle}: {found} for {expected}");
                    assert!((found - expected).abs() < 4e-5, "{name}");
                }
            }
        }
    }

    #[test]
    fn equal_angles_make_a_sharp_edge() {
        for falloff in [Falloff::Quadratic, Falloff::Smooth, Falloff::Linear] {
            let cone = Cone::new(Vec3::Z, 0.5, 0.5, falloff);
            let at = |angle: f32| cone.falloff(Vec3::new(angle.sin(), 0.0, angle.cos()));
            assert_eq!([at(0.0), at(0.499), at(0.501), at(3.0)], [1.0, 1.0, 0.0, 0.0]);
        }
    }
}
