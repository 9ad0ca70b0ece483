//! Rough dielectrics: isotropic microfacets that reflect and refract, seen from one direction.
//!
//! Source: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces". Directions are in the frame
//! of the shading normal (+z). Anisotropy would only change the orientation of the frame.

use crate::core::material::SMALLEST_ALPHA;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::ggx;
use crate::shading::glass_loss;
use crate::shading::interface::Interface;
use crate::shading::microfacets::Microfacets;
use firstlight_simd::{Vector3, frame_around};
use glam::{Vec2, Vec3};

/// Product of α and |η − 1| below which the spread of refracted directions is not representable in `f32`.
const SMALLEST_SPREAD: f32 = 3e-5;

/// Lower limit of cosines with the normal: larger slopes overflow when squared in `f32`.
const SMALLEST_COS: f32 = 1e-7;

/// Whether microfacets change directions so little that the surface is that of smooth glass.
///
/// - `alpha`: width; `eta`: index on one side over that on the other.
#[inline]
pub(crate) fn is_smooth(alpha: f32, eta: f32) -> bool {
    // True also if either is NaN.
    !(alpha >= SMALLEST_ALPHA && alpha.min(1.0) * (eta - 1.0).abs() >= SMALLEST_SPREAD)
}

/// Compensation for the light that single scattering loses: a lobe that does not depend on the incident direction.
///
/// After many bounces between microfacets, light leaves on each side with the distribution of the losses there: pdf
/// proportional to (1 − E(θ)) cos θ, where E is the single-scattering albedo for that side, and on the two sides in
/// proportion to n² (1 − Ē), the loss of uniform light from that side. So the lobe is reciprocal, and a white furnace
/// loses nothing (after Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks").
#[derive(Clone, Copy)]
struct Multiple {
    /// 1 − E of the view direction.
    lost: f32,
    /// Per side, near and far: share of the light, and 1 − Ē.
    sides: [(f32, f32); 2],
}

impl Multiple {
    /// `None` if nothing is lost.
    fn new(cos_o: f32, alpha: f32, eta: f32) -> Option<Self> {
        let lost = glass_loss::lost(cos_o, alpha, eta);
        let means = [glass_loss::mean_lost(alpha, eta), glass_loss::mean_lost(alpha, 1.0 / eta)];
        if lost.min(means[0]).min(means[1]) < SMALLEST_LOSS {
            return None;
        }
        let strength = [means[0] * eta * eta, means[1]];
        let share = strength.map(|one| one / (strength[0] + strength[1]));
        Some(Self { lost, sides: [(share[0], means[0]), (share[1], means[1])] })
    }
}

/// Smaller losses are not compensated.
const SMALLEST_LOSS: f32 = 1e-5;

/// A surface seen along `wo`.
#[derive(Clone, Copy)]
pub(crate) struct RoughGlass {
    facets: Microfacets,
    interface: Interface,
    /// Shading frame in world space; the last axis is the normal.
    axes: [Vector3<f32>; 3],
    /// Direction to the viewer in the frame, on the side of the normal.
    wo: Vector3<f32>,
    /// Smith's Λ of `wo`.
    lambda_o: f32,
    multiple: Option<Multiple>,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoughGlassSample {
    /// Unit, in world space.
    pub wi: Vec3,
    /// f · |cos| / pdf.
    pub weight: f32,
    /// Pdf per steradian.
    pub pdf: f32,
    /// Whether it leads to the far side.
    pub passes: bool,
}

impl RoughGlass {
    /// - `normal`: unit, on the side of `wo`; `facets`: isotropic; `interface`: rough in the sense of [`is_smooth`];
    ///   `compensate`: add the light that single scattering of GGX loses.
    #[inline]
    pub fn new(normal: Vec3, wo: Vec3, facets: Microfacets, interface: Interface, compensate: bool) -> Self {
        let axes = frame_around(normal.into());
        let wo = Vector3::from(wo).to_local(&axes);
        let wo = Vector3 { z: wo.z.max(SMALLEST_COS), ..wo };
        let is_whole = compensate && !facets.beckmann;
        let multiple = if is_whole { Multiple::new(wo.z, facets.alpha[0], interface.eta) } else { None };
        Self { facets, interface, axes, wo, lambda_o: facets.lambda(wo), multiple }
    }

    /// Returns f · |cos| and the pdf per steradian of [`Self::sample`].
    ///
    /// For light from the far side, f includes the factor by which an interface scales radiance: f(i, o) / nₒ² is
    /// symmetric.
    ///
    /// - `wi`: unit, on either side.
    pub fn eval(&self, wi: Vec3) -> (f32, f32) {
        let wi = Vector3::from(wi).to_local(&self.axes);
        self.with_multiple(wi, self.scattered_once(wi))
    }

    /// Evaluates single scattering.
    ///
    /// - `wi`: in the frame.
    fn scattered_once(&self, wi: Vector3<f32>) -> (f32, f32) {
        if wi.z > 0.0 {
            let half = (self.wo + wi).normalize();
            self.reflected(half, wi)
        } else if wi.z < 0.0 {
            let Interface { eta, .. } = self.interface;
            // Snell's law: the tangential components of η ωₒ and ωᵢ cancel.
            let sum = wi + self.wo * eta;
            let length = sum.length();
            let half = sum * ((eta - 1.0).signum() / length);
            if length > 0.0 && half.z > 0.0 && half.dot(wi) < 0.0 { self.refracted(half, wi) } else { (0.0, 0.0) }
        } else {
            (0.0, 0.0)
        }
    }

    /// Adds [`Multiple`] to the value and pdf of single scattering.
    fn with_multiple(&self, wi: Vector3<f32>, (value, pdf): (f32, f32)) -> (f32, f32) {
        let Interface { eta, radiance_eta, .. } = self.interface;
        let Some(Multiple { lost, sides }) = self.multiple else { return (value, pdf) };
        let beyond = wi.z < 0.0;
        let (share, mean) = sides[usize::from(beyond)];
        let (cos, eta, scale) = if beyond { (-wi.z, 1.0 / eta, radiance_eta * radiance_eta) } else { (wi.z, eta, 1.0) };
        let per_angle = lost * share * cosine_hemisphere_pdf(cos);
        let back = per_angle * glass_loss::lost(cos, self.facets.alpha[0], eta) / mean;
        (value + back * scale, pdf * (1.0 - lost) + per_angle)
    }

    /// Samples a direction of [`Multiple`].
    fn sample_multiple(&self, Multiple { sides, .. }: Multiple, u_side: f32, u: Vec2) -> Option<RoughGlassSample> {
        let local = cosine_hemisphere(u.to_array());
        let beyond = u_side >= sides[0].0;
        let wi = if beyond { local * -1.0 } else { local };
        let (value, pdf) = self.with_multiple(wi, self.scattered_once(wi));
        (local.z > 0.0 && pdf > 0.0).then(|| RoughGlassSample {
            wi: wi.to_world(&self.axes).normalize().into(),
            weight: value / pdf,
            pdf,
            passes: beyond,
        })
    }

    /// Samples a direction.
    ///
    /// - `u_choice`: selects reflection or refraction at the microfacet that `u` samples; uniform in `[0, 1)`.
    ///
    /// `None` for light that single scattering loses.
    pub fn sample(&self, mut u_choice: f32, u: Vec2) -> Option<RoughGlassSample> {
        let Interface { eta, radiance_eta, .. } = self.interface;
        if let Some(multiple) = self.multiple {
            if u_choice < multiple.lost {
                return self.sample_multiple(multiple, u_choice / multiple.lost, u);
            }
            u_choice = ((u_choice - multiple.lost) / (1.0 - multiple.lost)).min(1.0f32.next_down());
        }
        let half = self.facets.sample(self.wo, u.to_array());
        let (reflectance, cos_t) = fresnel(self.cos_o(half), eta);
        let reflects = u_choice < reflectance;
        let wi = if reflects { reflect(self.wo, half) } else { refract(self.wo, half, eta, cos_t) };
        if !(if reflects { wi.z > 0.0 } else { wi.z < 0.0 }) {
            return None;
        }
        // Share of the microfacet's light that escapes: G2 / G1.
        let seen = 1.0 + self.lambda_o;
        let (both, scale, once) = if reflects {
            (self.both_above(wi), 1.0, self.reflected(half, wi))
        } else {
            (self.above_and_below(wi), radiance_eta * radiance_eta, self.refracted(half, wi))
        };
        let (value, pdf) = self.with_multiple(wi, once);
        let weight = if self.multiple.is_some() { value / pdf } else { (both * seen).min(1.0) * scale };
        (pdf > 0.0).then(|| RoughGlassSample {
            wi: wi.to_world(&self.axes).normalize().into(),
            weight,
            pdf,
            passes: !reflects,
        })
    }

    /// [`Self::eval`] for a direction above the surface, with its half vector.
    fn reflected(&self, half: Vector3<f32>, wi: Vector3<f32>) -> (f32, f32) {
        let (reflectance, _) = fresnel(self.cos_o(half), self.interface.eta);
        // D / 4 cos θₒ: the Jacobian 1 / (4 ωₒ·h) cancels the cosine of the projected microfacet.
        let per_angle = reflectance * self.facets.distribution(half) / (4.0 * self.wo.z);
        (per_angle * self.both_above(wi), per_angle / (1.0 + self.lambda_o))
    }

    /// [`Self::eval`] for a direction below the surface, with the microfacet normal that refracts it.
    fn refracted(&self, half: Vector3<f32>, wi: Vector3<f32>) -> (f32, f32) {
        let Interface { eta, radiance_eta, .. } = self.interface;
        let cos_o = self.cos_o(half);
        let (reflectance, cos_t) = fresnel(cos_o, eta);
        if reflectance >= 1.0 {
            return (0.0, 0.0);
        }
        // |ωᵢ + η ωₒ| = |η cos θₒ − cos θₜ| without cancellation near η = 1; the Jacobian of the half vector is cos θₜ
        // over its square (Walter et al. 2007, equation 17).
        let length = (eta - 1.0) * (eta + 1.0) / (eta * cos_o + cos_t);
        let jacobian = cos_t / (length * length);
        let visible = self.facets.distribution(half) * cos_o / self.wo.z;
        let per_angle = (1.0 - reflectance) * visible * jacobian;
        (per_angle * self.above_and_below(wi) * (radiance_eta * radiance_eta), per_angle / (1.0 + self.lambda_o))
    }

    fn cos_o(&self, half: Vector3<f32>) -> f32 {
        self.wo.dot(half).clamp(0.0, 1.0)
    }

    /// Height-correlated masking and shadowing for two directions above (Heitz 2014, equation 99).
    fn both_above(&self, wi: Vector3<f32>) -> f32 {
        1.0 / (1.0 + self.lambda_o + self.lambda_i(wi))
    }

    /// The same for one direction above and one below.
    fn above_and_below(&self, wi: Vector3<f32>) -> f32 {
        ggx::above_and_below(self.lambda_o, self.lambda_i(wi))
    }

    fn lambda_i(&self, wi: Vector3<f32>) -> f32 {
        self.facets.lambda(Vector3 { z: wi.z.abs().max(SMALLEST_COS), ..wi })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::shading::bsdf::Lobe;
    use crate::shading::interface::MediumId;
    use crate::shading::scatter::Scatter;
    use crate::test_statistics::ChiSquared;
    use glam::DVec3;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    const ALPHAS: [f32; 10] = [1e-3, 3e-3, 0.01, 0.03, 0.06, 0.1, 0.2, 0.4, 0.7, 1.0];
    /// Cosine of incidence, and index on its side over that on the far side: from outside, from inside, nearly equal.
    const VIEWS: [(f32, f32); 9] = [
        (1.0, 1.0 / 1.5),
        (0.6, 1.0 / 1.5),
        (0.05, 1.0 / 1.5),
        (0.01, 1.0 / 1.5),
        (0.97, 1.5),
        // Just inside of the critical angle, and beyond it.
        (0.76, 1.5),
        (0.1, 1.5),
        (0.4, 1.0 / 2.4),
        (0.5, 1.0 / 1.05),
    ];

    fn interface(eta: f32) -> Interface {
        Interface { eta, radiance_eta: eta, beyond: MediumId::OUTSIDE }
    }

    fn lobe(alpha: f32, eta: f32) -> Lobe<'static> {
        Lobe::RoughGlass { interface: interface(eta), facets: Microfacets::ggx(alpha), compensate: false }
    }

    fn whole_lobe(alpha: f32, eta: f32) -> Lobe<'static> {
        Lobe::RoughGlass { interface: interface(eta), facets: Microfacets::ggx(alpha), compensate: true }
    }

    fn direction(cos: f32) -> Vec3 {
        Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    /// The sphere of directions to which `wo` is scattered, binned by the microfacet that does it: rings that are
    /// uniform in ln(1 + slope² / α²), and sectors, for each side. In `f64`, independent of the tested code.
    struct Grid {
        wo: DVec3,
        alpha: f64,
        eta: f64,
    }

    const RINGS: usize = 24;
    const SECTORS: usize = 16;
    const BINS: usize = 2 * RINGS * SECTORS;

    impl Grid {
        fn new(wo: Vec3, alpha: f32, eta: f32) -> Self {
            Self { wo: wo.as_dvec3().normalize(), alpha: f64::from(alpha), eta: f64::from(eta) }
        }

        fn bin(&self, wi: Vec3) -> usize {
            let (side, wi) = (usize::from(wi.z < 0.0), wi.as_dvec3());
            let half = if side == 0 { self.wo + wi } else { (wi + self.wo * self.eta) * (self.eta - 1.0).signum() };
            let slope2 = (half.x * half.x + half.y * half.y) / (half.z * half.z * self.alpha * self.alpha);
            let ring = (1.0 + slope2).ln() / self.last() * RINGS as f64;
            let sector = (half.y.atan2(half.x) / TAU + 0.5) * SECTORS as f64;
            (side * RINGS + (ring as usize).min(RINGS - 1)) * SECTORS + (sector as usize).min(SECTORS - 1)
        }

        /// ln(1 + slope² / α²) at the end of the last ring.
        fn last(&self) -> f64 {
            (1.0 + (1e3 / self.alpha).powi(2)).ln()
        }

        /// The direction to which a microfacet scatters `wo`; `None` if there is none on this side.
        fn scattered(&self, side: usize, ring: f64, sector: f64) -> Option<DVec3> {
            let slope = self.alpha * ((ring / RINGS as f64 * self.last()).exp() - 1.0).max(0.0).sqrt();
            let (sin, cos) = ((sector / SECTORS as f64 - 0.5) * TAU).sin_cos();
            let half = DVec3::new(slope * cos, slope * sin, 1.0).normalize();
            let cos_o = self.wo.dot(half);
            let cos2_t = 1.0 - self.eta * self.eta * (1.0 - cos_o * cos_o);
            let wi = if side == 0 {
                2.0 * cos_o * half - self.wo
            } else {
                -self.eta * self.wo + (self.eta * cos_o - cos2_t.max(0.0).sqrt()) * half
            };
            (cos_o > 0.0 && (side == 0 || cos2_t > 0.0) && (wi.z < 0.0) == (side == 1)).then_some(wi)
        }

        /// Integral over each bin per steradian: midpoint rule with `fine`² points, solid angles by differences; and
        /// whether some microfacets of the bin scatter nothing to this side.
        fn integrals(&self, fine: usize, f: impl Fn(Vec3) -> f32) -> Vec<(f64, bool)> {
            let mut sums = vec![(0.0, false); BINS];
            for (bin, (sum, is_cut)) in sums.iter_mut().enumerate() {
                let (side, ring, sector) = (bin / SECTORS / RINGS, bin / SECTORS % RINGS, bin % SECTORS);
                for k in 0..fine * fine {
                    let place = |at: usize, k: usize| at as f64 + (k as f64 + 0.5) / fine as f64;
                    let (x, y, step) = (place(ring, k % fine), place(sector, k / fine), 1e-5);
                    let at = |x, y| self.scattered(side, x, y);
                    let (Some(wi), Some(a), Some(b), Some(c), Some(d)) =
                        (at(x, y), at(x - step, y), at(x + step, y), at(x, y - step), at(x, y + step))
                    else {
                        *is_cut = true;
                        continue;
                    };
                    let solid_angle = (b - a).cross(d - c).length() / (2.0 * step * fine as f64).powi(2);
                    *sum += f64::from(f(wi.as_vec3())) * solid_angle;
                }
            }
            sums
        }
    }

    fn views() -> impl Iterator<Item = (u32, f32, f32, f32)> {
        let all = ALPHAS.into_iter().flat_map(|alpha| VIEWS.map(|(cos, eta)| (alpha, cos, eta)));
        (0..).zip(all).map(|(case, (alpha, cos, eta))| (case, alpha, cos, eta))
    }

    #[test]
    fn sampled_directions_follow_their_pdf_on_the_whole_sphere() {
        // Significance 1 % over all ninety cases (Šidák: 3.7 σ).
        for (case, alpha, cos, eta) in views() {
            let (lobe, wo) = (lobe(alpha, eta), direction(cos));
            let grid = Grid::new(wo, alpha, eta);
            let n = 200_000u32;
            let mut counts = vec![0.0; BINS + 1];
            for i in 0..n {
                let sampler = Sampler::new(i, case, 0, 0);
                match lobe.sample(wo, Vec3::Z, || sampler.single(5), sampler.pair(3)) {
                    Some(sample) => {
                        assert_eq!(sample.through.is_some(), sample.wi.z < 0.0);
                        counts[grid.bin(sample.wi)] += 1.0;
                    }
                    None => counts[BINS] += 1.0,
                }
            }
            let integrals = grid.integrals(16, |wi| lobe.eval(wo, wi, Vec3::Z).1);
            let mut expected: Vec<f64> = integrals.iter().map(|(share, _)| share * f64::from(n)).collect();
            let found: f64 = expected.iter().sum();
            assert!(
                found <= 1.003 * f64::from(n),
                "α {alpha}, cos {cos}, η {eta}: the pdf integrates to more than one"
            );
            expected.push((f64::from(n) - found).max(0.0));
            // Bins at an edge are inaccurate one by one, and so are those of nearly vertical microfacets, whose slopes
            // `f32` barely resolves.
            let is_steep = |bin: usize| bin / SECTORS % RINGS >= 3 * RINGS / 4;
            let (mut edge, mut of_edge) = (0.0, 0.0);
            for bin in (0..BINS).filter(|&bin| integrals[bin].1 || is_steep(bin)) {
                edge += std::mem::take(&mut counts[bin]);
                of_edge += std::mem::take(&mut expected[bin]);
            }
            counts.push(edge);
            expected.push(of_edge);
            let name = format!("α {alpha}, cos {cos}, η {eta}");
            ChiSquared::of(&counts, &expected, 0.01).assert_below(3.7, &name);
        }
    }

    /// Single-scattering albedo, reflected and refracted, by sampling.
    fn sampled_albedo(alpha: f32, cos: f32, eta: f32, n: u32) -> [f64; 2] {
        let (lobe, wo, mut sums) = (lobe(alpha, eta), direction(cos), [0.0; 2]);
        for i in 0..n {
            let sampler = Sampler::new(7, 0, 0, i);
            if let Some(sample) = lobe.sample(wo, Vec3::Z, || sampler.single(2), sampler.pair(0)) {
                let passes = sample.through.is_some();
                let scale = if passes { eta * eta } else { 1.0 };
                assert!(sample.weight.x <= scale, "a sample outweighs its light: {}", sample.weight.x / scale);
                sums[usize::from(passes)] += f64::from(sample.weight.x / scale);
            }
        }
        sums.map(|sum| sum / f64::from(n))
    }

    #[test]
    fn a_white_furnace_gains_nothing_and_sampling_agrees_with_the_integral() {
        for (_, alpha, cos, eta) in views() {
            let sampled = sampled_albedo(alpha, cos, eta, 1 << 16);
            let wo = direction(cos);
            let bins = Grid::new(wo, alpha, eta).integrals(16, |wi| lobe(alpha, eta).eval(wo, wi, Vec3::Z).0.x);
            let (above, below) = bins.split_at(BINS / 2);
            let sum = |bins: &[(f64, bool)]| bins.iter().map(|(sum, _)| sum).sum::<f64>();
            let integral = [sum(above), sum(below) / f64::from(eta * eta)];
            let name = format!("α {alpha}, cos {cos}, η {eta}: {sampled:?} for {integral:?}");
            assert!(sampled[0] + sampled[1] <= 1.0, "{name}");
            assert!(integral[0] + integral[1] <= 1.003, "{name}");
            assert!((0..2).all(|k| (sampled[k] - integral[k]).abs() < 4e-3), "{name}");
        }
    }

    #[test]
    fn it_loses_what_the_page_of_materials_says() {
        // Per cent of uniform light and of light along the normal, from outside and from inside.
        for (alpha, lost) in [
            (0.04, [0.2, 0.0, 0.7, 0.2]),
            (0.1, [0.9, 0.1, 3.3, 1.0]),
            (0.36, [5.6, 1.7, 21.9, 14.1]),
            (0.64, [15.1, 4.9, 40.0, 35.6]),
            (1.0, [29.6, 10.6, 56.4, 58.5]),
        ] {
            for (eta, lost) in [1.0 / 1.5, 1.5].into_iter().zip(lost.chunks(2)) {
                let loss = |cos, n| 100.0 * (1.0 - sampled_albedo(alpha, cos, eta, n).iter().sum::<f64>());
                // Uniform in the square of the cosine.
                let n = 32;
                let around =
                    (0..n).map(|i| loss(((i as f32 + 0.5) / n as f32).sqrt(), 1 << 12)).sum::<f64>() / f64::from(n);
                let along = loss(1.0, 1 << 14);
                assert!((around - lost[0]).abs() < 0.4, "α {alpha}, η {eta}: {around:.2} for {}", lost[0]);
                assert!((along - lost[1]).abs() < 0.6, "α {alpha}, η {eta}: {along:.2} for {}", lost[1]);
            }
        }
    }

    #[test]
    fn compensation_makes_a_furnace_white_and_is_sampled_as_its_pdf_says() {
        for (_, alpha, cos, eta) in views() {
            let (whole, once, wo, n) = (whole_lobe(alpha, eta), lobe(alpha, eta), direction(cos), 1 << 15);
            let lost = f64::from(glass_loss::lost(cos, alpha, eta));
            let (mut returned, mut given_back, mut pdf) = (0.0, 0.0, 0.0);
            for i in 0..n {
                let sampler = Sampler::new(9, 0, 0, i);
                if let Some(s) = whole.sample(wo, Vec3::Z, || sampler.single(2), sampler.pair(0)) {
                    let scale = if s.through.is_some() { eta * eta } else { 1.0 };
                    returned += f64::from(s.weight.x / scale) / f64::from(n);
                }
                // The compensation lobe is broad: uniform directions find it.
                let u = Sampler::new(10, 0, 0, i).pair(0);
                let z = 2.0 * u.x - 1.0;
                let (sin, cos_phi) = (TAU as f32 * u.y).sin_cos();
                let wi = Vec3::new((1.0 - z * z).sqrt() * cos_phi, (1.0 - z * z).sqrt() * sin, z);
                let (a, b) = (whole.eval(wo, wi, Vec3::Z), once.eval(wo, wi, Vec3::Z));
                let (scale, per_sample) = (if z < 0.0 { eta * eta } else { 1.0 }, 2.0 * TAU / f64::from(n));
                given_back += f64::from((a.0.x - b.0.x) / scale) * per_sample;
                pdf += (f64::from(a.1) - f64::from(b.1) * (1.0 - lost)) * per_sample;
            }
            let name =
                format!("α {alpha}, cos {cos}, η {eta}: {returned} back, {given_back} of {lost} lost, pdf {pdf}");
            assert!((returned - 1.0).abs() < 0.015, "{name}");
            if alpha > 0.05 {
                assert!((given_back - lost).abs() < 0.03 * lost + 1e-3, "{name}");
                assert!((pdf - lost).abs() < 0.03 * lost + 1e-3, "{name}");
            }
        }
    }

    #[test]
    fn light_goes_both_ways_alike() {
        for case in 0..8000 {
            let sampler = Sampler::new(case, 1, 0, 0);
            let (a, b, c) = (sampler.pair(0), sampler.pair(1), sampler.pair(2));
            let (alpha, eta) = (0.02 + 0.98 * c.x, [1.0 / 1.5, 1.5, 1.0 / 1.1, 2.0][case as usize % 4]);
            let place = |u: Vec2| {
                let z = 2.0 * u.x - 1.0;
                let (sin, cos) = (TAU as f32 * u.y).sin_cos();
                Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
            };
            let (o, i) = (place(a), place(b));
            if o.z.abs().min(i.z.abs()) < 1e-2 {
                continue;
            }
            let lobe = if case < 4000 { lobe(alpha, eta) } else { whole_lobe(alpha, eta) };
            let f = |o: Vec3, i: Vec3| lobe.eval(o, i, Vec3::Z).0.x / i.z.abs();
            // Divided by n² on the side at which light arrives, which is 1 below.
            let n2 = |w: Vec3| if w.z > 0.0 { eta * eta } else { 1.0 };
            let (forth, back) = (f(o, i) / n2(o), f(i, o) / n2(i));
            assert!((forth - back).abs() <= 2e-3 * forth.max(back) + 1e-5, "α {alpha}, η {eta}: {forth} and {back}");
        }
    }

    #[test]
    fn narrow_lobes_are_smooth_glass() {
        for eta in [1.0 / 1.5, 1.5, 1.0 / 1.05] {
            for cos in [1.0, 0.9, 0.5, 0.2] {
                let (smooth, rough) = (Lobe::Glass(interface(eta)), lobe(2.0 * SMALLEST_ALPHA, eta));
                assert!(!is_smooth(2.0 * SMALLEST_ALPHA, eta) || (eta - 1.0).abs() < 0.1);
                let (mut n_split, n) = (0, 4000);
                for i in 0..n {
                    let sampler = Sampler::new(3, 0, 0, i);
                    let sample =
                        |lobe: &Lobe| lobe.sample(direction(cos), Vec3::Z, || sampler.single(2), sampler.pair(0));
                    let (Some(a), Some(b)) = (sample(&smooth), sample(&rough)) else { panic!("light is lost") };
                    if a.through.is_some() != b.through.is_some() {
                        n_split += 1;
                        continue;
                    }
                    assert!((a.weight - b.weight).length() < 1e-3, "{a:?} {b:?}");
                    // The distribution has long tails: one in thousands deviates by 100 α.
                    assert!(a.wi.distance(b.wi) < 0.1, "η {eta}, cos {cos}: {a:?} {b:?}");
                }
                assert!(n_split < n / 200, "η {eta}, cos {cos}: {n_split} of {n} are split otherwise");
            }
        }
        assert!([0.0, -1.0, f32::NAN, 0.5 * SMALLEST_ALPHA].into_iter().all(|alpha| is_smooth(alpha, 1.5)));
        assert!(is_smooth(1.0, 1.0) && is_smooth(0.5, f32::NAN) && !is_smooth(SMALLEST_ALPHA, 1.5));
    }

    proptest! {
        #[test]
        fn nothing_is_infinite_or_negative(
            alpha in prop_oneof![Just(1.0), (0.0f32..1.0).prop_map(|x| x.max(1e-4)), (0.0f32..1.0).prop_map(|x| 1e-4 + 1e-3 * x)],
            eta in prop_oneof![0.1f32..10.0, (-1.0f32..1.0).prop_map(|x| 1.0 + 0.1 * x), (-1.0f32..1.0).prop_map(|x| 1.0 + 1e-3 * x)],
            cos in prop_oneof![0.0f32..1.0, (0.0f32..1.0).prop_map(|x| 1e-3 * x), Just(0.0), Just(1.0), Just(1e-30)],
            wi in (-1.0f32..1.0, -1.0f32..1.0, prop_oneof![-1.0f32..1.0, (-1.0f32..1.0).prop_map(|x| 1e-5 * x), Just(0.0), Just(1e-38)]),
            seed in any::<u32>(),
        ) {
            prop_assume!(!is_smooth(alpha, eta));
            let (lobe, whole, wo) = (lobe(alpha, eta), whole_lobe(alpha, eta), direction(cos));
            let wi = Vec3::from(wi).normalize_or(Vec3::X);
            for (lobe, (o, i)) in [lobe, whole].into_iter().flat_map(|lobe| [(wo, wi), (wi, wo), (wo, -wo), (wo, wo)].map(|ways| (lobe, ways))) {
                let (value, pdf) = lobe.eval(o, i, Vec3::Z);
                prop_assert!(value.is_finite() && value.x >= 0.0 && pdf.is_finite() && pdf >= 0.0, "{value} {pdf}");
            }
            let sampler = Sampler::new(seed, 0, 0, 0);
            for u in [sampler.pair(0), Vec2::ZERO, Vec2::splat(1.0f32.next_down())] {
                for choice in [sampler.single(1), 0.0, 1.0f32.next_down()] {
                    if let Some(s) = whole.sample(wo, Vec3::Z, || choice, u) {
                        prop_assert!(s.wi.is_finite() && s.pdf > 0.0 && s.pdf.is_finite(), "{s:?}");
                        prop_assert!(s.weight.is_finite() && s.weight.x >= 0.0, "{s:?}");
                    }
                    let Some(s) = lobe.sample(wo, Vec3::Z, || choice, u) else { continue };
                    prop_assert!(s.wi.is_finite() && (s.wi.length() - 1.0).abs() < 1e-5, "{s:?}");
                    prop_assert!(s.pdf > 0.0 && s.pdf.is_finite(), "{s:?}");
                    let most = if s.through.is_some() { eta * eta } else { 1.0 };
                    prop_assert!(s.weight.x >= 0.0 && s.weight.x <= most, "{s:?}");
                }
            }
        }

        #[test]
        fn what_is_sampled_is_what_is_evaluated(
            alpha in 0.01f32..1.0, eta in prop_oneof![0.4f32..0.95, 1.05f32..2.5], cos in 0.05f32..1.0, seed in any::<u32>(),
        ) {
            let (lobe, wo) = (lobe(alpha, eta), direction(cos));
            let sampler = Sampler::new(seed, 0, 0, 0);
            if let Some(s) = lobe.sample(wo, Vec3::Z, || sampler.single(1), sampler.pair(0)) {
                let (value, pdf) = lobe.eval(wo, s.wi, Vec3::Z);
                // At grazing incidence on a microfacet its angle has fewer accurate digits.
                let tolerance = 1e-2 + 1e-4 / s.wi.z.abs();
                prop_assert!((pdf / s.pdf - 1.0).abs() < tolerance, "{pdf} for {s:?}");
                prop_assert!((value.x / pdf / s.weight.x - 1.0).abs() < tolerance, "{value} / {pdf} for {s:?}");
            }
        }
    }
}
