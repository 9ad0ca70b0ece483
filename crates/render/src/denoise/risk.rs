//! The error of the combined image, from its own samples.
//!
//! Stein's unbiased risk estimate (1981) subtracts the variance of the raw image from its squared difference to the
//! filtered one. Where a filter removes nearly all noise, that is the difference of two large numbers, one of which is
//! known to some tenths only, and wherever the combination has chosen by the same difference, it is too small. So
//! variance and bias are estimated apart:
//!
//! - The variance of the filtered value follows from its covariance with the raw value. For a projection they are equal;
//!   a mean of projections over several windows has less.
//! - Its squared bias is what differs from the raw value by more than noise can; and even if that is too small to be seen,
//!   it is as large as the misfit of the windows and the variance: windows are weighted by expected squared error, and
//!   where that is least, bias and variance are of the same size.
//! - The variance of the raw value is averaged over a wide neighbourhood, and larger where it is mixed with the filtered
//!   one: the narrow neighbourhood has decided the shares, which are raw where its variance is too small at random.

use crate::denoise::comparison::Comparison;
use crate::denoise::input::DenoiseInput;
use crate::denoise::noise::VARIANCE_UNCERTAINTY;
use rayon::prelude::*;

/// Variance of the filtered value over its covariance with the raw one.
const OWN_VARIANCE: f32 = 0.85;
/// How much the variance of the raw value is too small where the filtered share is large, relative to both.
const AT_RANDOM: f32 = 1.5;

/// Standard deviations of parts of the estimate, relative to their mean: of the squared bias, and of a tile.
const BIAS_UNCERTAINTY: f64 = 0.5;
const TILE_UNCERTAINTY: f64 = 0.5;
/// Side in pixels of the tiles whose errors are independent.
const TILE: usize = 32;

/// Estimated root of relMSE of the combined image, and the bounds of its interval.
///
/// - `share`: filtered share of each pixel.
pub(super) fn error_of(input: &DenoiseInput, of: &Comparison, share: &[f32]) -> (f64, [f64; 2]) {
    let n = input.n_pixels();
    // Risk and squared bias.
    let of_pixel = |i: usize| {
        let (s, rest) = (share[i], 1.0 - share[i]);
        let own = of.covariance[i].max(0.0);
        let unseen = own + of.misfit[i].max(0.0);
        let bias = s * s * (of.bias[i] + unseen);
        let of_raw = rest * rest * (1.0 + AT_RANDOM * s) * of.variance[i];
        let risk = of_raw + (2.0 * rest + OWN_VARIANCE * s) * s * own + bias;
        (f64::from(risk), f64::from(bias))
    };
    let tiles_x = input.width.div_ceil(TILE);
    let of_band = |band: usize| {
        let (mut of_tiles, mut of_bias) = (vec![0.0; tiles_x], 0.0);
        for i in band * TILE * input.width..n.min((band + 1) * TILE * input.width) {
            let (risk, bias) = of_pixel(i);
            of_tiles[i % input.width / TILE] += risk;
            of_bias += bias;
        }
        (of_tiles, of_bias)
    };
    // Sums of bands in their order, so that the result does not depend on the number of threads.
    let of_bands: Vec<(Vec<f64>, f64)> = (0..input.height.div_ceil(TILE)).into_par_iter().map(of_band).collect();
    let of_bias: f64 = of_bands.iter().map(|(_, bias)| bias).sum();
    let of_tiles: Vec<f64> = of_bands.into_iter().flat_map(|(of_tiles, _)| of_tiles).collect();
    let sum: f64 = of_tiles.iter().sum();
    let error = (sum / (3 * n) as f64).max(0.0).sqrt();
    // On the logarithm, where a sum of positive terms is closer to symmetric.
    let of_tiles = of_tiles.iter().map(|risk| risk * risk).sum::<f64>().sqrt() * TILE_UNCERTAINTY;
    let relative = of_tiles.hypot(of_bias * BIAS_UNCERTAINTY) / sum.max(1e-30);
    let factor = (0.5 * 1.96 * relative.hypot(f64::from(VARIANCE_UNCERTAINTY))).exp();
    (error, [error / factor, error * factor])
}
