//! Layered surfaces with the parameters of glTF 2.0 (appendix B and `KHR_materials_*`), made energy-conserving.
//!
//! From above: a clear coat, a sheen, and a base that is metal, or a dielectric over a diffuse or transmissive layer.
//!
//! - A dielectric reflects by GGX and Schlick; the rest reaches the diffuse layer below, whose light must pass the
//!   dielectric again: f = albedo/π · (1 − E(θₒ)) (1 − E(θᵢ)) / (1 − Ē), where E is the albedo of all layers above
//!   (Kelemen and Szirmay-Kalos 2001). It is reciprocal, and a white base returns all light.
//! - Coat and sheen transmit 1 − E to the reflection and the glass below: the smaller value of both directions, which
//!   is reciprocal and loses what they reflect back down. To metal they transmit that of the viewer, and light that
//!   they reflect back down returns: white metal below them returns all light.
//! - Where a normal map turns the shading normal, light that would be scattered below the true surface is mirrored at
//!   it, as if neighbouring facets returned it (a simpler form of Schüssler et al. 2017, "Microfacet-based Normal
//!   Mapping for Robust Monte Carlo Path Tracing"): none is lost, and none is added.
//! - Light that a rough metal or rough glass loses between microfacets is compensated, as in [`crate::shading::metal`]
//!   and [`crate::shading::rough_glass`].
//!
//! Start reading at [`layers::Principled`]; [`seen`] has what depends on the view direction, for one point or sixteen,
//! and `transmitted` the light that passes, for one.

pub(crate) mod at;
mod iridescence;
pub(crate) mod layers;
pub(crate) mod seen;
mod transmitted;
mod viewed;

use crate::shading::interface::Interface;
use crate::shading::principled::layers::Principled;
use crate::shading::principled::seen::Seen;
use crate::shading::scatter::{BsdfSample, Scatter};
use glam::{Vec2, Vec3};

impl Scatter for Principled {
    fn has_non_specular(&self) -> bool {
        self.scatters() || self.is_transmission_rough()
    }

    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        Seen::new(*self, wo.into(), normal.into()).eval_all(wi)
    }

    fn through(&self) -> Option<Interface> {
        let transmission = self.transmission.filter(|transmission| transmission.is_lit)?;
        self.is_transmission_rough().then(|| transmission.interface())
    }

    fn straight(&self, wo: Vec3, normal: Vec3) -> Vec3 {
        Seen::new(*self, wo.into(), normal.into()).straight()
    }

    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        Seen::new(*self, wo.into(), normal.into()).sample(wo, u_lobe(), u)
    }
}

#[cfg(test)]
mod tests {
    use super::layers::{Inside, Transmission};
    use super::*;
    use crate::core::material::SMALLEST_ALPHA;
    use crate::sampling::Sampler;
    use crate::shading::interface::MediumId;
    use crate::shading::sheen;
    use crate::test_statistics::ChiSquared;
    use firstlight_simd::{Float, InstructionSet, LANES, Simd, Vector3, dispatch};
    use rayon::prelude::*;
    use std::f64::consts::{PI, TAU};

    const RINGS: usize = 12;
    const SECTORS: usize = 24;

    fn plain() -> Principled {
        Principled {
            dielectric: 1.0,
            facing: Vec3::splat(0.04).into(),
            grazing: 1.0,
            diffuse: Vec3::ONE.into(),
            metallic: 0.0,
            metal: Vec3::ONE.into(),
            alpha: [0.25; 2],
            tangent: None,
            true_normal: None,
            transmission: None,
            sheen: Vec3::ZERO.into(),
            sheen_alpha: 0.25,
            coat: 0.0,
            coat_alpha: 0.0,
            coat_normal: Vec3::Z.into(),
        }
    }

    fn direction(cos: f32) -> Vec3 {
        Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    fn transmission(share: f32, inside: Inside) -> Option<Transmission> {
        Some(Transmission { share, tint: Vec3::ONE, inside, is_lit: true })
    }

    fn solid(eta: f32) -> Inside {
        Inside::Solid(Interface { eta, radiance_eta: eta, beyond: MediumId::OUTSIDE })
    }

    fn brushed(surface: Principled) -> Principled {
        Principled { alpha: [0.6, 0.1], tangent: Some(Vec3::new(0.6, 0.8, 0.0).into()), ..surface }
    }

    /// Surfaces with each layer, alone and combined, with a name.
    fn surfaces() -> Vec<(&'static str, Principled)> {
        let metal = Principled { dielectric: 0.0, diffuse: Vec3::ZERO.into(), metallic: 1.0, ..plain() };
        let color = Vec3::new(0.8, 0.4, 0.1);
        let true_normal = Some(Vec3::new(0.6, 0.0, 0.8).into());
        let half = Principled {
            dielectric: 0.5,
            diffuse: (0.5 * color).into(),
            metallic: 0.5,
            metal: color.into(),
            ..plain()
        };
        let velvet = Principled { sheen: Vec3::new(0.9, 0.5, 0.7).into(), sheen_alpha: 0.09, ..plain() };
        let thin = Principled { diffuse: Vec3::ZERO.into(), ..plain() };
        let glass = Principled { dielectric: 0.4, diffuse: (0.4 * color).into(), ..plain() };
        vec![
            ("dielectric", plain()),
            ("glossy dielectric", Principled { alpha: [0.06; 2], ..plain() }),
            ("rough dielectric", Principled { alpha: [1.0; 2], ..plain() }),
            ("metal", metal),
            ("brushed metal", brushed(metal)),
            ("brushed plastic", brushed(plain())),
            ("mapped metal", Principled { true_normal, ..metal }),
            ("mapped coated plastic", Principled { true_normal, coat: 1.0, coat_alpha: 0.2, ..plain() }),
            ("half metal", half),
            ("velvet", velvet),
            ("coated", Principled { coat: 1.0, coat_alpha: 0.04, ..half }),
            ("all layers", Principled { coat: 0.7, coat_alpha: 0.3, metallic: 0.2, dielectric: 0.8, ..velvet }),
            ("thin", Principled { transmission: transmission(1.0, Inside::Thin(MediumId::OUTSIDE)), ..thin }),
            ("part glass", Principled { transmission: transmission(0.6, solid(1.0 / 1.5)), ..glass }),
            ("part glass from within", Principled { transmission: transmission(0.6, solid(1.5)), ..glass }),
        ]
    }

    /// Returns the bin of a direction, by its height and its azimuth.
    fn bin(wi: Vec3) -> usize {
        let ring = ((wi.z + 1.0) * 0.5 * (2 * RINGS) as f32) as usize;
        let sector = ((wi.y.atan2(wi.x) / std::f32::consts::TAU + 0.5) * SECTORS as f32) as usize;
        ring.min(2 * RINGS - 1) * SECTORS + sector.min(SECTORS - 1)
    }

    /// ∫ f over each bin, by the midpoint rule.
    fn integrals(fine: usize, f: impl Fn(Vec3) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; 2 * RINGS * SECTORS];
        let (n_z, n_phi) = (2 * RINGS * fine, SECTORS * fine);
        for i in 0..n_z {
            let z = (i as f64 + 0.5) / n_z as f64 * 2.0 - 1.0;
            let r = (1.0 - z * z).sqrt();
            for k in 0..n_phi {
                let phi = ((k as f64 + 0.5) / n_phi as f64 - 0.5) * TAU;
                let wi = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3();
                sums[i / fine * SECTORS + k / fine] += f(wi);
            }
        }
        let area = 4.0 * PI / (n_z * n_phi) as f64;
        sums.into_iter().map(|sum| sum * area).collect()
    }

    #[test]
    fn sampled_directions_follow_their_pdf_and_carry_f_over_it() {
        // Significance 1 % over all forty-five cases (Šidák: 3.5 σ).
        for (case, (name, surface)) in (0..).zip(surfaces()) {
            for (view, cos) in (0..).zip([0.9, 0.4, 0.08]) {
                let wo = direction(cos);
                let n = 100_000;
                let mut counts = vec![0.0; 2 * RINGS * SECTORS + 1];
                for i in 0..n {
                    let sampler = Sampler::new(i, case, view, 0);
                    let Some(sample) = surface.sample(wo, Vec3::Z, || sampler.single(5), sampler.pair(3)) else {
                        *counts.last_mut().unwrap() += 1.0;
                        continue;
                    };
                    counts[bin(sample.wi)] += 1.0;
                    assert_eq!(sample.through.is_some(), sample.wi.z < 0.0, "{name}");
                    let (value, pdf) = surface.eval(wo, sample.wi, Vec3::Z);
                    assert!((pdf - sample.pdf).abs() <= 2e-3 * pdf, "{name}, cos {cos}: {pdf} for {}", sample.pdf);
                    assert!(
                        (value / pdf - sample.weight).length() <= 4e-3 * sample.weight.length(),
                        "{name}, cos {cos}"
                    );
                }
                // A narrow lobe is not integrated accurately bin by bin.
                let is_narrow = surface.alpha[0].min(surface.alpha[1]) < 0.05
                    || (surface.coat > 0.0 && surface.coat_alpha < 0.05)
                    || cos < 0.1;
                let mut expected: Vec<f64> =
                    integrals(if is_narrow { 48 } else { 16 }, |wi| f64::from(surface.eval(wo, wi, Vec3::Z).1))
                        .into_iter()
                        .map(|share| share * f64::from(n))
                        .collect();
                let found: f64 = expected.iter().sum();
                assert!(
                    found < 1.005 * f64::from(n),
                    "{name}, cos {cos}: the pdf integrates to {}",
                    found / f64::from(n)
                );
                expected.push((f64::from(n) - found).max(0.0));
                if is_narrow {
                    let mut of_rings = [vec![0.0; 5], vec![0.0; 5]];
                    for (sums, bins) in of_rings.iter_mut().zip([&counts, &expected]) {
                        for (k, count) in bins.iter().enumerate() {
                            sums[k / (2 * RINGS * SECTORS / 4)] += count;
                        }
                    }
                    for (count, expected) in of_rings[0].iter().zip(&of_rings[1]) {
                        assert!((count - expected).abs() < 0.02 * f64::from(n), "{name}, cos {cos}: {of_rings:?}");
                    }
                } else {
                    ChiSquared::of(&counts, &expected, 1e-3).assert_below(3.5, &format!("{name}, cos {cos}"));
                }
            }
        }
    }

    /// Reflected and transmitted share of light in a white furnace.
    fn furnace(surface: &Principled, cos: f32, n: u32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(7, 0, 0, i);
            if let Some(sample) = surface.sample(direction(cos), Vec3::Z, || sampler.single(2), sampler.pair(0)) {
                let radiance_eta =
                    sample.through.map_or(1.0, |interface| interface.radiance_eta * interface.radiance_eta);
                sum += sample.weight / radiance_eta;
            }
        }
        sum / n as f32
    }

    /// Like [`furnace`], mean over all directions of the viewer.
    fn mean_furnace(surface: &Principled, n: u32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let sampler = Sampler::new(8, 0, 0, i);
            let wo = crate::sampling::cosine_hemisphere(sampler.pair(4));
            if let Some(sample) = surface.sample(wo, Vec3::Z, || sampler.single(2), sampler.pair(0)) {
                sum += sample.weight;
            }
        }
        sum / n as f32
    }

    #[test]
    fn a_white_base_returns_all_light_and_nothing_returns_more() {
        for roughness in [0.0f32, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0] {
            for cos in [1.0, 0.7, 0.4, 0.15, 0.05, 0.01] {
                let alpha = [roughness * roughness; 2];
                let metal = Principled { alpha, dielectric: 0.0, diffuse: Vec3::ZERO.into(), metallic: 1.0, ..plain() };
                let coat = Principled { alpha: [0.09; 2], coat: 1.0, coat_alpha: alpha[0], ..plain() };
                let sheen = Principled { sheen: Vec3::ONE.into(), sheen_alpha: sheen::alpha_of(roughness), ..plain() };
                let below = Principled { alpha: [0.09; 2], ..metal };
                let white = [
                    ("dielectric", Principled { alpha, ..plain() }),
                    ("tinted reflection", Principled { alpha, facing: Vec3::new(0.3, 0.1, 0.0).into(), ..plain() }),
                    ("mapped metal", Principled { true_normal: Some(Vec3::new(0.6, 0.0, 0.8).into()), ..metal }),
                    ("metal", metal),
                    ("coated metal", Principled { coat: 1.0, coat_alpha: alpha[0], ..below }),
                    ("sheen on metal", Principled { sheen: sheen.sheen, sheen_alpha: sheen.sheen_alpha, ..below }),
                    ("coat", coat),
                    ("sheen", sheen),
                ];
                for (name, surface) in white {
                    let found = furnace(&surface, cos, 1 << 15);
                    let name = format!("{name}, roughness {roughness}, cos {cos}: {found}");
                    println!("{name}");
                    // The albedo of a narrow sheen is less accurate.
                    let most = if name.starts_with("sheen on") { 1.02 } else { 1.008 };
                    assert!(found.max_element() <= most, "{name}");
                    // A coat or sheen hides a part of the reflection of a dielectric below it, and finite tables are
                    // inaccurate at grazing angles.
                    let is_whole = !name.starts_with("coat,") && !name.starts_with("sheen,") && cos > 0.02;
                    let least = if is_whole { 0.994 } else { 0.9 };
                    assert!(found.min_element() >= least, "{name}");
                }
            }
        }
    }

    #[test]
    fn white_light_from_all_around_returns_from_every_white_surface() {
        let strengths = [0.0f32, 0.3, 0.5, 0.8, 0.9, 1.0];
        let cases = [0.0f32, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0].map(|roughness| strengths.map(|a| (roughness, a)));
        cases.as_flattened().par_iter().for_each(|&(roughness, anisotropy)| {
            let narrow = (roughness * roughness).max(SMALLEST_ALPHA);
            let alpha = match anisotropy {
                0.0 => [roughness * roughness; 2],
                _ => [narrow + (1.0 - narrow) * anisotropy * anisotropy, narrow],
            };
            let plastic = Principled { alpha, tangent: Some(Vec3::new(0.6, 0.8, 0.0).into()), ..plain() };
            let metal = Principled { dielectric: 0.0, diffuse: Vec3::ZERO.into(), metallic: 1.0, ..plastic };
            for (base, surface) in [("metal", metal), ("plastic", plastic)] {
                let coated = |coat_alpha| Principled { coat: 1.0, coat_alpha, ..surface };
                let sheen = Principled { sheen: Vec3::ONE.into(), sheen_alpha: sheen::alpha_of(0.3), ..surface };
                let above =
                    [("", surface), ("coated ", coated(0.0)), ("roughly coated ", coated(0.04)), ("velvet ", sheen)];
                for (above, surface) in above {
                    let found = mean_furnace(&surface, 1 << 16);
                    let name = format!("{above}{base}, roughness {roughness}, anisotropy {anisotropy}: {}", found.x);
                    println!("{name}");
                    assert!((0.99..=1.005).contains(&found.x) && found.x == found.y && found.x == found.z, "{name}");
                }
            }
        });
    }

    #[test]
    fn scattering_is_the_same_both_ways() {
        for (name, surface) in surfaces() {
            // The compensation of a metal's losses, and what coats pass to it, depend on the view angle only (Turquin
            // 2019); so does the side of the true surface.
            let surface = Principled { metallic: 0.0, true_normal: None, ..surface };
            for i in 0..200 {
                let sampler = Sampler::new(1, 2, 0, i);
                let [a, b] = [0, 1].map(|k| crate::sampling::cosine_hemisphere(sampler.pair(k)));
                if a.z < 0.05 || b.z < 0.05 {
                    continue;
                }
                let forth = surface.eval(a, b, Vec3::Z).0 / b.z;
                let back = surface.eval(b, a, Vec3::Z).0 / a.z;
                assert!((forth - back).length() <= 2e-3 * (forth.length() + 1e-3), "{name}: {forth} {back}");
            }
        }
    }

    #[test]
    fn no_parameters_give_what_is_no_number() {
        (0..200_000).for_each(check_configuration);
    }

    /// The same with more configurations: `cargo test -p firstlight-render --lib hundred_million -- --ignored`.
    #[test]
    #[ignore = "it takes minutes"]
    fn none_of_a_hundred_million_configurations_gives_what_is_no_number() {
        (0..100_000_000_u32).into_par_iter().for_each(check_configuration);
    }

    /// A surface of random parameters: all layers, with many values at the ends of their ranges.
    fn random_surface(sampler: &Sampler) -> Principled {
        let pick = |k: u32| sampler.single(k);
        let ends = |k: u32| match pick(k) {
            x if x < 0.2 => 0.0,
            x if x > 0.8 => 1.0,
            x => (x - 0.2) / 0.6,
        };
        let normal = Vec3::new(pick(1) - 0.5, pick(2) - 0.5, pick(3) + 0.02).normalize();
        Principled {
            dielectric: ends(4),
            facing: Vec3::new(ends(5), ends(6), ends(7)).into(),
            grazing: ends(8),
            diffuse: (Vec3::splat(ends(9)) * (1.0 - ends(10))).into(),
            metallic: ends(10),
            metal: Vec3::new(ends(11), ends(12), ends(13)).into(),
            alpha: [ends(14).powi(2), if pick(15) < 0.5 { ends(14).powi(2) } else { ends(15).powi(2) }],
            tangent: (pick(16) < 0.5).then_some(Vec3::X.into()),
            true_normal: (pick(35) < 0.5).then_some(normal.into()),
            transmission: (pick(17) < 0.5).then(|| Transmission {
                share: ends(18),
                tint: Vec3::splat(ends(19)),
                inside: if pick(20) < 0.5 { Inside::Thin(MediumId::OUTSIDE) } else { solid(0.4 + 2.0 * pick(21)) },
                is_lit: pick(22) < 0.5,
            }),
            sheen: Vec3::splat(ends(23)).into(),
            sheen_alpha: sheen::alpha_of(ends(24)),
            coat: ends(25),
            coat_alpha: ends(26).powi(2),
            coat_normal: if pick(27) < 0.5 { normal } else { Vec3::Z }.into(),
        }
    }

    /// Surface, directions and random numbers of index `i`.
    fn check_configuration(i: u32) {
        let sampler = Sampler::new(9, 1, 0, i);
        let pick = |k: u32| sampler.single(k);
        let surface = random_surface(&sampler);
        let wo = direction((pick(28).powi(4)).max(1e-7));
        let wi = Vec3::new(pick(29) - 0.5, pick(30) - 0.5, pick(31) - 0.5).normalize_or(Vec3::Z);
        let (value, pdf) = surface.eval(wo, wi, Vec3::Z);
        assert!(value.is_finite() && value.min_element() >= 0.0 && pdf >= 0.0 && !pdf.is_nan(), "{i}: {surface:?}");
        if let Some(sample) = surface.sample(wo, Vec3::Z, || pick(32), Vec2::new(pick(33), pick(34))) {
            assert!(sample.weight.is_finite() && sample.weight.min_element() >= 0.0, "{i}: {sample:?} {surface:?}");
            assert!(sample.pdf > 0.0 && sample.wi.is_normalized(), "{i}: {sample:?} {surface:?}");
        }
    }

    /// What one lane gives: value and pdf of a direction; a sampled direction with its pdf, weight and whether it is one.
    type Outcome = [f32; 12];

    fn outcome_of_one(surface: Principled, [wo, wi]: [Vec3; 2], u_lobe: f32, u: [f32; 2]) -> Outcome {
        let seen = Seen::new(surface, wo.into(), Vec3::Z.into());
        let (value, pdf) = seen.eval(wi.into());
        let proposed = seen.propose(u_lobe, u);
        let (of_proposed, density) = seen.eval(proposed.wi);
        let found = seen.weighted(&proposed, of_proposed, density);
        let Vector3 { x, y, z } = proposed.wi;
        let weight = found.weight;
        let is_one = f32::from(found.go_on);
        [value.x, value.y, value.z, pdf, x, y, z, weight.x, weight.y, weight.z, found.pdf, is_one]
    }

    #[inline(always)]
    fn outcomes<S: Simd>(s: S, group: &[(Principled, [Vec3; 2], f32, [f32; 2]); LANES], out: &mut [Outcome; LANES]) {
        let number = |of: &dyn Fn(usize) -> f32| Float::load(s, &std::array::from_fn(of));
        let vector = |of: &dyn Fn(usize) -> Vector3<f32>| Vector3 {
            x: number(&|lane| of(lane).x),
            y: number(&|lane| of(lane).y),
            z: number(&|lane| of(lane).z),
        };
        let surface = |lane: usize| &group[lane].0;
        let nothing = Vector3::from(Vec3::ZERO);
        let layers = Principled {
            dielectric: number(&|lane| surface(lane).dielectric),
            facing: vector(&|lane| surface(lane).facing),
            grazing: number(&|lane| surface(lane).grazing),
            diffuse: vector(&|lane| surface(lane).diffuse),
            metallic: number(&|lane| surface(lane).metallic),
            metal: vector(&|lane| surface(lane).metal),
            alpha: [number(&|lane| surface(lane).alpha[0]), number(&|lane| surface(lane).alpha[1])],
            tangent: group
                .iter()
                .any(|(of, ..)| of.tangent.is_some())
                .then(|| vector(&|lane| surface(lane).tangent.unwrap_or(nothing))),
            true_normal: group
                .iter()
                .any(|(of, ..)| of.true_normal.is_some())
                .then(|| vector(&|lane| surface(lane).true_normal.unwrap_or(nothing))),
            transmission: None,
            sheen: vector(&|lane| surface(lane).sheen),
            sheen_alpha: number(&|lane| surface(lane).sheen_alpha),
            coat: number(&|lane| surface(lane).coat),
            coat_alpha: number(&|lane| surface(lane).coat_alpha),
            coat_normal: vector(&|lane| surface(lane).coat_normal),
        };
        let direction = |k: usize| vector(&|lane| group[lane].1[k].into());
        let seen = Seen::new(layers, direction(0), vector(&|_| Vec3::Z.into()));
        let (value, pdf) = seen.eval(direction(1));
        let proposed = seen.propose(number(&|lane| group[lane].2), [0, 1].map(|k| number(&|lane| group[lane].3[k])));
        let (of_proposed, density) = seen.eval(proposed.wi);
        let found = seen.weighted(&proposed, of_proposed, density);
        let (wi, weight) = (proposed.wi, found.weight);
        let numbers = [value.x, value.y, value.z, pdf, wi.x, wi.y, wi.z, weight.x, weight.y, weight.z, found.pdf];
        for (k, number) in numbers.into_iter().enumerate() {
            out.iter_mut().zip(number.to_array()).for_each(|(out, number)| out[k] = number);
        }
        out.iter_mut().enumerate().for_each(|(lane, out)| out[11] = f32::from(found.go_on >> lane & 1 != 0));
    }

    fn outcomes_by(set: InstructionSet, group: &[(Principled, [Vec3; 2], f32, [f32; 2]); LANES]) -> [[u32; 12]; LANES] {
        let mut out = [[0.0; 12]; LANES];
        let to = &mut out;
        dispatch!(
            set,
            outcomes(group: &[(Principled, [Vec3; 2], f32, [f32; 2]); LANES], to: &mut [Outcome; LANES])
        );
        // What is no number, or not used, says nothing.
        out.map(|mut lane| {
            if lane[11] == 0.0 {
                lane[4..11].fill(0.0);
            }
            lane.map(f32::to_bits)
        })
    }

    #[test]
    fn each_of_sixteen_lanes_scatters_as_one_surface_does() {
        let mut n_sampled = 0;
        for i in 0..4000 {
            let group = std::array::from_fn(|lane| {
                let sampler = Sampler::new(lane as u32, 5, 0, i);
                let surface = Principled { transmission: None, ..random_surface(&sampler) };
                let wo = direction((sampler.single(28).powi(4)).max(1e-7));
                let wi = crate::sampling::cosine_hemisphere(sampler.pair(29));
                (surface, [wo, wi], sampler.single(30), sampler.pair(31).to_array())
            });
            let lanes = outcomes_by(InstructionSet::detect(), &group);
            for set in InstructionSet::available().into_iter().filter(|_| i % 40 == 0) {
                assert_eq!(outcomes_by(set, &group), lanes, "{set:?}");
            }
            for (lane, found) in lanes.iter().enumerate() {
                let (surface, directions, u_lobe, u) = group[lane];
                if i % 40 == 0 {
                    // Whatever the other lanes are.
                    let alone = [group[lane]; LANES];
                    assert_eq!(outcomes_by(InstructionSet::detect(), &alone)[lane], *found, "{i}, {surface:?}");
                }
                let expected = outcome_of_one(surface, directions, u_lobe, u);
                n_sampled += u32::from(expected[11] > 0.0);
                let n = if expected[11] > 0.0 { 12 } else { 4 };
                for (k, (found, expected)) in found.map(f32::from_bits).into_iter().zip(expected).take(n).enumerate() {
                    // Exponents of a narrow sheen enlarge differences.
                    let is_close = (found - expected).abs() <= 1e-3 * expected.abs() + 1e-6 || found == expected;
                    assert!(is_close, "{i}, number {k}: {found} for {expected}, {surface:?}");
                }
            }
        }
        assert!(n_sampled > 40_000, "{n_sampled}");
    }
}
