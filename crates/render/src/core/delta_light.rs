//! Delta lights: point, spot and directional lights. No ray ever hits one.

use glam::Vec3;

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
    },
    /// From infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, W·m⁻².
        irradiance: Vec3,
    },
}

/// Falloff of a spot light from its axis.
///
/// Angles are stored as 1 − cos, which distinguishes narrow cones whose cosine is 1 in `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit, away from the tip.
    pub axis: Vec3,
    /// 1 − cos of the angle beyond which there is no light, 0..1.
    pub outer: f32,
    /// Reciprocal of the difference between `outer` and 1 − cos of the angle up to which the intensity is constant;
    /// finite.
    pub slope: f32,
}

impl Cone {
    /// - `axis`: unit.
    /// - `inner`, `outer`: radians from the axis, 0 ≤ `inner` ≤ `outer` ≤ π/2.
    pub fn new(axis: Vec3, inner: f64, outer: f64) -> Self {
        // 1 − cos a = 2 sin² (a/2)
        let one_minus_cos = |angle: f64| (2.0 * (0.5 * angle).sin().powi(2)) as f32;
        let (inner, outer) = (one_minus_cos(inner), one_minus_cos(outer));
        Self { axis, outer, slope: 1.0 / (outer - inner).max(1e-30) }
    }

    /// Returns the share of the intensity in direction `dir`, 0..1.
    ///
    /// - `dir`: unit, away from the tip.
    ///
    /// Source: glTF 2.0, KHR_lights_punctual.
    #[inline]
    pub fn falloff(&self, dir: Vec3) -> f32 {
        self.falloff_at(0.5 * (dir - self.axis).length_squared())
    }

    /// Like [`Self::falloff`], at an angle given as 1 − cos.
    #[inline]
    pub fn falloff_at(&self, one_minus_cos: f32) -> f32 {
        let t = ((self.outer - one_minus_cos) * self.slope).clamp(0.0, 1.0);
        t * t
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

    /// Radiant intensity, W·sr⁻¹, or for a directional light its irradiance, W·m⁻².
    pub fn strength(&self) -> Vec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// Radiant intensity in a unit direction, W·sr⁻¹; for a directional light, its irradiance.
    #[inline]
    pub fn towards(&self, dir: Vec3) -> Vec3 {
        match self {
            Self::Point { intensity, .. } => *intensity,
            Self::Spot { intensity, cone, .. } => cone.falloff(dir) * *intensity,
            Self::Directional { irradiance, .. } => *irradiance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_falls_off_as_gltf_says() {
        for (inner, outer) in [(0.0, 45.0), (20.0, 30.0), (0.05, 0.1), (89.0, 90.0)] {
            let (inner, outer): (f64, f64) = (f64::to_radians(inner), f64::to_radians(outer));
            let cone = Cone::new(Vec3::Z, inner, outer);
            for i in 0..=60 {
                let angle = outer * 1.1 * f64::from(i) / 60.0;
                let t = ((angle.cos() - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
                let dir = Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32);
                let found = f64::from(cone.falloff(dir));
                assert!((found - t * t).abs() < 2e-5, "{inner} {outer} {angle}: {found} for {}", t * t);
            }
        }
    }

    #[test]
    fn equal_angles_make_a_sharp_edge() {
        let cone = Cone::new(Vec3::Z, 0.5, 0.5);
        let at = |angle: f32| cone.falloff(Vec3::new(angle.sin(), 0.0, angle.cos()));
        assert_eq!([at(0.0), at(0.499), at(0.501), at(3.0)], [1.0, 1.0, 0.0, 0.0]);
    }
}
