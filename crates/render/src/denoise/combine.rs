//! The honest part: how much of the filtered picture to believe, pixel by pixel, and how wrong the result still is.
//!
//! Raw and filtered are mixed as James and Stein shrink (1961): by the share that the expected variance has of the
//! squared difference between both. Where the filter is right they differ by noise alone and it is believed; where it is
//! biased they differ by more than noise, and the more samples there are, the less noise there is. So the result goes to
//! the same limit as the raw picture, and is worse than it nowhere that the variance is known to a factor of two.

use super::blur::blur;
use super::input::DenoiseInput;
use super::regression::{Filtered, Regression};
use glam::Vec3;
use rayon::prelude::*;

/// Raw and filtered, mixed.
pub(super) struct Combined {
    pub color: Vec<Vec3>,
    /// How much of each pixel is filtered, 0..1.
    pub share: Vec<f32>,
    /// Estimated relMSE, the mean over pixels and channels of (x − truth)² / (level² + 0.01).
    pub relative_mse: f64,
}

/// Part of the squared difference that is taken for what it would be if the filter were right: the local mean of squared
/// differences is itself noisy, and where it is large by chance grains of noise would be left.
const TRUST: f32 = 0.4;
/// Pixels around a pixel, either way, that tell how large noise and difference are, twice.
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
    // Relative to a filtered picture that blurs lights, their noise would be the error of the whole.
    let by_bright = |i: usize| bright_level(input, found, filtered.color[i], i);
    let Surroundings { variance, own, difference } = Surroundings::of(input, found, filtered, &by_bright);
    let risk = |i: usize| {
        let rest = 1.0 - share[i];
        // Never less than what the filter has left of the noise.
        let of_filtered = (difference[i] - variance[i] + 2.0 * own[i]).max(own[i]);
        rest * rest * variance[i] + 2.0 * share[i] * rest * own[i] + share[i] * share[i] * of_filtered
    };
    let risk: f64 = (0..n).map(|i| f64::from(risk(i))).sum();
    Combined { color, share, relative_mse: risk / (3 * n) as f64 }
}

/// Means over the surroundings of each pixel, relative to the square of how bright it is, sums over channels.
struct Surroundings {
    /// Of the raw picture.
    variance: Vec<f32>,
    /// Covariance of raw and filtered.
    own: Vec<f32>,
    /// Squared, of raw and filtered.
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

/// One over the square of how bright a pixel is at least: as filtered, or as both halves of its samples say. A single
/// bright sample is in one half alone.
fn bright_level(input: &DenoiseInput, found: &Regression, filtered: Vec3, i: usize) -> f32 {
    let darker_half = match input.half_steps {
        // Who shows a bit of a light is as bright as it happens to be: the filter knows nothing of such pixels.
        _ if found.at_emitters[i] => input.color[i],
        Some(halves) => input.color[i] - halves.steps[i].abs(),
        None => Vec3::ZERO,
    };
    1.0 / (mean(filtered.max(darker_half)).powi(2) + 0.01)
}

/// Means over surroundings, of what is at emitters and of what is not apart from each other.
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
