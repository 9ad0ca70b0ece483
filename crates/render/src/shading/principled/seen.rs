//! A layered surface seen along one direction, at one point or at sixteen: all that it reflects.
//!
//! Each lane gives the same bits whatever the others are. What it transmits is in [`super::transmitted`].

use crate::core::color::luminance_of;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::reflect;
use crate::shading::ggx::{anisotropic_distribution, anisotropic_lambda, sample_visible_normal};
use crate::shading::integral_table::GAUSS;
use crate::shading::layer_albedo::{SchlickAlbedo, azimuths, bounded_sheen, sheen_albedo};
use crate::shading::metal::{mean_of_schlick, mean_width, schlick, with_further_bounces};
use crate::shading::microfacets::Reflection;
use crate::shading::principled::layers::{COAT_FACING, Inside, Principled};
use crate::shading::scatter::Sampled;
use firstlight_simd::{Elementary, Real, Truth, Vector3, frame_around, select, select_vector};

/// Lower limit of cosines with the normal.
const SMALLEST_COS: f32 = 1e-6;

/// Values that depend on the view direction.
#[derive(Clone, Copy)]
pub(crate) struct Seen<R: Real = f32> {
    pub(super) of: Principled<R>,
    /// Tangent, bitangent, and normal on the side of the viewer.
    pub(super) axes: [Vector3<R>; 3],
    /// Direction to the viewer, along the axes.
    pub(super) wo: Vector3<R>,
    /// Lanes that scatter at all: not those seen from behind.
    pub(super) is_valid: R::Mask,
    /// The coat, about its own normal.
    coat: Option<CoatSeen<R>>,
    /// Transmittance of the sheen.
    pub(super) past_sheen: R,
    /// Transmittance of all layers towards the viewer.
    past_all: Vector3<R>,
    /// Mean of `past_all` over all directions.
    mean_past_all: Vector3<R>,
    /// Albedo of the microfacets of the base.
    pub(super) base: SchlickAlbedo<R>,
    /// Share of the light that reaches the metal.
    above_metal: R,
    /// Factor that adds further bounces between microfacets of the metal.
    metal_gain: Vector3<R>,
    /// Probabilities of sampling: by the cosine, for the diffuse layer and the sheen; by visible normals of the base;
    /// by those of the coat; transmission.
    pub(super) pmf: [R; 4],
}

#[derive(Clone, Copy)]
struct CoatSeen<R> {
    axes: [Vector3<R>; 3],
    wo: Vector3<R>,
    /// Transmittance of the coat.
    past: R,
}

/// A direction before it is known how much light comes from it.
#[derive(Clone, Copy)]
pub(crate) struct Proposed<R: Real> {
    /// Unit, in world space.
    pub wi: Vector3<R>,
    /// Lanes that have a direction.
    pub go_on: R::Mask,
    by_base: R::Mask,
    by_coat: R::Mask,
    /// Lanes that selected transmission instead, and the rest of the number that did.
    pub(super) passes: R::Mask,
    pub(super) rest: R,
}

/// Evaluates GGX microfacets for two directions above them, both in the frame.
#[inline(always)]
pub(super) fn facets<R: Real>(wo: Vector3<R>, wi: Vector3<R>, alpha: [R; 2]) -> Reflection<R> {
    let half = (wo + wi).normalize();
    let masking = anisotropic_lambda(wo, alpha) + 1.0;
    let both = masking + anisotropic_lambda(wi, alpha);
    let per_area = anisotropic_distribution(half, alpha) / (wo.z * 4.0);
    Reflection { half, value: per_area / both, pdf: per_area / masking, weight: masking / both }
}

#[inline(always)]
fn ones<R: Real>(like: R) -> Vector3<R> {
    Vector3::all(like.all(1.0))
}

/// 1 minus a colour, at least 0.
#[inline(always)]
pub(super) fn rest_of<R: Real>(color: Vector3<R>) -> Vector3<R> {
    (ones(color.x) - color).max(Vector3::all(color.x.all(0.0)))
}

impl<R: Elementary> Seen<R> {
    /// Prepares a surface for a view direction.
    ///
    /// - `normal`: unit; `wo`: unit, on its side: others scatter nothing.
    #[inline(always)]
    pub fn new(of: Principled<R>, wo: Vector3<R>, normal: Vector3<R>) -> Self {
        let one = wo.x.all(1.0);
        let mut axes = frame_around(normal);
        if let Some(tangent) = of.tangent {
            // As without tangents where there is none.
            let has_one = !tangent.is_zero();
            let x = (tangent - normal * normal.dot(tangent)).normalize_or(axes[0]);
            let y = normal.cross(x);
            axes = [select_vector(has_one, x, axes[0]), select_vector(has_one, y, axes[1]), normal];
        }
        let mut local = wo.to_local(&axes);
        local.z = local.z.at_least(SMALLEST_COS);
        let mut coat = None;
        if of.has_coat().any() {
            // A coat normal that faces away is replaced by that of the base.
            let faces = of.coat_normal.dot(wo).is_positive();
            let axes = frame_around(select_vector(faces, of.coat_normal, normal));
            let mut wo = wo.to_local(&axes);
            wo.z = wo.z.at_least(SMALLEST_COS);
            coat = Some(CoatSeen { axes, wo, past: past_coat(&of, wo.z) });
        }
        let past_coat = if let Some(coat) = &coat { coat.past } else { one };
        let past_sheen = past_sheen(&of, local.z);
        let base = SchlickAlbedo::along(local, of.alpha);
        let reflected = of.dielectric_albedo(base);
        let upper = past_coat * past_sheen;
        let past_all = rest_of(reflected) * upper;
        let mut mean_past_all = ones(one);
        if (!of.diffuse.is_zero()).any() {
            mean_past_all = mean_of_past_all(&of);
        }
        let mut metal_gain = ones(one);
        let is_metal = of.metallic.is_positive() & !of.is_smooth();
        if is_metal.any() {
            metal_gain = select_vector(is_metal, gain_of_metal(&of, base), metal_gain);
        }
        let metal = (of.metal * base.facing + Vector3::all(base.grazing)).times(metal_gain);
        let transmitted = match of.transmission {
            None => one.all(0.0),
            Some(passed) => match passed.inside {
                Inside::Solid(_) => one * passed.share,
                Inside::Thin(_) => {
                    luminance_of(Vector3::in_all(one, passed.tint).times(ones(one) - reflected)) * passed.share
                }
            },
        };
        let mut by_cosine = luminance_of(of.diffuse.times(past_all));
        if (!of.sheen.is_zero()).any() {
            by_cosine += past_coat * luminance_of(of.sheen) * sheen_albedo(local.z, of.sheen_alpha);
        }
        let by_base = upper * luminance_of(reflected * of.dielectric + metal * of.metallic);
        let (by_coat, through) = (one - past_coat, upper * transmitted);
        let sum = by_cosine + by_base + by_coat + through;
        Self {
            of,
            axes,
            wo: local,
            is_valid: normal.dot(wo).is_positive() & sum.is_positive(),
            coat,
            past_sheen,
            past_all,
            mean_past_all,
            base,
            above_metal: upper,
            metal_gain,
            pmf: [by_cosine / sum, by_base / sum, by_coat / sum, through / sum],
        }
    }

    /// See [`Principled::scatters`].
    #[inline(always)]
    pub fn scatters(&self) -> R::Mask {
        self.of.scatters() & self.is_valid
    }

    /// Transmittance of the coat for light from one direction to the viewer.
    #[inline(always)]
    pub(super) fn below_coat(&self, wi: Vector3<R>) -> R {
        match &self.coat {
            Some(coat) => coat.past.min(past_coat(&self.of, coat.axes[2].dot(wi).abs())),
            None => wi.x.all(1.0),
        }
    }

    /// f · |cos| and pdf of all layers that are not specular and reflect. `wi`: unit, in world space.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> (Vector3<R>, R) {
        let (mut value, mut pdf) = self.eval_layers(wi);
        if let Some(surface) = self.of.true_normal {
            let is_mapped = !surface.is_zero();
            let height = surface.dot(wi);
            let mirrored = wi - surface * (height * 2.0);
            let (zero, nothing) = (height.all(0.0), Vector3::all(height.all(0.0)));
            let is_above = is_mapped & height.is_positive();
            // The mirrored direction, too, may be above the mapped normal.
            if (is_above & mirrored.dot(self.axes[2]).is_positive()).any() {
                let (more, density) = self.eval_layers(mirrored);
                value = select_vector(is_above, value + more, value);
                pdf = select(is_above, pdf + density, pdf);
            }
            let is_lit = is_above | !is_mapped;
            value = select_vector(is_lit, value, nothing);
            pdf = select(is_lit, pdf, zero);
        }
        (value, pdf)
    }

    /// [`Self::eval`] without the light that is mirrored at the true surface.
    #[inline(always)]
    fn eval_layers(&self, wi: Vector3<R>) -> (Vector3<R>, R) {
        let of = &self.of;
        let local = wi.to_local(&self.axes);
        let above = local.z.is_positive() & self.is_valid;
        let (zero, one) = (local.z.all(0.0), local.z.all(1.0));
        let below_coat = self.below_coat(wi);
        let past_sheen_i = past_sheen(of, local.z);
        let below = below_coat * self.past_sheen.min(past_sheen_i);
        let cosine = cosine_hemisphere_pdf(local.z);
        let (mut value, mut pdf) = (Vector3::all(zero), self.pmf[0] * cosine);
        if (!of.diffuse.is_zero()).any() {
            let reflected = of.dielectric_albedo(SchlickAlbedo::along(local, of.alpha));
            let mut past = past_sheen_i;
            if let Some(coat) = &self.coat {
                past = past * past_coat(of, coat.axes[2].dot(wi).abs());
            }
            let past_all_i = rest_of(reflected) * past;
            value = (of.diffuse * cosine).times(self.past_all).times(past_all_i).over(self.mean_past_all);
        }
        if (!of.sheen.is_zero()).any() {
            let half = (self.wo + local).normalize();
            let sheen = bounded_sheen(self.wo.z, local.z, half.z, of.sheen_alpha);
            value = value + of.sheen * (below_coat * sheen * local.z);
        }
        let by_base = !of.is_smooth() & self.pmf[1].is_positive();
        if by_base.any() {
            let found = facets(self.wo, local, of.alpha);
            let tint = self.tint(self.wo.dot(found.half), below);
            value = select_vector(by_base, value + tint * found.value, value);
            pdf = select(by_base, pdf + self.pmf[1] * found.pdf, pdf);
        }
        if let Some(coat) = &self.coat {
            let local = wi.to_local(&coat.axes);
            let by_coat = of.has_coat() & !of.is_coat_smooth() & local.z.is_positive();
            if by_coat.any() {
                let found = facets(coat.wo, local, [of.coat_alpha; 2]);
                let tint = schlick(Vector3::all(one * COAT_FACING), one, coat.wo.dot(found.half));
                value = select_vector(by_coat, value + tint * (of.coat * found.value), value);
                pdf = select(by_coat, pdf + self.pmf[2] * found.pdf, pdf);
            }
        }
        (select_vector(above, value, Vector3::all(zero)), select(above, pdf, zero))
    }

    /// Reflectance of the base below the upper layers, at an angle with its microfacets.
    ///
    /// - `below`: transmittance of the upper layers for both directions; for metal that of the viewer counts, so that
    ///   a white one returns all light.
    #[inline(always)]
    fn tint(&self, cos: R, below: R) -> Vector3<R> {
        let of = &self.of;
        let dielectric = schlick(of.facing, of.grazing, cos) * (of.dielectric * below);
        if !of.metallic.is_positive().any() {
            return dielectric;
        }
        let metal = schlick(of.metal, cos.all(1.0), cos).times(self.metal_gain);
        dielectric + metal * (of.metallic * self.above_metal)
    }

    /// Proposes a direction.
    ///
    /// - `u_lobe`: selects the technique; `u`: the direction.
    #[inline(always)]
    pub fn propose(&self, u_lobe: R, u: [R; 2]) -> Proposed<R> {
        let (of, pmf) = (&self.of, &self.pmf);
        let mut by_cosine = u_lobe.lt(pmf[0]);
        let rest = u_lobe - pmf[0];
        let mut by_base = !by_cosine & rest.lt(pmf[1]);
        let rest = rest - pmf[1];
        let mut by_coat = !by_cosine & !by_base & rest.lt(pmf[2]);
        let rest = rest - pmf[2];
        // What rounding leaves belongs to the last one that there is.
        let left = !by_cosine & !by_base & !by_coat;
        let passes = left & pmf[3].is_positive();
        let left = left & !passes;
        by_coat |= left & pmf[2].is_positive();
        by_base |= left & !by_coat & pmf[1].is_positive();
        by_cosine |= left & !by_coat & !by_base;
        let local = cosine_hemisphere(u);
        let mut wi = local.to_world(&self.axes);
        let mut go_on = by_cosine & local.z.is_positive();
        let (zero, one) = (rest.all(0.0), rest.all(1.0));
        let up = Vector3 { x: zero, y: zero, z: one };
        if by_base.any() {
            let smooth = of.is_smooth();
            let half = select_vector(smooth, up, sample_visible_normal(self.wo, of.alpha, u));
            let local = reflect(self.wo, half);
            wi = select_vector(by_base, local.to_world(&self.axes), wi);
            go_on |= by_base & (smooth | local.z.is_positive());
        }
        if let Some(coat) = &self.coat
            && by_coat.any()
        {
            let smooth = of.is_coat_smooth();
            let half = select_vector(smooth, up, sample_visible_normal(coat.wo, [of.coat_alpha; 2], u));
            let local = reflect(coat.wo, half);
            let world = local.to_world(&coat.axes);
            wi = select_vector(by_coat, world, wi);
            let above = local.z.is_positive() & self.axes[2].dot(world).is_positive();
            go_on |= by_coat & (smooth | above);
        }
        wi = wi.normalize();
        if let Some(surface) = of.true_normal {
            // Mirrored at the true surface if it is below.
            let height = surface.dot(wi);
            wi = select_vector(height.is_negative(), wi - surface * (height * 2.0), wi);
        }
        let rest = (rest / pmf[3]).at_least(0.0).at_most(1.0f32.next_down());
        Proposed { wi, go_on: go_on & self.is_valid, by_base, by_coat, passes: passes & self.is_valid, rest }
    }

    /// Weights a proposed direction: all layers that are not specular could have sampled it, so it is a one-sample
    /// estimate over their mixture.
    ///
    /// - `value`, `pdf`: of [`Self::eval`] in that direction.
    #[inline(always)]
    pub fn weighted(&self, proposed: &Proposed<R>, value: Vector3<R>, mut pdf: R) -> Sampled<R> {
        let of = &self.of;
        let by_base = proposed.by_base & of.is_smooth();
        let by_coat = proposed.by_coat & of.is_coat_smooth();
        let specular = by_base | by_coat;
        let go_on = proposed.go_on & (specular | pdf.is_positive());
        let mut weight = value * (pdf.all(1.0) / pdf);
        let mut probability = pdf.all(1.0);
        if specular.any() {
            let below = self.below_coat(proposed.wi) * self.past_sheen;
            let base = self.tint(self.wo.z, below) * (probability / self.pmf[1]);
            weight = select_vector(by_base, base, weight);
            probability = select(by_base, self.pmf[1], probability);
            if let Some(coat) = &self.coat {
                let tint = schlick(Vector3::all(pdf.all(COAT_FACING)), pdf.all(1.0), coat.wo.z);
                weight = select_vector(by_coat, tint * (of.coat / self.pmf[2]), weight);
                probability = select(by_coat, self.pmf[2], probability);
            }
            pdf = select(specular, pdf.all(f32::INFINITY), pdf);
        }
        Sampled { go_on, wi: proposed.wi, weight, pdf, probability }
    }
}

/// Transmittance of the coat at an angle.
#[inline(always)]
fn past_coat<R: Real>(of: &Principled<R>, cos: R) -> R {
    let albedo = SchlickAlbedo::new(cos, of.coat_alpha);
    cos.all(1.0) - of.coat * (albedo.facing * COAT_FACING + albedo.grazing)
}

/// Transmittance of the sheen at an angle.
#[inline(always)]
pub(super) fn past_sheen<R: Real>(of: &Principled<R>, cos: R) -> R {
    let one = cos.all(1.0);
    let strength = of.sheen.max_element();
    if !strength.is_positive().any() {
        return one;
    }
    (one - strength * sheen_albedo(cos, of.sheen_alpha)).at_least(0.0)
}

/// Factor of single scattering that adds further bounces between the microfacets of a metal.
///
/// - `base`: albedo of the microfacets in the direction of the viewer.
#[inline(always)]
fn gain_of_metal<R: Real>(of: &Principled<R>, base: SchlickAlbedo<R>) -> Vector3<R> {
    let returned = base.whole();
    let Vector3 { x, y, z } = of.metal;
    let mean = Vector3 { x: mean_of_schlick(x), y: mean_of_schlick(y), z: mean_of_schlick(z) };
    with_further_bounces(mean, (returned.all(1.0) - returned) / returned, mean_width(of.alpha))
}

/// Mean transmittance of all layers over all directions; not 0.
#[inline(always)]
fn mean_of_past_all<R: Real>(of: &Principled<R>) -> Vector3<R> {
    let one = of.coat.all(1.0);
    let mut mean = ones(one) - of.dielectric_albedo(SchlickAlbedo::mean(of.alpha));
    let is_layered = of.has_coat() | !of.sheen.is_zero();
    if is_layered.any() {
        let isotropic = of.alpha[0].equals(of.alpha[1]);
        let mut sum = Vector3::all(one.all(0.0));
        for &(at, weight) in &GAUSS {
            let cos = one.all(at);
            let mut rest = rest_of(of.dielectric_albedo(SchlickAlbedo::new(cos, of.alpha[0])));
            if (!isotropic).any() {
                let mut both = Vector3::all(one.all(0.0));
                for w in azimuths(at) {
                    let w = Vector3 { x: one.all(w.x), y: one.all(w.y), z: one.all(w.z) };
                    both = both + rest_of(of.dielectric_albedo(SchlickAlbedo::along(w, of.alpha)));
                }
                rest = select_vector(isotropic, rest, both.mul_all(0.5));
            }
            sum = sum + rest * (past_coat(of, cos) * past_sheen(of, cos) * (2.0 * at * weight));
        }
        mean = select_vector(is_layered, sum, mean);
    }
    mean.max(Vector3::all(one.all(1e-6)))
}
