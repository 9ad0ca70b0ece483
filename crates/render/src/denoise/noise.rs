//! The noise of the raw image, and how much of it a filter passes on.

use crate::denoise::input::DenoiseInput;
use crate::denoise::parallel::{Stop, each};
use crate::sampling::hash_u32;
use glam::Vec3;

/// The noise of the raw image.
pub(super) struct Noise {
    /// Variance of the radiance of each pixel, per channel; noisy.
    pub variance: Vec<Vec3>,
    /// Whether a pixel or a neighbour shows an emitter.
    pub at_emitters: Vec<bool>,
    /// What fireflies have more of than usual samples, radiance of each pixel; see [`crate::denoise::limit`].
    pub excess: Vec<Vec3>,
    /// Variance without that, relative to `variance`.
    pub usual: Vec<f32>,
    /// Variance that independent samples would have, relative to `variance`, at least 1. What samples that are spread
    /// evenly gain is known for the whole image only, and within a factor of two: where grains must not pass for detail,
    /// nothing is gained.
    pub independent: f32,
    /// See [`crate::denoise::doubt::scatter`].
    pub scatter: Vec<f32>,
    /// See [`crate::denoise::doubt::doubt`].
    pub doubt: Vec<f32>,
}

/// A filtered image.
pub(super) struct FilteredNoise {
    /// Radiance of each pixel.
    pub color: Vec<Vec3>,
    /// Covariance of raw and filtered value, per channel: the part of the noise that is common to both; noisy.
    pub covariance: Vec<Vec3>,
    /// What the filter's own model cannot explain of its input, squared, per channel: a sign of bias; 0 if it has none.
    pub misfit: Vec<Vec3>,
}

/// Standard deviation of the variance of the whole image, relative to it: how well the halves of the samples tell it.
pub(super) const VARIANCE_UNCERTAINTY: f32 = 0.2;

/// Returns the part of an excess that is hardly random: nearly all of it far above its standard deviation, next to nothing
/// far below.
pub(super) fn significant_part(excess: f32, deviation: f32) -> f32 {
    let square = excess * excess;
    square * excess / (square + deviation * deviation).max(1e-30)
}

/// Size of the probe's change of the image, relative to its noise: small enough for a filter to be nearly linear in it.
const PROBE: f32 = 0.25;

impl Noise {
    /// Variance of a pixel without what fireflies have more of, per channel.
    pub fn usual(&self, pixel: usize) -> Vec3 {
        self.usual[pixel] * self.variance[pixel]
    }

    /// Applies a filter about which nothing is known; `None` if it fails or `stop` returned true.
    ///
    /// How much noise it passes on is measured by a second image, changed by a multiple of the actual noise: the mean
    /// product of a pixel's change and that of its filtered value is the covariance (Ramani, Blu and Unser 2008,
    /// "Monte-Carlo SURE").
    pub fn probed(
        &self,
        input: &DenoiseInput,
        filter: &mut dyn FnMut(&[Vec3]) -> Option<Vec<Vec3>>,
        stop: Stop,
    ) -> Option<FilteredNoise> {
        let n = input.n_pixels();
        let noise = |i: usize| match input.half_steps {
            Some(halves) => halves.noise(i),
            None => {
                let sign = if hash_u32(i as u32) & 1 == 0 { 1.0 } else { -1.0 };
                sign * self.variance[i].map(f32::sqrt)
            }
        };
        let color = filter(input.color)?;
        let changed = each(n, stop, |i| input.color[i] + PROBE * noise(i))?;
        let of_changed = filter(&changed)?;
        let covariance: Vec<Vec3> = each(n, stop, |i| (of_changed[i] - color[i]) * noise(i) / PROBE)?;
        Some(FilteredNoise { color, covariance, misfit: vec![Vec3::ZERO; n] })
    }
}
