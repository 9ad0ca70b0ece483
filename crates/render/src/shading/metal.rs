//! Rough metal as seen from one direction, at one point or at sixteen.

use crate::shading::dielectric::reflect;
use crate::shading::ggx;
use firstlight_simd::{Real, Truth, Vector3, select_vector};
use std::f32::consts::PI;

/// Metal as seen along `wo`.
#[derive(Clone, Copy)]
pub(crate) struct Metal<R: Real> {
    /// GGX width, no unit; from [`crate::core::material::SMALLEST_ALPHA`] on.
    pub alpha: R,
    /// Seen head-on.
    pub reflectance: Vector3<R>,
    /// Whether it reflects more at grazing angles, see [`schlick`].
    pub schlick: R::Mask,
    /// The last is the normal.
    axes: [Vector3<R>; 3],
    /// Along `axes`.
    wo: Vector3<R>,
    lambda_o: R,
    /// What one bounce loses over what it returns; 0 where it is not given back.
    lost: R,
}

/// Of a direction that a metal was asked about.
pub(crate) struct MetalValue<R> {
    pub tint: Vector3<R>,
    /// f · cos over the tint.
    pub value: R,
    /// Per steradian.
    pub pdf: R,
    /// f · cos / pdf over the tint.
    pub weight: R,
}

impl<R: Real> Metal<R> {
    /// - `axes`: about the normal; `wo`: along them, unit, towards the viewer.
    /// - `lost`: what one bounce loses over what it returns, see [`ggx::single_scattering_albedo`]; 0 for no compensation.
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

    /// Whether the normal faces the viewer.
    #[inline(always)]
    pub fn facing(&self) -> R::Mask {
        self.wo.z.is_positive()
    }

    /// A direction in the world and along the axes, both unit; the second may lie below the surface.
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

    /// - `wi`: along the axes, above the surface.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> MetalValue<R> {
        let found = ggx::reflection(self.wo, self.lambda_o, wi, self.alpha);
        let tint = tint(self.schlick, self.reflectance, self.wo.dot(found.half));
        // The energy of further bounces given back (Turquin 2019, equation 16).
        let back = self.reflectance * self.lost;
        let one = Vector3 { x: back.x + 1.0, y: back.y + 1.0, z: back.z + 1.0 };
        MetalValue { tint: tint.times(one), value: found.value, pdf: found.pdf, weight: found.weight }
    }
}

impl Metal<f32> {
    /// [`Self::eval`] with value and density rounded in another order: the pictures of scenes whose metals are shaded one at a
    /// time depend on it.
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

/// Reflectance under an angle: by [`schlick`] where the mask says so, otherwise the same under all.
#[inline(always)]
pub(crate) fn tint<R: Real>(by_schlick: R::Mask, facing: Vector3<R>, cos: R) -> Vector3<R> {
    if !by_schlick.any() {
        return facing;
    }
    select_vector(by_schlick, schlick(facing, cos), facing)
}

/// Fresnel reflectance of a metal that reflects `facing` head-on (Schlick 1994).
#[inline(always)]
pub(crate) fn schlick<R: Real>(facing: Vector3<R>, cos: R) -> Vector3<R> {
    let x = (-cos + 1.0).at_least(0.0).at_most(1.0);
    let x2 = x * x;
    let grazing = x2 * x2 * x;
    let white = Vector3 { x: -facing.x + 1.0, y: -facing.y + 1.0, z: -facing.z + 1.0 };
    facing + white * grazing
}
