//! The settled filter: light over albedo as a linear function of normal, depth, position and albedo, in windows of many
//! sizes at once.
//!
//! First-order regression on features is what the best denoisers without learning do (Bitterli et al. 2016, "Nonlinearly
//! weighted first-order regression for denoising Monte Carlo renderings"; Moon et al. 2014). Here windows of 6 × 6 to
//! 96 × 96 pixels overlap everywhere, every pixel is predicted by all that hold it (collaboratively), and each prediction
//! counts by its expected squared error: noise of the window over its number of pixels, and misfit, which is what
//! residuals have more of than noise explains. So windows are large where light is even, small at the edges of shadows,
//! and those that an edge does not cross win over those that it does.

use super::blur::blur;
use super::fit::Fits;
use super::input::DenoiseInput;
use super::moments::{Blocks, N_FEATURES, Samples};
use glam::Vec3;
use rayon::prelude::*;

/// What a filter makes of a picture.
pub(super) struct Filtered {
    /// Radiance of each pixel.
    pub color: Vec<Vec3>,
    /// How much of each pixel is left in itself, 0..1.
    pub own: Vec<f32>,
}

/// Both candidates, and what was found out on the way.
pub(super) struct Regression {
    /// From windows of all sizes, and from the small ones alone.
    pub candidates: [Filtered; 2],
    /// Variance of the radiance of each pixel, sum over channels; noisy.
    pub variance: Vec<f32>,
    /// Emitters and their neighbours.
    pub at_emitters: Vec<bool>,
}

/// Sizes of windows: three times two to the power of 1..=5, pixels.
const N_LEVELS: u32 = 5;
/// The small ones.
const N_SMALL: u32 = 2;
/// No channel is divided by less, so that what dark surfaces reflect without it is not blown up.
const LEAST_ALBEDO: f32 = 0.04;
/// Of pixels next to emitters in windows of others: they are brighter than all around them by orders of magnitude.
const WEIGHT_AT_EMITTERS: f32 = 1e-3;

/// `None` when `stop` said so, which is asked once a row.
pub(super) fn regression(input: &DenoiseInput, stop: &(dyn Fn() -> bool + Sync)) -> Option<Regression> {
    let n = input.n_pixels();
    let guides = &input.guides;
    let at_emitters = near(input, |pixel| guides.emitters[pixel]);
    let albedo: Vec<Vec3> = guides.albedo.iter().map(|albedo| albedo.max(Vec3::splat(LEAST_ALBEDO))).collect();
    let mut samples = samples(input, &albedo, &at_emitters);
    let mut blocks = Blocks::finest(&samples);
    if input.half_steps.is_none() {
        // All that is known of the noise is what small windows do not explain.
        samples.variance = residuals(&samples, &Fits::of(&blocks, stop)?, stop)?;
        blocks = Blocks::finest(&samples);
    }
    let mut levels = Vec::new();
    loop {
        levels.push(Fits::of(&blocks, stop)?);
        if blocks.level == N_LEVELS || blocks.width.max(blocks.height) == 1 {
            break;
        }
        blocks = blocks.coarser();
    }
    let rows: Option<Vec<Vec<[(Vec3, f32); 2]>>> = (0..input.height)
        .into_par_iter()
        .map(|y| (!stop()).then(|| (0..input.width).map(|x| predict(&samples, &levels, x, y)).collect()))
        .collect();
    let predicted: Vec<[(Vec3, f32); 2]> = rows?.into_iter().flatten().collect();
    let candidate = |k: usize| Filtered {
        color: predicted.iter().zip(&albedo).map(|(of, albedo)| (of[k].0 * *albedo).max(Vec3::ZERO)).collect(),
        own: predicted.iter().map(|of| of[k].1.min(1.0)).collect(),
    };
    let variance = match input.half_steps {
        Some(halves) => (0..n).map(|i| halves.variance(i).element_sum()).collect(),
        None => (0..n).map(|i| samples.variance[i] * albedo[i].length_squared() / 3.0).collect(),
    };
    Some(Regression { candidates: [candidate(0), candidate(1)], variance, at_emitters })
}

/// How near each pixel is, −1/2..1/2: infinitely far is no special case, and the depth in the middle of the list is zero.
fn nearness(depth: &[f32]) -> Vec<f32> {
    let mut finite: Vec<f32> = depth.iter().copied().filter(|depth| depth.is_finite() && *depth > 0.0).collect();
    let middle = finite.len() / 2;
    let typical = if finite.is_empty() { 1.0 } else { *finite.select_nth_unstable_by(middle, f32::total_cmp).1 };
    let of = |&depth: &f32| if depth.is_finite() && depth > 0.0 { typical / (typical + depth) - 0.5 } else { -0.5 };
    depth.iter().map(of).collect()
}

fn samples(input: &DenoiseInput, albedo: &[Vec3], at_emitters: &[bool]) -> Samples {
    let guides = &input.guides;
    let n = input.n_pixels();
    let near = nearness(guides.depth);
    let features = |i: usize| {
        let normal = guides.normal[i];
        [normal.x, normal.y, normal.z, near[i], 0.0, 0.0, guides.albedo[i].element_sum() / 3.0]
    };
    let variance = |i: usize| {
        let of_color = input.half_steps.map_or(Vec3::ZERO, |halves| halves.variance(i));
        (of_color / (albedo[i] * albedo[i])).element_sum()
    };
    // Squares of radiance are what counts, and not those of radiance over albedo.
    let weight = |i: usize| {
        let mean = albedo[i].element_sum() / 3.0;
        mean * mean * if at_emitters[i] { WEIGHT_AT_EMITTERS } else { 1.0 }
    };
    Samples {
        width: input.width,
        height: input.height,
        features: (0..n).into_par_iter().map(features).collect(),
        light: (0..n).into_par_iter().map(|i| input.color[i] / albedo[i]).collect(),
        variance: (0..n).into_par_iter().map(variance).collect(),
        weight: (0..n).into_par_iter().map(weight).collect(),
    }
}

/// Whether it is true of a pixel or one of its eight neighbours.
fn near(input: &DenoiseInput, is: impl Fn(usize) -> bool + Sync) -> Vec<bool> {
    let (width, height) = (input.width, input.height);
    let around = |at: usize, n: usize| at.saturating_sub(1)..(at + 2).min(n);
    let row = |y: usize| (0..width).map(move |x| (x, y));
    let any = |(x, y): (usize, usize)| around(y, height).any(|y| around(x, width).any(|x| is(y * width + x)));
    (0..height).into_par_iter().flat_map_iter(|y| row(y).map(any).collect::<Vec<_>>()).collect()
}

/// Squared distance of each pixel from the fits of one level, scaled so that it is the variance where they are right.
fn residuals(samples: &Samples, fits: &Fits, stop: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f32>> {
    let residual = |x: usize, y: usize| {
        let pixel = y * samples.width + x;
        let (mut sum, mut n) = (0.0, 0.0);
        fits.around(x, y, &samples.features[pixel], |fit, features, _| {
            sum += (samples.light[pixel] - fit.predict(features).light).length_squared() * fit.unbias;
            n += 1.0;
        });
        sum / n
    };
    let rows: Option<Vec<Vec<f32>>> = (0..samples.height)
        .into_par_iter()
        .map(|y| (!stop()).then(|| (0..samples.width).map(|x| residual(x, y)).collect()))
        .collect();
    Some(rows?.into_iter().flatten().collect())
}

/// Light over albedo of a pixel, and how much of it is its own: from all windows, and from small ones.
#[inline(always)]
fn predict(samples: &Samples, levels: &[Fits], x: usize, y: usize) -> [(Vec3, f32); 2] {
    let pixel = y * samples.width + x;
    let features: &[f32; N_FEATURES] = &samples.features[pixel];
    let (mut light, mut own, mut total) = (Vec3::ZERO, 0.0, 0.0);
    let mut small = (Vec3::ZERO, 0.0);
    for fits in levels {
        fits.around(x, y, features, |fit, features, nearness| {
            let prediction = fit.predict(features);
            let error = fit.expected_error(&prediction);
            let weight = nearness / (error * error);
            light += weight * prediction.light;
            own += weight * prediction.leverage() * samples.weight[pixel] / fit.mean_weight.max(1e-20);
            total += weight;
        });
        if fits.level <= N_SMALL {
            small = (light / total.max(1e-30), own / total.max(1e-30));
        }
    }
    [(light / total.max(1e-30), own / total.max(1e-30)), small]
}

/// One picture of both candidates, each where its estimated risk is smaller (Stein 1981: the risk of a filter is known
/// without the truth, from its distance from what it has filtered, the variance, and how much of a pixel is left in
/// itself).
pub(super) fn pick(input: &DenoiseInput, found: &Regression) -> Filtered {
    let n = input.n_pixels();
    let [all, small] = &found.candidates;
    let level = |i: usize| 1.0 / ((all.color[i].element_sum() / 3.0).powi(2) + 0.01);
    let smooth = |values: Vec<f32>| blur(&values, input.width, input.height, 1);
    let risk = |of: &Filtered| {
        let of_pixel = |i: usize| {
            let variance = found.variance[i];
            level(i) * ((of.color[i] - input.color[i]).length_squared() - variance + 2.0 * of.own[i] * variance)
        };
        smooth((0..n).into_par_iter().map(of_pixel).collect())
    };
    let noise = smooth((0..n).into_par_iter().map(|i| level(i) * found.variance[i]).collect());
    let (of_all, of_small) = (risk(all), risk(small));
    let share = |i: usize| {
        let [a, b] = [of_all[i], of_small[i]].map(|risk| (risk.max(0.02 * noise[i]) + 1e-9).powi(2));
        b / (a + b)
    };
    let share = smooth((0..n).into_par_iter().map(share).collect());
    Filtered {
        color: (0..n).map(|i| small.color[i].lerp(all.color[i], share[i])).collect(),
        own: (0..n).map(|i| small.own[i] + (all.own[i] - small.own[i]) * share[i]).collect(),
    }
}
