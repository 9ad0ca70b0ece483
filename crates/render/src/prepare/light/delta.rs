//! Lights without size, as seen from one point or from sixteen.
//!
//! They are sampled as if they filled a solid angle of 1 / [`SHARPNESS`]: the density is that much larger, and so is
//! the radiance. What a sample brings is the quotient, which is exact, and next to any bounce's density theirs is so
//! large that the weight against bounces, which cannot find them, is 1 to the last bit.

use firstlight_kdtree::geometry::robust::{gamma, offset_along};
use firstlight_simd::{Real, Vector3, select, select_vector};

/// Density of the direction to a light without size, per steradian: a power of two, far above that of any bounce.
pub(crate) const SHARPNESS: f32 = (1u64 << 50) as f32;

/// Metres: as far away as directional lights are taken to be where they are weighed against others. Everything that can
/// be is hundreds of times as near.
pub(crate) const FAR: f32 = 1e15;

/// Metres: how far from the origin of a scene something can be.
pub(crate) const EVERYTHING: f32 = 2e12;

/// A light without size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeltaSource<R: Real> {
    /// Where it is, metres; or, unit, in which direction.
    pub origin: Vector3<R>,
    /// Of a spot, as in [`crate::core::delta_light::Cone`]; zero for all others.
    pub axis: Vector3<R>,
    pub outer: R,
    pub slope: R,
    /// Infinitely far away.
    pub is_far: R::Mask,
}

/// What a point sees of it.
pub(crate) struct DeltaSample<R: Real> {
    pub found: R::Mask,
    /// Where a shadow ray ends: in front of the point by what the kernel may lose, for something may be there. Where
    /// the light is far away, its direction.
    pub target: Vector3<R>,
    /// Unit.
    pub wi: Vector3<R>,
    /// Radiance over intensity, or over irradiance where the light is far away; per square metre, or per steradian.
    pub scale: R,
}

impl<R: Real> DeltaSource<R> {
    #[inline(always)]
    pub fn seen_from(&self, asked: R::Mask, position: Vector3<R>) -> DeltaSample<R> {
        let Self { origin, axis, outer, slope, is_far } = *self;
        let offset = origin - position;
        let distance2 = offset.length_squared();
        let distance = distance2.sqrt();
        let wi = offset * (distance.all(1.0) / distance);
        // 1 − cos of the angle between axis and −wi.
        let one_minus_cos = (wi + axis).length_squared() * 0.5;
        let t = ((outer - one_minus_cos) * slope).at_least(0.0).at_most(1.0);
        let scale = select(is_far, t.all(SHARPNESS), t * t * SHARPNESS / distance2);
        let n = wi.abs();
        let around = n.x + n.y + n.z;
        let lift = n.dot(origin.abs()) * gamma(6) + around * distance * gamma(16);
        let target = select_vector(is_far, origin, offset_along(origin, lift, -wi));
        let found = asked & (is_far | distance2.is_positive()) & scale.is_positive();
        DeltaSample { found, target, wi: select_vector(is_far, origin, wi), scale }
    }
}

/// Of lights without a cone: everything is within it.
pub(crate) const NO_CONE: (f32, f32) = (4.0, 1e30);
