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

/// Returns local means of values, separately for pixels at emitters and for all others.
///
/// - `radius`: of the two box filters, pixels.
pub(super) fn smooth_apart(values: &[f32], input: &DenoiseInput, at_emitters: &[bool], radius: usize) -> Vec<f32> {
    let (width, height) = (input.width, input.height);
    let of = |is: bool| {
        let inside: Vec<f32> = at_emitters.iter().map(|&at| if at == is { 1.0 } else { 0.0 }).collect();
        let sums: Vec<f32> = values.iter().zip(&inside).map(|(value, inside)| value * inside).collect();
        let (sums, inside) = (blur(&sums, width, height, radius), blur(&inside, width, height, radius));
        sums.iter().zip(&inside).map(|(sum, inside)| sum / inside.max(1e-6)).collect::<Vec<f32>>()
    };
    if !at_emitters.contains(&true) {
        return blur(values, width, height, radius);
    }
    let (apart, at) = (of(false), of(true));
    (0..values.len()).map(|i| if at_emitters[i] { at[i] } else { apart[i] }).collect()
}
