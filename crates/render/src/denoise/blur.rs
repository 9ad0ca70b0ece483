//! Box filters.

use super::input::DenoiseInput;
use super::{Stop, each, fill};
use bytemuck::zeroed_vec;

/// Radius in pixels of the two box filters that average variance and difference of raw and filtered image.
pub(super) const RADIUS: usize = 2;

/// Number of pixels that two box filters average: one over the sum of the squares of their weights, a triangle per axis.
pub(super) fn n_averaged(radius: usize) -> f32 {
    let side = (2 * radius + 1) as f32;
    let of_axis = 3.0 * side.powi(3) / (2.0 * side * side + 1.0);
    of_axis * of_axis
}

/// Applies a box filter of `2 * radius + 1` pixels per side twice, which is nearly a Gaussian. At the border the box is
/// cut. `None` if `stop` returned true.
pub(super) fn blur(values: &[f32], width: usize, height: usize, radius: usize, stop: Stop) -> Option<Vec<f32>> {
    box_mean(&box_mean(values, width, height, radius, stop)?, width, height, radius, stop)
}

fn box_mean(values: &[f32], width: usize, height: usize, radius: usize, stop: Stop) -> Option<Vec<f32>> {
    let mut rows: Vec<f32> = zeroed_vec(width * height);
    fill(&mut rows, width, stop, |y, to| {
        let from = &values[y * width..][..width];
        for (x, to) in to.iter_mut().enumerate() {
            let around = &from[x.saturating_sub(radius)..(x + radius + 1).min(width)];
            *to = around.iter().sum::<f32>() / around.len() as f32;
        }
    })?;
    let mut mean = zeroed_vec(width * height);
    fill(&mut mean, width, stop, |y, to: &mut [f32]| {
        let around = y.saturating_sub(radius)..(y + radius + 1).min(height);
        let share = 1.0 / around.len() as f32;
        for row in around {
            for (to, from) in to.iter_mut().zip(&rows[row * width..][..width]) {
                *to += from * share;
            }
        }
    })?;
    Some(mean)
}

/// Local means of values, separately for pixels at emitters and for all others.
pub(super) struct Apart<'a> {
    width: usize,
    height: usize,
    radius: usize,
    at_emitters: &'a [bool],
    /// Local share of pixels at emitters, and of all others; none where no pixel is at an emitter.
    shares: Option<[Vec<f32>; 2]>,
}

impl<'a> Apart<'a> {
    /// `None` if `stop` returned true.
    ///
    /// - `radius`: of the two box filters, pixels.
    pub fn of(input: &DenoiseInput, at_emitters: &'a [bool], radius: usize, stop: Stop) -> Option<Self> {
        let (width, height) = (input.width, input.height);
        let share = |is: bool| {
            let inside = each(at_emitters.len(), stop, |i| if at_emitters[i] == is { 1.0 } else { 0.0 })?;
            blur(&inside, width, height, radius, stop)
        };
        let shares = if at_emitters.contains(&true) { Some([share(true)?, share(false)?]) } else { None };
        Some(Self { width, height, radius, at_emitters, shares })
    }

    /// `None` if `stop` returned true.
    pub fn smooth(&self, values: &[f32], stop: Stop) -> Option<Vec<f32>> {
        let Self { width, height, radius, at_emitters, .. } = *self;
        let Some(shares) = &self.shares else { return blur(values, width, height, radius, stop) };
        let of = |is: bool| {
            let inside = each(values.len(), stop, |i| if at_emitters[i] == is { values[i] } else { 0.0 })?;
            blur(&inside, width, height, radius, stop)
        };
        let sums = [of(true)?, of(false)?];
        let mean = |i: usize| {
            let which = usize::from(!at_emitters[i]);
            sums[which][i] / shares[which][i].max(1e-6)
        };
        each(values.len(), stop, mean)
    }
}
