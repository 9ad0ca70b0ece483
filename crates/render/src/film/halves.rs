//! What the two halves of each pixel's samples say of the variance of its mean.
//!
//! Samples double: at 2n samples the film knows the mean of the first n, so the halves differ by twice the step
//! I₂ₙ − Iₙ, whose square is the variance of the mean for independent samples, on average over pixels. The second half of
//! a scrambled net fills the gaps of the first, so their errors are of opposite sign and the square is too large; the
//! error estimate of the whole picture ([`crate::film::estimate`]) knows by how much.

use crate::film::tiles::Film;
use glam::Vec3;

/// Squared steps of one pixel are a poor estimate of its variance, one degree of freedom a channel: average them.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfSteps {
    /// How far the mean of each pixel moved when its samples last doubled, W·m⁻²·sr⁻¹, row by row from the top.
    pub steps: Vec<Vec3>,
    /// Variance of the mean of all samples over the square of the step, for each pixel: its mean over the picture agrees
    /// with [`Film::error_estimate`].
    pub scale: Vec<f32>,
}

impl HalfSteps {
    /// Estimated variance of the mean of one pixel, a channel each.
    pub fn variance(&self, pixel: usize) -> Vec3 {
        self.steps[pixel] * self.steps[pixel] * self.scale[pixel]
    }
}

impl Film {
    /// The last steps of all pixels; `None` before the second sample of a pixel, or where a part of the film was read from
    /// a file and has not doubled since.
    pub fn half_steps(&self) -> Option<HalfSteps> {
        let n_pixels = self.width() as usize * self.height() as usize;
        let (mut steps, mut scale) = (vec![Vec3::ZERO; n_pixels], vec![1.0_f32; n_pixels]);
        let mut mean = 0.0;
        for tile in &self.tiles {
            if tile.half_steps.is_empty() {
                return None;
            }
            for (local, &of_camera) in tile.half_steps.iter().enumerate() {
                // Light from light paths is independent of that from the camera.
                let of_light = match &self.light {
                    Some(_) => *tile.light.half_steps.get(local)?,
                    None => Vec3::ZERO,
                };
                if of_camera.is_nan() {
                    return None;
                }
                let block = tile.block_of(local);
                // Since the last doubling variance has fallen, about as the samples have grown.
                let since = block.mean_of as f32 / block.spp.max(1) as f32;
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * self.width() as usize + (tile.origin.x + x) as usize;
                (steps[at], scale[at]) = (of_camera + of_light, since);
                mean += f64::from(since * tile.last_step(local));
            }
        }
        // Before the fourth sample nothing is known but that independent samples would need no scale.
        if let Some(error) = self.error_estimate().filter(|_| mean > 0.0) {
            let calibration = (error.relative.powi(2) * n_pixels as f64 / mean) as f32;
            scale.iter_mut().for_each(|scale| *scale *= calibration);
        }
        Some(HalfSteps { steps, scale })
    }
}
