//! Comparison with a reference whose variance is known: a z-test per pixel.
//!
//! The rule is that of the render tests of Mitsuba 3: under the hypothesis that both images have the same mean, the
//! difference of a pixel, over the standard deviation of a mean of as many samples, is normally distributed. Each
//! channel of CIE XYZ is tested on both sides, at a level at which all pixels together are right 99 times of 100
//! (Šidák 1967).
//!
//! Source: `src/render/tests/test_renders.py` of Mitsuba 3.

use crate::report::LinearPicture;
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Level of significance of all pixels together.
const SIGNIFICANCE: f64 = 0.01;
/// Variance below which a pixel is not taken for exact.
const LEAST_VARIANCE: f64 = 1e-4;
/// Share of values from which images count as equal.
const ENOUGH: f64 = 0.9975;

/// From linear Rec. 709 to CIE XYZ (IEC 61966-2-1).
const XYZ: DMat3 = DMat3::from_cols_array(&[
    0.412_453, 0.212_671, 0.019_334, 0.357_580, 0.715_160, 0.119_193, 0.180_423, 0.072_169, 0.950_227,
]);

/// The result of a z-test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// Share of the values of all pixels and channels that agree, 0 to 1.
    pub share: f64,
    /// Standard deviations from which a value does not agree.
    pub limit: f64,
    /// The largest difference, standard deviations.
    pub largest: f64,
}

impl ZTest {
    /// Tests the means of `spp` samples per pixel.
    ///
    /// - `variance`: of one sample, in CIE XYZ, which is stored as linear Rec. 709. All images have one size.
    pub fn of(picture: &LinearPicture, spp: u32, reference: &LinearPicture, variance: &LinearPicture) -> Self {
        let n = picture.pixels.len().max(1);
        let limit = limit(n);
        let (mut agree, mut largest) = (0_usize, 0_f64);
        for ((shown, truth), variance) in picture.pixels.iter().zip(&reference.pixels).zip(&variance.pixels) {
            let variance = (XYZ * variance.as_dvec3()).max(DVec3::splat(LEAST_VARIANCE));
            let z = (XYZ * (shown.as_dvec3() - truth.as_dvec3())).abs() * (f64::from(spp) / variance).map(f64::sqrt);
            agree += z.to_array().into_iter().filter(|z| *z < limit).count();
            largest = largest.max(z.max_element());
        }
        Self { share: agree as f64 / (3 * n) as f64, limit, largest }
    }

    /// Whether the images count as equal.
    pub fn passes(&self) -> bool {
        self.share >= ENOUGH
    }
}

/// Standard deviations beyond which each of `n` values lies with a probability of 1 − 0.99^(1/n), on both sides
/// together.
fn limit(n: usize) -> f64 {
    let level = -((1.0 - SIGNIFICANCE).ln() / n as f64).exp_m1();
    let (mut low, mut high) = (1.0, 40.0);
    while high - low > 1e-9 {
        let middle = 0.5 * (low + high);
        if 2.0 * upper_tail(middle) > level { low = middle } else { high = middle }
    }
    high
}

/// Probability that a normally distributed number exceeds `z`, which is at least 1: the continued fraction of Laplace.
fn upper_tail(z: f64) -> f64 {
    let fraction = (1..200).rev().fold(z, |rest, k| z + f64::from(k) / rest);
    (-0.5 * z * z).exp() / (TAU.sqrt() * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn tails_and_limits_are_those_of_tables() {
        for (z, tail) in [(1.0, 0.158_655_254), (1.96, 0.024_997_895), (3.0, 0.001_349_898), (5.0, 2.866_516e-7)] {
            assert!((upper_tail(z) / tail - 1.0).abs() < 1e-6, "{z}: {}", upper_tail(z));
        }
        // 1 % on both sides is 2.5758; for 2304 values 1 - 0.99^(1/2304) = 4.3621e-6, 4.5933.
        assert!((limit(1) - 2.575_829).abs() < 1e-5, "{}", limit(1));
        assert!((limit(2304) - 4.593_338).abs() < 1e-5, "{}", limit(2304));
    }

    #[test]
    fn noise_passes_and_another_light_does_not() {
        let picture = |value: &dyn Fn(u32) -> f32| LinearPicture {
            width: 64,
            height: 64,
            pixels: (0..4096).map(|i| Vec3::splat(value(i))).collect(),
        };
        // Sums of twelve uniform numbers less 6 have the variance 1.
        let noise = |i: u32| {
            let random = |k: u32| {
                let x = (12 * i + k).wrapping_mul(0x9e37_79b9);
                let x = (x ^ x >> 16).wrapping_mul(0x85eb_ca6b);
                (x ^ x >> 13).wrapping_mul(0xc2b2_ae35) as f32 / u32::MAX as f32
            };
            (0..12).map(random).sum::<f32>() - 6.0
        };
        // A grey sample with the standard deviation 0.5 of luminance; means of 100 samples.
        let variance = LinearPicture {
            pixels: vec![(XYZ.inverse() * (XYZ * DVec3::ONE).powf(2.0) * 0.25).as_vec3(); 4096],
            ..picture(&|_| 0.0)
        };
        let reference = picture(&|_| 1.0);
        let same = ZTest::of(&picture(&|i| 1.0 + 0.05 * noise(i)), 100, &reference, &variance);
        assert!(same.passes() && same.largest > 2.0 && same.largest < same.limit, "{same:?}");
        let brighter = ZTest::of(&picture(&|i| 1.2 + 0.05 * noise(i)), 100, &reference, &variance);
        assert!(!brighter.passes() && brighter.share < 0.9, "{brighter:?}");
    }
}
