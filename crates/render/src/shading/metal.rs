//! Rough metal seen from one direction, at one point or at sixteen.

use crate::shading::dielectric::reflect;
use crate::shading::ggx;
use firstlight_simd::{Real, Truth, Vector3, select_vector};
use std::f32::consts::PI;

/// A metal seen along `wo`.
#[derive(Clone, Copy)]
pub(crate) struct Metal<R: Real> {
    /// GGX width, dimensionless; at least [`crate::core::material::SMALLEST_ALPHA`].
    pub alpha: R,
    /// Reflectance at normal incidence.
    pub reflectance: Vector3<R>,
    /// Whether the reflectance increases towards grazing angles, see [`schlick`].
    pub schlick: R::Mask,
    /// Shading frame in world space; the last axis is the normal.
    axes: [Vector3<R>; 3],
    /// Direction to the viewer in the frame `axes`.
    wo: Vector3<R>,
    lambda_o: R,
    /// Lost over returned energy of single scattering; 0 without compensation.
    lost: R,
}

/// BSDF value for one direction.
pub(crate) struct MetalValue<R> {
    pub tint: Vector3<R>,
    /// f · cos divided by the tint.
    pub value: R,
    /// Pdf per steradian.
    pub pdf: R,
    /// f · cos / pdf divided by the tint.
    pub weight: R,
}

impl<R: Real> Metal<R> {
    /// Prepares the metal for a view direction.
    ///
    /// - `axes`: frame about the normal; `wo`: in that frame, unit, towards the viewer.
    /// - `lost`: lost over returned energy of single scattering, see [`ggx::single_scattering_albedo`]; 0 for no
    ///   compensation.
    #[inline(always)]
    pub fn new(
        axes: [Vector3<R>; 3],
        wo: Vector3<R>,
        alpha: R,
        reflectance: Vector3<R>,
        schlick: R::Mask,
        lost: R,
    ) -> Self {
        Self { alpha, reflectance, schlick, axes, wo, lambda_o: ggx::lambda(wo, alpha), lost }
    }

    /// Lanes in which the normal faces the viewer.
    #[inline(always)]
    pub fn facing(&self) -> R::Mask {
        self.wo.z.is_positive()
    }

    /// Samples a direction; returns it in world space and in the frame, both unit; it may lie below the surface.
    #[inline(always)]
    pub fn sample(&self, u: [R; 2]) -> [Vector3<R>; 2] {
        let h = ggx::sample_visible_normal(self.wo, self.alpha, u);
        let local = reflect(self.wo, h);
        [local.to_world(&self.axes).normalize(), local]
    }

    #[inline(always)]
    pub fn local(&self, wi: Vector3<R>) -> Vector3<R> {
        wi.to_local(&self.axes)
    }

    /// - `wi`: in the frame, above the surface.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> MetalValue<R> {
        let found = ggx::reflection(self.wo, self.lambda_o, wi, self.alpha);
        let tint = tint(self.schlick, self.reflectance, self.wo.dot(found.half));
        // Compensation for multiple scattering (Turquin 2019, equation 16).
        let back = self.reflectance * self.lost;
        let one = Vector3 { x: back.x + 1.0, y: back.y + 1.0, z: back.z + 1.0 };
        MetalValue { tint: tint.times(one), value: found.value, pdf: found.pdf, weight: found.weight }
    }
}

impl Metal<f32> {
    /// Like [`Self::eval`], with value and pdf rounded in another order: images of scenes whose metals are shaded one
    /// at a time depend on it.
    #[inline]
    pub fn eval_one(&self, wi: Vector3<f32>) -> MetalValue<f32> {
        let found = self.eval(wi);
        let h = (self.wo + wi).normalize();
        let (a2, lambda_i) = (self.alpha * self.alpha, ggx::lambda(wi, self.alpha));
        let d = a2 * h.z * h.z + (h.x * h.x + h.y * h.y);
        let distribution = a2 / (PI * d * d);
        let g2 = 1.0 / (1.0 + self.lambda_o + lambda_i);
        MetalValue {
            value: distribution * g2 / (4.0 * self.wo.z * wi.z) * wi.z,
            pdf: distribution / ((1.0 + self.lambda_o) * 4.0 * self.wo.z),
            ..found
        }
    }
}

/// Reflectance at an angle: by [`schlick`] where the mask is set, otherwise constant.
#[inline(always)]
pub(crate) fn tint<R: Real>(by_schlick: R::Mask, facing: Vector3<R>, cos: R) -> Vector3<R> {
    if !by_schlick.any() {
        return facing;
    }
    select_vector(by_schlick, schlick(facing, cos), facing)
}

/// Fresnel reflectance of a metal with reflectance `facing` at normal incidence (Schlick 1994).
#[inline(always)]
pub(crate) fn schlick<R: Real>(facing: Vector3<R>, cos: R) -> Vector3<R> {
    let x = (-cos + 1.0).at_least(0.0).at_most(1.0);
    let x2 = x * x;
    let grazing = x2 * x2 * x;
    let white = Vector3 { x: -facing.x + 1.0, y: -facing.y + 1.0, z: -facing.z + 1.0 };
    facing + white * grazing
}
