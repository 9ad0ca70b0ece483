//! The light that Disney's BSDF reflects to the side of the viewer, at one point or at sixteen.
//!
//! With w(x) = (1 − x)⁵, c the cosine of both directions with the half vector, and R = 2 · roughness · c²:
//!
//! f = F(c) D G / (4 cos θₒ cos θᵢ) + coat · (0.04 + 0.96 w(c)) D₁ G₁ + sheen · w(c)
//!   + ρ / π · ((1 − wₒ/2) (1 − wᵢ/2) + R (wₒ + wᵢ + wₒ wᵢ (R − 1)))
//!
//! where D₁ = (α² − 1) / (π ln α² (1 + (α² − 1) cos² θ)) and G₁ is the masking of GGX with a width of 1/4. `flatness`
//! blends the last term with that of a thin subsurface layer (Hanrahan and Krueger 1993, as in Burley 2015).

use crate::core::color::luminance_of;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect};
use crate::shading::ggx;
use crate::shading::microfacets::{Microfacets, SeenMicrofacets};
use crate::shading::scatter::Sampled;
use firstlight_simd::{Elementary, Real, Truth, Vector3, select, select_vector};
use std::f32::consts::{PI, TAU};

/// Reflectance of the coat at normal incidence.
const COAT_FACING: f32 = 0.04;
/// GGX width by which the coat is masked, whatever its own.
const COAT_MASKING: f32 = 0.25;
/// Narrowest GGX width.
const LEAST_ALPHA: f32 = 1e-3;
/// Mean of w over directions distributed by their cosine: ∫ 2 x (1 − x)⁵ dx.
const MEAN_WEIGHT: f32 = 1.0 / 21.0;

/// Parameters at a point, with all shares multiplied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DisneyLayers<R: Real = f32> {
    /// Albedo of the diffuse base.
    pub diffuse: Vector3<R>,
    /// The user's roughness, of the reflection that brightens the base.
    pub roughness: R,
    /// Share of the base that is a thin subsurface layer.
    pub flatness: R,
    pub sheen: Vector3<R>,
    /// Share of the reflection with the exact Fresnel term of `ior`.
    pub dielectric: R,
    pub ior: R,
    /// Share of the reflection with Schlick's, and its reflectance at normal incidence times that share.
    pub schlick: R,
    pub facing: Vector3<R>,
    /// GGX.
    pub facets: Microfacets<R>,
    /// Direction of the first width, in world space.
    pub tangent: Option<Vector3<R>>,
    /// Strength of the coat, a quarter of the user's, and its width, 0.001..0.1.
    pub coat: R,
    pub coat_alpha: R,
}

/// Parameters of a material at a point; all but the index are 0..1.
pub(crate) struct DisneyInputs<R> {
    pub color: Vector3<R>,
    pub metallic: R,
    pub roughness: R,
    pub anisotropic: R,
    /// Index of refraction.
    pub ior: R,
    pub specular_tint: R,
    pub transmission: R,
    pub flatness: R,
    pub sheen: R,
    pub sheen_tint: R,
    pub clearcoat: R,
    pub clearcoat_gloss: R,
}

impl<R: Real> DisneyInputs<R> {
    /// The colour at a luminance of 1; white for black.
    #[inline(always)]
    fn hue(&self) -> Vector3<R> {
        let (grey, one) = (luminance_of(self.color), Vector3::all(self.ior.all(1.0)));
        select_vector(grey.is_positive(), self.color.over(Vector3::all(grey)), one)
    }

    /// Widths along and across, for a roughness.
    #[inline(always)]
    pub fn facets(&self, roughness: R) -> Microfacets<R> {
        let one = roughness.all(1.0);
        let (alpha, aspect) = (roughness * roughness, (one - self.anisotropic * 0.9).sqrt());
        let alpha = [alpha / aspect, alpha * aspect].map(|alpha| alpha.at_least(LEAST_ALPHA));
        Microfacets { alpha, beckmann: one.is_negative() }
    }
}

/// The layers seen along one direction.
pub(crate) struct SeenLayers<R: Real = f32> {
    of: DisneyLayers<R>,
    facets: SeenMicrofacets<R>,
    /// (α² − 1) / ln α² of the coat.
    coat_scale: R,
    /// Approximate reflected share of light.
    pub strength: R,
    /// Probabilities of sampling by the cosine, by visible normals, and by normals of the coat.
    pmf: [R; 3],
}

#[inline(always)]
fn lerp<R: Real>(a: R, b: R, share: R) -> R {
    a + (b - a) * share
}

/// Schlick's (1 − cos)⁵.
#[inline(always)]
fn weight<R: Real>(cos: R) -> R {
    let rest = (cos.all(1.0) - cos).at_least(0.0).at_most(1.0);
    let square = rest * rest;
    square * square * rest
}

impl<R: Real> DisneyLayers<R> {
    /// What a solid reflects.
    #[inline(always)]
    pub fn solid(inputs: &DisneyInputs<R>) -> Self {
        let one = inputs.ior.all(1.0);
        let (opaque, hue) = (one - inputs.metallic, inputs.hue());
        let tinted = opaque * inputs.specular_tint;
        let root = (inputs.ior - 1.0) / (inputs.ior + 1.0);
        let white = Vector3::all(one);
        Self {
            diffuse: inputs.color * (opaque * (one - inputs.transmission)),
            roughness: inputs.roughness,
            flatness: inputs.flatness,
            sheen: (white + (hue - white) * inputs.sheen_tint) * (opaque * inputs.sheen),
            dielectric: opaque - tinted,
            ior: inputs.ior,
            schlick: inputs.metallic + tinted,
            facing: inputs.color * inputs.metallic + hue * (tinted * root * root),
            facets: inputs.facets(inputs.roughness),
            tangent: None,
            coat: inputs.clearcoat * 0.25,
            coat_alpha: one * 0.1 - inputs.clearcoat_gloss * 0.099,
        }
    }

    /// What a sheet reflects, of which only the clear part is shiny.
    ///
    /// - `beyond`: share of its diffuse light that goes to the far side, 0..1.
    #[inline(always)]
    pub fn sheet(inputs: &DisneyInputs<R>, beyond: R) -> Self {
        let layers = Self::solid(inputs);
        let (clear, back) = (inputs.transmission, beyond.all(1.0) - beyond);
        Self {
            diffuse: layers.diffuse * back,
            sheen: layers.sheen * (back * (back.all(1.0) - clear)),
            dielectric: layers.dielectric * clear,
            schlick: layers.schlick * clear,
            facing: layers.facing * clear,
            ..layers
        }
    }
}

impl<R: Elementary> DisneyLayers<R> {
    /// Reflectance of the dielectric, and Schlick's weight, which is that of the refracted ray where it is the steeper.
    #[inline(always)]
    fn fresnel(&self, cos: R) -> (R, R) {
        let one = cos.all(1.0);
        let (reflectance, cos_t) = fresnel(cos.at_most(1.0), one / self.ior);
        (reflectance, weight(select(one.lt(self.ior), cos, cos_t)))
    }

    /// Share of the dielectric's reflection at an angle with the normal.
    #[inline(always)]
    pub fn reflected(&self, cos: R) -> R {
        self.fresnel(cos).0
    }

    /// Reflectance of the microfacets.
    #[inline(always)]
    fn tint(&self, (reflectance, weight): (R, R)) -> Vector3<R> {
        let rise = Vector3::all(self.schlick) - self.facing;
        Vector3::all(self.dielectric * reflectance) + self.facing + rise * weight
    }

    /// Approximate reflected share of light, per channel.
    #[inline(always)]
    pub fn albedo(&self) -> Vector3<R> {
        self.diffuse + self.tint(self.fresnel(self.coat.all(1.0))) + Vector3::all(self.coat * COAT_FACING)
    }

    /// - `wo`, `normal`: unit, in world space.
    #[inline(always)]
    pub fn seen(self, wo: Vector3<R>, normal: Vector3<R>) -> SeenLayers<R> {
        let facets = SeenMicrofacets::new(self.facets, normal, self.tangent, wo);
        let one = self.coat.all(1.0);
        let found = self.fresnel(facets.wo().z.at_least(0.0));
        let by_cosine = luminance_of(self.diffuse) + luminance_of(self.sheen) * (found.1 + MEAN_WEIGHT);
        let by_facets = luminance_of(self.tint(found));
        let by_coat = self.coat * lerp(one * COAT_FACING, one, found.1);
        let has_coat = self.coat.is_positive();
        let mut coat_scale = one;
        if has_coat.any() {
            coat_scale = R::each(has_coat, [self.coat_alpha], |[alpha]| (alpha * alpha - 1.0) / (2.0 * alpha.ln()));
        }
        let strength = by_cosine + by_facets + by_coat;
        let per_strength = select(strength.is_positive(), one / strength, one.all(0.0));
        let pmf = [by_cosine, by_facets, by_coat].map(|part| part * per_strength);
        SeenLayers { of: self, facets, coat_scale, strength, pmf }
    }
}

impl<R: Elementary> SeenLayers<R> {
    /// f · cos and pdf.
    ///
    /// - `wi`: unit, in world space; both are zero where it, or the viewer, is behind the normal.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> (Vector3<R>, R) {
        self.eval_local(self.facets.local(wi))
    }

    #[inline(always)]
    fn eval_local(&self, local: Vector3<R>) -> (Vector3<R>, R) {
        let of = &self.of;
        let (cos_o, cos_i) = (self.facets.wo().z, local.z);
        let lit = self.facets.facing() & cos_i.is_positive();
        let one = cos_i.all(1.0);
        let (found, cos) = self.facets.eval(local);
        let fresnel = of.fresnel(cos);
        let cosine = cosine_hemisphere_pdf(cos_i);
        // The base, brighter in the direction from which it is lit, and the sheen.
        let (towards, from) = (weight(cos_o), weight(cos_i));
        let back = of.roughness * cos * cos * 2.0;
        let straight = (one - towards * 0.5) * (one - from * 0.5);
        let mut base = straight + back * (towards + from + towards * from * (back - 1.0));
        if of.flatness.is_positive().any() {
            let edge = back * 0.5;
            let both = lerp(one, edge, towards) * lerp(one, edge, from);
            let flat = (both * (one / (cos_o + cos_i) - 0.5) + 0.5) * 1.25;
            base = lerp(base, flat, of.flatness);
        }
        let mut value = of.diffuse * (cosine * base) + of.sheen * (weight(cos) * cos_i);
        let mut pdf = self.pmf[0] * cosine + self.pmf[1] * found.pdf;
        // Masking and shadowing are independent of each other, as in Mitsuba.
        let shadowing = of.facets.lambda(local) + 1.0;
        value = value + of.tint(fresnel) * (found.pdf / shadowing);
        let has_coat = of.coat.is_positive();
        if has_coat.any() {
            let half = found.half;
            let a2 = of.coat_alpha * of.coat_alpha;
            // 1 + (α² − 1) cos² without cancellation at the peak.
            let spread = (half.x * half.x + half.y * half.y + a2 * half.z * half.z) * PI;
            let normals = self.coat_scale / spread;
            let width = one * COAT_MASKING;
            let masking = (ggx::lambda(self.facets.wo(), width) + 1.0) * (ggx::lambda(local, width) + 1.0);
            let coat = of.coat * lerp(one * COAT_FACING, one, fresnel.1) * normals * cos_i / masking;
            value = select_vector(has_coat, value + Vector3::all(coat), value);
            pdf = select(has_coat, pdf + self.pmf[2] * normals * half.z / (cos * 4.0), pdf);
        }
        let zero = one.all(0.0);
        (select_vector(lit, value, Vector3::all(zero)), select(lit, pdf, zero))
    }

    /// - `u_choice`: selects the technique; `u`: the direction.
    #[inline(always)]
    pub fn sample(&self, u_choice: R, u: [R; 2]) -> Sampled<R> {
        let by_cosine = u_choice.lt(self.pmf[0]);
        let by_coat = !(u_choice - self.pmf[0]).lt(self.pmf[1]) & self.pmf[2].is_positive();
        let mut local = self.facets.sample(u);
        local = select_vector(by_cosine, cosine_hemisphere(u), local);
        if by_coat.any() {
            let one = u_choice.all(1.0);
            let a2 = self.of.coat_alpha * self.of.coat_alpha;
            let sin2 = ((a2.power(one - u[1]) - a2) / (one - a2)).at_least(0.0).at_most(1.0);
            let (sin_phi, cos_phi) = (u[0] * TAU).sin_cos();
            let sin = sin2.sqrt();
            let half = Vector3 { x: sin * cos_phi, y: sin * sin_phi, z: (one - sin2).sqrt() };
            local = select_vector(by_coat & !by_cosine, reflect(self.facets.wo(), half), local);
        }
        let (value, pdf) = self.eval_local(local);
        let one = pdf.all(1.0);
        let (go_on, weight) = (pdf.is_positive(), value * (one / pdf));
        Sampled { go_on, wi: self.facets.world(local), weight, pdf, probability: one }
    }
}
