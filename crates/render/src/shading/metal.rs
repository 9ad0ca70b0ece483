//! Rough metal seen from one direction, at one point or at sixteen.

use crate::shading::dielectric::reflect;
use crate::shading::ggx;
use firstlight_simd::{Real, Truth, Vector3, select_vector};

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
    /// Factor that adds further bounces between microfacets, see [`with_further_bounces`]; 1 without compensation.
    pub gain: Vector3<R>,
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
        let gain = with_further_bounces(mean_reflectance(schlick, reflectance), lost, alpha);
        Self { alpha, reflectance, schlick, axes, wo, lambda_o: ggx::lambda(wo, alpha), gain }
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
        let cos = self.wo.dot(found.half);
        let tint = tint(self.schlick, self.reflectance, cos);
        MetalValue { tint: tint.times(self.gain), value: found.value, pdf: found.pdf, weight: found.weight }
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

/// Mean of [`schlick`] over all directions, weighted by their cosine, where the mask is set.
#[inline(always)]
pub(crate) fn mean_reflectance<R: Real>(by_schlick: R::Mask, facing: Vector3<R>) -> Vector3<R> {
    if !by_schlick.any() {
        return facing;
    }
    let mean = Vector3 { x: mean_of_schlick(facing.x), y: mean_of_schlick(facing.y), z: mean_of_schlick(facing.z) };
    select_vector(by_schlick, mean, facing)
}

/// ∫ 2 cos (facing + (1 − facing) (1 − cos)⁵) d cos.
#[inline(always)]
pub(crate) fn mean_of_schlick<R: Real>(facing: R) -> R {
    facing + (-facing + 1.0) * (1.0 / 21.0)
}

/// Returns the factor of single scattering that adds the light of all further bounces between microfacets.
///
/// - `mean`: reflectance of a bounce, mean over directions; `lost`: lost over returned energy of single scattering;
///   `alpha`: width; of anisotropic surfaces the root of the mean of both squares.
///
/// A white surface returns all light, as in Turquin 2019. For others each bounce absorbs: the share of light that
/// meets one more microfacet is constant from the second bounce on, so the sum is a geometric series (as in Kulla and
/// Conty 2017, whose share is too large for wide surfaces, as Turquin's, 0, is too small). The share is fitted to
/// random walks between microfacets (Heitz et al. 2016); grey surfaces reflect within 1.5 % of the walks.
#[inline(always)]
pub(crate) fn with_further_bounces<R: Real>(mean: Vector3<R>, lost: R, alpha: R) -> Vector3<R> {
    let again = (alpha * 0.11 + 0.28) * alpha + 0.05;
    Vector3 {
        x: with_bounces_of(mean.x, lost, again),
        y: with_bounces_of(mean.y, lost, again),
        z: with_bounces_of(mean.z, lost, again),
    }
}

#[inline(always)]
fn with_bounces_of<R: Real>(mean: R, lost: R, again: R) -> R {
    let first = mean * (-again + 1.0);
    first * lost / (-(mean * again) + 1.0) + 1.0
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, cosine_hemisphere};
    use crate::shading::layer_albedo::SchlickAlbedo;
    use glam::{Vec2, Vec3};

    /// Reflectances of a surface lit from all around, per channel, by random walks between microfacets on a surface
    /// with uniform heights (Heitz et al. 2016, "Multiple-Scattering Microfacet BSDFs with the Smith Model").
    ///
    /// - `reflectance`: by the cosine with the microfacet normal.
    fn walked(alpha: [f32; 2], reflectance: impl Fn(f32) -> Vec3) -> Vec3 {
        let n = 60_000;
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(i, 3, 0, 1);
            let mut dir = -cosine_hemisphere(sampler.pair(0)).max(Vec3::new(-1.0, -1.0, 1e-4)).normalize();
            // Share of the surface below the current height.
            let (mut height, mut throughput) = (1.0_f32, Vec3::ONE);
            for k in 0..64 {
                let u = sampler.single(4 * k + 2);
                let lambda = if dir.z < 0.0 {
                    -1.0 - ggx::anisotropic_lambda((-dir).into(), alpha)
                } else {
                    ggx::anisotropic_lambda(dir.into(), alpha)
                };
                if dir.z >= 0.0 && u > 1.0 - height.powf(lambda) {
                    sum += throughput;
                    break;
                }
                height = (height / (1.0 - u).powf(1.0 / lambda)).clamp(0.0, 1.0);
                let back = -dir;
                let u = Vec2::new(sampler.single(4 * k + 3), sampler.single(4 * k + 4));
                let normal: Vec3 = ggx::sample_anisotropic_normal(back.into(), alpha, u.to_array()).into();
                throughput *= reflectance(back.dot(normal).clamp(0.0, 1.0));
                dir = (2.0 * back.dot(normal) * normal - back).normalize();
            }
        }
        sum / n as f32
    }

    #[test]
    fn further_bounces_are_those_of_random_walks() {
        for alpha in [[0.1; 2], [0.3; 2], [0.6; 2], [1.0; 2], [1.0, 0.1], [0.6, 0.3]] {
            let once = SchlickAlbedo::mean(alpha);
            let whole = once.facing + once.grazing;
            let wide = (0.5 * (alpha[0] * alpha[0] + alpha[1] * alpha[1])).sqrt();
            let lost = (1.0 - whole) / whole;
            let colors = Vec3::new(0.2, 0.5, 0.9);
            let gain: Vec3 = with_further_bounces(colors.into(), lost, wide).into();
            let (found, expected) = (whole * colors * gain, walked(alpha, |_| colors));
            let off = (found / expected - 1.0).abs();
            assert!(off.max_element() < 0.015, "α {alpha:?}: {found} for {expected}");
            // Schlick's term: light that meets several microfacets meets them at other angles than the mean.
            let gain: Vec3 = with_further_bounces(mean_reflectance(true, colors.into()), lost, wide).into();
            let found = (colors * once.facing + Vec3::splat(once.grazing)) * gain;
            let expected = walked(alpha, |cos| schlick(colors.into(), cos).into());
            let off = (found / expected - 1.0).abs();
            assert!(off.max_element() < 0.05, "α {alpha:?}, Schlick: {found} for {expected}");
        }
    }

    #[test]
    fn a_white_surface_gets_back_what_it_lost() {
        for (alpha, lost) in [(0.0, 0.0), (0.3, 0.2), (1.0, 1.5)] {
            let gain: Vec3 = with_further_bounces(Vec3::new(1.0, 0.0, 0.5).into(), lost, alpha).into();
            assert!((gain.x - 1.0 - lost).abs() < 1e-6 && gain.y == 1.0, "{gain}");
            assert!(gain.z <= 1.0 + 0.5 * lost, "{gain}");
        }
    }
}
