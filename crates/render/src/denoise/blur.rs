//! Box filters.

use rayon::prelude::*;

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
