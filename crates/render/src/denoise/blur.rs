//! Box filters.

use crate::denoise::input::DenoiseInput;
use crate::denoise::parallel::{Stop, each, fill};
use bytemuck::zeroed_vec;

/// Radius in pixels of the two box filters that average the difference of two images.
pub(super) const RADIUS: usize = 2;
/// Radius in pixels of those that average the noise as far as it is not known from few pixels; see [`Pooled`].
pub(super) const WIDE_RADIUS: usize = 6;

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
    // Sums of shifted rows, many pixels at once; a running sum would be the end of a chain, and lose small values beside
    // large ones for the rest of a row.
    let around = |at: usize, n: usize| at.saturating_sub(radius)..(at + radius + 1).min(n);
    let mut rows: Vec<f32> = zeroed_vec(width * height);
    fill(&mut rows, width, stop, |y, to| {
        let from = &values[y * width..][..width];
        let whole = radius.min(width)..width.saturating_sub(radius).max(radius.min(width));
        for x in (0..whole.start).chain(whole.end..width) {
            let around = &from[around(x, width)];
            to[x] = around.iter().sum::<f32>() / around.len() as f32;
        }
        let n = whole.len();
        let to = &mut to[whole];
        if n > 0 {
            (0..2 * radius + 1).for_each(|shift| add(to, &from[shift..][..n]));
            scale(to, 2 * radius + 1);
        }
    })?;
    let mut mean = zeroed_vec(width * height);
    fill(&mut mean, width, stop, |y, to: &mut [f32]| {
        let around = around(y, height);
        around.clone().for_each(|row| add(to, &rows[row * width..][..width]));
        scale(to, around.len());
    })?;
    Some(mean)
}

fn add(to: &mut [f32], values: &[f32]) {
    to.iter_mut().zip(values).for_each(|(to, value)| *to += value);
}

fn scale(sums: &mut [f32], n: usize) {
    let by = 1.0 / n as f32;
    sums.iter_mut().for_each(|sum| *sum *= by);
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

/// Local means of noisy values: of a narrow neighbourhood where they are known there, of a wide one as far as they are not.
///
/// Where few samples are bright, a narrow neighbourhood may have none of them, and its mean says that there is no noise;
/// where light changes, in a shadow say, the wide one is wrong. How far narrow means differ from the wide one at random
/// follows from how values scatter inside of narrow neighbourhoods, and by that they shrink to it (empirical Bayes: Efron
/// and Morris 1973).
pub(super) struct Pooled<'a> {
    narrow: Apart<'a>,
    wide: Apart<'a>,
}

impl<'a> Pooled<'a> {
    /// `None` if `stop` returned true.
    pub fn of(input: &DenoiseInput, at_emitters: &'a [bool], stop: Stop) -> Option<Self> {
        let of_radius = |radius| Apart::of(input, at_emitters, radius, stop);
        Some(Self { narrow: of_radius(RADIUS)?, wide: of_radius(WIDE_RADIUS)? })
    }

    /// Means of the narrow neighbourhood alone; `None` if `stop` returned true.
    pub fn narrow(&self, of: &(dyn Fn(usize) -> f32 + Sync), stop: Stop) -> Option<Vec<f32>> {
        self.narrow.smooth(&each(self.narrow.at_emitters.len(), stop, of)?, stop)
    }

    /// Means of the wide neighbourhood alone; `None` if `stop` returned true.
    pub fn wide(&self, of: &(dyn Fn(usize) -> f32 + Sync), stop: Stop) -> Option<Vec<f32>> {
        self.wide.smooth(&each(self.wide.at_emitters.len(), stop, of)?, stop)
    }

    /// The means; `None` if `stop` returned true.
    pub fn mean(&self, of: &(dyn Fn(usize) -> f32 + Sync), stop: Stop) -> Option<Vec<f32>> {
        let n = self.narrow.at_emitters.len();
        let values = each(n, stop, of)?;
        let (near, far) = (self.narrow.smooth(&values, stop)?, self.wide.smooth(&values, stop)?);
        let squares = self.narrow.smooth(&each(n, stop, |i| values[i] * values[i])?, stop)?;
        let at_random = |i: usize| (squares[i] - near[i] * near[i]).max(0.0) / n_averaged(RADIUS);
        let at_random = self.wide.smooth(&each(n, stop, at_random)?, stop)?;
        let off = self.wide.smooth(&each(n, stop, |i| (near[i] - far[i]).powi(2))?, stop)?;
        each(n, stop, |i| near[i] + (far[i] - near[i]) * (at_random[i].max(0.0) / off[i].max(1e-30)).min(1.0))
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
