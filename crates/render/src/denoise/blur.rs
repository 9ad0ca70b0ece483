//! Box filters.

use super::input::DenoiseInput;
use rayon::prelude::*;

/// Radius in pixels of the two box filters that average variance and difference of raw and filtered image.
pub(super) const RADIUS: usize = 2;
/// Number of pixels that these two average: one over the sum of the squares of their weights.
pub(super) const N_AVERAGED: f32 = 54.0;

/// Applies a box filter of `2 * radius + 1` pixels per side twice, which is nearly a Gaussian. At the border the box is
/// cut.
pub(super) fn blur(values: &[f32], width: usize, height: usize, radius: usize) -> Vec<f32> {
    box_mean(&box_mean(values, width, height, radius), width, height, radius)
}

fn box_mean(values: &[f32], width: usize, height: usize, radius: usize) -> Vec<f32> {
    let mut rows = vec![0.0; width * height];
    rows.par_chunks_exact_mut(width).zip(values.par_chunks_exact(width)).for_each(|(to, from)| {
        for (x, to) in to.iter_mut().enumerate() {
            let around = &from[x.saturating_sub(radius)..(x + radius + 1).min(width)];
            *to = around.iter().sum::<f32>() / around.len() as f32;
        }
    });
    let mut mean = vec![0.0; width * height];
    mean.par_chunks_exact_mut(width).enumerate().for_each(|(y, to)| {
        let around = y.saturating_sub(radius)..(y + radius + 1).min(height);
        let share = 1.0 / around.len() as f32;
        for row in around {
            for (to, from) in to.iter_mut().zip(&rows[row * width..][..width]) {
                *to += from * share;
            }
        }
    });
    mean
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
    /// - `radius`: of the two box filters, pixels.
    pub fn of(input: &DenoiseInput, at_emitters: &'a [bool], radius: usize) -> Self {
        let (width, height) = (input.width, input.height);
        let share = |is: bool| {
            let inside: Vec<f32> = at_emitters.par_iter().map(|&at| if at == is { 1.0 } else { 0.0 }).collect();
            blur(&inside, width, height, radius)
        };
        let shares = at_emitters.contains(&true).then(|| [true, false].map(share));
        Self { width, height, radius, at_emitters, shares }
    }

    pub fn smooth(&self, values: &[f32]) -> Vec<f32> {
        let Self { width, height, radius, at_emitters, .. } = *self;
        let Some(shares) = &self.shares else { return blur(values, width, height, radius) };
        let of = |is: bool| {
            let inside = values.par_iter().zip(at_emitters).map(|(&value, &at)| if at == is { value } else { 0.0 });
            blur(&inside.collect::<Vec<f32>>(), width, height, radius)
        };
        let sums = [true, false].map(of);
        let mean = |i: usize| {
            let which = usize::from(!at_emitters[i]);
            sums[which][i] / shares[which][i].max(1e-6)
        };
        (0..values.len()).into_par_iter().map(mean).collect()
    }
}
