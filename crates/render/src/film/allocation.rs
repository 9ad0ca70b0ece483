//! Sample allocation: which blocks of pixels get the next samples.
//!
//! Samples are allocated in rounds. A round begins when a film has spent its budget, a power of two of samples per
//! pixel on average, and doubles the budget. At its beginning, the film and the costs of its blocks determine which
//! blocks double their samples, once or twice, and in which order, and which of their shadow rays are subject to
//! roulette ([`crate::film::shadow_roulette`]); the decision is stored in the film. So a film is a function of scene, seed
//! and settings, independent of threads and portions, and resuming a stopped film gives the same result.
//!
//! Between passes the sample count of every block is a power of two, so that each pixel's sequence stays stratified,
//! and doublings measure the error. The optimal allocation has n ∝ √(variance / cost); powers of two lose 2 %. Doublings
//! are ordered by the reduction of the error per cost: doubling from n to 2n lowers variance / n by variance / (2n), for
//! n samples, so by variance / (2 n²) per sample. Where pixels are noisy paths are often long, so without the cost an
//! allocation can lose more time than it saves.
//!
//! The decision uses the samples that are allocated by it, which is a bias (a block that happens to look dark gets
//! fewer samples to correct that). It is kept small: the variance of a block is averaged over nine blocks and up to
//! three doublings, and no block falls below a quarter of the mean. It falls with 1 / n, while noise falls with 1 / √n.

use crate::core::settings::ErrorMetric;
use crate::film::block::{Block, MAX_DOUBLINGS, NEVER, Steps, doubled};
use crate::film::round::Round;
use crate::film::shadow_roulette::share_of;
use crate::film::tile::FilmTile;
use glam::{DVec3, UVec2};
use rayon::prelude::*;

/// Samples per pixel before the first allocation by error.
pub(crate) const FIRST_ROUND: u32 = 4;

/// No block has less than 1 / `LEAST_SHARE` of the mean samples per pixel, and none more than `MOST_SHARE` times the
/// mean.
const LEAST_SHARE: u32 = 4;
const MOST_SHARE: u32 = 16;

/// Relative reduction of the squared error times cost that a first uneven round must achieve: an even film is faster to
/// display and to predict, and a smaller gain may be noise.
const LEAST_GAIN: f64 = 0.05;

/// State of a block at the beginning of a round.
#[derive(Clone, Copy, Debug)]
struct BlockCandidate {
    n_pixels: u32,
    spp: u32,
    /// Variance of one sample relative to the squared level, mean over pixels and channels; `None` if unknown.
    variance: Option<f64>,
    /// Weight of the block in the metric.
    weight: f64,
    /// Cost of one sample per pixel.
    cost: f64,
}

/// The blocks of a film, row by row.
struct Grid {
    width: usize,
    blocks: Vec<BlockCandidate>,
}

/// A possible doubling of a block's samples.
struct Doubling {
    block: usize,
    /// Reduction of the squared error per cost; infinite for a mandatory doubling.
    gain: f64,
    /// Number of its samples, over all pixels of the block.
    n_samples: u64,
}

/// Decides a round of a film with these tiles, whose blocks form a grid of `size` blocks, and stores it in the blocks.
///
/// - `from`: mean samples per pixel that have been spent.
/// - `irregular`: see [`Round::irregular`].
/// - `costs`: cost of a sample per block, row by row; without, all cost the same.
pub(crate) fn begin_round(
    tiles: &mut [FilmTile],
    size: UVec2,
    (from, irregular): (u32, bool),
    metric: ErrorMetric,
    costs: Option<&[f64]>,
) -> Round {
    let to = doubled(from);
    let mut grid = Grid::of(tiles, size, metric);
    for (block, cost) in grid.blocks.iter_mut().zip(costs.unwrap_or_default()) {
        block.cost = *cost;
    }
    let shadow_shares = if costs.is_some() { grid.shadow_shares() } else { vec![0.0; grid.blocks.len()] };
    grid.smooth();
    let n_pixels: u64 = grid.blocks.iter().map(|block| u64::from(block.n_pixels)).sum();
    let doublings = grid.best_doublings(to);
    let total: u64 = grid.blocks.iter().map(|block| u64::from(block.n_pixels) * u64::from(block.spp)).sum();
    // Compensates what earlier rounds spent too much or too little, by at most half of a round: a region may be far
    // ahead.
    let usual = n_pixels * u64::from(to - from);
    let budget = (n_pixels * u64::from(to)).saturating_sub(total).clamp(usual / 2, usual + usual / 2);
    let mut due = vec![[NEVER; MAX_DOUBLINGS]; grid.blocks.len()];
    let mut spent = 0;
    for doubling in doublings {
        // Rounded to the nearest doubling.
        let at = spent + doubling.n_samples / 2;
        if at > budget && doubling.gain.is_finite() {
            break;
        }
        spent += doubling.n_samples;
        let share = (at as f64 / budget as f64 * f64::from(to - from)).ceil() as u32;
        let place = due[doubling.block].iter_mut().find(|due| **due == NEVER).expect("no more than that many");
        *place = (from + share.max(1)).min(to);
    }
    let even = grid.is_better_even(&due, from, to);
    for tile in tiles {
        for i in 0..tile.blocks.len() {
            let place = place_of(tile, &tile.blocks[i], grid.width);
            let due = if even { [NEVER; MAX_DOUBLINGS] } else { due[place] };
            let block = &mut tile.blocks[i];
            (block.base, block.due, block.shadow_share) = (block.spp, due, shadow_shares[place]);
        }
    }
    Round { from, to, budget: from, even, irregular }
}

/// Returns a finished round, for a film whose samples were changed otherwise: the next round is decided from its
/// counts.
pub(crate) fn end_round(tiles: &mut [FilmTile], budget: u32) -> Round {
    for block in tiles.iter_mut().flat_map(|tile| &mut tile.blocks) {
        (block.base, block.due, block.shadow_share) = (block.spp, [NEVER; MAX_DOUBLINGS], 0.0);
    }
    Round { from: budget, to: budget, budget, even: false, irregular: true }
}

/// Returns the index of a block in a grid of that width.
fn place_of(tile: &FilmTile, block: &Block, width: usize) -> usize {
    let at = (tile.origin + block.start) / crate::film::block::BLOCK_SIZE;
    at.y as usize * width + at.x as usize
}

impl Grid {
    fn of(tiles: &[FilmTile], size: UVec2, metric: ErrorMetric) -> Self {
        let nothing = BlockCandidate { n_pixels: 0, spp: 0, variance: None, weight: 1.0, cost: 1.0 };
        let mut grid = Self { width: size.x as usize, blocks: vec![nothing; (size.x * size.y) as usize] };
        let known: Vec<Vec<(usize, BlockCandidate)>> = tiles
            .par_iter()
            .map(|tile| {
                let of = |(i, block): (usize, &Block)| {
                    let n_pixels = block.n_pixels() as u32;
                    let weight = match metric {
                        ErrorMetric::RelativeMse => 1.0,
                        ErrorMetric::Display { exposure_stops } => display_weight(tile, block, exposure_stops),
                    };
                    let variance = variance_of(&block.steps, 3 * n_pixels);
                    let candidate = BlockCandidate { n_pixels, spp: block.spp, variance, weight, cost: 1.0 };
                    (place_of(tile, &tile.blocks[i], size.x as usize), candidate)
                };
                tile.blocks.iter().enumerate().map(of).collect()
            })
            .collect();
        for (place, candidate) in known.into_iter().flatten() {
            grid.blocks[place] = candidate;
        }
        grid
    }

    /// Replaces variance and cost of each block by a weighted mean over itself and its neighbours, with the weights of
    /// the metric.
    fn smooth(&mut self) {
        let smoothed = self.smoothed(|block| block.variance.map(|variance| variance * block.weight));
        for (block, (variance, cost)) in self.blocks.iter_mut().zip(smoothed) {
            (block.variance, block.cost) = (Some(variance), cost);
        }
    }

    /// Returns [`Block::shadow_share`] of each block. To be called before [`Self::smooth`].
    fn shadow_shares(&self) -> Vec<f32> {
        let smoothed = self.smoothed(|block| block.variance).into_iter();
        smoothed.map(|(variance, cost)| share_of(variance, cost)).collect()
    }

    /// Returns the weighted means of a variance and of the cost over each block and its neighbours. Where no variance is
    /// known, that of the whole image is taken.
    fn smoothed(&self, variance_of: impl Fn(&BlockCandidate) -> Option<f64> + Sync) -> Vec<(f64, f64)> {
        const WEIGHTS: [[f64; 3]; 3] = [[1.0, 2.0, 1.0], [2.0, 8.0, 2.0], [1.0, 2.0, 1.0]];
        let (width, height) = (self.width, self.blocks.len() / self.width);
        let of = |block: &BlockCandidate| {
            variance_of(block).map_or((0.0, 0.0), |v| (v * f64::from(block.n_pixels), f64::from(block.n_pixels)))
        };
        let (sum, n) = self.blocks.iter().map(of).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        let everywhere = if n > 0.0 { sum / n } else { 1.0 };
        (0..self.blocks.len())
            .into_par_iter()
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let (mut sum, mut n) = (0.0, 0.0);
                let (mut cost, mut weights) = (0.0, 0.0);
                for (dy, row) in WEIGHTS.iter().enumerate().filter(|(dy, _)| (1..=height).contains(&(y + dy))) {
                    for (dx, weight) in row.iter().enumerate().filter(|(dx, _)| (1..=width).contains(&(x + dx))) {
                        let block = &self.blocks[(y + dy - 1) * width + x + dx - 1];
                        let (of_sum, of_n) = of(block);
                        (sum, n) = (sum + weight * of_sum, n + weight * of_n);
                        (cost, weights) = (cost + weight * block.cost, weights + weight);
                    }
                }
                (if n > 0.0 { sum / n } else { everywhere }, cost / weights)
            })
            .collect()
    }

    /// Returns all permitted doublings up to a mean of `to` samples per pixel, the most effective first.
    fn best_doublings(&self, to: u32) -> Vec<Doubling> {
        let mut doublings = Vec::new();
        for (place, block) in self.blocks.iter().enumerate() {
            let mut spp = block.spp;
            for _ in 0..MAX_DOUBLINGS {
                let next = doubled(spp);
                if u64::from(next) > u64::from(to) * u64::from(MOST_SHARE) {
                    break;
                }
                let n_samples = u64::from(next - spp) * u64::from(block.n_pixels);
                let must_be = spp < to / LEAST_SHARE;
                let fall = block.variance.unwrap_or_default() / (f64::from(spp.max(1)) * f64::from(next) * block.cost);
                let gain = if must_be { f64::INFINITY } else { fall };
                doublings.push(Doubling { block: place, gain, n_samples });
                spp = next;
            }
        }
        // The sort is stable: equal gains stay in the order of the blocks, and the doublings of a block in their own
        // order.
        doublings.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        doublings
    }

    /// Whether an even film should stay even, because an uneven allocation gains too little.
    fn is_better_even(&self, due: &[[u32; MAX_DOUBLINGS]], from: u32, to: u32) -> bool {
        if self.blocks.iter().any(|block| block.spp != from) {
            return false;
        }
        // Squared error times cost.
        let product = |spp_of: &dyn Fn(usize, &BlockCandidate) -> u32| {
            let of = |(i, block): (usize, &BlockCandidate)| {
                let (n_pixels, spp) = (f64::from(block.n_pixels), f64::from(spp_of(i, block)));
                (n_pixels * block.variance.unwrap_or_default() / spp, n_pixels * spp * block.cost)
            };
            let sums = self.blocks.iter().enumerate().map(of).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            sums.0 * sums.1
        };
        let after = |i: usize, block: &BlockCandidate| {
            due[i].iter().filter(|&&due| due != NEVER).fold(block.spp, |spp, _| doubled(spp))
        };
        product(&after) >= (1.0 - LEAST_GAIN) * product(&|_, _| to)
    }
}

/// Returns the variance of one sample, relative to the squared level, mean over pixels and channels, as measured by
/// doublings and under the assumption of independent samples. Later doublings have more samples and a larger weight.
fn variance_of(steps: &Steps, n_values: u32) -> Option<f64> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for ago in 0..Steps::KEPT {
        if let Some(step) = steps.ago(ago) {
            let share = 0.5_f64.powi(ago as i32);
            sum += share * step * f64::from(steps.at) * share / f64::from(n_values);
            weights += share;
        }
    }
    (weights > 0.0).then(|| sum / weights)
}

/// Returns the weight of a relative error on a display: the squared slope of the encoded value with respect to the
/// relative error, mean over pixels and channels. It is small above white, which is 1 after exposure.
fn display_weight(tile: &FilmTile, block: &Block, exposure_stops: f32) -> f64 {
    let exposure = f64::from(exposure_stops).exp2();
    let floor = 0.01 * f64::from(tile.unit).powi(2);
    let encoded = |light: f64| (1.0 - (-light.max(0.0) * exposure).exp()).powf(1.0 / 2.2);
    let of = |light: f64| {
        // A finite difference as wide as the error of a noisy mean, and a hundredth of white, so that black is no pole.
        let step = 0.1 * light.abs() + 0.01 / exposure;
        let slope = (encoded(light + step) - encoded(light - step)) / (2.0 * step);
        slope * slope * (light * light + floor)
    };
    let weight = |mean: DVec3| of(mean.x) + of(mean.y) + of(mean.z);
    let sum: f64 = block.locals(tile.size.x).map(|local| weight(tile.mean(local))).sum();
    sum / (3.0 * block.n_pixels() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::block::{BLOCK_PIXELS, BLOCK_SIZE};
    use crate::film::tiles::Film;
    use crate::sampling::Sampler;
    use glam::Vec3;

    const SIDE: u32 = 64;

    /// Renders an adaptive film of a function of pixel and random numbers, without a scene.
    fn film_of(seed: u32, budget: u32, light: &(dyn Fn(u32, u32, glam::Vec2) -> f32 + Sync)) -> Film {
        let mut film = Film::new(SIDE, SIDE);
        while film.spp() < budget {
            film.begin_round_if_due(ErrorMetric::RelativeMse);
            let goal = (film.spp() + 1).next_power_of_two().min(budget);
            let round = film.round;
            for tile in &mut film.tiles {
                for i in 0..tile.blocks.len() {
                    let origin = tile.origin + tile.blocks[i].start;
                    while tile.blocks[i].spp < tile.blocks[i].target(round.as_ref(), goal) {
                        let sample = tile.blocks[i].next_sample();
                        let seen = |p: u32| {
                            let (x, y) = (origin.x + p % BLOCK_SIZE, origin.y + p / BLOCK_SIZE);
                            light(x, y, Sampler::new(seed, x, y, sample).pair(0))
                        };
                        let radiance: Vec<Vec3> = (0..BLOCK_PIXELS as u32).map(|p| Vec3::splat(seen(p))).collect();
                        tile.add_sample(i, sample, &radiance);
                        tile.record(false);
                    }
                }
            }
            film.has_spent(goal);
        }
        film
    }

    /// One half of the image has little noise; in the other one sample in 400 carries half of the light.
    fn rare(x: u32, _y: u32, u: glam::Vec2) -> f32 {
        let firefly = if x >= SIDE / 2 && u.x < 1.0 / 400.0 { 200.0 } else { 0.0 };
        let base = if x >= SIDE / 2 { 0.5 } else { 0.9 + 0.2 * u.y };
        base + firefly
    }

    /// The bias of deciding by the allocated samples, at its worst: few samples, and half of the light in one of 400.
    #[test]
    fn rare_bright_samples_lose_little_of_their_mean() {
        const RENDERS: u32 = 400;
        let halves: Vec<[f64; 2]> = (0..RENDERS)
            .into_par_iter()
            .map(|seed| {
                let film = film_of(1000 + seed, 16, &rare);
                let mut sums = [0.0; 2];
                for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
                    sums[(x >= SIDE / 2) as usize] += f64::from(film.mean(x, y).x);
                }
                sums.map(|sum| sum / f64::from(SIDE * SIDE / 2))
            })
            .collect();
        let mean = |side: usize| halves.iter().map(|half| half[side]).sum::<f64>() / f64::from(RENDERS);
        assert!((mean(0) - 1.0).abs() < 1e-4, "{}", mean(0));
        assert!((mean(1) - 1.0).abs() < 0.05, "{}", mean(1));
    }
}
