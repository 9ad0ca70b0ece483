//! Limit for fireflies: rare samples that are brighter than all others by orders of magnitude.
//!
//! Averaged with its neighbours, a firefly becomes a bright blotch. It is in one half of a pixel's samples only, and so
//! the halves differ much more there than at the pixels around. The brighter half of each pixel is lowered until its
//! distance from the darker one is no longer unusual; what both halves show, a highlight say, stays.
//!
//! The limited image is the input of the filter; the combination has the limited values where it trusts the filter, and
//! the samples where it does not. A pixel is changed by no more than half of the distance between its halves, which
//! vanishes with more samples: so the limit of the combined image is still that of the raw one.

use crate::denoise::blur::Apart;
use crate::denoise::input::DenoiseInput;
use crate::denoise::moments::Samples;
use crate::denoise::parallel::{AT_ONCE, Stop, each, fill};
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
    let size = |i: usize, step: Vec3| (step / albedo[i]).abs().element_sum();
    let sizes: Vec<f32> = each(n, stop, |i| size(i, halves.spread(i)))?;
    let typical = Apart::of(input, at_emitters, RADIUS, stop)?.smooth(&sizes, stop)?;
    // Both steps without what is unusual of them.
    let limited = |i: usize| {
        let (step, late, share) = (halves.steps[i], halves.late[i], halves.doubled[i]);
        if at_emitters[i] || sizes[i] <= LARGEST_STEP * typical[i] {
            return (step, late);
        }
        let part = |size: f32| (LARGEST_STEP * typical[i] / size.max(1e-30)).min(1.0);
        let kept = part(size(i, share * step));
        // The doubling becomes darker by what its brighter half loses, and so the samples since then change it by more.
        let late = late + (1.0 - share) * (1.0 - kept) * brightness(step) * step;
        let kept_late = if late.element_sum() > 0.0 { part(size(i, late)) } else { 1.0 };
        (kept * step, kept_late * late)
    };
    let excess = each(n, stop, |i| {
        let (step, late) = limited(i);
        let of_half = (halves.steps[i] - step) * brightness(halves.steps[i]);
        // What the mean of all samples was before, less what it is now.
        halves.late[i] + of_half - late
    })?;
    fill(&mut samples.light, AT_ONCE, stop, |part, light| {
        let first = part * AT_ONCE;
        for ((i, light), excess) in (first..).zip(light).zip(&excess[first..]) {
            let (step, late) = limited(i);
            *light -= (excess / albedo[i]).extend(0.0);
            light.w = (halves.change(i, step, late) / albedo[i]).element_sum();
        }
    })?;
    fill(&mut samples.variance, AT_ONCE, stop, |part, variance| {
        for (i, variance) in (part * AT_ONCE..).zip(variance) {
            let (step, late) = limited(i);
            *variance = (halves.variance_of(i, step, late) / (albedo[i] * albedo[i])).element_sum();
        }
    })?;
    Some(excess)
}

/// 1 or −1: the sign that makes a step brighter.
fn brightness(step: Vec3) -> f32 {
    step.element_sum().signum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::Guides;
    use crate::film::halves::HalfSteps;
    use glam::Vec4Swizzles;

    const WIDTH: usize = 40;
    const HEIGHT: usize = 30;
    const N: usize = WIDTH * HEIGHT;
    const FIREFLY: usize = 12 * WIDTH + 17;

    /// Steps of ±0.1 around a radiance of 1, and what the limit makes of them with another radiance and step at one
    /// pixel: light, variance, and what was taken away there; and whether any other pixel was changed.
    fn limited(color: Vec3, step: Vec3, is_emitter: bool) -> (Vec3, f32, Vec3, bool) {
        limited_later(color, step, Vec3::ZERO, 1.0, is_emitter)
    }

    /// The same with later samples.
    ///
    /// - `late`: change by them; `doubled`: share of the samples before them.
    fn limited_later(color: Vec3, step: Vec3, late: Vec3, doubled: f32, is_emitter: bool) -> (Vec3, f32, Vec3, bool) {
        let mut colors = vec![Vec3::ONE; N];
        let mut steps: Vec<Vec3> = (0..N).map(|i| Vec3::splat(if i % 2 == 0 { 0.1 } else { -0.1 })).collect();
        (colors[FIREFLY], steps[FIREFLY]) = (color, step);
        let mut halves = HalfSteps { steps, late: vec![Vec3::ZERO; N], doubled: vec![1.0; N], calibration: 1.0 };
        (halves.late[FIREFLY], halves.doubled[FIREFLY]) = (late, doubled);
        let mut at_emitters = vec![false; N];
        at_emitters[FIREFLY] = is_emitter;
        let albedo = vec![Vec3::splat(0.5); N];
        let guides = Guides {
            albedo: &albedo,
            emitted: &[Vec3::ZERO; N],
            normal: &albedo,
            depth: &vec![1.0; N],
            emitters: &at_emitters,
        };
        let input = DenoiseInput { width: WIDTH, height: HEIGHT, color: &colors, half_steps: Some(&halves), guides };
        let light: Vec<Vec3> = colors.iter().map(|color| *color / 0.5).collect();
        let variance: Vec<f32> = (0..N).map(|i| (halves.variance(i) / 0.25).element_sum()).collect();
        let mut samples = Samples {
            width: WIDTH,
            height: HEIGHT,
            features: vec![[0.0; 7]; N],
            light: light.iter().map(|light| light.extend(0.0)).collect(),
            variance,
            weight: vec![1.0; N],
        };
        let excess = limit(&input, &albedo, &at_emitters, &mut samples, &|| false).unwrap();
        let others = (0..N).any(|i| i != FIREFLY && (samples.light[i].xyz() != light[i] || excess[i] != Vec3::ZERO));
        (samples.light[FIREFLY].xyz(), samples.variance[FIREFLY], excess[FIREFLY], others)
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

    /// Four samples of radiance 1 and one of 100 among them or after them: in five samples, they raise the mean alike.
    #[test]
    fn a_firefly_is_lowered_alike_in_the_doubling_and_after_it() {
        let (color, share) = (Vec3::splat(1.0 + 99.0 / 5.0), 0.8);
        let before = limited_later(color, Vec3::splat(99.0 / 4.0), Vec3::splat(-99.0 / 20.0), share, false);
        let after = limited_later(color, Vec3::ZERO, Vec3::splat(99.0 / 5.0), share, false);
        for (light, variance, excess, others) in [before, after] {
            let radiance = light * 0.5;
            assert!((1.2..2.0).contains(&radiance.x), "{radiance}");
            assert!((radiance + excess - color).abs().max_element() < 1e-4, "{radiance} and {excess}");
            // About the square of what is left of the firefly.
            let expected = (radiance.x - 1.0).powi(2) / 0.25 * 3.0;
            assert!((0.5..2.0).contains(&(variance / expected)), "{variance} for {expected}");
            assert!(!others);
        }
        // A dark sample after a bright doubling is none.
        let dark = limited_later(Vec3::splat(0.8), Vec3::splat(0.1), Vec3::splat(-0.2), share, false);
        assert_eq!(dark.2, Vec3::ZERO);
    }

    #[test]
    fn highlights_and_emitters_stay_as_they_are() {
        let bright = Vec3::splat(51.0);
        assert_eq!(limited(bright, Vec3::splat(0.3), false).2, Vec3::ZERO, "in both halves");
        assert_eq!(limited(bright, Vec3::splat(50.0), true).2, Vec3::ZERO, "an emitter");
    }
}
