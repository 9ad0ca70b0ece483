//! A square block of pixels that have the same samples: the unit of sample allocation.
//!
//! 8 × 8 pixels are small enough for an allocation to follow shadows and edges, and enough to measure their error.

use crate::film::round::Round;
use glam::{UVec2, Vec3};
use std::ops::Range;

/// Pixels along the side of a block.
pub(crate) const BLOCK_SIZE: u32 = 8;

/// Maximum number of pixels per block.
pub(crate) const BLOCK_PIXELS: usize = (BLOCK_SIZE * BLOCK_SIZE) as usize;

/// How often a block may double its samples in one round.
pub(crate) const MAX_DOUBLINGS: usize = 2;

/// Value of [`Block::due`] for a doubling that is not part of the round.
pub(crate) const NEVER: u32 = u32::MAX;

/// One block of a tile, and which samples its pixels have.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Upper left pixel, relative to the tile.
    pub start: UVec2,
    /// Width and height in pixels.
    pub size: UVec2,
    /// Samples per pixel so far, non-finite ones included.
    pub spp: u32,
    /// The numbers of those samples, ascending, with gaps between the ranges; new samples extend the last range.
    pub ranges: Vec<Range<u32>>,
    /// Sample count of the means at the last power of two ([`FilmTile::before`](crate::film::tile::FilmTile::before));
    /// 0 before the first.
    pub mean_of: u32,
    /// Squared changes of the image by the latest doublings.
    pub steps: Steps,
    /// Samples per pixel when the round began.
    pub base: u32,
    /// The budgets from which on the samples are doubled once and twice; [`NEVER`] if not in this round.
    pub due: [u32; MAX_DOUBLINGS],
    /// Share of a pixel's level below which shadow rays are subject to roulette, see [`crate::film::shadow_roulette`]; 0
    /// for none.
    pub shadow_share: f32,
}

impl Block {
    pub fn new(start: UVec2, size: UVec2) -> Self {
        let ranges = std::iter::once(0..0).collect();
        let (steps, due) = (Steps::default(), [NEVER; MAX_DOUBLINGS]);
        Self { start, size, spp: 0, ranges, mean_of: 0, steps, base: 0, due, shadow_share: 0.0 }
    }

    /// Whether the change of the mean between the halves of `mean_of` samples is measured.
    pub fn knows_half_step(&self) -> bool {
        self.steps.at > 0 && self.steps.at == self.mean_of
    }

    /// The last doubling of a pixel for storage: the change of its mean, and the squared relative one; 0 where there was
    /// none, `None` if it was not stored.
    ///
    /// - `local`: the pixel; `half_steps`, `last`: lists of its tile.
    pub fn change(&self, local: usize, half_steps: &[Vec3], last: &[f32]) -> Option<[f32; 4]> {
        let change = if self.knows_half_step() { *half_steps.get(local)? } else { Vec3::ZERO };
        let relative = if self.steps.at > 0 { *last.get(local)? } else { 0.0 };
        (!change.is_nan()).then_some([change.x, change.y, change.z, relative])
    }

    /// Removes all samples; the next one has number `first`.
    pub fn clear(&mut self, first: u32) {
        let Self { start: _, size: _, spp, ranges, mean_of, steps, base, due, shadow_share } = self;
        (*spp, *mean_of, *base, *steps, *due) = (0, 0, 0, Steps::default(), [NEVER; MAX_DOUBLINGS]);
        *shadow_share = 0.0;
        ranges.clear();
        ranges.push(first..first);
    }

    pub fn n_pixels(&self) -> usize {
        (self.size.x * self.size.y) as usize
    }

    /// Indices of its pixels in a tile of this width, row by row.
    pub fn locals(&self, tile_width: u32) -> impl Iterator<Item = usize> + use<> {
        let Self { start, size, .. } = *self;
        (start.y..start.y + size.y)
            .flat_map(move |y| (start.x..start.x + size.x).map(move |x| (y * tile_width + x) as usize))
    }

    /// The number of the next sample.
    pub fn next_sample(&self) -> u32 {
        self.ranges.last().map_or(0, |range| range.end)
    }

    /// Samples per pixel of the block when the film's budget (mean samples per pixel) is spent.
    pub fn target(&self, round: Option<&Round>, budget: u32) -> u32 {
        if round.is_none_or(|round| round.even) {
            return budget;
        }
        let doublings = self.due.iter().take_while(|&&due| due <= budget);
        doublings.fold(self.base, |spp, _| doubled(spp))
    }

    /// The budget to which its latest samples belong.
    pub fn begun(&self, round: &Round) -> u32 {
        let reaches = |due: &&u32| self.target(Some(round), **due) >= self.spp;
        if self.spp <= self.base {
            round.from
        } else {
            *self.due.iter().find(reaches).unwrap_or(&self.spp.max(round.to))
        }
    }

    /// Returns samples that both blocks have, if any.
    pub fn shares_with(&self, other: &Self) -> Option<Range<u32>> {
        let pairs = self.ranges.iter().flat_map(|a| other.ranges.iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| a.start.max(b.start)..a.end.min(b.end)).find(|shared| !shared.is_empty())
    }

    /// Whether the error statistics of `other` are closer to those of a film rendered in one go, where the second half
    /// of the samples doubles the first.
    pub fn knows_less_than(&self, other: &Self) -> bool {
        let start = |block: &Self| std::cmp::Reverse(block.ranges.first().map_or(0, |range| range.start));
        (other.spp, start(other)) > (self.spp, start(self))
    }

    /// Adds the samples of another block to this one's counts and ranges.
    pub fn merge_samples(&mut self, other: &Self) {
        self.spp += other.spp;
        let next = self.next_sample();
        self.ranges = joined(self.ranges.iter().chain(&other.ranges), next);
    }
}

/// Returns the next power of two above a number of samples.
pub(crate) fn doubled(spp: u32) -> u32 {
    spp.saturating_add(1).checked_next_power_of_two().unwrap_or(u32::MAX)
}

/// Sorts ranges and joins those that touch; returns an empty range at `next` if there is none.
fn joined<'a>(ranges: impl Iterator<Item = &'a Range<u32>>, next: u32) -> Vec<Range<u32>> {
    let mut ranges: Vec<Range<u32>> = ranges.filter(|range| !range.is_empty()).cloned().collect();
    if ranges.is_empty() {
        ranges.push(next..next);
    }
    ranges.sort_by_key(|range| range.start);
    ranges.into_iter().fold(Vec::new(), |mut joined: Vec<Range<u32>>, range| {
        match joined.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => joined.push(range),
        }
        joined
    })
}

/// Squared changes of the image by the latest doublings of the samples, newest first: sums over pixels and channels of
/// |I₂ₙ − Iₙ|² / (level² + 0.01); NaN where unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Steps {
    /// Samples per pixel after the newest doubling; 0 before the first.
    pub at: u32,
    pub values: [f32; Self::KEPT],
}

impl Steps {
    /// Number of doublings from which the slope of the error is estimated.
    pub const KEPT: usize = 3;

    /// Adds the squared change of the doubling to `at` samples.
    pub fn push(&mut self, at: u32, value: f64) {
        let older = self.values;
        // Doublings in between were not recorded.
        let gap = if self.at > 0 { at.ilog2().saturating_sub(self.at.ilog2()).max(1) as usize } else { Self::KEPT };
        let old = |k: usize| k.checked_sub(gap).map_or(f32::NAN, |k| older[k]);
        self.values = std::array::from_fn(|k| if k == 0 { value as f32 } else { old(k) });
        self.at = at;
    }

    /// Returns the value of the `n`-th doubling before the newest, if it is known.
    pub fn ago(&self, n: usize) -> Option<f64> {
        let value = *self.values.get(n)?;
        (self.at > 0 && !value.is_nan()).then_some(f64::from(value))
    }
}
