//! Sums of products of features and light over square blocks of pixels, from blocks of 2 × 2 upwards.
//!
//! Linear regression in a window needs such sums only, and those of a window are the sums of its blocks: so a fit over
//! 96 × 96 pixels costs no more than one over 6 × 6, and there are fewer of them.
//!
//! Pixel positions are relative to the centre of the block, which avoids cancellation; they are shifted where blocks
//! are added.

use crate::denoise::parallel::{Stop, each};
use glam::{Vec4, Vec4Swizzles};

/// Features per pixel: normal (3), nearness, position in the image (2), mean albedo.
pub(super) const N_FEATURES: usize = 7;
/// Indices of the position features: column and row, pixels.
pub(super) const X: usize = 4;
pub(super) const Y: usize = 5;

/// Channels that are fitted: three of light, and its noise.
pub(super) const N_CHANNELS: usize = 4;

/// Layout of [`Sums`]: weights, features, products of features, the channels, their products with features, squares of
/// light, variances, their squares, and the number of pixels. All but the last are weighted.
pub(super) const WEIGHT: usize = 0;
pub(super) const FEATURE: usize = 1;
const PRODUCT: usize = FEATURE + N_FEATURES;
pub(super) const LIGHT: usize = PRODUCT + N_FEATURES * (N_FEATURES + 1) / 2;
pub(super) const MIXED: usize = LIGHT + N_CHANNELS;
pub(super) const SQUARE: usize = MIXED + N_CHANNELS * N_FEATURES;
pub(super) const VARIANCE: usize = SQUARE + 1;
pub(super) const SCATTER: usize = VARIANCE + 1;
pub(super) const COUNT: usize = SCATTER + 1;
const N_SUMS: usize = COUNT + 1;

/// The sums of one block or window.
pub(super) type Sums = [f32; N_SUMS];

/// Index of the product of two features.
#[inline(always)]
pub(super) const fn product(i: usize, j: usize) -> usize {
    let (i, j) = if i < j { (i, j) } else { (j, i) };
    PRODUCT + i * N_FEATURES - i * (i + 1) / 2 + j
}

/// Input of the sums, per pixel.
pub(super) struct Samples {
    pub width: usize,
    pub height: usize,
    /// Features; the position is zero here.
    pub features: Vec<[f32; N_FEATURES]>,
    /// Light over albedo, and as the last channel half of what the halves of the samples differ by, sum over channels; 0
    /// if they are unknown.
    pub light: Vec<Vec4>,
    /// Variance of `light`, sum over channels.
    pub variance: Vec<f32>,
    pub weight: Vec<f32>,
}

/// The blocks of one size.
pub(super) struct Blocks {
    /// The side of a block is 2^`level` pixels.
    pub level: u32,
    pub width: usize,
    pub height: usize,
    sums: Vec<Sums>,
}

impl Blocks {
    /// Sums blocks of 2 × 2 pixels; `None` if `stop` returned true.
    pub fn finest(samples: &Samples, stop: Stop) -> Option<Self> {
        let (width, height) = (samples.width.div_ceil(2), samples.height.div_ceil(2));
        let sums = each(width * height, stop, |block| {
            let (left, top) = (2 * (block % width), 2 * (block / width));
            let mut sums = [0.0; N_SUMS];
            for (y, x) in (top..(top + 2).min(samples.height))
                .flat_map(|y| (left..(left + 2).min(samples.width)).map(move |x| (y, x)))
            {
                add_pixel(
                    &mut sums,
                    samples,
                    y * samples.width + x,
                    x as f32 - left as f32 - 0.5,
                    y as f32 - top as f32 - 0.5,
                );
            }
            sums
        })?;
        Some(Self { level: 1, width, height, sums })
    }

    /// Merges to blocks with twice the side; `None` if `stop` returned true.
    pub fn coarser(&self, stop: Stop) -> Option<Self> {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let quarter = 0.25 * (2u32 << self.level) as f32;
        let sums = each(width * height, stop, |block| {
            let (left, top) = (2 * (block % width), 2 * (block / width));
            let mut sums = [0.0; N_SUMS];
            for (y, x) in
                (top..(top + 2).min(self.height)).flat_map(|y| (left..(left + 2).min(self.width)).map(move |x| (y, x)))
            {
                let side = |at: usize, first: usize| if at == first { -quarter } else { quarter };
                self.add_shifted(&mut sums, x, y, side(x, left), side(y, top));
            }
            sums
        })?;
        Some(Self { level: self.level + 1, width, height, sums })
    }

    /// Returns the sums over the window of 3 × 3 blocks around a block, relative to its centre.
    pub fn window(&self, x: usize, y: usize) -> Sums {
        let side = (1u32 << self.level) as f32;
        let mut sums = [0.0; N_SUMS];
        for row in y.saturating_sub(1)..(y + 2).min(self.height) {
            for column in x.saturating_sub(1)..(x + 2).min(self.width) {
                let (dx, dy) = ((column as f32 - x as f32) * side, (row as f32 - y as f32) * side);
                self.add_shifted(&mut sums, column, row, dx, dy);
            }
        }
        sums
    }

    /// - `dx`, `dy`: from the reference centre to that of the block, pixels.
    #[inline(always)]
    fn add_shifted(&self, sums: &mut Sums, x: usize, y: usize, dx: f32, dy: f32) {
        let mut own = self.sums[y * self.width + x];
        shift(&mut own, X, dx);
        shift(&mut own, Y, dy);
        sums.iter_mut().zip(&own).for_each(|(sum, own)| *sum += own);
    }
}

fn add_pixel(sums: &mut Sums, samples: &Samples, pixel: usize, x: f32, y: f32) {
    let mut features = samples.features[pixel];
    (features[X], features[Y]) = (x, y);
    let (weight, light) = (samples.weight[pixel], samples.light[pixel]);
    sums[WEIGHT] += weight;
    sums[COUNT] += 1.0;
    sums[VARIANCE] += weight * samples.variance[pixel];
    sums[SCATTER] += weight * samples.variance[pixel] * samples.variance[pixel];
    sums[SQUARE] += weight * light.xyz().length_squared();
    for c in 0..N_CHANNELS {
        sums[LIGHT + c] += weight * light[c];
    }
    for i in 0..N_FEATURES {
        let feature = weight * features[i];
        sums[FEATURE + i] += feature;
        for j in i..N_FEATURES {
            sums[product(i, j)] += feature * features[j];
        }
        for c in 0..N_CHANNELS {
            sums[MIXED + N_CHANNELS * i + c] += feature * light[c];
        }
    }
}

/// Moves the origin of a feature: its values grow by `by`.
#[inline(always)]
fn shift(sums: &mut Sums, feature: usize, by: f32) {
    let square = product(feature, feature);
    sums[square] += sums[FEATURE + feature] * (2.0 * by) + sums[WEIGHT] * (by * by);
    for other in (0..N_FEATURES).filter(|&other| other != feature) {
        sums[product(feature, other)] += sums[FEATURE + other] * by;
    }
    for c in 0..N_CHANNELS {
        sums[MIXED + N_CHANNELS * feature + c] += sums[LIGHT + c] * by;
    }
    sums[FEATURE + feature] += sums[WEIGHT] * by;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(width: usize, height: usize) -> Samples {
        let number = |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1009) as f32 / 1009.0;
        let n = width * height;
        let features = |i: usize| std::array::from_fn(|k| if k == X || k == Y { 0.0 } else { number(i, k) - 0.5 });
        Samples {
            width,
            height,
            features: (0..n).map(features).collect(),
            light: (0..n).map(|i| Vec4::new(number(i, 11), number(i, 12), number(i, 13), number(i, 16))).collect(),
            variance: (0..n).map(|i| number(i, 14)).collect(),
            weight: (0..n).map(|i| number(i, 15)).collect(),
        }
    }

    /// Windows of all sizes, including those cut by the border, equal the sum over their pixels.
    #[test]
    fn sums_of_windows_are_those_of_their_pixels() {
        let samples = samples(43, 29);
        let mut blocks = Blocks::finest(&samples, &|| false).unwrap();
        for level in 1..=3 {
            assert_eq!(blocks.level, level);
            let side = 1i64 << level;
            for (x, y) in [(0, 0), (1, 2), (blocks.width - 1, blocks.height - 1), (2, 1)] {
                let mut expected = [0.0_f32; N_SUMS];
                let (left, top) = (x as i64 * side, y as i64 * side);
                for (row, column) in (0..29).flat_map(|row| (0..43).map(move |column| (row, column))) {
                    let inside = |at: i64, from: i64| (from - side..from + 2 * side).contains(&at);
                    if inside(column, left) && inside(row, top) {
                        let middle = |at: i64, from: i64| at as f32 - from as f32 - 0.5 * (side as f32 - 1.0);
                        let pixel = (row * 43 + column) as usize;
                        add_pixel(&mut expected, &samples, pixel, middle(column, left), middle(row, top));
                    }
                }
                for (i, (found, expected)) in blocks.window(x, y).iter().zip(&expected).enumerate() {
                    let off = (found - expected).abs();
                    assert!(
                        off <= 2e-4 * expected.abs().max(1.0),
                        "level {level}, {x},{y}, sum {i}: {found} for {expected}"
                    );
                }
            }
            blocks = blocks.coarser(&|| false).unwrap();
        }
    }
}
