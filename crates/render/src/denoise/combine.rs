//! Combination of the raw and the filtered image per pixel.
//!
//! Raw and filtered values are mixed by James–Stein shrinkage (1961): the filtered share is the variance divided by the
//! sum of variance and squared bias. Where the filter is unbiased, the two images differ by noise alone and the filter
//! dominates; where it is biased, their squared difference exceeds the variance, which vanishes with more samples. So
//! the result converges to the same limit as the raw image.

use crate::denoise::comparison::Comparison;
use crate::denoise::denoised::Denoised;
use crate::denoise::energy::given_back;
use crate::denoise::input::DenoiseInput;
use crate::denoise::noise::{FilteredNoise, Noise};
use crate::denoise::parallel::{Stop, each};
use crate::denoise::risk::error_of;
use glam::Vec3;

/// Returns `None` if `stop` returned true.
pub(super) fn combine(input: &DenoiseInput, noise: &Noise, filtered: &FilteredNoise, stop: Stop) -> Option<Denoised> {
    let n = input.n_pixels();
    let compared = Comparison::of(input, noise, filtered, stop)?;
    let share: Vec<f32> = each(n, stop, |i| {
        let gain = compared.gain[i].max(0.0);
        (gain / (gain + compared.bias[i]).max(1e-12)).clamp(0.0, 1.0)
    })?;
    // Where the filter is trusted, what is left of the raw value has no fireflies.
    let combined = |i: usize| (input.color[i] - share[i] * noise.excess[i]).lerp(filtered.color[i], share[i]);
    let mut color = each(n, stop, combined)?;
    if noise.excess.iter().any(|excess| *excess != Vec3::ZERO) {
        let back = given_back(input, noise, filtered, &share, stop)?;
        color.iter_mut().zip(&back).for_each(|(color, back)| *color += *back);
    }
    let (error, error_95) = error_of(input, &compared, &share);
    Some(Denoised { color, share, error, error_95 })
}
