//! Combination of the raw and the filtered image per pixel.
//!
//! Raw and filtered values are mixed by James–Stein shrinkage (1961): the filtered share is the expected variance
//! divided by the squared difference between both. Where the filter is unbiased, the two differ by noise alone and the
//! filter dominates; where it is biased, they differ by more than the noise, which vanishes with more samples. So the
//! result converges to the same limit as the raw image, and is nowhere worse than it if the variance is known to a
//! factor of two.

use super::Denoised;
use super::blur::{RADIUS, smooth_apart};
use super::input::DenoiseInput;
use super::noise::{Filtered, Noise};
use super::risk::error_of;
use glam::Vec3;
use rayon::prelude::*;

/// Share of the squared difference that is replaced by its expectation for an unbiased filter: the local mean of
/// squared differences is noisy itself, and where it is large at random, grains of noise would remain.
const TRUST: f32 = 0.4;

pub(super) fn combine(input: &DenoiseInput, noise: &Noise, filtered: &Filtered) -> Denoised {
    let n = input.n_pixels();
    let by_filtered = |i: usize| (filtered.color[i] * filtered.color[i] + 0.01).recip();
    let smooth = |of: &(dyn Fn(usize) -> Vec3 + Sync)| {
        let values: Vec<f32> = (0..n).into_par_iter().map(|i| by_filtered(i).dot(of(i))).collect();
        smooth_apart(&values, input, &noise.at_emitters, RADIUS)
    };
    let variance = smooth(&|i| noise.variance[i]);
    let own = smooth(&|i| filtered.covariance[i]);
    let difference = smooth(&|i| {
        let off = filtered.color[i] - input.color[i];
        off * off
    });
    let share: Vec<f32> = (0..n)
        .map(|i| {
            let gain = variance[i] - own[i];
            (gain / ((1.0 - TRUST) * difference[i] + TRUST * gain).max(1e-12)).clamp(0.0, 1.0)
        })
        .collect();
    let color = (0..n).map(|i| input.color[i].lerp(filtered.color[i], share[i])).collect();
    let (error, error_95) = error_of(input, noise, filtered, &share);
    Denoised { color, share, error, error_95 }
}
