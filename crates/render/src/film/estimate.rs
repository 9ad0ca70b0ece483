//! Estimates the error of an image from its own samples, without giving up any of their stratification.
//!
//! Let Iₙ be a pixel's mean over the first n = 2ᵏ samples. Its samples are an Owen-scrambled net, and so are the next
//! n, with the same distribution. Then E|Iₙ − I₂ₙ|² = var Iₙ − var I₂ₙ exactly, however the two halves correlate: I₂ₙ
//! is the mean of both, so cov(Iₙ, I₂ₙ) = var I₂ₙ. Summed over the image, the differences of consecutive doublings give
//! both the error and its rate of convergence: where the variance falls as n^−a, so do they, and var I₂ₙ is the
//! difference divided by 2ᵃ − 1. Independent batches would give the same, at the cost of the stratification across
//! batches.
//!
//! The level that a difference is relative to must not come from the pixel alone: one bright sample that only few
//! pixels have drawn yet (a caustic) would raise the value that its own error is divided by, and so hide its error; see
//! [`local_level`]. Blocks of pixels may have doubled their samples a different number of times. Each contributes its
//! own latest doublings; the sum over the image then estimates the present error of all blocks.

use crate::film::block::Steps;
use glam::DVec3;

/// The estimated error of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Root of relMSE, the mean over pixels and channels of variance / (mean² + 0.01), in the radiance unit of the scene:
    /// 1, but for lights of physical strength.
    pub relative: f64,
    /// Lower bound of an interval that contains the true value for this image with a probability of about 95 %, and
    /// more where the slope is well known. The interval is wide as long as the rate of convergence rests on few
    /// doublings.
    pub low: f64,
    /// Upper bound of that interval; see `low`.
    pub high: f64,
    /// relMSE is expected to fall as samples^−`exponent` from here on; 1 for independent samples.
    pub exponent: f64,
    /// Mean samples per pixel of the image.
    spp: u32,
    /// Whether all pixels have the same number of samples, now and later.
    is_even: bool,
}

/// The measured doublings of all parts of an image.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evidence {
    parts: Vec<ErrorPart>,
    /// Pixels times channels of each tile.
    n_values: Vec<f64>,
}

/// A block of pixels, or the light-traced part of a tile.
#[derive(Clone, Copy, Debug)]
struct ErrorPart {
    tile: usize,
    steps: Steps,
    /// Samples per pixel now, at least those of the newest doubling.
    spp: u32,
}

impl Evidence {
    /// Adds a tile; its parts follow.
    pub fn add_tile(&mut self, n_pixels: usize) {
        self.n_values.push(3.0 * n_pixels as f64);
    }

    /// Adds a part with `spp` samples per pixel to the tile that was added last.
    pub fn add_part(&mut self, steps: Steps, spp: u32) {
        self.parts.push(ErrorPart { tile: self.n_values.len() - 1, steps, spp });
    }

    /// Returns the squared change per tile by the doubling `ago` doublings before the newest, if all parts know it.
    fn of_tiles(&self, ago: usize) -> Option<Vec<f64>> {
        let mut of_tiles = vec![0.0; self.n_values.len()];
        for part in &self.parts {
            of_tiles[part.tile] += part.steps.ago(ago)?;
        }
        Some(of_tiles)
    }
}

impl ErrorEstimate {
    /// Predicts the relative error at `spp` samples per pixel, at least 1.
    ///
    /// Between powers of two the samples of an even image consist of several nets of different size, one per bit of
    /// their number, each weighted by its share: where errors fall fast, 96 samples are no better than 64.
    pub fn relative_at(&self, spp: u32) -> f64 {
        let (now, spp) = (self.spp.max(1), spp.max(1));
        let fall = if self.is_even {
            of_nets(spp, self.exponent) / of_nets(now, self.exponent)
        } else {
            (f64::from(spp) / f64::from(now)).powf(-self.exponent)
        };
        self.relative * fall.sqrt()
    }

    /// Samples per pixel that bring the relative error down to `target`, rounded up by at most an eighth; `u32::MAX` if
    /// none do.
    pub fn spp_for(&self, target: f64) -> u32 {
        let candidates = (3..29).flat_map(|bit| (8..16u32).map(move |eighths| eighths << bit >> 3));
        (1..8).chain(candidates).find(|&spp| self.relative_at(spp) <= target).unwrap_or(u32::MAX)
    }

    /// Returns `None` before the first doubling of every part.
    ///
    /// - `spp`: mean samples per pixel of the image; `is_even`: whether all pixels have the same number.
    pub(crate) fn new(evidence: &Evidence, spp: u32, is_even: bool) -> Option<Self> {
        let tiles: Vec<Option<Vec<f64>>> = (0..Steps::KEPT).map(|ago| evidence.of_tiles(ago)).collect();
        let newest = tiles[0].as_ref().filter(|_| !evidence.parts.is_empty())?;
        let n_values: f64 = evidence.n_values.iter().sum();
        let mean = |steps: &[f64]| steps.iter().sum::<f64>() / n_values;
        let last = mean(newest);
        // Tiles are independent: their scatter gives the relative uncertainty of a sum over them.
        let n_tiles = evidence.n_values.len() as f64;
        let scatter_about = |steps: &[f64], expected: &dyn Fn(usize) -> f64| {
            let squares = steps.iter().enumerate().map(|(i, step)| (step - expected(i)).powi(2));
            (squares.sum::<f64>() * n_tiles / (n_tiles - 1.0)).sqrt() / n_values
        };
        let sigma = |steps: &[f64]| {
            let mean = mean(steps);
            if n_tiles < 2.0 || mean <= 0.0 {
                return 1.0;
            }
            scatter_about(steps, &|tile| mean * evidence.n_values[tile]) / mean
        };
        // Number of doublings that all blocks have seen, less one.
        let level = evidence.parts.iter().map(|part| part.steps.at.ilog2() as usize - 1).min()?;
        let slope = |longest: usize, expected: &Expected| {
            let known = (1..=longest).rev().find_map(|span| Some((span, tiles[span].as_ref()?)));
            match known.filter(|_| last > 0.0) {
                Some((span, before)) => {
                    let seen = (mean(before) / last).log2() / span as f64;
                    let of_tiles = sigma(before).hypot(sigma(newest)) / std::f64::consts::LN_2;
                    expected.and_seen(seen, of_tiles.hypot(WOBBLE) / span as f64)
                }
                None => *expected,
            }
        };
        // The first steps say little about the later slope; with a single step the samples are assumed to be
        // independent.
        let earliest = level.saturating_sub(2).max(level.saturating_sub(1).min(2));
        let so_far = slope(level - earliest, &SO_FAR);
        // The slope from here on uses all steps that are known.
        let exponent = slope(level.min(2), &FROM_HERE_ON).exponent;
        let growth = so_far.exponent.exp2();
        let mut known = (0, 0, 1.0);
        let now = evidence.parts.iter().map(|part| {
            let at = part.steps.at;
            if (known.0, known.1) != (part.spp, at) {
                known = (part.spp, at, of_nets(part.spp, exponent) / of_nets(at, exponent));
            }
            part.steps.ago(0).unwrap_or_default() * known.2
        });
        let relative_mse = now.sum::<f64>() / n_values / (growth - 1.0);

        // On the logarithm, where a sum of positive terms is closer to symmetric. The scatter of the same tiles from
        // one doubling to the next equals that between the estimate and the true error; at the first doubling only the
        // scatter over the tiles is known.
        let of_noise = match tiles[1].as_ref().filter(|_| level > 0) {
            Some(before) if n_tiles >= 2.0 && last > 0.0 && mean(before) > 0.0 => {
                let fall = last / mean(before);
                scatter_about(newest, &|tile| fall * before[tile]) / last
            }
            _ => sigma(newest),
        };
        // The slope that converts the last difference to an error is uncertain, too.
        let of_slope = growth * std::f64::consts::LN_2 / (growth - 1.0) * so_far.uncertainty;
        let factor = (0.5 * student_t(n_tiles - 1.0) * of_noise).hypot(0.5 * 1.96 * of_slope).exp();
        let relative = relative_mse.sqrt();
        Some(Self { relative, low: relative / factor, high: relative * factor, exponent, spp, is_even })
    }
}

/// Returns the variance of `spp` samples, at least 1, that consist of nets of different size, one per bit of their
/// number, where the variance of a net falls as samples^−`exponent`; 1 for one sample.
fn of_nets(spp: u32, exponent: f64) -> f64 {
    let nets = (0..32).filter(|bit| spp >> bit & 1 == 1).map(|bit| f64::from(1u32 << bit));
    nets.map(|n| (n / f64::from(spp)).powi(2) * n.powf(-exponent)).sum()
}

/// From independent samples to the best rate of scrambled nets for smooth integrands (Owen 1997).
const MIN_EXPONENT: f64 = 1.0;
const MAX_EXPONENT: f64 = 3.0;

/// An exponent and its standard deviation.
#[derive(Clone, Copy, Debug)]
struct Expected {
    exponent: f64,
    uncertainty: f64,
}

/// Prior for the exponent so far: about that of independent samples, which is conservative.
const SO_FAR: Expected = Expected { exponent: MIN_EXPONENT, uncertainty: 0.5 };

/// Prior from eight samples on: mean and standard deviation of the exponent over the built-in scenes up to 64 samples
/// (1.28 and 0.20), rounded conservatively.
const FROM_HERE_ON: Expected = Expected { exponent: 1.2, uncertainty: 0.316 };

impl Expected {
    /// Returns the posterior after observing an exponent with this uncertainty: a slope from few bright pixels has
    /// little weight.
    fn and_seen(&self, seen: f64, uncertainty: f64) -> Self {
        let (expected, of_seen) = (self.uncertainty.powi(2), uncertainty.powi(2));
        let trust = expected / (expected + of_seen);
        let exponent = (self.exponent + trust * (seen - self.exponent)).clamp(MIN_EXPONENT, MAX_EXPONENT);
        Self { exponent, uncertainty: (trust * of_seen).sqrt() }
    }
}

/// Returns the 97.5 % quantile of Student's t, which replaces a normal variable's 1.96 when its deviation is estimated
/// from `freedom` + 1 values. Accurate to half a per cent (Cornish–Fisher expansion from four degrees of freedom on).
fn student_t(freedom: f64) -> f64 {
    match freedom {
        ..1.5 => 12.706,
        ..2.5 => 4.303,
        ..3.5 => 3.182,
        _ => 1.96 + 2.372 / freedom + 2.823 / freedom.powi(2) + 2.556 / freedom.powi(3),
    }
}

/// Deviation of the slope of a single doubling from the long-term slope where edges dominate, even without noise: nets
/// of odd and of even powers of two subdivide the square differently.
const WOBBLE: f64 = 0.25;

/// Returns the level of pixel `i` for relative errors, W·m⁻²·sr⁻¹ per channel: its own mean, but at most its
/// neighbours' mean or the mean of its own darker half, whichever is larger.
///
/// A single bright sample raises one half only, and few of the neighbours. A light that covers one pixel, and so none
/// of its neighbours, is bright in both halves.
pub(crate) fn local_level(means: &[DVec3], before: DVec3, width: usize, i: usize) -> DVec3 {
    let (x, y, height) = (i % width, i / width, means.len() / width);
    let darker_half = before.min(2.0 * means[i] - before);
    // The 3 × 3 pixels around it, shifted inwards at a border.
    let around = |k: usize, n: usize| {
        let first = k.saturating_sub(1).min(n.saturating_sub(3));
        first..(first + 3).min(n)
    };
    let rows = around(y, height).flat_map(|y| around(x, width).map(move |x| y * width + x));
    let (mut sum, mut n) = (-means[i], -1.0);
    for pixel in rows {
        sum += means[pixel];
        n += 1.0;
    }
    let neighbours = if n > 0.0 { sum / n } else { means[i] };
    means[i].min(neighbours.max(darker_half))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tile::FilmTile;
    use crate::sampling::Sampler;
    use glam::{UVec2, Vec3};

    /// Renders pixels with a known mean; returns the estimate and the true error.
    fn run(spp: u32, integrand: impl Fn(glam::Vec2) -> f64, mean: f64) -> (ErrorEstimate, f64) {
        let n_tiles = 64;
        let mut evidence = Evidence::default();
        let mut true_error = 0.0;
        for t in 0..n_tiles {
            let mut tile = FilmTile::try_new(UVec2::ZERO, UVec2::splat(8)).unwrap();
            for s in 0..spp {
                let sample = |p: u32| integrand(Sampler::new(2, t, p, s).pair(0)) as f32;
                let radiance: Vec<Vec3> = (0..64).map(|p| Vec3::splat(sample(p))).collect();
                tile.add_sample(0, s, &radiance);
                tile.record(true);
            }
            evidence.add_tile(64);
            evidence.add_part(tile.blocks[0].steps, spp);
            for local in 0..64 {
                true_error += (tile.mean(local).x - mean).powi(2) / (mean * mean + 0.01);
            }
        }
        let estimate = ErrorEstimate::new(&evidence, spp, true).unwrap();
        (estimate, (true_error / f64::from(64 * n_tiles)).sqrt())
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
                // The documented accuracy holds from 16 samples on; with fewer there is a single slope.
                let good = if spp < 16 { 0.75..1.35 } else { 0.8..1.25 };
                assert!(good.contains(&ratio), "{name} at {spp} spp: {estimate:?} for {truth}");
            }
        }
    }

    /// One sample in 2,000 is bright and carries a twentieth of the light: most pixels have not drawn it yet.
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
        // A light that covers one pixel: 19 in the first half, 21 in the second.
        assert_eq!(local_level(&around(20.0), DVec3::splat(19.0), width, 4), DVec3::splat(19.0));
        // A firefly in the second half, or in the first.
        assert!((local_level(&around(10.05), dark, width, 4) - dark).length() < 1e-12);
        assert!((local_level(&around(10.05), DVec3::splat(20.0), width, 4) - dark).length() < 1e-12);
        // A pixel in a corner has the same neighbours, and a block of one pixel only itself.
        let mut corner = vec![dark; 9];
        corner[0] = DVec3::splat(10.05);
        assert!((local_level(&corner, dark, width, 0) - dark).length() < 1e-12);
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
