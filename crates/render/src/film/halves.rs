//! How each pixel's mean has changed with its latest samples, as an estimate of its variance.
//!
//! At 2n samples the film knows the mean of the first n; the step I₂ₙ − Iₙ is half of the difference between the
//! halves. For independent samples its squared expectation is the variance of the mean. The second half of a scrambled
//! net fills the gaps of the first, so their errors are negatively correlated and the square is too large; the error
//! estimate of the whole image ([`crate::film::estimate`]) gives the factor.
//!
//! Between two doublings, the change since the last one tells what the later samples have brought. With a share w of
//! the samples in the last doubling, w²·step² + w·change² has the variance of the mean as its expectation, and a single
//! bright sample raises it by about the square of what it raises the mean by, whichever part it is in.

use crate::film::tiles::Film;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Steps of the last doubling, and what has come since. The square of one step is a poor variance estimate, with one
/// degree of freedom per channel: average over pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfSteps {
    /// Change of the mean of each pixel by the last doubling of its samples, W·m⁻²·sr⁻¹, row by row from the top.
    pub steps: Vec<Vec3>,
    /// Change of the mean of each pixel since then; zero right after a doubling.
    pub late: Vec<Vec3>,
    /// Share of the samples of each pixel that were in that doubling: 1 right after it, and more than 1/2 later.
    pub doubled: Vec<f32>,
    /// Variance of the mean divided by what independent samples would have: with it the mean variance over the image
    /// agrees with [`Film::error_estimate`].
    pub calibration: f32,
}

impl HalfSteps {
    /// Estimated variance of the mean of one pixel, per channel.
    pub fn variance(&self, pixel: usize) -> Vec3 {
        self.variance_of(pixel, self.steps[pixel], self.late[pixel])
    }

    /// Like [`Self::variance`], with other steps.
    pub(crate) fn variance_of(&self, pixel: usize, step: Vec3, late: Vec3) -> Vec3 {
        let share = self.doubled[pixel];
        (share * share * step * step + share * late * late) * self.calibration
    }

    /// A change of one pixel that is made of its own noise: the expectation of its square is the variance.
    pub(crate) fn noise(&self, pixel: usize) -> Vec3 {
        self.change(pixel, self.steps[pixel], self.late[pixel]) * self.calibration.sqrt()
    }

    /// Half of what the halves of the samples of one pixel differ by, from its step and what has come since: the
    /// expectation of its square is the variance that independent samples would have.
    pub(crate) fn change(&self, pixel: usize, step: Vec3, late: Vec3) -> Vec3 {
        let share = self.doubled[pixel];
        share * step + share.sqrt() * late
    }

    /// How much the mean of one pixel depends on the part of its samples that is brightest: at least what a single
    /// bright sample raises it by.
    pub(crate) fn spread(&self, pixel: usize) -> Vec3 {
        self.doubled[pixel] * self.steps[pixel].abs() + self.late[pixel].abs()
    }
}

impl Film {
    /// The last steps of all pixels; `None` before the second sample per pixel, or if those of some pixels are unknown.
    pub fn half_steps(&self) -> Option<HalfSteps> {
        let n_pixels = self.width() as usize * self.height() as usize;
        let (mut steps, mut late) = (vec![Vec3::ZERO; n_pixels], vec![Vec3::ZERO; n_pixels]);
        let mut doubled = vec![1.0_f32; n_pixels];
        let width = self.width() as usize;
        let rows = steps.par_chunks_exact_mut(width).zip(late.par_chunks_exact_mut(width));
        let rows = rows.zip(doubled.par_chunks_exact_mut(width)).zip(0..self.height());
        let of_row = |(((steps, late), doubled), y)| self.half_steps_of_row(y, steps, late, doubled);
        // In the order of the rows, so that the sum does not depend on the number of threads.
        let means: Option<Vec<f64>> = rows.map(of_row).collect();
        let mean: f64 = means?.iter().sum();
        // Before the fourth sample only that of independent samples is known.
        let known = self.error_estimate().filter(|_| mean > 0.0);
        let calibration = known.map_or(1.0, |error| (error.relative.powi(2) * n_pixels as f64 / mean) as f32);
        Some(HalfSteps { steps, late, doubled, calibration })
    }
    /// Fills in one row; returns the sum of the variances that independent samples would have, relative to the level of
    /// each pixel; `None` like [`Self::half_steps`].
    fn half_steps_of_row(&self, y: u32, steps: &mut [Vec3], late: &mut [Vec3], doubled: &mut [f32]) -> Option<f64> {
        let mut sum = 0.0;
        for tile in self.tiles_of_row(y) {
            if tile.half_steps.is_empty() {
                return None;
            }
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            // Blocks may have more samples or fewer than the image has in the mean, for which there are light paths.
            let light_share =
                (self.light.as_ref()).map_or(1.0, |light| tile.light.mean_of as f32 / light.spp.max(1) as f32);
            for block in tile.blocks_in_row(y - tile.origin.y) {
                let share = block.mean_of as f32 / block.spp.max(1) as f32;
                for x in block.start.x..block.start.x + block.size.x {
                    let (local, at) = (first + x as usize, (tile.origin.x + x) as usize);
                    // Light paths are independent of camera paths.
                    let (of_light, traced) = match &self.light {
                        Some(light) => {
                            (*tile.light.half_steps.get(local)?, light.mean(y as usize * self.width() as usize + at))
                        }
                        None => (Vec3::ZERO, DVec3::ZERO),
                    };
                    let step = tile.half_steps[local] + of_light;
                    if !step.is_finite() {
                        return None;
                    }
                    let now = tile.mean_of(local, block.spp) + traced;
                    (steps[at], late[at]) = (step, (now - tile.shown_before(local)).as_vec3());
                    doubled[at] = share;
                    let [of_camera, of_light] = tile.last_steps(local, block.steps);
                    sum += f64::from(share * of_camera + light_share * of_light);
                }
            }
        }
        Some(sum)
    }
}
