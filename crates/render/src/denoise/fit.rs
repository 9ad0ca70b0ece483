//! The best linear function of the features in one window, and how wrong it is there.

use super::moments::{Blocks, COUNT, FEATURE, LIGHT, MIXED, N_FEATURES, SQUARE, Sums, VARIANCE, WEIGHT, X, Y, product};
use glam::Vec3;
use rayon::prelude::*;

/// Squared error of light over albedo that no fit is better than: one that has no noise and no misfit where it was made
/// still knows nothing of pixels that are unlike those.
const LEAST_MISFIT: f32 = 1e-4;

/// Light as a linear function of the features, as ridge regression finds it in a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Of the features in the window.
    mean: [f32; N_FEATURES],
    /// One over the variance of each feature, and what keeps it from zero.
    precision: [f32; N_FEATURES],
    /// Of light in the window, a channel each.
    light: [f32; 3],
    slope: [[f32; 3]; N_FEATURES],
    /// Mean squared distance of the fit from the light itself, without noise: what no fit of this kind can explain.
    pub misfit: f32,
    /// Mean variance of the noise in the window.
    pub noise: f32,
    /// Residuals times this have the variance of the noise, where there is no misfit.
    pub unbias: f32,
    /// One over the number of pixels.
    inverse_count: f32,
    /// Of a pixel.
    pub mean_weight: f32,
}

/// What a fit says of one pixel.
pub(super) struct Prediction {
    pub light: Vec3,
    /// Squared distance from the mean features in standard deviations, and one.
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
    /// Expected squared error of a prediction: features that are unlike the window's are not its business.
    pub fn expected_error(&self, prediction: &Prediction) -> f32 {
        (self.misfit + LEAST_MISFIT) * prediction.distance + self.noise * prediction.leverage()
    }

    /// - `features`: with the position from the middle of the window's middle block.
    #[inline(always)]
    pub fn predict(&self, features: &[f32; N_FEATURES]) -> Prediction {
        let (mut light, mut distance) = (Vec3::from(self.light), 1.0);
        for (((feature, mean), precision), slope) in
            features.iter().zip(&self.mean).zip(&self.precision).zip(&self.slope)
        {
            let off = feature - mean;
            distance += off * off * precision;
            light += off * Vec3::from(*slope);
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
    /// Each row of windows asks `stop` first; `None` when it said so.
    pub fn of(blocks: &Blocks, stop: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let ridge = ridge(blocks.level);
        let rows: Option<Vec<Vec<Fit>>> = (0..blocks.height)
            .into_par_iter()
            .map(|y| (!stop()).then(|| (0..blocks.width).map(|x| solve(&blocks.window(x, y), &ridge)).collect()))
            .collect();
        let fits = rows?.into_iter().flatten().collect();
        Some(Self { level: blocks.level, width: blocks.width, height: blocks.height, fits })
    }

    /// Calls `take` with each window that holds a pixel, the pixel's features there, and how near it is to the middle,
    /// 0..1.
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

/// Added to the variance of each feature: differences that are much smaller than this say nothing.
fn ridge(level: u32) -> [f32; N_FEATURES] {
    let side = (1u32 << level) as f32;
    let place = 0.02 * side * side;
    [3e-3, 3e-3, 3e-3, 1e-6, place, place, 1e-3]
}

// Indices as in the formulas, which go through rows and columns at once.
#[allow(clippy::needless_range_loop)]
fn solve(sums: &Sums, ridge: &[f32; N_FEATURES]) -> Fit {
    let inverse_weight = 1.0 / sums[WEIGHT].max(1e-20);
    let inverse_count = 1.0 / sums[COUNT].max(1.0);
    let mean: [f32; N_FEATURES] = std::array::from_fn(|i| sums[FEATURE + i] * inverse_weight);
    let light: [f32; 3] = std::array::from_fn(|c| sums[LIGHT + c] * inverse_weight);
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
    // Cholesky's factor in place, with the reciprocals of its diagonal.
    for j in 0..N_FEATURES {
        let mut pivot = factor[j][j];
        for k in 0..j {
            pivot -= factor[j][k] * factor[j][k];
        }
        // No smaller than what was added, but for rounding.
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
    let mut slope = [[0.0; 3]; N_FEATURES];
    let mut unexplained = sums[SQUARE] * inverse_weight;
    for c in 0..3 {
        let covariance: [f32; N_FEATURES] =
            std::array::from_fn(|i| sums[MIXED + 3 * i + c] * inverse_weight - mean[i] * light[c]);
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
        unexplained -= light[c] * light[c];
        for i in 0..N_FEATURES {
            unexplained -= solution[i] * (covariance[i] + solution[i] * ridge[i]);
            slope[i][c] = solution[i];
        }
    }
    let residual = unexplained.max(0.0);
    // What the fit has taken of the noise.
    let left = (1.0 - freedom * inverse_count).max(0.1);
    let noise = sums[VARIANCE] * inverse_weight;
    Fit {
        mean,
        precision,
        light,
        slope,
        misfit: (residual - noise * left).max(0.0),
        noise,
        unbias: 1.0 / left,
        inverse_count,
        mean_weight: sums[WEIGHT] * inverse_count,
    }
}
