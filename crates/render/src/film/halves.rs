//! The change of each pixel's mean between the two halves of its samples, as an estimate of its variance.
//!
//! At 2n samples the film knows the mean of the first n; the step I₂ₙ − Iₙ is half of the difference between the
//! halves. For independent samples its squared expectation is the variance of the mean. The second half of a scrambled
//! net fills the gaps of the first, so their errors are negatively correlated and the square is too large; the error
//! estimate of the whole image ([`crate::film::estimate`]) gives the factor.

use crate::film::tiles::Film;
use glam::Vec3;

/// Steps of the last doubling. The square of one step is a poor variance estimate, with one degree of freedom per
/// channel: average over pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfSteps {
    /// Change of the mean of each pixel by the last doubling of its samples, W·m⁻²·sr⁻¹, row by row from the top.
    pub steps: Vec<Vec3>,
    /// Per pixel: variance of the mean of all samples divided by the square of the step. The mean variance over the
    /// image agrees with [`Film::error_estimate`].
    pub scale: Vec<f32>,
}

impl HalfSteps {
    /// Estimated variance of the mean of one pixel, per channel.
    pub fn variance(&self, pixel: usize) -> Vec3 {
        self.steps[pixel] * self.steps[pixel] * self.scale[pixel]
    }
}

impl Film {
    /// The last steps of all pixels; `None` before the second sample per pixel, or if a part of the film was read from
    /// a file of an older format and has not doubled since.
    pub fn half_steps(&self) -> Option<HalfSteps> {
        let n_pixels = self.width() as usize * self.height() as usize;
        let (mut steps, mut scale) = (vec![Vec3::ZERO; n_pixels], vec![1.0_f32; n_pixels]);
        let mut mean = 0.0;
        for tile in &self.tiles {
            if tile.half_steps.is_empty() {
                return None;
            }
            for (local, &of_camera) in tile.half_steps.iter().enumerate() {
                // Light paths are independent of camera paths.
                let of_light = match &self.light {
                    Some(_) => *tile.light.half_steps.get(local)?,
                    None => Vec3::ZERO,
                };
                if !(of_camera + of_light).is_finite() {
                    return None;
                }
                let block = tile.block_of(local);
                // Since the last doubling the variance has fallen approximately as 1 / samples.
                let since = block.mean_of as f32 / block.spp.max(1) as f32;
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * self.width() as usize + (tile.origin.x + x) as usize;
                (steps[at], scale[at]) = (of_camera + of_light, since);
                mean += f64::from(since * tile.last_step(local));
            }
        }
        // Before the fourth sample only the scale of independent samples, 1, is known.
        if let Some(error) = self.error_estimate().filter(|_| mean > 0.0) {
            let calibration = (error.relative.powi(2) * n_pixels as f64 / mean) as f32;
            scale.iter_mut().for_each(|scale| *scale *= calibration);
        }
        Some(HalfSteps { steps, scale })
    }
}
