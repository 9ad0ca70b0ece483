//! BSDFs of single lobes.

use crate::core::color::luminance;
use crate::core::material::{Fresnel, SMALLEST_ALPHA};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::ggx;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::metal::{Metal, schlick};
use crate::shading::rough_glass::{RoughGlass, RoughGlassSample};
use crate::shading::scatter::{BsdfSample, Scatter};
use firstlight_kdtree::geometry::Frame;
use firstlight_simd::{Vector3, frame_around};
use glam::{Vec2, Vec3};

/// A lobe, with all of its parameters evaluated at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Lobe {
    Diffuse {
        albedo: Vec3,
    },
    Mirror {
        reflectance: Vec3,
    },
    Metal {
        alpha: f32,
        reflectance: Vec3,
        fresnel: Fresnel,
        compensate: bool,
    },
    Glass(Interface),
    /// Rough in the sense of [`crate::shading::rough_glass::is_smooth`].
    RoughGlass {
        interface: Interface,
        alpha: f32,
        compensate: bool,
    },
}

impl Lobe {
    /// A placeholder for a transmissive lobe that is distinguished from others but never sampled.
    pub const CLEAR: Self = Self::Glass(Interface { eta: 1.0, radiance_eta: 1.0, beyond: MediumId::OUTSIDE });
}

impl Lobe {
    /// Approximate reflected or transmitted share of light, 0..1.
    pub fn albedo_estimate(&self) -> f32 {
        match self {
            Self::Diffuse { albedo } => luminance(*albedo),
            Self::Mirror { reflectance } | Self::Metal { reflectance, .. } => luminance(*reflectance),
            Self::Glass(_) | Self::RoughGlass { .. } => 1.0,
        }
    }
}

impl Scatter for Lobe {
    #[inline]
    fn has_non_specular(&self) -> bool {
        match self {
            Self::Diffuse { .. } | Self::RoughGlass { .. } => true,
            Self::Metal { alpha, .. } => *alpha >= SMALLEST_ALPHA,
            Self::Mirror { .. } | Self::Glass(_) => false,
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        if let Self::RoughGlass { interface, alpha, compensate } = *self {
            let (normal, interface) =
                if normal.dot(wo) < 0.0 { (-normal, interface.reversed()) } else { (normal, interface) };
            let (value, pdf) = RoughGlass::new(normal, wo, alpha, interface, compensate).eval(wi);
            return (Vec3::splat(value), pdf);
        }
        let cos = normal.dot(wi);
        if cos <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        match *self {
            Self::Diffuse { albedo } => {
                let pdf = cosine_hemisphere_pdf(cos);
                (albedo * pdf, pdf)
            }
            Self::Metal { alpha, reflectance, fresnel, compensate } if alpha >= SMALLEST_ALPHA => {
                let metal = metal_at(normal, wo, alpha, reflectance, fresnel, compensate);
                if !metal.facing() {
                    return (Vec3::ZERO, 0.0);
                }
                let found = metal.eval(metal.local(wi.into()));
                (Vec3::from(found.tint) * found.value, found.pdf)
            }
            _ => (Vec3::ZERO, 0.0),
        }
    }

    #[inline]
    fn through(&self) -> Option<Interface> {
        match self {
            Self::RoughGlass { interface, .. } => Some(*interface),
            _ => None,
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
            Self::Metal { alpha, reflectance, fresnel, .. } if alpha < SMALLEST_ALPHA => {
                let tint = fresnel.reflectance(reflectance, normal.dot(wo));
                Some(specular(1.0, mirrored(wo, normal), tint, None))
            }
            Self::Metal { alpha, reflectance, fresnel, compensate } => {
                let metal = metal_at(normal, wo, alpha, reflectance, fresnel, compensate);
                if !metal.facing() {
                    return None;
                }
                let [wi, local] = metal.sample(u.to_array());
                // Below the surface: light that a second bounce would have returned.
                if local.z <= 0.0 {
                    return None;
                }
                let found = metal.eval(local);
                let weight = Vec3::from(found.tint) * found.weight;
                Some(BsdfSample { wi: wi.into(), weight, pdf: found.pdf, probability: 1.0, through: None })
            }
            Self::RoughGlass { interface, alpha, compensate } => {
                let surface = RoughGlass::new(normal, wo, alpha, interface, compensate);
                surface.sample(u_choice(), u).map(|RoughGlassSample { wi, weight, pdf, passes }| BsdfSample {
                    wi,
                    weight: Vec3::splat(weight),
                    pdf,
                    probability: 1.0,
                    through: passes.then_some(interface),
                })
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

impl Fresnel {
    #[inline]
    pub(crate) fn reflectance(self, facing: Vec3, cos: f32) -> Vec3 {
        match self {
            Self::Constant => facing,
            Self::Schlick => schlick(facing.into(), cos).into(),
        }
    }
}

#[inline]
fn metal_at(normal: Vec3, wo: Vec3, alpha: f32, reflectance: Vec3, fresnel: Fresnel, compensate: bool) -> Metal<f32> {
    let axes = frame_around(normal.into());
    let wo = Vector3::from(wo).to_local(&axes);
    let lost = if compensate { ggx::lost_over_returned(wo.z, alpha) } else { 0.0 };
    Metal::new(axes, wo, alpha, reflectance.into(), fresnel == Fresnel::Schlick, lost)
}

#[inline]
fn mirrored(wo: Vec3, normal: Vec3) -> Vec3 {
    reflect(wo.into(), normal.into()).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::shading::surface::blend::{Blend, Part};

    fn metal(alpha: f32, compensate: bool) -> Lobe {
        Lobe::Metal { alpha, reflectance: Vec3::ONE, fresnel: Fresnel::Constant, compensate }
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
        let coat = coat.map(|(lobe, weight)| (Part::Lobe(lobe), weight));
        same_mean(2, &Blend::new(&coat, Vec::new()));
        same_mean(3, &Blend::new(&coat[..1], Vec::new()));
    }

    fn same_mean(case: u32, bsdf: &impl Scatter) {
        for cos in [0.9, 0.4, 0.1] {
            let wo = direction(cos);
            // ∫ f cos · L for a non-uniform L, by uniform directions and by sampling.
            let light = |w: Vec3| 1.0 + w.x + 0.5 * w.y * w.y;
            let n = 1 << 16;
            let (mut even, mut sampled, mut pdf_integral) = (Vec3::ZERO, Vec3::ZERO, 0.0);
            for i in 0..n {
                let sampler = Sampler::new(11, case, 0, i);
                let u = sampler.pair(0);
                let (r, phi) = ((1.0 - u.x * u.x).sqrt(), std::f32::consts::TAU * u.y);
                let wi = Vec3::new(r * phi.cos(), r * phi.sin(), u.x);
                let (value, pdf) = bsdf.eval(wo, wi, Vec3::Z);
                even += value * light(wi) * std::f32::consts::TAU;
                pdf_integral += pdf * std::f32::consts::TAU;
                if let Some(s) = bsdf.sample(wo, Vec3::Z, || sampler.single(2), sampler.pair(1)) {
                    sampled += s.weight * light(s.wi);
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
        for lobe in [Lobe::Diffuse { albedo: Vec3::splat(0.6) }, metal(0.3, false)] {
            let forth = lobe.eval(a, b, Vec3::Z).0 / b.z;
            let back = lobe.eval(b, a, Vec3::Z).0 / a.z;
            assert!((forth - back).length() < 1e-4 * forth.length());
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
