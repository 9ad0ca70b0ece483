//! How wrong is the picture? Told from its own samples, without giving up any of their evenness.
//!
//! Let Iₙ be a pixel's mean over the first n = 2ᵏ samples. Its samples are an Owen-scrambled net, and so are the next
//! n, with the same distribution. Then E|Iₙ − I₂ₙ|² = var Iₙ − var I₂ₙ exactly, however the two halves correlate:
//! I₂ₙ is the mean of both, so cov(Iₙ, I₂ₙ) = var I₂ₙ. Summed over the picture these differences of consecutive
//! doublings are large sums and tell both the error and how fast it falls: where it falls as n^−a, they do too, and
//! var I₂ₙ is the difference over 2ᵃ − 1. Independent batches would tell the same, and cost the evenness between them.
//!
//! What a difference is relative to must not come from the pixel alone: one bright sample that few pixels have drawn
//! yet (a caustic) would raise the very value that its own error is divided by, and hide itself: see [`local_level`].

use glam::DVec3;
use std::collections::TryReserveError;

/// The error of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Root of relMSE, the mean over pixels and channels of variance / (mean² + 0.01).
    pub relative: f64,
    /// Bounds of an interval that holds the true value of this picture with a probability of about 95 %, and more where
    /// the slope is well known; it is wide as long as only few doublings tell how fast the error falls.
    pub low: f64,
    /// Upper bound of that interval; see `low`.
    pub high: f64,
    /// relMSE is expected to fall as samples^−`exponent` from here on, from doubling to doubling; 1 for independent samples.
    pub exponent: f64,
    /// relMSE of a single sample, extended down from what was seen last.
    variance_of_one: f64,
}

impl ErrorEstimate {
    /// Relative error at a number of samples a pixel, at least 1.
    ///
    /// Between powers of two the samples are several nets of different size, one for each bit of their number, and
    /// each counts with its share: where errors fall fast, 96 samples are no better than 64.
    pub fn relative_at(&self, spp: u32) -> f64 {
        let spp = spp.max(1);
        let nets = (0..32).filter(|bit| spp >> bit & 1 == 1).map(|bit| f64::from(1u32 << bit));
        let share = |n: f64| (n / f64::from(spp)).powi(2) * n.powf(-self.exponent);
        (self.variance_of_one * nets.map(share).sum::<f64>()).sqrt()
    }

    /// Samples a pixel that bring the relative error down to `target`, to within an eighth; `u32::MAX` if none do.
    pub fn spp_for(&self, target: f64) -> u32 {
        let candidates = (3..29).flat_map(|bit| (8..16u32).map(move |eighths| eighths << bit >> 3));
        (1..8).chain(candidates).find(|&spp| self.relative_at(spp) <= target).unwrap_or(u32::MAX)
    }

    pub(crate) fn from_tiles<'a>(tiles: impl Iterator<Item = &'a TileConvergence> + Clone, spp: u32) -> Option<Self> {
        // The last doubling that every tile has seen. Films that were added up may have missed some.
        let n_levels = tiles.clone().map(|tile| tile.steps.len()).min()?;
        let is_known = |level: &usize| tiles.clone().all(|tile| !tile.steps[*level].is_nan());
        let level = (0..n_levels).rev().find(is_known)?;
        let n_values: f64 = tiles.clone().map(|tile| tile.n_values).sum();
        let step = |k: usize| tiles.clone().map(|tile| tile.steps[k]).sum::<f64>() / n_values;
        let last = step(level);
        // Tiles are independent of each other: their scatter is the uncertainty of a sum over them, relative to it.
        let n_tiles = tiles.clone().count() as f64;
        let sigma = |k: usize| {
            let mean = step(k);
            if n_tiles < 2.0 || mean <= 0.0 {
                return 1.0;
            }
            let scatter: f64 = tiles.clone().map(|tile| (tile.steps[k] - mean * tile.n_values).powi(2)).sum();
            (scatter * n_tiles / (n_tiles - 1.0)).sqrt() / (n_values * mean)
        };
        let slope = |earliest: usize, expected: &Expected| match (earliest..level).find(is_known) {
            Some(first) if last > 0.0 => {
                let span = (level - first) as f64;
                let seen = (step(first) / last).log2() / span;
                let of_tiles = sigma(first).hypot(sigma(level)) / std::f64::consts::LN_2;
                expected.and_seen(seen, of_tiles.hypot(WOBBLE) / span)
            }
            _ => *expected,
        };
        // The first steps say little of how fast later ones fall; independent samples where there is only one.
        let so_far = slope(level.saturating_sub(2).max(level.saturating_sub(1).min(2)), &SO_FAR);
        // Further on all that is known helps.
        let exponent = slope(level.saturating_sub(2), &FROM_HERE_ON).exponent;
        let (spp_at_level, growth) = (f64::from(2u32 << level), so_far.exponent.exp2());
        let variance_of_one = last / (growth - 1.0) * spp_at_level.powf(exponent);

        // On the logarithm, where the sum of positive terms is closer to symmetric. Two looks at the same tiles, from one
        // doubling to the next, scatter as this one and the truth do; of a first one only the tiles themselves are known.
        let of_noise = match level.checked_sub(1).filter(is_known) {
            Some(before) if n_tiles >= 2.0 && last > 0.0 && step(before) > 0.0 => {
                let fall = last / step(before);
                let scatter: f64 =
                    tiles.clone().map(|tile| (tile.steps[level] - fall * tile.steps[before]).powi(2)).sum();
                (scatter * n_tiles / (n_tiles - 1.0)).sqrt() / (n_values * last)
            }
            _ => sigma(level),
        };
        // And the slope of the last doubling, that the difference is made an error with, is not known for sure.
        let of_slope = growth * std::f64::consts::LN_2 / (growth - 1.0) * so_far.uncertainty;
        let factor = (0.5 * student_t(n_tiles - 1.0) * of_noise).hypot(0.5 * 1.96 * of_slope).exp();
        let mut estimate = Self { relative: 0.0, low: 0.0, high: 0.0, exponent, variance_of_one };
        estimate.relative = estimate.relative_at(spp);
        (estimate.low, estimate.high) = (estimate.relative / factor, estimate.relative * factor);
        Some(estimate)
    }
}

/// Between plain random sampling and the best that scrambled nets do on smooth integrands (Owen 1997).
const MIN_EXPONENT: f64 = 1.0;
const MAX_EXPONENT: f64 = 3.0;

/// An exponent and its standard deviation.
#[derive(Clone, Copy, Debug)]
struct Expected {
    exponent: f64,
    uncertainty: f64,
}

/// Of pictures so far, before anything is seen: about that of independent samples, which errs on the side of caution.
const SO_FAR: Expected = Expected { exponent: MIN_EXPONENT, uncertainty: 0.5 };

/// From eight samples on: mean and deviation of how the true error of the built-in scenes falls to 64, a little rounded
/// towards caution (1.28 and 0.20).
const FROM_HERE_ON: Expected = Expected { exponent: 1.2, uncertainty: 0.316 };

impl Expected {
    /// After an exponent was seen that is as uncertain as that: a slope from few bright pixels is worth little.
    fn and_seen(&self, seen: f64, uncertainty: f64) -> Self {
        let (expected, of_seen) = (self.uncertainty.powi(2), uncertainty.powi(2));
        let trust = expected / (expected + of_seen);
        let exponent = (self.exponent + trust * (seen - self.exponent)).clamp(MIN_EXPONENT, MAX_EXPONENT);
        Self { exponent, uncertainty: (trust * of_seen).sqrt() }
    }
}

/// What a normal variable's 1.96 becomes when its deviation is itself known from `freedom` + 1 values only: 97.5 % of
/// Student's t lie below. To half a per cent (Cornish and Fisher's expansion from four degrees on).
fn student_t(freedom: f64) -> f64 {
    match freedom {
        ..1.5 => 12.706,
        ..2.5 => 4.303,
        ..3.5 => 3.182,
        _ => 1.96 + 2.372 / freedom + 2.823 / freedom.powi(2) + 2.556 / freedom.powi(3),
    }
}

/// How far the slope of a single doubling lies from the long one where edges rule, even without any noise: nets of odd
/// and of even powers of two divide the square differently.
const WOBBLE: f64 = 0.25;

/// The steps of one tile's pixels from doubling to doubling.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileConvergence {
    /// Means at the last power of two.
    pub checkpoint: Vec<DVec3>,
    /// That power of two; 0 before the first.
    pub checkpoint_spp: u32,
    /// `steps[k]`: sum over pixels and channels of |I₂ₙ − Iₙ|² / (level² + 0.01), n = 2ᵏ; NaN where it is not known.
    pub steps: Vec<f64>,
    /// Each pixel's share of the last step, mean over channels.
    pub last: Vec<f32>,
    /// Pixels times channels.
    pub n_values: f64,
}

impl TileConvergence {
    /// Has the memory ready that a tile of `n` pixels needs.
    pub fn try_reserve(&mut self, n: usize) -> Result<(), TryReserveError> {
        self.checkpoint.try_reserve_exact(n)?;
        self.last.try_reserve_exact(n)
    }

    /// As new, in the same memory.
    pub fn clear(&mut self) {
        let Self { checkpoint, checkpoint_spp, steps, last, n_values } = self;
        checkpoint.clear();
        steps.clear();
        last.clear();
        (*checkpoint_spp, *n_values) = (0, 0.0);
    }

    /// Takes the means after `spp` samples, a power of two, of a tile `width` pixels wide.
    pub fn record(&mut self, spp: u32, width: usize, means: impl Iterator<Item = DVec3>) {
        let now: Vec<DVec3> = means.collect();
        self.n_values = 3.0 * now.len() as f64;
        let spp_before = std::mem::replace(&mut self.checkpoint_spp, spp);
        let level = spp.ilog2() as usize;
        if spp > 1 && spp_before == spp / 2 {
            let pairs = self.checkpoint.iter().zip(&now).enumerate();
            let relative = pairs.map(|(i, (a, b))| {
                let (difference, level) = (*a - *b, local_level(&now, *a, width, i));
                (difference * difference / (level * level + 0.01)).element_sum()
            });
            self.last.clear();
            let last = &mut self.last;
            let sum = relative.inspect(|step| last.push((step / 3.0) as f32)).sum();
            self.steps.resize(level - 1, f64::NAN);
            self.steps.push(sum);
        } else {
            // Samples came in too large a lump to tell.
            self.steps.resize(level, f64::NAN);
        }
        // Not the new list itself: this one's memory is reserved, for as long as the film is there.
        self.checkpoint.clear();
        self.checkpoint.extend_from_slice(&now);
    }

    /// Of one pixel, relative and squared; 0 before the second sample.
    pub fn last_step(&self, pixel: usize) -> f32 {
        self.last.get(pixel).copied().unwrap_or(0.0)
    }
}

/// What the error of pixel `i` is relative to: its own mean, but no more than its neighbours' mean and its own darker
/// half.
///
/// A bright sample that came once raises one half alone, and few of the neighbours. A light of a single pixel, which
/// its neighbours know nothing of, is bright in both halves.
fn local_level(means: &[DVec3], before: DVec3, width: usize, i: usize) -> DVec3 {
    let (x, y, height) = (i % width, i / width, means.len() / width);
    // At the border pixels repeat.
    let around = |k: usize, n: usize| [k.saturating_sub(1), k, (k + 1).min(n - 1)];
    let rows = around(y, height).map(|y| around(x, width).map(|x| means[y * width + x]).iter().sum::<DVec3>());
    let neighbours = (rows.iter().sum::<DVec3>() - means[i]) / 8.0;
    let darker_half = before.min(2.0 * means[i] - before);
    means[i].min(neighbours.max(darker_half))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// Runs pixels with a known mean and compares the estimate with the true error.
    fn run(spp: u32, integrand: impl Fn(glam::Vec2) -> f64, mean: f64) -> (ErrorEstimate, f64) {
        let n_tiles = 64;
        let mut tiles = vec![TileConvergence::default(); n_tiles];
        let mut true_error = 0.0;
        for (t, tile) in tiles.iter_mut().enumerate() {
            let mut sums = vec![DVec3::ZERO; 64];
            for s in 0..spp {
                for (p, sum) in sums.iter_mut().enumerate() {
                    *sum += DVec3::splat(integrand(Sampler::new(2, t as u32, p as u32, s).pair(0)));
                }
                if (s + 1).is_power_of_two() {
                    tile.record(s + 1, 8, sums.iter().map(|sum| *sum / f64::from(s + 1)));
                }
            }
            for sum in sums {
                true_error += (sum.x / f64::from(spp) - mean).powi(2) / (mean * mean + 0.01);
            }
        }
        let estimate = ErrorEstimate::from_tiles(tiles.iter(), spp).unwrap();
        (estimate, (true_error / (64 * n_tiles) as f64).sqrt())
    }

    #[test]
    fn estimate_matches_the_true_error() {
        let smooth = |u: glam::Vec2| f64::from(u.x * u.y + u.x) * 4.0 / 3.0;
        let edge = |u: glam::Vec2| if u.x + 0.7 * u.y < 0.8 { 1.0 } else { 0.0 };
        // ∫ of the edge: the line meets y = 1 at x = 0.1, x = 0.8 at y = 0.
        let edge_mean = 0.45;
        for spp in [8, 16, 64, 128, 96] {
            for (name, (estimate, truth)) in [("smooth", run(spp, smooth, 1.0)), ("edge", run(spp, edge, edge_mean))] {
                let ratio = estimate.relative / truth;
                // What is promised from 16 samples on; before that there is one slope to go by.
                let good = if spp < 16 { 0.75..1.35 } else { 0.8..1.25 };
                assert!(good.contains(&ratio), "{name} at {spp} spp: {estimate:?} for {truth}");
            }
        }
    }

    /// One sample in 2,000 is bright and brings a twentieth of the light: most pixels have not met it yet.
    #[test]
    fn rare_bright_samples_do_not_hide_their_own_error() {
        let rare = |u: glam::Vec2| if u.x < 0.0005 { 100.95 } else { 0.95 };
        for spp in [16, 32, 64, 128] {
            let (estimate, truth) = run(spp, rare, 1.0);
            let ratio = estimate.relative / truth;
            assert!((0.8..1.25).contains(&ratio), "at {spp} spp: {estimate:?} for {truth}");
        }
    }

    #[test]
    fn lights_keep_their_level_and_fireflies_lose_it() {
        let (dark, width) = (DVec3::splat(0.1), 3);
        let around = |middle: f64| {
            let mut means = vec![dark; 9];
            means[4] = DVec3::splat(middle);
            means
        };
        // A light of one pixel: 19 in the first half, 21 in the second.
        assert_eq!(local_level(&around(20.0), DVec3::splat(19.0), width, 4), DVec3::splat(19.0));
        // A firefly in the second half, or in the first.
        assert!((local_level(&around(10.05), dark, width, 4) - dark).length() < 1e-12);
        assert!((local_level(&around(10.05), DVec3::splat(20.0), width, 4) - dark).length() < 1e-12);
        // Its neighbours count a ninth of it at most, and a tile of one pixel has itself alone.
        assert_eq!(local_level(&around(10.05), dark, width, 0), dark);
        assert_eq!(local_level(&[dark], dark, 1, 0), dark);
    }

    #[test]
    fn few_tiles_are_worth_less() {
        for (freedom, t) in [(1.0, 12.706), (3.0, 3.182), (4.0, 2.776), (9.0, 2.262), (30.0, 2.042), (1e6, 1.96)] {
            assert!((student_t(freedom) / t - 1.0).abs() < 5e-3, "{freedom}: {}", student_t(freedom));
        }
    }

    #[test]
    fn prediction_inverts_itself() {
        let (estimate, _) = run(64, |u| f64::from(u.x * u.x), 1.0 / 3.0);
        for target in [0.05, 0.01, 1e-3] {
            let spp = estimate.spp_for(target);
            assert!(estimate.relative_at(spp) <= target && estimate.relative_at(spp / 2) > target);
        }
        assert_eq!(estimate.spp_for(0.0), u32::MAX);
    }
}
