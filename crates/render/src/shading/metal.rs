//! Metals, at one point or at sixteen: microfacets, or a mirror, whose reflectance is constant, Schlick's, or that of a
//! conductor.

use crate::shading::conductor::conductor;
use crate::shading::ggx;
use crate::shading::integral_table::GAUSS;
use crate::shading::layer_albedo::SchlickAlbedo;
use crate::shading::microfacets::{Microfacets, SeenMicrofacets};
use crate::shading::scatter::Sampled;
use firstlight_simd::{Real, Truth, Vector3, select, select_vector};

/// A metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Metal<R: Real = f32> {
    pub facets: Microfacets<R>,
    /// Direction of the first width, in world space; not needed where both are the same.
    pub tangent: Option<Vector3<R>>,
    pub tint: Tint<R>,
    /// Whether the energy that single scattering of GGX loses is returned.
    pub compensate: R::Mask,
}

/// Reflectance by the angle with a microfacet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tint<R: Real = f32> {
    /// At normal incidence; for conductors a factor.
    pub color: Vector3<R>,
    /// Whether it increases towards grazing angles, see [`schlick`].
    pub schlick: R::Mask,
    /// η and k of conductors; 0 and 1 in other lanes.
    pub index: Option<[Vector3<R>; 2]>,
}

/// A metal seen along one direction.
#[derive(Clone, Copy)]
pub(crate) struct SeenMetal<R: Real> {
    facets: SeenMicrofacets<R>,
    tint: Tint<R>,
    /// Factor that adds further bounces between microfacets, see [`with_further_bounces`]; 1 without compensation.
    gain: Vector3<R>,
    smooth: R::Mask,
}

impl<R: Real> Metal<R> {
    /// - `wo`, `normal`: unit, in world space.
    #[inline(always)]
    pub fn seen(&self, wo: Vector3<R>, normal: Vector3<R>) -> SeenMetal<R> {
        let facets = SeenMicrofacets::new(self.facets, normal, self.tangent, wo);
        let (smooth, alpha) = (self.facets.is_smooth(), self.facets.alpha);
        let mut lost = wo.x.all(0.0);
        let mut gain = Vector3::all(wo.x.all(1.0));
        let compensated = self.compensate & !self.facets.beckmann & !smooth;
        if compensated.any() {
            lost = select(compensated, ggx::lost_over_returned(facets.wo().z, alpha[0]), lost);
            let elongated = compensated & !self.facets.is_isotropic();
            if elongated.any() {
                let returned = SchlickAlbedo::along(facets.wo(), alpha).whole();
                lost = select(elongated, (returned.all(1.0) - returned) / returned, lost);
            }
            gain = with_further_bounces(self.tint.mean(), lost, mean_width(alpha));
        }
        SeenMetal { facets, tint: self.tint, gain, smooth }
    }
}

impl<R: Real> SeenMetal<R> {
    /// Lanes for which light sampling can contribute.
    #[inline(always)]
    pub fn non_specular(&self) -> R::Mask {
        !self.smooth
    }

    /// f · cos and pdf of what is not specular.
    ///
    /// - `wi`: unit, in world space; both are zero where it, or the viewer, is behind the normal.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> (Vector3<R>, R) {
        let local = self.facets.local(wi);
        let lit = self.facets.facing() & local.z.is_positive() & !self.smooth;
        let (found, cos) = self.facets.eval(local);
        let (value, zero) = (self.tint.at(cos).times(self.gain) * found.value, cos.all(0.0));
        (select_vector(lit, value, Vector3::all(zero)), select(lit, found.pdf, zero))
    }

    #[inline(always)]
    pub fn sample(&self, u: [R; 2]) -> Sampled<R> {
        let local = self.facets.sample(u);
        let wi = self.facets.world(local);
        let (found, cos) = self.facets.eval(local);
        let one = cos.all(1.0);
        // Below the surface: light that a second bounce would have returned.
        let go_on = self.smooth | (self.facets.facing() & local.z.is_positive());
        let weight = self.tint.at(cos).times(self.gain) * found.weight;
        if !self.smooth.any() {
            return Sampled { go_on, wi, weight, pdf: found.pdf, probability: one };
        }
        let weight = select_vector(self.smooth, self.tint.at(self.facets.wo().z), weight);
        let pdf = select(self.smooth, one.all(f32::INFINITY), found.pdf);
        Sampled { go_on, wi, weight, pdf, probability: one }
    }
}

impl<R: Real> Tint<R> {
    #[inline(always)]
    pub fn at(&self, cos: R) -> Vector3<R> {
        let mut tint = self.color;
        if self.schlick.any() {
            tint = select_vector(self.schlick, schlick(tint, cos.all(1.0), cos), tint);
        }
        match self.index {
            Some([eta, k]) => tint.times(conductor(cos, eta, k)),
            None => tint,
        }
    }

    /// Mean over all directions, weighted by their cosine, without the factor of conductors.
    #[inline(always)]
    pub fn mean(&self) -> Vector3<R> {
        let mut mean = self.color;
        if self.schlick.any() {
            let Vector3 { x, y, z } = mean;
            let of_schlick = Vector3 { x: mean_of_schlick(x), y: mean_of_schlick(y), z: mean_of_schlick(z) };
            mean = select_vector(self.schlick, of_schlick, mean);
        }
        let Some([eta, k]) = self.index else { return mean };
        let mut sum = Vector3::all(eta.x.all(0.0));
        for &(cos, weight) in &GAUSS {
            sum = sum + conductor(eta.x.all(cos), eta, k).mul_all(2.0 * cos * weight);
        }
        select_vector(eta.is_zero(), mean, sum)
    }
}

/// Width of an isotropic surface on which light bounces between microfacets about as often.
#[inline(always)]
pub(crate) fn mean_width<R: Real>([x, y]: [R; 2]) -> R {
    select(x.equals(y), x, ((x * x + y * y) * 0.5).sqrt())
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

/// Fresnel reflectance by those at normal incidence and at grazing angles (Schlick 1994).
#[inline(always)]
pub(crate) fn schlick<R: Real>(facing: Vector3<R>, grazing: R, cos: R) -> Vector3<R> {
    let x = (-cos + 1.0).at_least(0.0).at_most(1.0);
    let x2 = x * x;
    facing + (Vector3::all(grazing) - facing) * (x2 * x2 * x)
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
                let normal: Vec3 = ggx::sample_visible_normal(back.into(), alpha, u.to_array()).into();
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
            let wide = mean_width(alpha);
            let lost = (1.0 - whole) / whole;
            let colors = Vec3::new(0.2, 0.5, 0.9);
            let gain: Vec3 = with_further_bounces(colors.into(), lost, wide).into();
            let (found, expected) = (whole * colors * gain, walked(alpha, |_| colors));
            let off = (found / expected - 1.0).abs();
            assert!(off.max_element() < 0.015, "α {alpha:?}: {found} for {expected}");
            // Schlick's term: light that meets several microfacets meets them at other angles than the mean.
            let tint = Tint { color: colors.into(), schlick: true, index: None };
            let gain: Vec3 = with_further_bounces(tint.mean(), lost, wide).into();
            let found = (colors * once.facing + Vec3::splat(once.grazing)) * gain;
            let expected = walked(alpha, |cos| schlick(colors.into(), 1.0, cos).into());
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
