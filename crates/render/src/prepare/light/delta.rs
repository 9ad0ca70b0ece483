//! Delta lights, seen from one point or from sixteen.
//!
//! They are sampled as if they filled a solid angle of 1 / [`SHARPNESS`]: the pdf is larger by that factor, and so is
//! the radiance. The contribution of a sample is the quotient, which is exact, and compared with any BSDF pdf theirs is
//! so large that the MIS weight against BSDF sampling, which cannot find them, is exactly 1.

use crate::core::delta_light::share_in_cone;
use firstlight_kdtree::geometry::robust::{gamma, offset_along};
use firstlight_simd::{Elementary, Real, Vector3, select, select_vector};

/// Pdf per steradian of the direction to a delta light: a power of two, far above any BSDF pdf.
pub(crate) const SHARPNESS: f32 = (1u64 << 50) as f32;

/// Assumed distance of directional lights in metres, where they are weighted against others. All objects are closer by
/// a factor of hundreds.
pub(crate) const FAR: f32 = 1e15;

/// Maximum distance of objects from the origin of a scene, metres.
pub(crate) const EVERYTHING: f32 = 2e12;

/// A delta light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeltaSource<R: Real> {
    /// Position in metres; or, if it is far away, unit direction to the light.
    pub origin: Vector3<R>,
    /// Cone of a spot light, as in [`crate::core::delta_light::Cone`]; zero axis for all others.
    pub axis: Vector3<R>,
    pub outer: R,
    pub slope: R,
    /// Coefficients of its falloff.
    pub falloff: [R; 2],
    /// Whether it is infinitely far away.
    pub is_far: R::Mask,
}

/// A sample of a delta light.
pub(crate) struct DeltaSample<R: Real> {
    pub found: R::Mask,
    /// End of a shadow ray: just before the light, by the error bound of the kernel, because there may be a surface.
    /// For a light that is far away, its direction.
    pub target: Vector3<R>,
    /// Unit, towards the light.
    pub wi: Vector3<R>,
    /// Radiance over intensity, or over irradiance if the light is far away; per square metre, or per steradian.
    pub scale: R,
}

impl<R: Elementary> DeltaSource<R> {
    #[inline(always)]
    pub fn seen_from(&self, asked: R::Mask, position: Vector3<R>) -> DeltaSample<R> {
        let Self { origin, axis, outer, slope, falloff, is_far } = *self;
        let offset = origin - position;
        let distance2 = offset.length_squared();
        let distance = distance2.sqrt();
        let wi = offset * (distance.all(1.0) / distance);
        // 1 − cos of the angle between axis and −wi.
        let one_minus_cos = (wi + axis).length_squared() * 0.5;
        let share = share_in_cone(one_minus_cos, outer, slope, falloff);
        let scale = select(is_far, share.all(SHARPNESS), share * SHARPNESS / distance2);
        let n = wi.abs();
        let around = n.x + n.y + n.z;
        let lift = n.dot(origin.abs()) * gamma(6) + around * distance * gamma(16);
        let target = select_vector(is_far, origin, offset_along(origin, lift, -wi));
        let found = asked & (is_far | distance2.is_positive()) & scale.is_positive();
        DeltaSample { found, target, wi: select_vector(is_far, origin, wi), scale }
    }
}

/// Cone of lights without one: all directions are inside.
pub(crate) const NO_CONE: (f32, f32) = (4.0, 1e30);
