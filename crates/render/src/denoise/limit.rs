//! Limit for fireflies: rare samples that are brighter than all others by orders of magnitude.
//!
//! Averaged with its neighbours, a firefly becomes a bright blotch. It is in one half of a pixel's samples only, and so
//! the halves differ much more there than at the pixels around. The brighter half of each pixel is lowered until its
//! distance from the darker one is no longer unusual; what both halves show, a highlight say, stays.
//!
//! The limited image is the input of the filter; the combination has the limited values where it trusts the filter, and
//! the samples where it does not. A pixel is changed by no more than half of the distance between its halves, which
//! vanishes with more samples: so the limit of the combined image is still that of the raw one.

use super::blur::Apart;
use super::input::DenoiseInput;
use super::moments::Samples;
use super::{AT_ONCE, Stop, each, fill};
use bytemuck::zeroed_vec;
use glam::Vec3;

/// Largest step of a pixel, relative to the mean step around it. The mean of the absolute values: a mean of squares
/// would be that of the fireflies themselves.
const LARGEST_STEP: f32 = 4.0;
/// Radius in pixels of the two box filters that average steps.
const RADIUS: usize = 6;

/// Limits the light of each pixel, and with it its variance; returns by how much radiance is lowered. Nothing is changed
/// at emitters, or if the halves are unknown. `None` if `stop` returned true.
///
/// - `albedo`: divisors of radiance.
pub(super) fn limit(
    input: &DenoiseInput,
    albedo: &[Vec3],
    at_emitters: &[bool],
    samples: &mut Samples,
    stop: Stop,
) -> Option<Vec<Vec3>> {
    let n = input.n_pixels();
    let Some(halves) = input.half_steps else { return Some(zeroed_vec(n)) };
    let sizes: Vec<f32> = each(n, stop, |i| (halves.steps[i] / albedo[i]).abs().element_sum())?;
    let typical = Apart::of(input, at_emitters, RADIUS, stop)?.smooth(&sizes, stop)?;
    // Part of the step that is kept.
    let kept = |i: usize| {
        let most = LARGEST_STEP * typical[i];
        if at_emitters[i] || sizes[i] <= most { 1.0 } else { most / sizes[i] }
    };
    let excess = each(n, stop, |i| match kept(i) {
        1.0 => Vec3::ZERO,
        kept => halves.steps[i] * halves.steps[i].element_sum().signum() * (1.0 - kept),
    })?;
    fill(&mut samples.light, AT_ONCE, stop, |part, light| {
        let first = part * AT_ONCE;
        light.iter_mut().zip(&excess[first..]).zip(&albedo[first..]).for_each(|((to, excess), by)| *to -= excess / by);
    })?;
    fill(&mut samples.variance, AT_ONCE, stop, |part, variance| {
        for (i, variance) in variance.iter_mut().enumerate() {
            *variance *= kept(part * AT_ONCE + i).powi(2);
        }
    })?;
    Some(excess)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::Guides;
    use crate::film::halves::HalfSteps;

    const WIDTH: usize = 40;
    const HEIGHT: usize = 30;
    const N: usize = WIDTH * HEIGHT;
    const FIREFLY: usize = 12 * WIDTH + 17;

    /// Steps of ±0.1 around a radiance of 1, and what the limit makes of them with another radiance and step at one
    /// pixel: light, variance, and what was taken away there; and whether any other pixel was changed.
    fn limited(color: Vec3, step: Vec3, is_emitter: bool) -> (Vec3, f32, Vec3, bool) {
        let mut colors = vec![Vec3::ONE; N];
        let mut steps: Vec<Vec3> = (0..N).map(|i| Vec3::splat(if i % 2 == 0 { 0.1 } else { -0.1 })).collect();
        (colors[FIREFLY], steps[FIREFLY]) = (color, step);
        let halves = HalfSteps { steps, scale: vec![1.0; N] };
        let mut at_emitters = vec![false; N];
        at_emitters[FIREFLY] = is_emitter;
        let albedo = vec![Vec3::splat(0.5); N];
        let guides = Guides { albedo: &albedo, normal: &albedo, depth: &vec![1.0; N], emitters: &at_emitters };
        let input = DenoiseInput { width: WIDTH, height: HEIGHT, color: &colors, half_steps: Some(&halves), guides };
        let light: Vec<Vec3> = colors.iter().map(|color| *color / 0.5).collect();
        let variance: Vec<f32> = (0..N).map(|i| (halves.variance(i) / 0.25).element_sum()).collect();
        let mut samples = Samples {
            width: WIDTH,
            height: HEIGHT,
            features: vec![[0.0; 7]; N],
            light: light.clone(),
            variance,
            weight: vec![1.0; N],
        };
        let excess = limit(&input, &albedo, &at_emitters, &mut samples, &|| false).unwrap();
        let others = (0..N).any(|i| i != FIREFLY && (samples.light[i] != light[i] || excess[i] != Vec3::ZERO));
        (samples.light[FIREFLY], samples.variance[FIREFLY], excess[FIREFLY], others)
    }

    #[test]
    fn a_firefly_is_lowered_to_the_darker_half_and_a_few_usual_steps() {
        // A sample of radiance 1 in the darker half, 101 in the brighter one, which may be the first or the second.
        for sign in [1.0, -1.0] {
            let (light, variance, excess, others) = limited(Vec3::splat(51.0), Vec3::splat(sign * 50.0), false);
            // The mean step around it is 0.1, and a little more by the firefly itself: one of about 170 pixels.
            let radiance = light * 0.5;
            assert!((1.4..4.0).contains(&radiance.x), "{radiance}");
            assert!((radiance + excess - Vec3::splat(51.0)).abs().max_element() < 1e-4, "{radiance} and {excess}");
            let expected = (radiance.x - 1.0).powi(2) / 0.25 * 3.0;
            assert!((variance / expected - 1.0).abs() < 1e-3, "{variance} for {expected}");
            assert!(!others);
        }
    }

    #[test]
    fn highlights_and_emitters_stay_as_they_are() {
        let bright = Vec3::splat(51.0);
        assert_eq!(limited(bright, Vec3::splat(0.3), false).2, Vec3::ZERO, "in both halves");
        assert_eq!(limited(bright, Vec3::splat(50.0), true).2, Vec3::ZERO, "an emitter");
    }
}
