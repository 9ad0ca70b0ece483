//! The filter: light over albedo as a linear function of normal, depth, position and albedo, in windows of many sizes
//! at once.
//!
//! First-order regression on features is the basis of the best denoisers without learning (Bitterli et al. 2016,
//! "Nonlinearly weighted first-order regression for denoising Monte Carlo renderings"; Moon et al. 2014). Here windows
//! of 6 × 6 to 96 × 96 pixels overlap everywhere, and every pixel is predicted by all windows that contain it
//! (collaborative filtering). Each prediction is weighted by its expected squared error: the noise of the window over
//! its number of pixels, plus the misfit, which is the part of the residuals that noise does not explain. So large
//! windows dominate where light is smooth, small ones at the edges of shadows, and windows that an edge does not cross
//! dominate over those that it does.

use crate::denoise::blur::{Pooled, blur};
use crate::denoise::doubt::{doubt, scatter};
use crate::denoise::fit::Fits;
use crate::denoise::input::DenoiseInput;
use crate::denoise::limit::limit;
use crate::denoise::moments::{Blocks, N_FEATURES, Samples};
use crate::denoise::noise::{FilteredNoise, Noise};
use crate::denoise::parallel::{LEAST_ALBEDO, Stop, each};
use crate::denoise::soften::soften;
use bytemuck::Zeroable;
use glam::{Vec3, Vec4, Vec4Swizzles};

/// A pixel filtered by regression.
#[derive(Clone, Copy, Zeroable)]
pub(super) struct Candidate {
    /// Radiance.
    pub color: Vec3,
    /// Half of what it would differ by between the halves of the samples, sum over channels, as of grey light.
    pub noise: f32,
    /// Weight of the pixel's own value in its filtered value, 0..1.
    pub own: f32,
    /// Mean squared misfit of the windows, of light over albedo, sum over channels.
    pub misfit: f32,
}

impl Candidate {
    /// - `share`: of the other one.
    fn mixed(&self, other: &Self, share: f32) -> Self {
        let mix = |own: f32, other: f32| own + (other - own) * share;
        let color = self.color.lerp(other.color, share);
        let noise = mix(self.noise, other.noise);
        Self { color, noise, own: mix(self.own, other.own), misfit: mix(self.misfit, other.misfit) }
    }
}

/// Candidates of each pixel: from windows of all sizes, from those that are small, and from the smallest only.
pub(super) type Candidates = [Candidate; 3];

/// The candidates of all pixels, and the noise of the raw image.
pub(super) struct Regression {
    pub candidates: Vec<Candidates>,
    pub noise: Noise,
}

/// Number of window sizes: 3 · 2ᵏ pixels for k in 1..=5.
const N_LEVELS: u32 = 5;
/// Standard deviations by which residuals must exceed the noise to be taken for misfit, if the noise is known apart from
/// them.
const SIGNIFICANCE: f32 = 3.0;
/// How many times as much as by noise alone candidates must differ for that of the smaller windows to be taken: around a
/// pixel, if that is to suffice; around it and in a wide neighbourhood, if both must hold.
const DIFFERENCE_ALONE: f32 = 6.0;
const DIFFERENCES: [f32; 2] = [1.0, 0.7];
/// Weight of pixels at emitters in the windows of others: they are brighter than all others by orders of magnitude.
const WEIGHT_AT_EMITTERS: f32 = 1e-3;

/// Light from beyond the scene that counts as an emitter, relative to the mean of the image: a sun in an environment.
const BRIGHT: f32 = 8.0;

/// Returns `None` if `stop` returned true.
pub(super) fn regression(input: &DenoiseInput, stop: Stop) -> Option<Regression> {
    let RegressionStart { samples, mut blocks, albedo, noise } = RegressionStart::of(input, stop)?;
    // Without halves the noise is that of the residuals.
    let (significance, n_small) = if input.half_steps.is_some() { (SIGNIFICANCE, 1) } else { (0.0, 2) };
    let mut levels = Vec::new();
    loop {
        levels.push(Fits::of(&blocks, significance, stop)?);
        if blocks.level == N_LEVELS || blocks.width.max(blocks.height) == 1 {
            break;
        }
        blocks = blocks.coarser(stop)?;
    }
    let width = input.width;
    let pixel = |i: usize| {
        predict(&samples, &levels, n_small, i % width, i / width).map(|Predicted { light, own, misfit }| Candidate {
            // Scattered light is never negative, whatever noise of lights is around.
            noise: light.w * albedo[i].element_sum() / 3.0,
            color: (light.xyz() * albedo[i]).max(Vec3::ZERO) + input.guides.emitted[i],
            own: own.min(1.0),
            misfit,
        })
    };
    Some(Regression { candidates: each(input.n_pixels(), stop, pixel)?, noise })
}

/// The noise of the raw image alone; `None` if `stop` returned true.
pub(super) fn noise(input: &DenoiseInput, stop: Stop) -> Option<Noise> {
    RegressionStart::of(input, stop).map(|start| start.noise)
}

/// What a regression starts from.
struct RegressionStart {
    samples: Samples,
    blocks: Blocks,
    /// Divisors of radiance.
    albedo: Vec<Vec3>,
    noise: Noise,
}

impl RegressionStart {
    fn of(input: &DenoiseInput, stop: Stop) -> Option<Self> {
        let guides = &input.guides;
        let n = input.n_pixels();
        let mean = input.color.iter().map(|color| color.element_sum()).sum::<f32>() / n as f32;
        let shines = |pixel: usize| guides.emitters[pixel] || guides.emitted[pixel].element_sum() > BRIGHT * mean;
        let at_emitters = near(input, shines, stop)?;
        let albedo: Vec<Vec3> = each(n, stop, |i| guides.albedo[i].max(Vec3::splat(LEAST_ALBEDO)))?;
        let mut samples = samples(input, &albedo, &at_emitters, stop)?;
        let excess = limit(input, &albedo, &at_emitters, &mut samples, stop)?;
        let independent = input.half_steps.map_or(1.0, |halves| halves.calibration.clamp(1e-3, 1.0).recip());
        samples.variance.iter_mut().for_each(|variance| *variance *= independent);
        let mut blocks = Blocks::finest(&samples, stop)?;
        let variance = match input.half_steps {
            Some(halves) => each(n, stop, |i| halves.variance(i))?,
            None => {
                // The only estimate of the noise is the residual of small windows.
                samples.variance = residuals(&samples, &Fits::of(&blocks, 0.0, stop)?, stop)?;
                blocks = Blocks::finest(&samples, stop)?;
                each(n, stop, |i| samples.variance[i] / 3.0 * albedo[i] * albedo[i])?
            }
        };
        let usual = each(n, stop, |i| {
            let all = (variance[i] / (albedo[i] * albedo[i])).element_sum();
            (samples.variance[i] / (independent * all).max(1e-30)).min(1.0)
        })?;
        let pooled = Pooled::of(input, &at_emitters, stop)?;
        let scatter = scatter(&samples.variance, &pooled, stop)?;
        let doubt = doubt(input, &scatter, stop)?;
        let noise = Noise { variance, at_emitters, excess, usual, independent, scatter, doubt };
        Some(Self { samples, blocks, albedo, noise })
    }
}

fn samples(input: &DenoiseInput, albedo: &[Vec3], at_emitters: &[bool], stop: Stop) -> Option<Samples> {
    let guides = &input.guides;
    let n = input.n_pixels();
    let near = guides.nearness(stop)?;
    let features = |i: usize| {
        let normal = guides.normal[i];
        [normal.x, normal.y, normal.z, near[i], 0.0, 0.0, guides.albedo[i].element_sum() / 3.0]
    };
    let variance = |i: usize| {
        let of_color = input.half_steps.map_or(Vec3::ZERO, |halves| halves.variance(i));
        (of_color / (albedo[i] * albedo[i])).element_sum()
    };
    // Weighted by albedo², because the squared error of radiance counts, not that of radiance over albedo.
    let weight = |i: usize| {
        let mean = albedo[i].element_sum() / 3.0;
        mean * mean * if at_emitters[i] { WEIGHT_AT_EMITTERS } else { 1.0 }
    };
    Some(Samples {
        width: input.width,
        height: input.height,
        features: each(n, stop, features)?,
        light: each(n, stop, |i| ((input.color[i] - input.guides.emitted[i]) / albedo[i]).extend(0.0))?,
        variance: each(n, stop, variance)?,
        weight: each(n, stop, weight)?,
    })
}

/// Whether `is` holds for a pixel or one of its eight neighbours; `None` if `stop` returned true.
fn near(input: &DenoiseInput, is: impl Fn(usize) -> bool + Sync, stop: Stop) -> Option<Vec<bool>> {
    let (width, height) = (input.width, input.height);
    let around = |at: usize, n: usize| at.saturating_sub(1)..(at + 2).min(n);
    let any = |x: usize, y: usize| around(y, height).any(|y| around(x, width).any(|x| is(y * width + x)));
    each(width * height, stop, |i| any(i % width, i / width))
}

/// Returns the squared residual of each pixel for the fits of one level, scaled so that it estimates the variance where
/// the fits are unbiased.
fn residuals(samples: &Samples, fits: &Fits, stop: Stop) -> Option<Vec<f32>> {
    let residual = |x: usize, y: usize| {
        let pixel = y * samples.width + x;
        let (mut sum, mut n) = (0.0, 0.0);
        fits.around(x, y, &samples.features[pixel], |fit, features, _| {
            sum += (samples.light[pixel] - fit.predict(features).light).xyz().length_squared() * fit.unbias;
            n += 1.0;
        });
        sum / n
    };
    let width = samples.width;
    each(width * samples.height, stop, |i| residual(i % width, i / width))
}

/// The weighted mean over windows at one pixel.
#[derive(Clone, Copy)]
struct Predicted {
    /// Light over albedo, and its noise.
    light: Vec4,
    /// Weight of the pixel's own value in it.
    own: f32,
    misfit: f32,
}

/// Returns the means over the windows that contain a pixel: over all, over small ones, and over the smallest.
///
/// - `n_small`: number of window sizes that count as the smallest; the small ones are of one size more.
#[inline(always)]
fn predict(samples: &Samples, levels: &[Fits], n_small: u32, x: usize, y: usize) -> [Predicted; 3] {
    let pixel = y * samples.width + x;
    let features: &[f32; N_FEATURES] = &samples.features[pixel];
    let (mut light, mut own, mut misfit, mut total) = (Vec4::ZERO, 0.0, 0.0, 0.0);
    let mut found = [Predicted { light, own, misfit }; 3];
    for fits in levels {
        fits.around(x, y, features, |fit, features, nearness| {
            let prediction = fit.predict(features);
            let error = fit.expected_error(&prediction);
            let weight = nearness / (error * error);
            light += weight * prediction.light;
            own += weight * prediction.leverage() * samples.weight[pixel] / fit.mean_weight.max(1e-20);
            misfit += weight * fit.misfit;
            total += weight;
        });
        let by = total.max(1e-30).recip();
        // The smaller ones keep what they have once the windows are larger.
        let n = if fits.level <= n_small {
            3
        } else if fits.level == n_small + 1 {
            2
        } else {
            1
        };
        found[..n].fill(Predicted { light: light * by, own: own * by, misfit: misfit * by });
    }
    found
}

/// Goes from windows of all sizes to smaller ones where these differ by more than the noise that they have more of: there
/// the larger ones miss something. Compared with each other, both have so little noise that a difference tells more
/// than that of either from the raw image, above all where few samples are bright. What counts is the product of the
/// differences that both halves of the samples show: its expectation has no noise in it, and a single bright sample is
/// in one half only. `None` if `stop` returned true.
pub(super) fn pick(
    input: &DenoiseInput,
    candidates: &[Candidates],
    of_raw: &Noise,
    stop: Stop,
) -> Option<FilteredNoise> {
    let n = input.n_pixels();
    let level = |i: usize| (candidates[i][0].color * candidates[i][0].color + 0.01).recip();
    let pooled = Pooled::of(input, &of_raw.at_emitters, stop)?;
    let mut picked: Vec<Candidate> = each(n, stop, |i| candidates[i][0])?;
    for of_sizes in [1, 2] {
        let smaller = |i: usize| &candidates[i][of_sizes];
        // Of sums over channels: a ninth for the square of three.
        let product = each(n, stop, |i| {
            let off = (smaller(i).color - picked[i].color).element_sum();
            let noise = smaller(i).noise - picked[i].noise;
            level(i).element_sum() / 9.0 * (off * off - noise * noise)
        })?;
        let [here, around] = [pooled.narrow(&|i| product[i], stop)?, pooled.wide(&|i| product[i], stop)?];
        let more = |i: usize| (smaller(i).own - picked[i].own).max(0.0) * level(i).dot(of_raw.usual(i));
        let noise = pooled.mean(&more, stop)?;
        let share = |i: usize| {
            let by_noise = (of_raw.independent * noise[i]).max(1e-30);
            let [here, around] = [here[i] / (by_noise * (1.0 + of_raw.doubt[i])), around[i] / by_noise];
            let both = significance(here / DIFFERENCES[0]) * significance(around / DIFFERENCES[1]);
            1.0 - both.max(significance(here / DIFFERENCE_ALONE))
        };
        let share = blur(&each(n, stop, share)?, input.width, input.height, 1, stop)?;
        picked = each(n, stop, |i| smaller(i).mixed(&picked[i], share[i]))?;
    }
    let albedo = &input.guides.albedo;
    let mut color: Vec<Vec3> = each(n, stop, |i| picked[i].color)?;
    if input.half_steps.is_some() {
        let own: Vec<f32> = each(n, stop, |i| picked[i].own)?;
        color = soften(input, of_raw, &pooled, color, &own, stop)?;
    }
    Some(FilteredNoise {
        color,
        covariance: each(n, stop, |i| picked[i].own * of_raw.usual(i))?,
        misfit: each(n, stop, |i| picked[i].misfit / 3.0 * albedo[i] * albedo[i])?,
    })
}

/// How far a difference is significant, 0..1, from its ratio to the least one that is.
fn significance(ratio: f32) -> f32 {
    let power = ratio.clamp(0.0, 1e8).powi(4);
    power / (1.0 + power)
}
