//! The best linear function of the features in one window, and its error.

use crate::denoise::moments::{
    Blocks, COUNT, FEATURE, LIGHT, MIXED, N_CHANNELS, N_FEATURES, SCATTER, SQUARE, Sums, VARIANCE, WEIGHT, X, Y,
    product,
};
use crate::denoise::noise::significant_part;
use crate::denoise::parallel::{Stop, each};
use bytemuck::Zeroable;
use glam::Vec4;

/// Lower limit of the squared misfit of light over albedo: a fit without noise and misfit in its window is still
/// uncertain for pixels with other features.
const LEAST_MISFIT: f32 = 1e-4;

/// Share of the squared distance from the mean features by which misfit grows: it is not noise, and much of it comes from
/// places with features like those of the pixel.
const MISFIT_BY_DISTANCE: f32 = 0.1;

/// Mean square of the difference of a squared residual and its variance, over the squared variance: each of both scatters
/// by 2 of it if the noise is normal.
const SCATTER_OF_EXCESS: f32 = 4.0;

/// Light as a linear function of the features, by ridge regression in a window.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(super) struct Fit {
    /// Mean features of the window.
    mean: [f32; N_FEATURES],
    /// One over the variance of each feature plus the ridge term.
    precision: [f32; N_FEATURES],
    /// Mean of the window, per channel.
    light: Vec4,
    slope: [Vec4; N_FEATURES],
    /// Mean squared residual of the fit minus the noise: the part that no fit of this kind can explain.
    pub misfit: f32,
    /// Mean variance of the noise in the window.
    pub noise: f32,
    /// Factor that corrects the variance of residuals for the degrees of freedom of the fit.
    pub unbias: f32,
    /// One over the number of pixels.
    inverse_count: f32,
    /// Mean weight of a pixel.
    pub mean_weight: f32,
}

/// Prediction of a fit for one pixel.
pub(super) struct Prediction {
    /// Light over albedo, and its noise.
    pub light: Vec4,
    /// 1 + squared distance from the mean features in standard deviations.
    distance: f32,
    inverse_count: f32,
}

impl Prediction {
    /// Variance of the prediction over that of one pixel's noise.
    pub fn leverage(&self) -> f32 {
        self.distance * self.inverse_count
    }
}

impl Fit {
    /// Returns the expected squared error of a prediction, which grows with the distance of the features from the
    /// window's mean.
    pub fn expected_error(&self, prediction: &Prediction) -> f32 {
        let of_misfit = 1.0 + MISFIT_BY_DISTANCE * (prediction.distance - 1.0);
        (self.misfit + LEAST_MISFIT) * of_misfit + self.noise * prediction.leverage()
    }

    /// - `features`: with the position relative to the centre of the window's central block.
    #[inline(always)]
    pub fn predict(&self, features: &[f32; N_FEATURES]) -> Prediction {
        let (mut light, mut distance) = (self.light, 1.0);
        for (((feature, mean), precision), slope) in
            features.iter().zip(&self.mean).zip(&self.precision).zip(&self.slope)
        {
            let off = feature - mean;
            distance += off * off * precision;
            light += off * *slope;
        }
        Prediction { light, distance, inverse_count: self.inverse_count }
    }
}

/// The fits in all windows of one size.
pub(super) struct Fits {
    pub level: u32,
    pub width: usize,
    pub height: usize,
    fits: Vec<Fit>,
}

impl Fits {
    /// Fits all windows; `None` if `stop` returned true.
    ///
    /// - `significance`: standard deviations by which residuals must exceed the noise to be taken for misfit.
    pub fn of(blocks: &Blocks, significance: f32, stop: Stop) -> Option<Self> {
        let ridge = ridge(blocks.level);
        let (width, height) = (blocks.width, blocks.height);
        let fit = |i: usize| solve(&blocks.window(i % width, i / width), &ridge, significance);
        let fits = each(width * height, stop, fit)?;
        Some(Self { level: blocks.level, width, height, fits })
    }

    /// Calls `take` with each window that contains a pixel, the pixel's features relative to it, and the pixel's
    /// nearness to the centre, 0..1.
    #[inline(always)]
    pub fn around(
        &self,
        x: usize,
        y: usize,
        features: &[f32; N_FEATURES],
        mut take: impl FnMut(&Fit, &[f32; N_FEATURES], f32),
    ) {
        let side = 1usize << self.level;
        let reach = 1.0 / (1.5 * side as f32);
        let middle = |at: usize, block: usize| at as f32 - (block * side) as f32 - 0.5 * (side as f32 - 1.0);
        let nearness = |off: f32| (1.0 - (off * reach) * (off * reach)).max(0.0);
        let (column, row) = (x >> self.level, y >> self.level);
        let mut features = *features;
        for window_y in row.saturating_sub(1)..(row + 2).min(self.height) {
            features[Y] = middle(y, window_y);
            let near_y = nearness(features[Y]);
            for window_x in column.saturating_sub(1)..(column + 2).min(self.width) {
                features[X] = middle(x, window_x);
                take(&self.fits[window_y * self.width + window_x], &features, near_y * nearness(features[X]));
            }
        }
    }
}

/// Returns the ridge term per feature, added to its variance: much smaller differences are ignored. Above the rounding
/// errors of the sums.
fn ridge(level: u32) -> [f32; N_FEATURES] {
    let side = (1u32 << level) as f32;
    let place = 6e-4 * side * side;
    [3e-5, 3e-5, 3e-5, 3e-7, place, place, 1e-5]
}

// Indices as in the formulas, which use rows and columns at once.
#[allow(clippy::needless_range_loop)]
fn solve(sums: &Sums, ridge: &[f32; N_FEATURES], significance: f32) -> Fit {
    let inverse_weight = 1.0 / sums[WEIGHT].max(1e-20);
    let inverse_count = 1.0 / sums[COUNT].max(1.0);
    let mean: [f32; N_FEATURES] = std::array::from_fn(|i| sums[FEATURE + i] * inverse_weight);
    let light = Vec4::from_array(std::array::from_fn(|c| sums[LIGHT + c] * inverse_weight));
    let (mut factor, mut precision, mut freedom) = ([[0.0; N_FEATURES]; N_FEATURES], [0.0; N_FEATURES], 1.0);
    for i in 0..N_FEATURES {
        for j in i..N_FEATURES {
            factor[j][i] = sums[product(i, j)] * inverse_weight - mean[i] * mean[j];
        }
        let variance = factor[i][i].max(0.0);
        factor[i][i] = variance + ridge[i];
        precision[i] = 1.0 / factor[i][i];
        freedom += variance * precision[i];
    }
    // Cholesky factor in place, with the reciprocals of its diagonal.
    for j in 0..N_FEATURES {
        let mut pivot = factor[j][j];
        for k in 0..j {
            pivot -= factor[j][k] * factor[j][k];
        }
        // The pivot is at least the ridge term, except for rounding.
        let reciprocal = 1.0 / pivot.max(0.5 * ridge[j]).sqrt();
        factor[j][j] = reciprocal;
        for i in j + 1..N_FEATURES {
            let mut sum = factor[i][j];
            for k in 0..j {
                sum -= factor[i][k] * factor[j][k];
            }
            factor[i][j] = sum * reciprocal;
        }
    }
    let mut slope = [Vec4::ZERO; N_FEATURES];
    let mut unexplained = sums[SQUARE] * inverse_weight;
    for c in 0..N_CHANNELS {
        let covariance: [f32; N_FEATURES] =
            std::array::from_fn(|i| sums[MIXED + N_CHANNELS * i + c] * inverse_weight - mean[i] * light[c]);
        let mut solution = covariance;
        for i in 0..N_FEATURES {
            for k in 0..i {
                solution[i] -= factor[i][k] * solution[k];
            }
            solution[i] *= factor[i][i];
        }
        for i in (0..N_FEATURES).rev() {
            for k in i + 1..N_FEATURES {
                solution[i] -= factor[k][i] * solution[k];
            }
            solution[i] *= factor[i][i];
        }
        let mut explained = light[c] * light[c];
        for i in 0..N_FEATURES {
            explained += solution[i] * (covariance[i] + solution[i] * ridge[i]);
            slope[i][c] = solution[i];
        }
        if c < 3 {
            unexplained -= explained;
        }
    }
    let residual = unexplained.max(0.0);
    // Share of the noise that is left in the residuals.
    let left = (1.0 - freedom * inverse_count).max(0.1);
    let noise = sums[VARIANCE] * inverse_weight;
    // Both are means over the degrees of freedom that are left, of squared residuals and variances that scatter as much as
    // those of single samples: where few of these are bright, much more than normal noise would.
    let scatter = (SCATTER_OF_EXCESS * sums[SCATTER] * inverse_weight).sqrt();
    let deviation = significance * scatter / (sums[COUNT] - freedom).max(2.0).sqrt();
    Fit {
        mean,
        precision,
        light,
        slope,
        misfit: significant_part((residual - noise * left).max(0.0), deviation),
        noise,
        unbias: 1.0 / left,
        inverse_count,
        mean_weight: sums[WEIGHT] * inverse_count,
    }
}
