//! A diffuse base under a dielectric coat, at one point or at sixteen.
//!
//! The coat reflects by the exact Fresnel term, at microfacets if it is rough. What it transmits, T(θ), is scattered
//! by the base, and comes out of the coat again or is reflected back to the base, any number of times:
//!
//! f = F D G / (4 cos θₒ cos θᵢ) + ρ / (1 − ρ R) · T(θₒ) T(θᵢ) / (π n²)
//!
//! where ρ is the albedo of the base and R the share of uniform light that the coat reflects inwards (Jakob, "Mitsuba",
//! plugins `plastic` and `roughplastic`; the geometric series is that of Kubelka). A smooth white one returns all light:
//! 1 − T̄ = 1 − n² (1 − R). A rough one loses what its microfacets lose in single scattering.

use crate::core::color::luminance_of;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::coat::Coat;
use crate::shading::microfacets::SeenMicrofacets;
use crate::shading::scatter::Sampled;
use firstlight_simd::{Real, Truth, Vector3, select, select_vector};

/// A plastic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plastic<'a, R: Real = f32> {
    /// ρ / (1 − ρ R) / n², see the [module](self).
    base: Vector3<R>,
    /// Strength of the reflection of the coat.
    specular: R,
    coat: Coat<'a, R>,
}

/// A plastic seen along one direction.
pub(crate) struct SeenPlastic<'a, R: Real> {
    of: Plastic<'a, R>,
    facets: SeenMicrofacets<R>,
    /// Share of the light of the base that the coat transmits to the viewer.
    passed: R,
    /// Probability of sampling the coat.
    pmf: R,
}

impl<'a, R: Real> Plastic<'a, R> {
    /// - `albedo`: of the base; `nonlinear`: ρ in the denominator, otherwise 1.
    #[inline(always)]
    pub fn new(albedo: Vector3<R>, nonlinear: R::Mask, specular: R, coat: Coat<'a, R>) -> Self {
        let (inwards, one) = (coat.reflected_inwards(), specular.all(1.0));
        let again = select_vector(nonlinear, albedo, Vector3::all(one)) * inwards;
        let base = albedo.over((Vector3::all(one) - again) * (coat.ior * coat.ior));
        Self { base, specular, coat }
    }

    /// Lanes for which light sampling can contribute.
    #[inline(always)]
    pub fn non_specular(&self) -> R::Mask {
        !self.base.is_zero() | !self.coat.is_smooth()
    }

    /// Approximate reflected share of light.
    #[inline(always)]
    pub fn albedo(&self) -> Vector3<R> {
        let passed = self.coat.mean_passed();
        let reflected = self.specular * self.coat.reflected(passed.all(1.0));
        self.base * (passed * passed) + Vector3::all(reflected)
    }

    /// - `wo`, `normal`: unit, in world space.
    #[inline(always)]
    pub fn seen(self, wo: Vector3<R>, normal: Vector3<R>) -> SeenPlastic<'a, R> {
        let facets = SeenMicrofacets::new(self.coat.facets, normal, None, wo);
        let passed = self.coat.passed(facets.wo().z);
        let coat = self.specular * (passed.all(1.0) - passed);
        let sum = coat + luminance_of(self.base) * passed * self.coat.mean_passed();
        let pmf = select(sum.is_positive(), coat / sum, sum.all(0.5));
        SeenPlastic { of: self, facets, passed, pmf }
    }
}

impl<R: Real> SeenPlastic<'_, R> {
    /// See [`Plastic::non_specular`].
    #[inline(always)]
    pub fn non_specular(&self) -> R::Mask {
        self.of.non_specular()
    }

    /// f · cos and pdf of all that is not specular.
    ///
    /// - `wi`: unit, in world space; both are zero where it, or the viewer, is behind the normal.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> (Vector3<R>, R) {
        self.eval_local(self.facets.local(wi))
    }

    #[inline(always)]
    fn eval_local(&self, local: Vector3<R>) -> (Vector3<R>, R) {
        let Plastic { base, specular, coat } = &self.of;
        let lit = self.facets.facing() & local.z.is_positive();
        let cosine = cosine_hemisphere_pdf(local.z);
        let zero = cosine.all(0.0);
        let mut value = *base * (cosine * self.passed * coat.passed(local.z));
        let mut pdf = (zero + 1.0 - self.pmf) * cosine;
        let by_coat = !coat.is_smooth() & self.pmf.is_positive();
        if by_coat.any() {
            let (found, cos) = self.facets.eval(local);
            let reflected = Vector3::all(*specular * coat.reflected(cos) * found.value);
            value = select_vector(by_coat, value + reflected, value);
            pdf = select(by_coat, pdf + self.pmf * found.pdf, pdf);
        }
        (select_vector(lit, value, Vector3::all(zero)), select(lit, pdf, zero))
    }

    /// - `u_choice`: selects coat or base; `u`: the direction.
    #[inline(always)]
    pub fn sample(&self, u_choice: R, u: [R; 2]) -> Sampled<R> {
        let Plastic { specular, coat, .. } = &self.of;
        let by_coat = u_choice.lt(self.pmf);
        let mut local = cosine_hemisphere(u);
        if by_coat.any() {
            local = select_vector(by_coat, self.facets.sample(u), local);
        }
        let (value, mut pdf) = self.eval_local(local);
        let one = pdf.all(1.0);
        let mut weight = value * (one / pdf);
        let mut go_on = pdf.is_positive();
        let mut probability = one;
        let mirrored = by_coat & coat.is_smooth() & self.facets.facing();
        if mirrored.any() {
            let share = *specular * coat.reflected(self.facets.wo().z) / self.pmf;
            weight = select_vector(mirrored, Vector3::all(share), weight);
            pdf = select(mirrored, one.all(f32::INFINITY), pdf);
            probability = select(mirrored, self.pmf, probability);
            go_on |= mirrored;
        }
        Sampled { go_on, wi: self.facets.world(local), weight, pdf, probability }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::{ColorInput, Material, ScalarInput};
    use crate::prepare::coat_table::{CoatTable, N_WIDTHS};
    use crate::sampling::{Sampler, cosine_hemisphere};
    use crate::shading::coat::entries;
    use crate::shading::interface::{Interface, MediumId};
    use crate::shading::metal::{Metal, Tint};
    use crate::shading::microfacets::Microfacets;
    use crate::shading::rough_glass::RoughGlass;
    use crate::shading::scatter::BsdfSample;
    use crate::test_statistics::ChiSquared;
    use firstlight_simd::{Float, InstructionSet, LANES, Simd, dispatch};
    use glam::{Vec2, Vec3};
    use std::f64::consts::TAU;

    /// The tables of one coat.
    fn table_of(ior: f32, alpha: ScalarInput) -> CoatTable {
        CoatTable::build(
            &[Material::Plastic {
                diffuse: ColorInput::Constant(Vec3::ONE),
                alpha,
                ior,
                specular: 1.0.into(),
                nonlinear: true,
                beckmann: false,
            }],
            None,
        )
    }

    fn plastic(table: &CoatTable, albedo: Vec3, nonlinear: bool, specular: f32, alpha: f32) -> Plastic<'_> {
        let coat = Coat::at(table, 0, table.rows[0].ior, Microfacets::ggx(alpha));
        Plastic::new(albedo.into(), nonlinear, specular, coat)
    }

    fn sample(plastic: &Plastic, wo: Vec3, u_choice: f32, u: Vec2) -> Option<BsdfSample> {
        plastic.seen(wo.into(), Vec3::Z.into()).sample(u_choice, u.to_array()).reflected()
    }

    fn eval(plastic: &Plastic, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (value, pdf) = plastic.seen(wo.into(), Vec3::Z.into()).eval(wi.into());
        (value.into(), pdf)
    }

    fn direction(cos: f32) -> Vec3 {
        Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    /// Reflected share of uniform light, by sampling.
    fn furnace(plastic: &Plastic, cos: f32, n: u32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(5, 0, 0, i);
            if let Some(s) = sample(plastic, direction(cos), sampler.single(1), sampler.pair(0)) {
                sum += s.weight;
            }
        }
        sum / n as f32
    }

    #[test]
    fn a_smooth_white_one_returns_all_light_and_none_returns_more() {
        for ior in [1.05, 1.33, 1.5, 2.0] {
            for alpha in [0.0, 0.05, 0.2, 0.5, 1.0] {
                let table = table_of(ior, alpha.into());
                let plastic = plastic(&table, Vec3::ONE, true, 1.0, alpha);
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
                let table = table_of(ior, input);
                let plastic = plastic(&table, albedo, true, 1.0, alpha);
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
        let table = table_of(1.5, 0.0.into());
        let coat = plastic(&table, Vec3::ONE, true, 1.0, 0.0).coat;
        // The share of uniform light that a surface of index 1.5 reflects inwards, as tables have it.
        assert!((coat.reflected_inwards() - 0.5963).abs() < 2e-4, "{}", coat.reflected_inwards());
        let albedo = Vec3::new(0.8, 0.4, 0.1);
        let [a, b] = [true, false].map(|nonlinear| Vec3::from(plastic(&table, albedo, nonlinear, 0.0, 0.0).base));
        let ratio = a / b;
        let expected = (1.0 - 0.5963) / (1.0 - 0.5963 * albedo);
        assert!((ratio - expected).abs().max_element() < 1e-3, "{ratio} for {expected}");
    }

    #[test]
    fn sampled_directions_follow_their_pdf_and_light_goes_both_ways_alike() {
        let (rings, sectors, fine, n) = (12, 24, 16, 100_000);
        // Significance 1 % over all nine cases (Šidák: 3.1 σ).
        for (case, alpha) in (0..).zip([0.1, 0.3, 1.0]) {
            let table = table_of(1.5, alpha.into());
            let plastic = plastic(&table, Vec3::new(0.6, 0.3, 0.1), true, 0.8, alpha);
            for (view, cos) in (0..).zip([0.9, 0.5, 0.2]) {
                let wo = direction(cos);
                let bin = |w: Vec3| {
                    let sector = ((w.y.atan2(w.x) / TAU as f32 + 0.5) * sectors as f32) as usize;
                    ((w.z * rings as f32) as usize).min(rings - 1) * sectors + sector.min(sectors - 1)
                };
                let mut counts = vec![0.0; rings * sectors + 1];
                for i in 0..n {
                    let sampler = Sampler::new(i, case, view, 0);
                    let Some(s) = sample(&plastic, wo, sampler.single(5), sampler.pair(3)) else {
                        *counts.last_mut().unwrap() += 1.0;
                        continue;
                    };
                    counts[bin(s.wi)] += 1.0;
                    let (value, pdf) = eval(&plastic, wo, s.wi);
                    assert!((pdf - s.pdf).abs() <= 2e-3 * pdf && (value / pdf - s.weight).length() < 1e-3);
                    let back = eval(&plastic, s.wi, wo).0 / wo.z;
                    let forth = value / s.wi.z;
                    assert!(s.wi.z < 0.02 || (forth - back).length() <= 2e-3 * forth.length(), "{forth} {back}");
                }
                let mut expected = vec![0.0; rings * sectors];
                let (n_z, n_phi) = (rings * fine, sectors * fine);
                for (i, k) in (0..n_z).flat_map(|i| (0..n_phi).map(move |k| (i, k))) {
                    let z = (i as f64 + 0.5) / n_z as f64;
                    let (r, phi) = ((1.0 - z * z).sqrt(), ((k as f64 + 0.5) / n_phi as f64 - 0.5) * TAU);
                    let wi = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3();
                    let share = f64::from(eval(&plastic, wo, wi).1) * TAU / (n_z * n_phi) as f64;
                    expected[i / fine * sectors + k / fine] += share * f64::from(n);
                }
                let found: f64 = expected.iter().sum();
                assert!(found < 1.005 * f64::from(n), "α {alpha}, cos {cos}: the pdf integrates to more than one");
                expected.push((f64::from(n) - found).max(0.0));
                ChiSquared::of(&counts, &expected, 2e-3).assert_below(3.1, &format!("α {alpha}, cos {cos}"));
            }
        }
    }

    /// A metal and a plastic made from uniform numbers: values, pdfs and samples.
    #[inline(always)]
    fn outcomes<R: Real>(table: &[f32], n: &[R; 24]) -> [R; 24] {
        let (zero, one) = (n[0].all(0.0), n[0].all(1.0));
        let vector = |k: usize| Vector3 { x: n[k], y: n[k + 1], z: n[k + 2] };
        let direction = |k: usize| (vector(k).mul_all(2.0) - Vector3 { x: one, y: one, z: zero + 0.99 }).normalize();
        let (isotropic, smooth, half) = (n[0].lt(zero + 0.3), n[1].lt(zero + 0.2), zero + 0.5);
        let along = select(smooth, zero, n[2]);
        let alpha = [along, select(isotropic, along, n[3])];
        let facets = Microfacets { alpha, beckmann: n[4].lt(half) }.at_least_rough();
        let index = [vector(5).mul_all(3.0), vector(8).mul_all(5.0)];
        let tint = Tint { color: vector(11), schlick: n[14].lt(half), index: Some(index) };
        let metal = Metal { facets, tangent: Some(direction(8)), tint, compensate: n[4].lt(zero + 0.7) };
        let (normal, wo, wi) = (Vector3 { x: zero, y: zero, z: one }, direction(15), direction(18));
        let facets = Microfacets::isotropic(along, n[4].lt(zero + 0.2));
        let rows = [zero, zero + (N_WIDTHS - 1) as f32];
        let plastic = Plastic::new(vector(11), n[14].lt(half), n[5], Coat::new(zero + 1.5, facets, table, rows));
        let (metal, plastic) = (metal.seen(wo, normal), plastic.seen(wo, normal));
        let sampled = [metal.sample([n[21], n[22]]), plastic.sample(n[23], [n[21], n[22]])];
        let mut found = [zero; 24];
        for (k, ((value, pdf), sampled)) in [metal.eval(wi), plastic.eval(wi)].into_iter().zip(sampled).enumerate() {
            // What carries no light says nothing.
            let of = |number: R| select(sampled.go_on, number, zero);
            let Sampled { wi, weight, pdf: density, .. } = sampled;
            let of_wi = [value.x, value.y, value.z, pdf];
            let rest = [of(wi.x), of(wi.y), of(wi.z), of(weight.x), of(weight.y), of(weight.z), of(density)];
            found[12 * k..][..4].copy_from_slice(&of_wi);
            found[12 * k + 4..][..7].copy_from_slice(&rest);
        }
        found
    }

    #[inline(always)]
    fn of_lanes<S: Simd>(s: S, table: &[f32], group: &[[f32; 24]; LANES], to: &mut [[f32; 24]; LANES]) {
        let numbers = std::array::from_fn(|k| Float::load(s, &std::array::from_fn(|lane| group[lane][k])));
        for (k, found) in outcomes(table, &numbers).into_iter().enumerate() {
            to.iter_mut().zip(found.to_array()).for_each(|(to, found)| to[k] = found);
        }
    }

    #[test]
    fn each_of_sixteen_lanes_scatters_as_one_metal_and_one_plastic_do() {
        let table = table_of(1.5, ScalarInput::Texture(0));
        let table = entries(&table);
        let mut n_sampled = 0;
        for (i, set) in (0..1000).flat_map(|i| InstructionSet::available().into_iter().map(move |set| (i, set))) {
            let group: [[f32; 24]; LANES] = std::array::from_fn(|lane| {
                let sampler = Sampler::new(lane as u32, 6, 0, i);
                std::array::from_fn(|k| sampler.single(k as u32))
            });
            let mut lanes = [[0.0; 24]; LANES];
            let (numbers, to) = (&group, &mut lanes);
            dispatch!(set, of_lanes(table: &[f32], numbers: &[[f32; 24]; LANES], to: &mut [[f32; 24]; LANES]));
            for (numbers, lane) in group.iter().zip(lanes) {
                let alone = outcomes(table, numbers);
                assert_eq!(alone.map(f32::to_bits), lane.map(f32::to_bits), "{set:?}, {numbers:?}: {alone:?} {lane:?}");
                n_sampled += u32::from(alone[10] > 0.0);
            }
        }
        assert!(n_sampled > 8_000, "{n_sampled}");
    }
}
