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

//! Blocks of pixels may have doubled their samples a different number of times. Each brings what its own last doublings
//! changed: the sum over the picture is then that of an estimate of each block's present error.

use crate::film::block::Steps;
use glam::DVec3;

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
    /// Samples a pixel that the picture has, the mean over it.
    spp: u32,
    /// All pixels have that number of samples, and will have.
    is_even: bool,
}

/// What the doublings of all parts of a picture have changed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evidence {
    parts: Vec<Part>,
    /// Pixels times channels of each tile.
    n_values: Vec<f64>,
}

/// A block of pixels, or the traced light in a tile.
#[derive(Clone, Copy, Debug)]
struct Part {
    tile: usize,
    steps: Steps,
    /// Samples now, at least those of the newest step.
    spp: u32,
}

impl Evidence {
    /// Begins a tile; its parts follow.
    pub fn add_tile(&mut self, n_pixels: usize) {
        self.n_values.push(3.0 * n_pixels as f64);
    }

    /// A part of the tile that was begun last, of `spp` samples.
    pub fn add_part(&mut self, steps: Steps, spp: u32) {
        self.parts.push(Part { tile: self.n_values.len() - 1, steps, spp });
    }

    /// What the doubling so many before the last changed in each tile, if all parts know it.
    fn of_tiles(&self, ago: usize) -> Option<Vec<f64>> {
        let mut of_tiles = vec![0.0; self.n_values.len()];
        for part in &self.parts {
            of_tiles[part.tile] += part.steps.ago(ago)?;
        }
        Some(of_tiles)
    }
}

impl ErrorEstimate {
    /// Relative error at a number of samples a pixel, at least 1.
    ///
    /// Between powers of two the samples of an even picture are several nets of different size, one for each bit of their
    /// number, and each counts with its share: where errors fall fast, 96 samples are no better than 64.
    pub fn relative_at(&self, spp: u32) -> f64 {
        let (now, spp) = (self.spp.max(1), spp.max(1));
        let fall = if self.is_even {
            of_nets(spp, self.exponent) / of_nets(now, self.exponent)
        } else {
            (f64::from(spp) / f64::from(now)).powf(-self.exponent)
        };
        self.relative * fall.sqrt()
    }

    /// Samples a pixel that bring the relative error down to `target`, to within an eighth; `u32::MAX` if none do.
    pub fn spp_for(&self, target: f64) -> u32 {
        let candidates = (3..29).flat_map(|bit| (8..16u32).map(move |eighths| eighths << bit >> 3));
        (1..8).chain(candidates).find(|&spp| self.relative_at(spp) <= target).unwrap_or(u32::MAX)
    }

    /// - `spp`: samples a pixel that the picture has, the mean over it; `is_even`: all pixels have as many.
    pub(crate) fn new(evidence: &Evidence, spp: u32, is_even: bool) -> Option<Self> {
        let tiles: Vec<Option<Vec<f64>>> = (0..Steps::KEPT).map(|ago| evidence.of_tiles(ago)).collect();
        let newest = tiles[0].as_ref().filter(|_| !evidence.parts.is_empty())?;
        let n_values: f64 = evidence.n_values.iter().sum();
        let mean = |steps: &[f64]| steps.iter().sum::<f64>() / n_values;
        let last = mean(newest);
        // Tiles are independent of each other: their scatter is the uncertainty of a sum over them, relative to it.
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
        // Doublings that all blocks have seen, less one.
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
        // The first steps say little of how fast later ones fall; independent samples where there is only one.
        let earliest = level.saturating_sub(2).max(level.saturating_sub(1).min(2));
        let so_far = slope(level - earliest, &SO_FAR);
        // Further on all that is known helps.
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

        // On the logarithm, where the sum of positive terms is closer to symmetric. Two looks at the same tiles, from one
        // doubling to the next, scatter as this one and the truth do; of a first one only the tiles themselves are known.
        let of_noise = match tiles[1].as_ref().filter(|_| level > 0) {
            Some(before) if n_tiles >= 2.0 && last > 0.0 && mean(before) > 0.0 => {
                let fall = last / mean(before);
                scatter_about(newest, &|tile| fall * before[tile]) / last
            }
            _ => sigma(newest),
        };
        // And the slope of the last doubling, that the difference is made an error with, is not known for sure.
        let of_slope = growth * std::f64::consts::LN_2 / (growth - 1.0) * so_far.uncertainty;
        let factor = (0.5 * student_t(n_tiles - 1.0) * of_noise).hypot(0.5 * 1.96 * of_slope).exp();
        let relative = relative_mse.sqrt();
        Some(Self { relative, low: relative / factor, high: relative * factor, exponent, spp, is_even })
    }
}

/// The variance of so many samples, at least 1, in nets of different size, one for each bit of their number, where that of
/// a net falls as samples^−`exponent`; 1 for one sample.
fn of_nets(spp: u32, exponent: f64) -> f64 {
    let nets = (0..32).filter(|bit| spp >> bit & 1 == 1).map(|bit| f64::from(1u32 << bit));
    nets.map(|n| (n / f64::from(spp)).powi(2) * n.powf(-exponent)).sum()
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

/// What the error of pixel `i` is relative to: its own mean, but no more than its neighbours' mean and its own darker
/// half.
///
/// A bright sample that came once raises one half alone, and few of the neighbours. A light of a single pixel, which
/// its neighbours know nothing of, is bright in both halves.
pub(crate) fn local_level(means: &[DVec3], before: DVec3, width: usize, i: usize) -> DVec3 {
    let (x, y, height) = (i % width, i / width, means.len() / width);
    let darker_half = before.min(2.0 * means[i] - before);
    // Three by three pixels around it, moved inwards at a border.
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

    /// Runs pixels with a known mean and compares the estimate with the true error.
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
        // A pixel in a corner has the same neighbours, and a block of one pixel has itself alone.
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
