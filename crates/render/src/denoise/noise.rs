//! The noise of the raw image, and how much of it a filter passes on.

use super::input::DenoiseInput;
use crate::sampling::hash_u32;
use glam::Vec3;
use rayon::prelude::*;

/// The noise of the raw image.
pub(super) struct Noise {
    /// Variance of the radiance of each pixel, per channel; noisy.
    pub variance: Vec<Vec3>,
    /// Whether a pixel or a neighbour shows an emitter.
    pub at_emitters: Vec<bool>,
}

/// A filtered image.
pub(super) struct Filtered {
    /// Radiance of each pixel.
    pub color: Vec<Vec3>,
    /// Covariance of raw and filtered value, per channel: the part of the noise that is common to both; noisy.
    pub covariance: Vec<Vec3>,
}

/// Size of the probe's change of the image, relative to its noise: small enough for a filter to be nearly linear in it.
const PROBE: f32 = 0.25;

impl Noise {
    /// Applies a filter about which nothing is known; `None` if it fails or is stopped.
    ///
    /// How much noise it passes on is measured by a second image, changed by a multiple of the actual noise: the mean
    /// product of a pixel's change and that of its filtered value is the covariance (Ramani, Blu and Unser 2008,
    /// "Monte-Carlo SURE").
    pub fn probed(
        &self,
        input: &DenoiseInput,
        filter: &mut dyn FnMut(&[Vec3]) -> Option<Vec<Vec3>>,
    ) -> Option<Filtered> {
        let n = input.n_pixels();
        let noise = |i: usize| match input.half_steps {
            Some(halves) => halves.steps[i] * halves.scale[i].sqrt(),
            None => {
                let sign = if hash_u32(i as u32) & 1 == 0 { 1.0 } else { -1.0 };
                sign * self.variance[i].map(f32::sqrt)
            }
        };
        let color = filter(input.color)?;
        let changed: Vec<Vec3> = (0..n).into_par_iter().map(|i| input.color[i] + PROBE * noise(i)).collect();
        let of_changed = filter(&changed)?;
        let covariance = (0..n).into_par_iter().map(|i| (of_changed[i] - color[i]) * noise(i) / PROBE).collect();
        Some(Filtered { color, covariance })
    }
}
