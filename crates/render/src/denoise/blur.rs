//! Box filters.

use crate::denoise::input::DenoiseInput;
use crate::denoise::parallel::{Stop, each, fill};
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

/// Values that can leave a running sum in `f64` without a trace beside values of about one; infinity cannot at all.
const MOST_OF_RUNNING_SUM: f32 = 1e8;

fn box_mean(values: &[f32], width: usize, height: usize, radius: usize, stop: Stop) -> Option<Vec<f32>> {
    let mut rows: Vec<f32> = zeroed_vec(width * height);
    fill(&mut rows, width, stop, |y, to| {
        let from = &values[y * width..][..width];
        if from.iter().any(|value| !(value.abs() < MOST_OF_RUNNING_SUM)) {
            for (x, to) in to.iter_mut().enumerate() {
                let around = &from[x.saturating_sub(radius)..(x + radius + 1).min(width)];
                *to = around.iter().sum::<f32>() / around.len() as f32;
            }
            return;
        }
        let mut sum: f64 = from[..radius.min(width)].iter().map(|value| f64::from(*value)).sum();
        for (x, to) in to.iter_mut().enumerate() {
            if x + radius < width {
                sum += f64::from(from[x + radius]);
            }
            if x > radius {
                sum -= f64::from(from[x - radius - 1]);
            }
            let n = (x + radius + 1).min(width) - x.saturating_sub(radius);
            *to = (sum / n as f64) as f32;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_means_are_those_of_their_pixels() {
        for (width, height, radius) in [(1, 1, 2), (7, 5, 1), (9, 4, 6), (40, 30, 12)] {
            let value = |i: usize| ((i * 7919) % 101) as f32 * if i.is_multiple_of(17) { 1e6 } else { 1.0 };
            let mut values: Vec<f32> = (0..width * height).map(value).collect();
            values[0] = f32::INFINITY;
            let means = box_mean(&values, width, height, radius, &|| false).unwrap();
            for (i, mean) in means.iter().enumerate() {
                let around = |at: usize, n: usize| at.saturating_sub(radius)..(at + radius + 1).min(n);
                let (columns, rows) = (around(i % width, width), around(i / width, height));
                if columns.contains(&0) && rows.contains(&0) {
                    continue;
                }
                let n = (columns.len() * rows.len()) as f64;
                let all = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
                let expected = all.map(|i| f64::from(values[i])).sum::<f64>() / n;
                assert!((f64::from(*mean) / expected - 1.0).abs() < 1e-5, "{width} × {height}, {radius}, {i}: {mean}");
            }
        }
    }
}
