//! BSDFs of single lobes.

use crate::core::color::luminance;
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::disney::Disney;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::metal::Metal;
use crate::shading::microfacets::Microfacets;
use crate::shading::plastic::Plastic;
use crate::shading::rough_glass::{RoughGlass, RoughGlassSample};
use crate::shading::scatter::{BsdfSample, Scatter};
use crate::shading::translucent::Translucent;
use firstlight_kdtree::geometry::Frame;
use glam::{Vec2, Vec3};

/// A lobe, with all of its parameters evaluated at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Lobe<'a> {
    Diffuse {
        albedo: Vec3,
    },
    Mirror {
        reflectance: Vec3,
    },
    Metal(Metal),
    Plastic(Plastic<'a>),
    Disney(Disney),
    /// With the media on both sides.
    Translucent(Translucent, MediumId),
    /// A pane without thickness.
    ThinGlass {
        ior: f32,
        reflectance: Vec3,
        transmittance: Vec3,
        /// Media on both sides.
        here: MediumId,
    },
    Glass(Interface),
    /// Rough in the sense of [`crate::shading::rough_glass::is_smooth`].
    RoughGlass {
        interface: Interface,
        /// Isotropic.
        facets: Microfacets,
        compensate: bool,
    },
}

impl Lobe<'_> {
    /// A placeholder for a transmissive lobe that is distinguished from others but never sampled.
    pub const CLEAR: Self = Self::Glass(Interface { eta: 1.0, radiance_eta: 1.0, beyond: MediumId::OUTSIDE });

    /// Approximate reflected or transmitted share of light, per channel, 0..1.
    pub fn albedo(&self) -> Vec3 {
        match *self {
            Self::Diffuse { albedo } => albedo,
            Self::Mirror { reflectance } => reflectance,
            Self::Metal(metal) => metal.tint.at(1.0).into(),
            Self::Plastic(plastic) => plastic.albedo().into(),
            Self::Disney(disney) => disney.albedo(),
            Self::Translucent(translucent, _) => translucent.albedo().into(),
            Self::ThinGlass { transmittance, .. } => transmittance,
            Self::Glass(_) | Self::RoughGlass { .. } => Vec3::ONE,
        }
    }

    /// The same of all channels together.
    pub fn albedo_estimate(&self) -> f32 {
        match self {
            Self::Glass(_) | Self::RoughGlass { .. } => 1.0,
            _ => luminance(self.albedo()),
        }
    }

    /// Whether [`Scatter::through`] leads into the medium of the path itself, as it does for all such parts of a blend.
    pub fn is_thin(&self) -> bool {
        match self {
            Self::Translucent(..) => true,
            Self::Disney(disney) => disney.is_thin(),
            _ => false,
        }
    }
}

impl Scatter for Lobe<'_> {
    #[inline]
    fn has_non_specular(&self) -> bool {
        match self {
            Self::Diffuse { .. } | Self::RoughGlass { .. } | Self::Translucent(..) | Self::Disney(_) => true,
            Self::Metal(metal) => !metal.facets.is_smooth(),
            Self::Plastic(plastic) => plastic.non_specular(),
            Self::Mirror { .. } | Self::Glass(_) | Self::ThinGlass { .. } => false,
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        if let Self::RoughGlass { interface, facets, compensate } = *self {
            let (normal, interface) =
                if normal.dot(wo) < 0.0 { (-normal, interface.reversed()) } else { (normal, interface) };
            let (value, pdf) = RoughGlass::new(normal, wo, facets, interface, compensate).eval(wi);
            return (Vec3::splat(value), pdf);
        }
        if let Self::Disney(disney) = self {
            return disney.eval(wo, wi, normal);
        }
        let cos = normal.dot(wi);
        if let Self::Translucent(translucent, _) = self {
            let (value, pdf) = translucent.eval(normal.dot(wo), cos);
            return (value.into(), pdf);
        }
        if cos <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (value, pdf) = match *self {
            Self::Metal(metal) => metal.seen(wo.into(), normal.into()).eval(wi.into()),
            Self::Plastic(plastic) => plastic.seen(wo.into(), normal.into()).eval(wi.into()),
            Self::Diffuse { albedo } => {
                let pdf = cosine_hemisphere_pdf(cos);
                return (albedo * pdf, pdf);
            }
            _ => return (Vec3::ZERO, 0.0),
        };
        (value.into(), pdf)
    }

    #[inline]
    fn through(&self) -> Option<Interface> {
        match self {
            Self::RoughGlass { interface, .. } => Some(*interface),
            Self::Translucent(_, here) => Some(Interface::thin(*here)),
            Self::Disney(disney) => disney.through(),
            _ => None,
        }
    }

    #[inline]
    fn straight(&self, wo: Vec3, normal: Vec3) -> Vec3 {
        match *self {
            Self::ThinGlass { ior, transmittance, .. } => (1.0 - pane_reflectance(normal.dot(wo), ior)) * transmittance,
            _ => Vec3::ZERO,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, normal: Vec3, u_choice: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        let specular =
            |probability, wi, weight, through| BsdfSample { wi, weight, pdf: f32::INFINITY, probability, through };
        match *self {
            Self::Diffuse { albedo } => {
                let local = cosine_hemisphere(u);
                let wi = Frame::around(normal).to_world(local);
                (local.z > 0.0).then(|| BsdfSample {
                    wi,
                    weight: albedo,
                    pdf: cosine_hemisphere_pdf(local.z),
                    probability: 1.0,
                    through: None,
                })
            }
            Self::Mirror { reflectance } => Some(specular(1.0, mirrored(wo, normal), reflectance, None)),
            Self::Metal(metal) => metal.seen(wo.into(), normal.into()).sample(u.to_array()).reflected(),
            Self::Plastic(plastic) => {
                plastic.seen(wo.into(), normal.into()).sample(u_choice(), u.to_array()).reflected()
            }
            Self::Disney(disney) => disney.sample(wo, normal, u_choice, u),
            Self::RoughGlass { interface, facets, compensate } => {
                let surface = RoughGlass::new(normal, wo, facets, interface, compensate);
                surface.sample(u_choice(), u).map(|RoughGlassSample { wi, weight, pdf, passes }| BsdfSample {
                    wi,
                    weight: Vec3::splat(weight),
                    pdf,
                    probability: 1.0,
                    through: passes.then_some(interface),
                })
            }
            Self::Translucent(translucent, here) => {
                let (sampled, passes) = translucent.sample(normal.into(), u_choice(), u.to_array());
                let through = passes.then(|| Interface::thin(here));
                sampled.reflected().map(|sample| BsdfSample { through, ..sample })
            }
            Self::ThinGlass { ior, reflectance, here, .. } => {
                let (back, on) = (pane_reflectance(normal.dot(wo), ior) * reflectance, self.straight(wo, normal));
                let pmf = luminance(back) / luminance(back + on);
                if u_choice() < pmf {
                    Some(specular(pmf, mirrored(wo, normal), back / pmf, None))
                } else if pmf < 1.0 {
                    Some(specular(1.0 - pmf, -wo, on / (1.0 - pmf), Some(Interface::thin(here))))
                } else {
                    None
                }
            }
            Self::Glass(interface) => {
                let Interface { eta, radiance_eta, .. } = interface;
                let (reflectance, cos_t) = fresnel(normal.dot(wo).clamp(0.0, 1.0), eta);
                if u_choice() < reflectance {
                    // The weight f·cos/pdf is reflectance over the probability of reflection: one.
                    Some(specular(reflectance, mirrored(wo, normal), Vec3::ONE, None))
                } else {
                    // Radiance scales with n² across the interface: the factor η².
                    let wi = refract(wo.into(), normal.into(), eta, cos_t).into();
                    Some(specular(1.0 - reflectance, wi, Vec3::splat(radiance_eta * radiance_eta), Some(interface)))
                }
            }
        }
    }
}

/// Share of light that a pane reflects: R + T² R + T² R³ + …, by light that goes to and fro inside.
#[inline]
fn pane_reflectance(cos: f32, ior: f32) -> f32 {
    let once = fresnel(cos.clamp(0.0, 1.0), 1.0 / ior).0;
    2.0 * once / (1.0 + once)
}

#[inline]
fn mirrored(wo: Vec3, normal: Vec3) -> Vec3 {
    reflect(wo.into(), normal.into()).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::shading::disney::tests::{opaque, sheet, solid};
    use crate::shading::metal::Tint;
    use crate::shading::surface::blend::Blend;

    fn metal(alpha: f32, compensate: bool) -> Lobe<'static> {
        let tint = Tint { color: Vec3::ONE.into(), schlick: false, index: None };
        Lobe::Metal(Metal { facets: Microfacets::ggx(alpha), tangent: None, tint, compensate })
    }

    /// Gold.
    fn gold(facets: Microfacets, compensate: bool) -> Lobe<'static> {
        let index = [Vec3::new(0.143, 0.375, 1.442).into(), Vec3::new(3.983, 2.386, 1.603).into()];
        let tint = Tint { color: Vec3::new(1.0, 0.9, 0.8).into(), schlick: false, index: Some(index) };
        Lobe::Metal(Metal { facets, tangent: Some(Vec3::X.into()), tint, compensate })
    }

    fn conductor_of(alpha: f32, compensate: bool) -> Lobe<'static> {
        gold(Microfacets::ggx(alpha), compensate)
    }

    const BECKMANN: Microfacets = Microfacets { alpha: [0.4; 2], beckmann: true };

    /// Gold with microfacets of Beckmann of two widths.
    fn anisotropic() -> Lobe<'static> {
        gold(Microfacets { alpha: [0.5, 0.2], beckmann: true }, false)
    }

    fn leaf(reflectance: Vec3, transmittance: Vec3) -> Lobe<'static> {
        Lobe::Translucent(Translucent::new(reflectance.into(), transmittance.into()), MediumId::OUTSIDE)
    }

    fn direction(cos: f32) -> Vec3 {
        Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    /// Reflected share of light in a white furnace.
    fn furnace(bsdf: &impl Scatter, cos: f32) -> Vec3 {
        let n = 1 << 14;
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(5, 0, 0, i);
            if let Some(s) = bsdf.sample(direction(cos), Vec3::Z, || sampler.single(1), sampler.pair(0)) {
                sum += s.weight;
            }
        }
        sum / n as f32
    }

    #[test]
    fn white_furnace_loses_nothing_and_makes_nothing() {
        for cos in [1.0, 0.7, 0.3, 0.05, 1e-3] {
            for lobe in [Lobe::Diffuse { albedo: Vec3::ONE }, Lobe::Mirror { reflectance: Vec3::ONE }] {
                assert!((furnace(&lobe, cos) - Vec3::ONE).length() < 1e-4, "{lobe:?} at {cos}");
            }
            for alpha in [0.001, 0.05, 0.3, 0.6, 1.0] {
                let plain = furnace(&metal(alpha, false), cos).x;
                assert!(plain <= 1.0 + 1e-4, "α {alpha}, cos {cos}: {plain}");
            }
        }
    }

    #[test]
    fn compensation_returns_what_single_scattering_lost() {
        for cos in [1.0, 0.7, 0.3, 0.1, 0.03, 0.01] {
            for alpha in [1e-3, 0.01, 0.03, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 1.0] {
                let whole = furnace(&metal(alpha, true), cos).x;
                assert!((whole - 1.0).abs() < 1e-3, "α {alpha}, cos {cos}: {whole}");
            }
        }
    }

    #[test]
    fn sampling_and_evaluation_give_the_same_mean() {
        let coat = [(Lobe::Diffuse { albedo: Vec3::new(0.8, 0.4, 0.1) }, 0.7), (metal(0.2, false), 0.3)];
        same_mean(0, &Lobe::Diffuse { albedo: Vec3::splat(0.6) });
        same_mean(1, &metal(0.4, false));
        same_mean(4, &conductor_of(0.3, false));
        same_mean(5, &conductor_of(0.7, true));
        same_mean(8, &anisotropic());
        let (interface, facets) = (Interface { eta: 1.5, radiance_eta: 1.5, beyond: MediumId::OUTSIDE }, BECKMANN);
        same_mean(9, &Lobe::RoughGlass { interface, facets, compensate: false });
        let disneys = [opaque(), solid(true), solid(false), sheet()];
        (10..).zip(disneys).for_each(|(case, disney)| same_mean(case, &Lobe::Disney(disney)));
        let leaf = leaf(Vec3::new(0.1, 0.4, 0.1), Vec3::new(0.3, 0.5, 0.05));
        same_mean(6, &leaf);
        same_mean(7, &blend(&[(leaf, 0.8), (metal(0.3, false), 0.2)]));
        same_mean(2, &blend(&coat));
        same_mean(3, &blend(&coat[..1]));
    }

    fn blend<'a>(parts: &[(Lobe<'a>, f32)]) -> Blend<'a> {
        let mut blend = Blend::default();
        parts.iter().for_each(|&(lobe, weight)| blend.push(lobe, weight));
        blend.finish(None);
        blend
    }

    fn same_mean(case: u32, bsdf: &impl Scatter) {
        for cos in [0.9, 0.4, 0.1] {
            let wo = direction(cos);
            // ∫ f cos · L for a non-uniform L over the sphere, by uniform directions and by sampling.
            let light = |w: Vec3| 1.0 + w.x + 0.5 * w.y * w.y + if w.z < 0.0 { 2.0 } else { 0.0 };
            let n = 1 << 16;
            let (mut even, mut sampled, mut pdf_integral) = (Vec3::ZERO, Vec3::ZERO, 0.0);
            for i in 0..n {
                let sampler = Sampler::new(11, case, 0, i);
                let u = sampler.pair(0);
                let (r, phi) = ((1.0 - u.x * u.x).sqrt(), std::f32::consts::TAU * u.y);
                for z in [u.x, -u.x] {
                    let wi = Vec3::new(r * phi.cos(), r * phi.sin(), z);
                    let (value, pdf) = bsdf.eval(wo, wi, Vec3::Z);
                    even += value * light(wi) * std::f32::consts::TAU;
                    pdf_integral += pdf * std::f32::consts::TAU;
                }
                if let Some(s) = bsdf.sample(wo, Vec3::Z, || sampler.single(2), sampler.pair(1)) {
                    sampled += s.weight * light(s.wi);
                    assert_eq!(s.through.is_some(), s.wi.z < 0.0, "case {case}, {cos}");
                    let (value, pdf) = bsdf.eval(wo, s.wi, Vec3::Z);
                    assert!((value / pdf - s.weight).length() < 2e-3 * s.weight.length());
                    assert!((pdf - s.pdf).abs() < 2e-3 * pdf);
                }
            }
            let (even, sampled) = (even / n as f32, sampled / n as f32);
            assert!((even - sampled).length() < 0.02 * even.length(), "case {case}, {cos}: {even} {sampled}");
            assert!(pdf_integral / n as f32 <= 1.01, "case {case}: pdf integrates to more than one");
        }
    }

    #[test]
    fn reflection_is_reciprocal() {
        let (a, b) = (direction(0.8), Vec3::new(-0.3, 0.5, 0.6).normalize());
        let lobes = [
            Lobe::Diffuse { albedo: Vec3::splat(0.6) },
            metal(0.3, false),
            conductor_of(0.3, false),
            anisotropic(),
            leaf(Vec3::splat(0.3), Vec3::splat(0.6)),
            Lobe::Disney(opaque()),
            Lobe::Disney(sheet()),
        ];
        for lobe in lobes {
            let forth = lobe.eval(a, b, Vec3::Z).0 / b.z;
            let back = lobe.eval(b, a, Vec3::Z).0 / a.z;
            assert!((forth - back).length() < 1e-4 * forth.length());
        }
        // Through a leaf, seen from both sides.
        let leaf = lobes[4];
        let (forth, back) = (leaf.eval(a, -b, Vec3::Z).0 / b.z, leaf.eval(-b, a, Vec3::Z).0 / a.z);
        assert!(forth.x > 0.1 && (forth - back).length() < 1e-6, "{forth} {back}");
    }

    #[test]
    fn white_conductors_and_leaves_return_all_light() {
        let white = |alpha, compensate| {
            let tint =
                Tint { color: Vec3::ONE.into(), schlick: false, index: Some([Vec3::ZERO.into(), Vec3::ONE.into()]) };
            Lobe::Metal(Metal { facets: Microfacets::ggx(alpha), tangent: None, tint, compensate })
        };
        for cos in [1.0, 0.5, 0.1] {
            for (lobe, tolerance) in [
                (white(0.0, false), 1e-5),
                (white(0.4, true), 1e-3),
                (white(1.0, true), 1e-3),
                (leaf(Vec3::splat(0.25), Vec3::splat(0.75)), 1e-4),
            ] {
                let found = furnace(&lobe, cos);
                assert!((found - Vec3::ONE).abs().max_element() < tolerance, "{lobe:?}, cos {cos}: {found}");
            }
            assert!(furnace(&white(1.0, false), cos).x < 0.8);
            assert!(furnace(&conductor_of(0.3, true), cos).max_element() <= 1.0);
        }
    }

    #[test]
    fn a_pane_reflects_twice_r_over_one_plus_r_and_passes_the_rest_straight() {
        for ior in [1.0f32, 1.33, 1.5, 2.4] {
            for cos in [1.0, 0.6, 0.2, 1e-3] {
                let tint = Vec3::new(0.9, 0.5, 0.2);
                let here = MediumId(4);
                let pane = Lobe::ThinGlass { ior, reflectance: Vec3::ONE, transmittance: tint, here };
                // Light between the two sides, summed bounce by bounce.
                let once = f64::from(fresnel(cos, 1.0 / ior).0);
                let (mut back, mut on, mut inside) = (once, 0.0, 1.0 - once);
                for bounce in 0..100_000 {
                    *(if bounce % 2 == 0 { &mut on } else { &mut back }) += inside * (1.0 - once);
                    inside *= once;
                }
                let (mut reflected, mut passed) = (Vec3::ZERO, Vec3::ZERO);
                let n = 1000;
                for i in 0..n {
                    let u = (i as f32 + 0.5) / n as f32;
                    let Some(s) = pane.sample(direction(cos), Vec3::Z, || u, Vec2::ZERO) else { continue };
                    match s.through {
                        Some(interface) => {
                            assert_eq!((s.wi, interface), (-direction(cos), Interface::thin(here)));
                            passed += s.weight / n as f32;
                        }
                        None => reflected += s.weight / n as f32,
                    }
                }
                let close = |found: f32, expected: f64| (f64::from(found) - expected).abs() < 3.0 / f64::from(n);
                assert!(close(reflected.x, back) && close(reflected.z, back), "{ior}, {cos}: {reflected} for {back}");
                assert!((passed / tint - Vec3::splat(on as f32)).abs().max_element() < 0.02, "{ior}, {cos}: {passed}");
            }
        }
    }

    #[test]
    fn glass_splits_all_light_and_nothing_more() {
        for eta in [1.0 / 1.5, 1.5, 1.0, 1.0 / 1.000_001] {
            for cos in [1.0, 0.6, 0.2, 1e-3] {
                let bsdf = Lobe::Glass(Interface { eta, radiance_eta: eta, beyond: MediumId::OUTSIDE });
                let (reflectance, _) = fresnel(cos, eta);
                let n = 1000;
                let reflected = (0..n)
                    .filter(|i| {
                        let u = (*i as f32 + 0.5) / n as f32;
                        let s = bsdf.sample(direction(cos), Vec3::Z, || u, Vec2::ZERO).unwrap();
                        assert_eq!(s.through.is_some(), s.wi.z < 0.0);
                        assert_eq!(s.weight, Vec3::splat(if s.through.is_some() { eta * eta } else { 1.0 }));
                        s.through.is_none()
                    })
                    .count();
                assert!((reflected as f32 / n as f32 - reflectance).abs() < 2.0 / n as f32);
            }
        }
    }
}
