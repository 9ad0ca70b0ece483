//! What raw and filtered image show of each other.
//!
//! Squared difference and variance are as uncertain as single samples, and where few of these are bright, both are made by
//! them: so what exceeds the variance, with fireflies and without, counts as bias as far as its mean over a neighbourhood
//! is far above the deviation that such a mean has. Else grains of noise would remain wherever it is large at random:
//! without samples that show a bias, blur is better.
//!
//! The variance may be too small by all that samples that are spread evenly gain, which is known for the whole image only.
//! The product of the differences of two neighbouring pixels does not depend on it: their noise is independent, and their
//! bias is not. So a bias that neighbours share in some direction, as along an edge, is found by such pairs, and one of
//! single pixels once it is several times larger than that gain.
//!
//! A pixel that has a bright sample in both halves at random looks like detail: its variance is small, and its difference
//! large. By how much pixels scatter at random follows from the variances around. For significance no pixel counts for
//! much more than that: what only one of them shows is noise.

use crate::denoise::blur::{Pooled, RADIUS, n_averaged};
use crate::denoise::input::DenoiseInput;
use crate::denoise::noise::{FilteredNoise, Noise, VARIANCE_UNCERTAINTY};
use crate::denoise::parallel::{Stop, each};
use glam::Vec3;

/// Standard deviations by which the squared difference must exceed its expectation to be taken for bias.
const SIGNIFICANCE: f32 = 3.0;

/// Mean square of what the squared difference exceeds the variance by, over that of the variance, for normal noise.
const SQUARE_OF_EXCESS: f32 = 4.0 / 3.0;
/// How many times as large as the gain of samples that are spread evenly a bias must be to be found without pairs.
const UNCERTAIN_GAIN: f32 = 4.0;
/// Directions of pairs, columns and rows.
const DIRECTIONS: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];
/// Standard deviation of the mean product of pairs in one direction, relative to that of squared differences: that of a
/// square of normal noise is 4/3 in three channels, and that of a product 1.
const DEVIATION_OF_PAIRS: f32 = 0.9;
/// What the excess of one pixel counts for significance, at most: multiples of the root mean square of the variances
/// around, but at least this square of a level.
const LARGEST_EXCESS: f32 = 4.0;
const LEAST_LIMIT: f32 = 0.2;
/// How much doubt in detail counts for significance.
const DOUBT: f32 = 0.05;
/// Level of pixels that show an emitter in part: their own value less this multiple of the step.
const EMITTER_STEPS: f32 = 0.5;

/// What is known of raw and filtered image around each pixel: local means, relative to its squared level, sums over
/// channels.
pub(super) struct Comparison {
    /// What filtering takes off the variance.
    pub gain: Vec<f32>,
    /// Variance of the raw value.
    pub variance: Vec<f32>,
    /// Covariance of raw and filtered value.
    pub covariance: Vec<f32>,
    /// Misfit of the filter.
    pub misfit: Vec<f32>,
    /// What is likely to be the squared bias of the filter.
    pub bias: Vec<f32>,
}

impl Comparison {
    /// `None` if `stop` returned true.
    pub fn of(input: &DenoiseInput, noise: &Noise, filtered: &FilteredNoise, stop: Stop) -> Option<Self> {
        let n = input.n_pixels();
        let weight: Vec<Vec3> = each(n, stop, |i| one_over_level(input, noise, filtered, i))?;
        let pooled = Pooled::of(input, &noise.at_emitters, stop)?;
        let narrow = |of: &(dyn Fn(usize) -> f32 + Sync)| pooled.narrow(of, stop);
        let excess_of =
            |off: Vec3, variance: Vec3, i: usize| weight[i].dot(off * off - variance + filtered.covariance[i]);
        let squares_around = pooled.wide(&|i| weight[i].dot(noise.variance[i]).powi(2), stop)?;
        let scatter = each(n, stop, |i| squares_around[i].max(0.0).sqrt())?;
        let off = |i: usize| filtered.color[i] - input.color[i];
        let usual_off = each(n, stop, |i| off(i) + noise.excess[i])?;
        let own_of_all = each(n, stop, |i| excess_of(off(i), noise.variance[i], i))?;
        let own_of_usual = each(n, stop, |i| excess_of(usual_off[i], noise.usual(i), i))?;
        let of_all = narrow(&|i| own_of_all[i])?;
        let of_usual = narrow(&|i| own_of_usual[i])?;
        let limit = |own: f32, i: usize| own.min((LARGEST_EXCESS * scatter[i]).max(LEAST_LIMIT));
        let limited_of_all = narrow(&|i| limit(own_of_all[i], i))?;
        let limited_of_usual = narrow(&|i| limit(own_of_usual[i], i))?;
        let of_pairs = |direction: &[isize; 2]| {
            let product = |i: usize| usual_off[i] * mean_beside(&usual_off, input.width, i, *direction);
            narrow(&|i| limit(weight[i].dot(product(i) + filtered.covariance[i]), i))
        };
        let of_pairs = DIRECTIONS.iter().map(of_pairs).collect::<Option<Vec<_>>>()?;
        let squares = pooled.mean(&|i| weight[i].dot(noise.usual(i)).powi(2), stop)?;
        let variance = pooled.wide(&|i| weight[i].dot(noise.variance[i]), stop)?;
        let uncertainty = VARIANCE_UNCERTAINTY.max(UNCERTAIN_GAIN * (noise.independent - 1.0));
        let bias = each(n, stop, |i| {
            let excess = of_all[i].min(of_usual[i]).max(0.0);
            // Both squared difference and variance have one degree of freedom per channel.
            let square = SQUARE_OF_EXCESS * squares[i].max(0.0);
            let deviation = SIGNIFICANCE * (square / n_averaged(RADIUS)).sqrt();
            let limited = limited_of_all[i].min(limited_of_usual[i]).max(0.0);
            let doubt = 1.0 + DOUBT * noise.doubt[i];
            let of_squares = limited / deviation.hypot(uncertainty * variance[i]).max(1e-30);
            let most = of_pairs.iter().map(|of_direction| of_direction[i]).fold(0.0, f32::max);
            let of_pairs = most / (DEVIATION_OF_PAIRS * deviation).max(1e-30);
            let ratio = of_squares.max(of_pairs) / doubt;
            excess - excess / (1.0 + ratio.powi(4))
        })?;
        Some(Self {
            gain: pooled.mean(&|i| weight[i].dot(noise.variance[i] - filtered.covariance[i]), stop)?,
            covariance: narrow(&|i| weight[i].dot(filtered.covariance[i]))?,
            misfit: narrow(&|i| weight[i].dot(filtered.misfit[i]))?,
            variance,
            bias,
        })
    }
}

/// Returns the mean of the values on either side of a pixel in a direction; zero if neither is in the image.
fn mean_beside(values: &[Vec3], width: usize, i: usize, [columns, rows]: [isize; 2]) -> Vec3 {
    let (x, y) = ((i % width) as isize, (i / width) as isize);
    let at = |sign: isize| {
        let (x, y) = (x + sign * columns, y + sign * rows);
        let is_inside = (0..width as isize).contains(&x) && y >= 0;
        is_inside.then(|| values.get(y as usize * width + x as usize).copied()).flatten()
    };
    match (at(-1), at(1)) {
        (Some(before), Some(after)) => 0.5 * (before + after),
        (one, other) => one.or(other).unwrap_or(Vec3::ZERO),
    }
}

/// Returns one over the squared level of a pixel plus 0.01: the level is the filtered value, or the darker half of its
/// samples if that is brighter. A single bright sample is in one half only. Relative to a filtered image that blurs
/// lights, their noise would dominate the error of the whole image.
fn one_over_level(input: &DenoiseInput, noise: &Noise, filtered: &FilteredNoise, i: usize) -> Vec3 {
    let darker_half = match input.half_steps {
        // The filter has no information about pixels that show a light in part.
        Some(halves) if noise.at_emitters[i] => input.color[i] - EMITTER_STEPS * halves.spread(i),
        Some(halves) => input.color[i] - halves.spread(i),
        None if noise.at_emitters[i] => input.color[i],
        None => Vec3::ZERO,
    };
    let level = filtered.color[i].max(darker_half);
    (level * level + 0.01).recip()
}
