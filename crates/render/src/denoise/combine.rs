//! Combination of the raw and the filtered image per pixel, and its error estimate.
//!
//! Raw and filtered values are mixed by James–Stein shrinkage (1961): the filtered share is the expected variance
//! divided by the squared difference between both. Where the filter is unbiased, the two differ by noise alone and the
//! filter dominates; where it is biased, they differ by more than the noise, which vanishes with more samples. So the
//! result converges to the same limit as the raw image, and is nowhere worse than it if the variance is known to a
//! factor of two.

use super::blur::blur;
use super::input::DenoiseInput;
use super::regression::{Filtered, Regression};
use glam::Vec3;
use rayon::prelude::*;

/// The combined image.
pub(super) struct Combined {
    pub color: Vec<Vec3>,
    /// Filtered share of each pixel, 0..1.
    pub share: Vec<f32>,
    /// Estimated relMSE, the mean over pixels and channels of (x − reference)² / (level² + 0.01).
    pub relative_mse: f64,
}

/// Share of the squared difference that is replaced by its expectation for an unbiased filter: the local mean of
/// squared differences is noisy itself, and where it is large at random, grains of noise would remain.
const TRUST: f32 = 0.4;
/// Radius in pixels of the two box filters that average variance and difference.
const RADIUS: usize = 2;

pub(super) fn combine(input: &DenoiseInput, found: &Regression, filtered: &Filtered) -> Combined {
    let n = input.n_pixels();
    let by_filtered = |i: usize| 1.0 / (mean(filtered.color[i]).powi(2) + 0.01);
    let around = Surroundings::of(input, found, filtered, &by_filtered);
    let share: Vec<f32> = (0..n)
        .map(|i| {
            let gain = around.variance[i] - around.own[i];
            (gain / ((1.0 - TRUST) * around.difference[i] + TRUST * gain).max(1e-12)).clamp(0.0, 1.0)
        })
        .collect();
    let color = (0..n).map(|i| input.color[i].lerp(filtered.color[i], share[i])).collect();
    // Relative to a filtered image that blurs lights, their noise would dominate the error of the whole image.
    let by_bright = |i: usize| bright_level(input, found, filtered.color[i], i);
    let Surroundings { variance, own, difference } = Surroundings::of(input, found, filtered, &by_bright);
    let risk = |i: usize| {
        let rest = 1.0 - share[i];
        // Never less than the noise that the filter leaves.
        let of_filtered = (difference[i] - variance[i] + 2.0 * own[i]).max(own[i]);
        rest * rest * variance[i] + 2.0 * share[i] * rest * own[i] + share[i] * share[i] * of_filtered
    };
    let risk: f64 = (0..n).map(|i| f64::from(risk(i))).sum();
    Combined { color, share, relative_mse: risk / (3 * n) as f64 }
}

/// Local means around each pixel, relative to the squared level, sums over channels.
struct Surroundings {
    /// Variance of the raw image.
    variance: Vec<f32>,
    /// Covariance of raw and filtered image.
    own: Vec<f32>,
    /// Squared difference of raw and filtered image.
    difference: Vec<f32>,
}

impl Surroundings {
    fn of(
        input: &DenoiseInput,
        found: &Regression,
        filtered: &Filtered,
        level: &(dyn Fn(usize) -> f32 + Sync),
    ) -> Self {
        let smooth = |of: &(dyn Fn(usize) -> f32 + Sync)| {
            let values: Vec<f32> = (0..input.n_pixels()).into_par_iter().map(|i| level(i) * of(i)).collect();
            smooth_apart(&values, input, &found.at_emitters)
        };
        Self {
            variance: smooth(&|i| found.variance[i]),
            own: smooth(&|i| found.variance[i] * filtered.own[i]),
            difference: smooth(&|i| (filtered.color[i] - input.color[i]).length_squared()),
        }
    }
}

fn mean(color: Vec3) -> f32 {
    color.element_sum() / 3.0
}

/// Returns one over the squared level of a pixel plus 0.01: the level is the filtered value, or the darker half of its
/// samples if that is brighter. A single bright sample is in one half only.
fn bright_level(input: &DenoiseInput, found: &Regression, filtered: Vec3, i: usize) -> f32 {
    let darker_half = match input.half_steps {
        // Pixels that partly show a light: the filter has no information about them, so their own value is used.
        _ if found.at_emitters[i] => input.color[i],
        Some(halves) => input.color[i] - halves.steps[i].abs(),
        None => Vec3::ZERO,
    };
    1.0 / (mean(filtered.max(darker_half)).powi(2) + 0.01)
}

/// Returns local means of values, separately for pixels at emitters and for all others.
fn smooth_apart(values: &[f32], input: &DenoiseInput, at_emitters: &[bool]) -> Vec<f32> {
    let (width, height) = (input.width, input.height);
    let of = |is: bool| {
        let inside: Vec<f32> = at_emitters.iter().map(|&at| if at == is { 1.0 } else { 0.0 }).collect();
        let sums: Vec<f32> = values.iter().zip(&inside).map(|(value, inside)| value * inside).collect();
        let (sums, inside) = (blur(&sums, width, height, RADIUS), blur(&inside, width, height, RADIUS));
        sums.iter().zip(&inside).map(|(sum, inside)| sum / inside.max(1e-6)).collect::<Vec<f32>>()
    };
    if !at_emitters.contains(&true) {
        return blur(values, width, height, RADIUS);
    }
    let (apart, at) = (of(false), of(true));
    (0..values.len()).map(|i| if at_emitters[i] { at[i] } else { apart[i] }).collect()
}
