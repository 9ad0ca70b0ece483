//! A diffuse base under a dielectric coat.
//!
//! The coat reflects by the exact Fresnel term, at microfacets if it is rough. What it transmits, T(θ), is scattered
//! by the base, and comes out of the coat again or is reflected back to the base, any number of times:
//!
//! f = F D G / (4 cos θₒ cos θᵢ) + ρ / (1 − ρ R) · T(θₒ) T(θᵢ) / (π n²)
//!
//! where ρ is the albedo of the base and R the share of uniform light that the coat reflects inwards (Jakob, "Mitsuba",
//! plugins `plastic` and `roughplastic`; the geometric series is that of Kubelka). A smooth white one returns all light:
//! 1 − T̄ = 1 − n² (1 − R). A rough one loses what its microfacets lose in single scattering.

use crate::core::color::luminance;
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::coat::Coat;
use crate::shading::dielectric::reflect;
use crate::shading::microfacets::SeenMicrofacets;
use crate::shading::scatter::BsdfSample;
use firstlight_simd::{Vector3, frame_around};
use glam::{Vec2, Vec3};

/// Its parameters at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plastic<'a> {
    /// ρ / (1 − ρ R) / n², see the [module](self).
    base: Vec3,
    /// Strength of the reflection of the coat.
    specular: f32,
    coat: Coat<'a>,
}

impl<'a> Plastic<'a> {
    /// - `albedo`: of the base; `nonlinear`: ρ in the denominator, otherwise 1.
    pub fn new(albedo: Vec3, nonlinear: bool, specular: f32, coat: Coat<'a>) -> Self {
        let inwards = coat.reflected_inwards();
        let again = if nonlinear { albedo * inwards } else { Vec3::splat(inwards) };
        Self { base: albedo / ((1.0 - again) * coat.ior * coat.ior), specular, coat }
    }

    pub fn has_non_specular(&self) -> bool {
        self.base != Vec3::ZERO || !self.coat.is_smooth()
    }

    /// Approximate reflected share of light.
    pub fn albedo(&self) -> Vec3 {
        self.base * self.coat.mean_passed().powi(2) + Vec3::splat(self.specular * self.coat.reflected(1.0))
    }

    /// Probability of sampling the coat.
    fn pmf(&self, passed: f32) -> f32 {
        let coat = self.specular * (1.0 - passed);
        let base = luminance(self.base) * passed * self.coat.mean_passed();
        if coat + base > 0.0 { coat / (coat + base) } else { 0.5 }
    }

    fn microfacets(&self, normal: Vec3, wo: Vec3) -> Option<SeenMicrofacets> {
        SeenMicrofacets::new(self.coat.facets, normal, normal, wo)
    }

    /// f · cos and pdf of all that is not specular; `normal`: unit, on the side of `wo` and of `wi`.
    pub fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        let (cos_o, cos_i) = (normal.dot(wo), normal.dot(wi));
        if cos_o <= 0.0 || cos_i <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let passed = self.coat.passed(cos_o);
        let pmf = self.pmf(passed);
        let cosine = cosine_hemisphere_pdf(cos_i);
        let mut value = self.base * (cosine * passed * self.coat.passed(cos_i));
        let mut pdf = (1.0 - pmf) * cosine;
        if !self.coat.is_smooth()
            && pmf > 0.0
            && let Some(facets) = self.microfacets(normal, wo)
        {
            let (found, cos) = facets.eval(facets.local(wi));
            value += Vec3::splat(self.specular * self.coat.reflected(cos) * found.value);
            pdf += pmf * found.pdf;
        }
        (value, pdf)
    }

    /// - `u_choice`: selects coat or base; `u`: the direction.
    pub fn sample(&self, wo: Vec3, normal: Vec3, u_choice: f32, u: Vec2) -> Option<BsdfSample> {
        let cos_o = normal.dot(wo);
        if cos_o <= 0.0 {
            return None;
        }
        let pmf = self.pmf(self.coat.passed(cos_o));
        let wi = if u_choice >= pmf {
            Vector3::from(cosine_hemisphere(u)).to_world(&frame_around(normal.into())).normalize()
        } else if self.coat.is_smooth() {
            let wi = reflect(wo.into(), normal.into()).into();
            let weight = Vec3::splat(self.specular * self.coat.reflected(cos_o) / pmf);
            return Some(BsdfSample { wi, weight, pdf: f32::INFINITY, probability: pmf, through: None });
        } else {
            self.microfacets(normal, wo)?.sample(u)[0]
        };
        let wi = wi.into();
        let (value, pdf) = self.eval(wo, wi, normal);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: value / pdf, pdf, probability: 1.0, through: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::ScalarInput;
    use crate::sampling::Sampler;
    use crate::shading::coat::rows;
    use crate::shading::interface::{Interface, MediumId};
    use crate::shading::microfacets::Microfacets;
    use crate::shading::rough_glass::RoughGlass;
    use crate::test_statistics::ChiSquared;
    use std::f64::consts::TAU;

    fn direction(cos: f32) -> Vec3 {
        Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    /// Reflected share of uniform light, by sampling.
    fn furnace(plastic: &Plastic, cos: f32, n: u32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(5, 0, 0, i);
            if let Some(s) = plastic.sample(direction(cos), Vec3::Z, sampler.single(1), sampler.pair(0)) {
                sum += s.weight;
            }
        }
        sum / n as f32
    }

    #[test]
    fn a_smooth_white_one_returns_all_light_and_none_returns_more() {
        for ior in [1.05, 1.33, 1.5, 2.0] {
            for alpha in [0.0, 0.05, 0.2, 0.5, 1.0] {
                let rows = rows(ior, alpha.into(), false);
                let coat = Coat::new(ior, Microfacets::ggx(alpha), &rows);
                let plastic = Plastic::new(Vec3::ONE, true, 1.0, coat);
                for cos in [1.0, 0.7, 0.3, 0.05] {
                    let found = furnace(&plastic, cos, 1 << 14).x;
                    let least = if alpha == 0.0 { 0.998 } else { 0.0 };
                    assert!((least..1.003).contains(&found), "n {ior}, α {alpha}, cos {cos}: {found}");
                }
            }
        }
    }

    /// A random walk between coat and base: a smooth or rough dielectric, single scattering at each meeting, over a
    /// Lambertian base, without an absorbing medium in between.
    fn walked(albedo: Vec3, ior: f32, alpha: f32, cos: f32) -> Vec3 {
        let n = 200_000;
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(i, 1, 0, 3);
            let (mut throughput, mut wo, mut eta) = (Vec3::ONE, direction(cos), 1.0 / ior);
            for k in 0..200 {
                let (u, choice) = (sampler.pair(3 * k), sampler.single(3 * k + 1));
                // Seen from outside first, then from the base, whose light travels upwards.
                let passes = if alpha == 0.0 {
                    choice >= crate::shading::dielectric::fresnel(wo.z, eta).0
                } else {
                    let interface = Interface { eta, radiance_eta: 1.0, beyond: MediumId::OUTSIDE };
                    let glass = RoughGlass::new(Vec3::Z, wo, Microfacets::ggx(alpha), interface, false);
                    let Some(sample) = glass.sample(choice, u) else { break };
                    throughput *= sample.weight;
                    sample.passes
                };
                if passes != (k == 0) {
                    sum += throughput;
                    break;
                }
                // From the base, in a random direction.
                throughput *= albedo;
                wo = cosine_hemisphere(sampler.pair(3 * k + 2));
                eta = ior;
            }
        }
        sum / n as f32
    }

    #[test]
    fn random_walks_between_coat_and_base_return_as_much() {
        let albedo = Vec3::new(0.9, 0.5, 0.1);
        for (ior, alpha) in [(1.5, 0.0), (1.33, 0.0), (1.5, 0.1), (1.5, 0.4), (1.8, 0.25)] {
            for textured in [false, true] {
                let input = if textured { ScalarInput::Texture(0) } else { alpha.into() };
                let rows = rows(ior, input, false);
                let plastic = Plastic::new(albedo, true, 1.0, Coat::new(ior, Microfacets::ggx(alpha), &rows));
                for cos in [0.95, 0.5, 0.15] {
                    let (found, expected) = (furnace(&plastic, cos, 1 << 16), walked(albedo, ior, alpha, cos));
                    let off = (found - expected).abs().max_element();
                    // A rough coat lets light in at all angles, but the walk leaves by the angle at which it came.
                    assert!(off < 6e-3, "n {ior}, α {alpha}, cos {cos}: {found} for {expected}");
                }
            }
        }
    }

    #[test]
    fn the_linear_one_is_lighter_and_less_saturated() {
        let rows = rows(1.5, 0.0.into(), false);
        let coat = Coat::new(1.5, Microfacets::ggx(0.0), &rows);
        // The share of uniform light that a surface of index 1.5 reflects inwards, as tables have it.
        assert!((coat.reflected_inwards() - 0.5963).abs() < 2e-4, "{}", coat.reflected_inwards());
        let albedo = Vec3::new(0.8, 0.4, 0.1);
        let [a, b] = [true, false].map(|nonlinear| Plastic::new(albedo, nonlinear, 0.0, coat));
        let ratio = a.base / b.base;
        let expected = (1.0 - 0.5963) / (1.0 - 0.5963 * albedo);
        assert!((ratio - expected).abs().max_element() < 1e-3, "{ratio} for {expected}");
    }

    #[test]
    fn sampled_directions_follow_their_pdf_and_light_goes_both_ways_alike() {
        let (rings, sectors, fine, n) = (12, 24, 16, 100_000);
        // Significance 1 % over all nine cases (Šidák: 3.1 σ).
        for (case, alpha) in (0..).zip([0.1, 0.3, 1.0]) {
            let rows = rows(1.5, alpha.into(), false);
            let plastic =
                Plastic::new(Vec3::new(0.6, 0.3, 0.1), true, 0.8, Coat::new(1.5, Microfacets::ggx(alpha), &rows));
            for (view, cos) in (0..).zip([0.9, 0.5, 0.2]) {
                let wo = direction(cos);
                let bin = |w: Vec3| {
                    let sector = ((w.y.atan2(w.x) / TAU as f32 + 0.5) * sectors as f32) as usize;
                    ((w.z * rings as f32) as usize).min(rings - 1) * sectors + sector.min(sectors - 1)
                };
                let mut counts = vec![0.0; rings * sectors + 1];
                for i in 0..n {
                    let sampler = Sampler::new(i, case, view, 0);
                    let Some(s) = plastic.sample(wo, Vec3::Z, sampler.single(5), sampler.pair(3)) else {
                        *counts.last_mut().unwrap() += 1.0;
                        continue;
                    };
                    counts[bin(s.wi)] += 1.0;
                    let (value, pdf) = plastic.eval(wo, s.wi, Vec3::Z);
                    assert!((pdf - s.pdf).abs() <= 2e-3 * pdf && (value / pdf - s.weight).length() < 1e-3);
                    let back = plastic.eval(s.wi, wo, Vec3::Z).0 / wo.z;
                    let forth = value / s.wi.z;
                    assert!(s.wi.z < 0.02 || (forth - back).length() <= 2e-3 * forth.length(), "{forth} {back}");
                }
                let mut expected = vec![0.0; rings * sectors];
                let (n_z, n_phi) = (rings * fine, sectors * fine);
                for (i, k) in (0..n_z).flat_map(|i| (0..n_phi).map(move |k| (i, k))) {
                    let z = (i as f64 + 0.5) / n_z as f64;
                    let (r, phi) = ((1.0 - z * z).sqrt(), ((k as f64 + 0.5) / n_phi as f64 - 0.5) * TAU);
                    let wi = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3();
                    let share = f64::from(plastic.eval(wo, wi, Vec3::Z).1) * TAU / (n_z * n_phi) as f64;
                    expected[i / fine * sectors + k / fine] += share * f64::from(n);
                }
                let found: f64 = expected.iter().sum();
                assert!(found < 1.005 * f64::from(n), "α {alpha}, cos {cos}: the pdf integrates to more than one");
                expected.push((f64::from(n) - found).max(0.0));
                ChiSquared::of(&counts, &expected, 2e-3).assert_below(3.1, &format!("α {alpha}, cos {cos}"));
            }
        }
    }
}
