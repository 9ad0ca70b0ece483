//! Disney's BSDF at one point: what it reflects, and what passes it, as Mitsuba 3 evaluates it in `principled` and
//! `principledthin` (Burley 2012, "Physically Based Shading at Disney", and 2015, "Extending the Disney BRDF to a BSDF
//! with Integrated Subsurface Scattering"). Its parts are a plain sum: unlike `principled` it neither conserves energy
//! nor is it limited to it. What it reflects, also at sixteen points, is [`crate::shading::disney_layers`].
//!
//! A solid refracts at the microfacets of its reflection, tinted by the root of its colour at each passage. A thin sheet
//! scatters what passes about the straight direction, as if it were reflected on the far side, by GGX of a roughness of
//! its own; and diffusely.

use crate::core::color::luminance;
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::disney_layers::{DisneyLayers, SeenLayers};
use crate::shading::interface::{Interface, MediumId};
use crate::shading::microfacets::{Microfacets, SeenMicrofacets};
use crate::shading::rough_glass::{self, RoughGlass};
use crate::shading::scatter::{BsdfSample, Scatter};
use firstlight_kdtree::geometry::Frame;
use firstlight_simd::Vector3;
use glam::{Vec2, Vec3};

/// A surface, with all of its parameters evaluated at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Disney {
    pub layers: DisneyLayers,
    pub through: Option<Through>,
}

/// What passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Through {
    Solid {
        /// Share of light that can pass.
        share: f32,
        /// Colour of one passage.
        tint: Vec3,
        interface: Interface,
        /// Whether the viewer is outside; light inside meets nothing but glass.
        is_front: bool,
    },
    Thin {
        /// Colour of what passes about the straight direction, before the reflection is subtracted, and its GGX.
        clear: Vec3,
        facets: Microfacets,
        /// Colour of what passes diffusely.
        diffuse: Vec3,
        /// Media on both sides.
        here: MediumId,
    },
}

/// A surface seen along one direction.
struct Seen<'a> {
    of: &'a Disney,
    wo: Vec3,
    /// On the side of the viewer.
    normal: Vec3,
    layers: SeenLayers,
    /// Probability of sampling what passes.
    pmf: f32,
}

impl Disney {
    /// Whether light that passes stays in its medium.
    pub fn is_thin(&self) -> bool {
        matches!(self.through, Some(Through::Thin { .. }))
    }

    /// Approximate share of light that is scattered, per channel.
    pub fn albedo(&self) -> Vec3 {
        let passed = match self.through {
            None => Vec3::ZERO,
            Some(Through::Solid { share, tint, .. }) => share * tint,
            Some(Through::Thin { clear, diffuse, .. }) => clear + diffuse,
        };
        (Vec3::from(self.layers.albedo()) + passed).min(Vec3::ONE)
    }

    /// The solid as seen from the other side.
    fn reversed(self) -> Self {
        let through = match self.through {
            Some(Through::Solid { share, tint, interface, is_front }) => {
                Some(Through::Solid { share, tint, interface: interface.reversed(), is_front: !is_front })
            }
            other => other,
        };
        Self { through, ..self }
    }

    /// Microfacets of a solid, if they are rough in the sense of [`rough_glass::is_smooth`].
    fn rough(&self, eta: f32) -> Option<Microfacets> {
        let [x, y] = self.layers.facets.alpha;
        let alpha = if x == y { x } else { (x * y).sqrt() };
        (!rough_glass::is_smooth(alpha, eta)).then(|| Microfacets::isotropic(alpha.min(1.0), false))
    }

    fn seen(&self, wo: Vec3, normal: Vec3) -> Seen<'_> {
        let layers = self.layers.seen(wo.into(), normal.into());
        let kept = 1.0 - self.layers.reflected(normal.dot(wo).clamp(0.0, 1.0));
        let (passed, reflected) = match self.through {
            None => (0.0, layers.strength),
            Some(Through::Solid { share, is_front: false, .. }) => (share, 0.0),
            Some(Through::Solid { share, tint, .. }) => (share * kept * luminance(tint), layers.strength),
            Some(Through::Thin { clear, diffuse, .. }) => {
                (kept * luminance(clear) + luminance(diffuse), layers.strength)
            }
        };
        let pmf = if passed > 0.0 { passed / (passed + reflected) } else { 0.0 };
        Seen { of: self, wo, normal, layers, pmf }
    }
}

impl Seen<'_> {
    fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        let beyond = self.normal.dot(wi) < 0.0;
        match self.of.through {
            Some(Through::Solid { share, tint, interface, is_front }) if beyond || !is_front => {
                let Some(facets) = self.of.rough(interface.eta) else { return (Vec3::ZERO, 0.0) };
                let (value, pdf) = RoughGlass::new(self.normal, self.wo, facets, interface, false).eval(wi);
                (share * value * if beyond { tint } else { Vec3::ONE }, self.pmf * pdf)
            }
            Some(Through::Thin { clear, facets, diffuse, .. }) if beyond => {
                let (value, pdf) = self.eval_sheet(clear, facets, diffuse, wi);
                (value, self.pmf * pdf)
            }
            _ => {
                let (value, pdf) = self.layers.eval(wi.into());
                (value.into(), (1.0 - self.pmf) * pdf)
            }
        }
    }

    /// Probability with which the clear part of a sheet is sampled.
    fn share_of_clear(&self, clear: Vec3, diffuse: Vec3) -> f32 {
        let kept = 1.0 - self.of.layers.reflected(self.normal.dot(self.wo).clamp(0.0, 1.0));
        let [clear, diffuse] = [kept * luminance(clear), luminance(diffuse)];
        if clear + diffuse > 0.0 { clear / (clear + diffuse) } else { 0.0 }
    }

    /// What passes a sheet from a direction on the far side, and the pdf of sampling it there.
    fn eval_sheet(&self, clear: Vec3, facets: Microfacets, diffuse: Vec3, wi: Vec3) -> (Vec3, f32) {
        let seen = SeenMicrofacets::new(facets, self.normal.into(), self.of.layers.tangent, self.wo.into());
        let local = seen.local(wi.into());
        let mirrored = Vector3 { z: -local.z, ..local };
        let (found, cos) = seen.eval(mirrored);
        let cosine = cosine_hemisphere_pdf(-local.z);
        let share = self.share_of_clear(clear, diffuse);
        let mut value = diffuse * cosine;
        // No microfacet lets light pass that meets it from the viewer's side.
        if local.dot(found.half) < 0.0 {
            let shadowing = facets.lambda(mirrored) + 1.0;
            value += clear * ((1.0 - self.of.layers.reflected(cos)) * found.pdf / shadowing);
        }
        (value, share * found.pdf + (1.0 - share) * cosine)
    }

    /// At a surface that is too smooth, or bends light too little, for microfacets to matter.
    fn mirrored_or_refracted(&self, interface: Interface, u: f32) -> BsdfSample {
        let (normal, wo) = (self.normal.into(), self.wo.into());
        let (reflectance, cos_t) = fresnel(self.normal.dot(self.wo).clamp(0.0, 1.0), interface.eta);
        let passes = u >= reflectance;
        let wi = if passes { refract(wo, normal, interface.eta, cos_t) } else { reflect(wo, normal) };
        BsdfSample {
            wi: wi.into(),
            weight: Vec3::splat(if passes { interface.radiance_eta * interface.radiance_eta } else { 1.0 }),
            pdf: f32::INFINITY,
            probability: self.pmf * if passes { 1.0 - reflectance } else { reflectance },
            through: passes.then_some(interface),
        }
    }

    fn sample(&self, u_choice: f32, u: Vec2) -> Option<BsdfSample> {
        let through = self.of.through.filter(|_| u_choice < self.pmf);
        let Some(through) = through else {
            let rest = ((u_choice - self.pmf) / (1.0 - self.pmf)).clamp(0.0, 1.0f32.next_down());
            let mut sampled = self.layers.sample(rest, u.to_array());
            sampled.weight = sampled.weight * (1.0 / (1.0 - self.pmf));
            sampled.pdf *= 1.0 - self.pmf;
            return sampled.reflected();
        };
        let rest = (u_choice / self.pmf).clamp(0.0, 1.0f32.next_down());
        match through {
            Through::Solid { share, tint, interface, is_front } => {
                let found = match self.of.rough(interface.eta) {
                    Some(facets) => {
                        let glass = RoughGlass::new(self.normal, self.wo, facets, interface, false);
                        let found = glass.sample(rest, u)?;
                        let through = found.passes.then_some(interface);
                        BsdfSample {
                            wi: found.wi,
                            weight: Vec3::splat(found.weight),
                            pdf: self.pmf * found.pdf,
                            probability: 1.0,
                            through,
                        }
                    }
                    None => self.mirrored_or_refracted(interface, rest),
                };
                // Outside, the layers reflect.
                (found.through.is_some() || !is_front).then(|| BsdfSample {
                    weight: found.weight * (share / self.pmf) * if found.through.is_some() { tint } else { Vec3::ONE },
                    ..found
                })
            }
            Through::Thin { clear, facets, diffuse, here } => {
                let share = self.share_of_clear(clear, diffuse);
                let wi: Vec3 = if rest < share {
                    let seen = SeenMicrofacets::new(facets, self.normal.into(), self.of.layers.tangent, self.wo.into());
                    let local = seen.sample(u.to_array());
                    (local.z > 0.0).then(|| seen.world(Vector3 { z: -local.z, ..local }).into())?
                } else {
                    Frame::around(-self.normal).to_world(cosine_hemisphere(u))
                };
                let (value, pdf) = self.eval_sheet(clear, facets, diffuse, wi);
                let pdf = self.pmf * pdf;
                (pdf > 0.0 && self.normal.dot(wi) < 0.0).then(|| BsdfSample {
                    wi,
                    weight: value / pdf,
                    pdf,
                    probability: 1.0,
                    through: Some(Interface::thin(here)),
                })
            }
        }
    }
}

impl Scatter for Disney {
    fn has_non_specular(&self) -> bool {
        true
    }

    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        match normal.dot(wo) < 0.0 {
            true if self.through.is_none() => (Vec3::ZERO, 0.0),
            true => self.reversed().seen(wo, -normal).eval(wi),
            false if self.through.is_none() && normal.dot(wi) <= 0.0 => (Vec3::ZERO, 0.0),
            false => self.seen(wo, normal).eval(wi),
        }
    }

    fn through(&self) -> Option<Interface> {
        match self.through? {
            Through::Solid { interface, .. } => self.rough(interface.eta).map(|_| interface),
            Through::Thin { here, .. } => Some(Interface::thin(here)),
        }
    }

    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        self.seen(wo, normal).sample(u_lobe(), u)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    const BASE: Vec3 = Vec3::new(0.6, 0.3, 0.1);

    fn hue() -> Vec3 {
        BASE / luminance(BASE)
    }

    fn ggx(x: f32, y: f32) -> Microfacets {
        Microfacets { alpha: [x, y], beckmann: false }
    }

    /// A layered solid: roughness 0.4, metallic 0.3, anisotropic 0.5, specular 0.7, spec_tint 0.4, sheen 0.8, sheen_tint
    /// 0.5, clearcoat 0.9, clearcoat_gloss 0.3, flatness 0.6.
    pub(crate) fn opaque() -> Disney {
        let (ior, aspect) = (1.620_006_8_f32, 0.55_f32.sqrt());
        let tinted = hue() * ((ior - 1.0) / (ior + 1.0)).powi(2);
        let layers = DisneyLayers {
            diffuse: (0.7 * BASE).into(),
            roughness: 0.4,
            flatness: 0.6,
            sheen: (0.7 * 0.8 * Vec3::ONE.lerp(hue(), 0.5)).into(),
            dielectric: 0.7 * 0.6,
            ior,
            schlick: 0.3 + 0.7 * 0.4,
            facing: (0.3 * BASE + 0.7 * 0.4 * tinted).into(),
            facets: ggx(0.16 / aspect, 0.16 * aspect),
            tangent: Some(Vec3::X.into()),
            coat: 0.25 * 0.9,
            coat_alpha: 0.1 - 0.099 * 0.3,
        };
        Disney { layers, through: None }
    }

    /// Roughness 0.5, eta 1.4, spec_trans 0.6, clearcoat 0.5, sheen 0.5.
    pub(crate) fn solid(is_front: bool) -> Disney {
        let layers = DisneyLayers {
            diffuse: (0.4 * BASE).into(),
            roughness: 0.5,
            flatness: 0.0,
            sheen: Vec3::splat(0.5).into(),
            dielectric: 1.0,
            ior: 1.4,
            schlick: 0.0,
            facing: Vec3::ZERO.into(),
            facets: ggx(0.25, 0.25),
            tangent: None,
            coat: 0.125,
            coat_alpha: 0.1,
        };
        let eta = if is_front { 1.0 / 1.4 } else { 1.4 };
        let interface = Interface { eta, radiance_eta: eta, beyond: MediumId::OUTSIDE };
        Disney { layers, through: Some(Through::Solid { share: 0.6, tint: BASE.powf(0.5), interface, is_front }) }
    }

    /// Roughness 0.5, anisotropic 0.6, eta 1.4, spec_trans 0.4, spec_tint 0.3, diff_trans 1.2, flatness 0.5, sheen 0.7,
    /// sheen_tint 0.3.
    pub(crate) fn sheet() -> Disney {
        let (aspect, narrow) = ((1.0 - 0.9 * 0.6_f32).sqrt(), (0.5_f32 * (0.65 * 1.4 - 0.35)).powi(2));
        let back = 0.6 * 0.4;
        let layers = DisneyLayers {
            diffuse: (back * BASE).into(),
            roughness: 0.5,
            flatness: 0.5,
            sheen: (back * 0.7 * Vec3::ONE.lerp(hue(), 0.3)).into(),
            dielectric: 0.4 * 0.7,
            ior: 1.4,
            schlick: 0.4 * 0.3,
            facing: (0.4 * 0.3 * hue() / 36.0).into(),
            facets: ggx(0.25 / aspect, 0.25 * aspect),
            tangent: Some(Vec3::X.into()),
            coat: 0.0,
            coat_alpha: 0.1,
        };
        let facets = ggx(narrow / aspect, narrow * aspect);
        let (clear, diffuse) = (0.4 * BASE, 0.6 * 0.6 * BASE);
        Disney { layers, through: Some(Through::Thin { clear, facets, diffuse, here: MediumId::OUTSIDE }) }
    }

    #[test]
    fn values_are_those_of_mitsuba() {
        // `principled` and `principledthin` of Mitsuba 3.9.1, `BSDF.eval`, for these directions and their images below.
        let steep = [Vec3::new(0.3, 0.2, 0.9), Vec3::new(-0.4, 0.1, 0.8)];
        let grazing = [Vec3::new(0.9, 0.1, 0.2), Vec3::new(-0.85, -0.2, 0.3)];
        let aside = [Vec3::new(0.6, -0.5, 0.5), Vec3::new(0.7, 0.3, 0.1)];
        let below = |[wo, wi]: [Vec3; 2]| [wo, Vec3 { z: -wi.z, ..wi }];
        let cases = [
            (opaque(), steep, [0.185_042, 0.102_448, 0.047_385_8], 1e-3),
            (opaque(), grazing, [0.406_008, 0.300_417, 0.230_023], 1e-3),
            (opaque(), aside, [0.024_728_8, 0.012_530_2, 0.004_397_77], 1e-3),
            (solid(true), steep, [0.091_262_9, 0.057_309_6, 0.034_674_1], 1e-3),
            (solid(true), grazing, [0.366_34, 0.356_133, 0.349_328], 1e-3),
            // Refraction has Euler's beta function of both Λ, not the product of two maskings.
            (solid(true), below(steep), [0.024_494, 0.017_319_8, 0.009_999_61], 0.02),
            (solid(false), steep, [0.010_425_5; 3], 0.02),
            (sheet(), steep, [0.038_862_1, 0.020_727_4, 0.008_637_5], 1e-3),
            (sheet(), below(steep), [0.084_533_8, 0.042_266_9, 0.014_089], 1e-3),
            (sheet(), grazing, [0.083_201_1, 0.069_79, 0.060_849_2], 1e-3),
            (sheet(), below(grazing), [0.067_365_6, 0.033_682_8, 0.011_227_6], 1e-3),
            (sheet(), aside, [0.008_074_86, 0.004_149_69, 0.001_532_91], 1e-3),
            (sheet(), below(aside), [0.008_951_13, 0.004_475_57, 0.001_491_86], 1e-3),
        ];
        for (i, (surface, [wo, wi], expected, bound)) in cases.into_iter().enumerate() {
            let found = surface.eval(wo.normalize(), wi.normalize(), Vec3::Z).0;
            let off = (found / Vec3::from(expected) - 1.0).abs().max_element();
            assert!(off < bound, "case {i}: {found} for {expected:?}");
        }
        let [wo, wi] = below(grazing).map(Vec3::normalize);
        assert_eq!(opaque().eval(wo, wi, Vec3::Z), (Vec3::ZERO, 0.0));
    }

    #[test]
    fn a_surface_whose_index_is_almost_that_of_air_lets_light_pass_unscattered() {
        let mut surface = solid(true);
        let eta = 1.0 / (1.0 + 1e-5);
        if let Some(Through::Solid { interface, .. }) = &mut surface.through {
            (interface.eta, interface.radiance_eta) = (eta, eta);
        }
        surface.layers.ior = 1.0 + 1e-5;
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let mut passed = Vec3::ZERO;
        let n = 4096;
        for i in 0..n {
            let sampler = crate::sampling::Sampler::new(3, 0, 0, i);
            let Some(sample) = surface.sample(wo, Vec3::Z, || sampler.single(1), sampler.pair(0)) else { continue };
            if sample.wi.z < 0.0 {
                assert!(sample.pdf.is_infinite() && sample.wi.dot(-wo) > 0.9999 && sample.through.is_some());
                passed += sample.weight;
            }
        }
        let expected = 0.6 * (1.0 - fresnel(wo.z, eta).0) * BASE.powf(0.5);
        assert!((passed / n as f32 - expected).abs().max_element() < 0.02, "{passed} {expected}");
    }
}
