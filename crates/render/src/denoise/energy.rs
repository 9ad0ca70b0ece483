//! Light that the limit for fireflies takes away ([`crate::denoise::limit`]), given back as a wide blur.
//!
//! A single firefly says little about the light of its neighbourhood, and its light is better left out. Where many
//! pixels have lost light, its mean is known, and without it the image would be too dark: scenes whose light comes from
//! rare bright samples lose up to a quarter with two samples per pixel. So as much of the mean is given back as is
//! significant, and little of it where it exceeds the filtered light: there it comes from a highlight nearby.

use crate::denoise::blur::{Apart, n_averaged};
use crate::denoise::input::DenoiseInput;
use crate::denoise::noise::{FilteredNoise, Noise};
use crate::denoise::parallel::{LEAST_ALBEDO, Stop, each};
use glam::Vec3;

/// Radius in pixels of the two box filters that average what was taken away.
const RADIUS: usize = 24;
/// Standard deviations by which the mean must differ from zero.
const SIGNIFICANCE: f32 = 8.0;

/// Returns the radiance that each pixel gets back; `None` if `stop` returned true.
///
/// - `share`: filtered share of each pixel.
pub(super) fn given_back(
    input: &DenoiseInput,
    noise: &Noise,
    filtered: &FilteredNoise,
    share: &[f32],
    stop: Stop,
) -> Option<Vec<Vec3>> {
    let n = input.n_pixels();
    let albedo = |i: usize| input.guides.albedo[i].max(Vec3::splat(LEAST_ALBEDO));
    let lost: Vec<Vec3> = each(n, stop, |i| share[i] * noise.excess[i] / albedo(i))?;
    let wide = Apart::of(input, &noise.at_emitters, RADIUS, stop)?;
    let mean = |of: &(dyn Fn(usize) -> f32 + Sync)| wide.smooth(&each(n, stop, of)?, stop);
    let [red, green, blue] = [mean(&|i| lost[i].x)?, mean(&|i| lost[i].y)?, mean(&|i| lost[i].z)?];
    let squares = mean(&|i| lost[i].element_sum().powi(2))?;
    each(n, stop, |i| {
        let mean = Vec3::new(red[i], green[i], blue[i]);
        let sum = mean.element_sum().max(0.0);
        let deviation = SIGNIFICANCE * (squares[i].max(0.0) / n_averaged(RADIUS)).sqrt();
        let light = (filtered.color[i] / albedo(i)).element_sum();
        let square = sum * sum;
        let beyond = square / light.max(1e-12);
        albedo(i) * mean * (square / (square + deviation * deviation + beyond * beyond).max(1e-30))
    })
}
