//! Combination of the raw and the filtered image per pixel.
//!
//! Raw and filtered values are mixed by James–Stein shrinkage (1961): the filtered share is the variance divided by the
//! sum of variance and squared bias. Where the filter is unbiased, the two images differ by noise alone and the filter
//! dominates; where it is biased, their squared difference exceeds the variance, which vanishes with more samples. So
//! the result converges to the same limit as the raw image.
//!
//! Squared difference and variance are local means over few pixels with one or three degrees of freedom each, and as
//! uncertain as that: what exceeds the variance counts as bias as far as it is significant.

use crate::denoise::blur::{Apart, RADIUS};
use crate::denoise::denoised::Denoised;
use crate::denoise::energy::given_back;
use crate::denoise::input::DenoiseInput;
use crate::denoise::noise::{FilteredNoise, Noise, squared_bias};
use crate::denoise::parallel::{Stop, each};
use crate::denoise::risk::error_of;
use glam::Vec3;

/// Returns `None` if `stop` returned true.
pub(super) fn combine(input: &DenoiseInput, noise: &Noise, filtered: &FilteredNoise, stop: Stop) -> Option<Denoised> {
    let n = input.n_pixels();
    let by_filtered = |i: usize| (filtered.color[i] * filtered.color[i] + 0.01).recip();
    let apart = Apart::of(input, &noise.at_emitters, RADIUS, stop)?;
    let smooth =
        |of: &(dyn Fn(usize) -> Vec3 + Sync)| apart.smooth(&each(n, stop, |i| by_filtered(i).dot(of(i)))?, stop);
    let variance = smooth(&|i| noise.variance[i])?;
    let own = smooth(&|i| filtered.covariance[i])?;
    let difference = smooth(&|i| {
        let off = filtered.color[i] - input.color[i];
        off * off
    })?;
    let share: Vec<f32> = each(n, stop, |i| {
        let gain = (variance[i] - own[i]).max(0.0);
        let bias = squared_bias(difference[i], variance[i], own[i]);
        (gain / (gain + bias).max(1e-12)).clamp(0.0, 1.0)
    })?;
    // Where the filter is trusted, what is left of the raw value has no fireflies.
    let combined = |i: usize| (input.color[i] - share[i] * noise.excess[i]).lerp(filtered.color[i], share[i]);
    let mut color = each(n, stop, combined)?;
    if noise.excess.iter().any(|excess| *excess != Vec3::ZERO) {
        let back = given_back(input, noise, filtered, &share, stop)?;
        color.iter_mut().zip(&back).for_each(|(color, back)| *color += *back);
    }
    let (error, error_95) = error_of(input, noise, filtered, &share, stop)?;
    Some(Denoised { color, share, error, error_95 })
}
