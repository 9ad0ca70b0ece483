//! Soft edges for what few bright samples show.
//!
//! Windows of the regression that have no bright sample at random seem to have neither noise nor misfit, and their
//! prediction outweighs all others. That is right for single fireflies; but where bright samples carry most of the
//! light, around the focus of a caustic say, the edges of such windows are steps in the image, and the small ones are
//! dark spots. There the noise of a window is not known, which shows in how variances scatter
//! ([`crate::denoise::doubt`]). As far as that is so, and as steps are within what the noise of the filtered image
//! allows, it is blurred within surfaces.

use crate::denoise::blur::{Pooled, blur};
use crate::denoise::input::{DenoiseInput, OTHER_NEARNESS, OTHER_NORMAL};
use crate::denoise::noise::Noise;
use crate::denoise::parallel::{LEAST_ALBEDO, Stop, each};
use glam::{Vec2, Vec3};

/// Reach of the blur in pixels: beyond the side of the smallest window, whose steps vanish in it.
const RADIUS: usize = 9;
/// Distances in pixels of the places that it averages, the first and the second time: the other one fills the gaps.
const STRIDES: [usize; 2] = [3, 2];
/// Scatter of variances from which on the noise of a window is not known: a little above that of normal noise.
const UNKNOWN: f32 = 4.0;
/// How much blur may change each time, squared, relative to the variance of the filtered light: more is a step that the
/// samples show.
const LARGEST_CHANGE: f32 = 0.35;
/// Share of the blur below which a pixel stays as it is.
const LEAST_SHARE: f32 = 1e-3;

/// Returns the filtered image with such blur; `None` if `stop` returned true.
///
/// - `color`: the filtered image; `own`: weight of each pixel's own value in it.
pub(super) fn soften(
    input: &DenoiseInput,
    noise: &Noise,
    pooled: &Pooled,
    mut color: Vec<Vec3>,
    own: &[f32],
    stop: Stop,
) -> Option<Vec<Vec3>> {
    let guides = &input.guides;
    let n = input.n_pixels();
    let unknown: Vec<f32> = each(n, stop, |i| {
        let ratio = (noise.scatter[i] / UNKNOWN).clamp(0.0, 1e6);
        if noise.at_emitters[i] { 0.0 } else { 1.0 - 1.0 / (1.0 + ratio.powi(4)) }
    })?;
    if unknown.iter().all(|share| *share < LEAST_SHARE) {
        return Some(color);
    }
    let albedo: Vec<Vec3> = each(n, stop, |i| guides.albedo[i].max(Vec3::splat(LEAST_ALBEDO)))?;
    let near = guides.nearness(stop)?;
    let allowed = pooled.wide(&|i| own[i] * (noise.usual(i) / (albedo[i] * albedo[i])).element_sum(), stop)?;
    for stride in STRIDES {
        let light: Vec<Vec3> = each(n, stop, |i| (color[i] - guides.emitted[i]) / albedo[i])?;
        let blurred = each(n, stop, |i| match unknown[i] < LEAST_SHARE {
            true => light[i],
            false => around(input, noise, (&light, &near), i, stride),
        })?;
        let change = pooled.narrow(&|i| (blurred[i] - light[i]).length_squared(), stop)?;
        let share: Vec<f32> = each(n, stop, |i| {
            let ratio = change[i].max(0.0) / (LARGEST_CHANGE * allowed[i]).max(1e-30);
            unknown[i] / (1.0 + ratio.min(1e9).powi(2))
        })?;
        let share = blur(&share, input.width, input.height, 1, stop)?;
        color = each(n, stop, |i| color[i] + share[i] * (blurred[i] - light[i]) * albedo[i])?;
    }
    Some(color)
}

/// The mean of the light on the surface around a pixel that is not at an emitter.
fn around(input: &DenoiseInput, noise: &Noise, (light, near): (&[Vec3], &[f32]), pixel: usize, stride: usize) -> Vec3 {
    let (normal, width) = (input.guides.normal, input.width);
    let places = |at: usize, n: usize| {
        let first = at - (RADIUS / stride).min(at / stride) * stride;
        (first..(at + RADIUS + 1).min(n)).step_by(stride)
    };
    let (x, y) = (pixel % width, pixel / width);
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for (row, column) in places(y, input.height).flat_map(|row| places(x, width).map(move |column| (row, column))) {
        let other = row * width + column;
        if noise.at_emitters[other] {
            continue;
        }
        let off = Vec2::new(column as f32 - x as f32, row as f32 - y as f32) / (RADIUS + 1) as f32;
        let close = (1.0 - off.length_squared()).max(0.0);
        let normals = (normal[pixel] - normal[other]).length_squared() / OTHER_NORMAL;
        let depths = ((near[pixel] - near[other]) / OTHER_NEARNESS).powi(2);
        // One for the same surface, and vanishing with the distance of others.
        let alike = (1.0 + normals + depths).powi(4).recip();
        let weight = close * close * alike;
        sum += weight * light[other];
        total += weight;
    }
    sum / total
}
