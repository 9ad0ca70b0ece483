//! A square of pixels that have the same samples: what samples are allocated to.
//!
//! 8 × 8 pixels are small enough for an allocation to follow shadows and edges, and enough for their error to be known.

use crate::film::round::Round;
use glam::UVec2;
use std::ops::Range;

/// Pixels along the side of a block.
pub(crate) const BLOCK_SIZE: u32 = 8;

/// Pixels of a block at most.
pub(crate) const BLOCK_PIXELS: usize = (BLOCK_SIZE * BLOCK_SIZE) as usize;

/// How often a block may double its samples in one round.
pub(crate) const MAX_DOUBLINGS: usize = 2;

/// A doubling that is not part of the round.
pub(crate) const NEVER: u32 = u32::MAX;

/// One block of a tile, and which samples its pixels have.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Upper left pixel, in the tile.
    pub start: UVec2,
    /// Pixels.
    pub size: UVec2,
    /// Samples taken of each pixel so far, bad ones included.
    pub spp: u32,
    /// The numbers of those samples, ascending, with gaps between the ranges; new samples lengthen the last one.
    pub ranges: Vec<Range<u32>>,
    /// Samples of the means at the last power of two ([`FilmTile::before`](crate::film::tile::FilmTile::before)); 0 before
    /// the first.
    pub mean_of: u32,
    /// What doublings changed.
    pub steps: Steps,
    /// Samples when the round began.
    pub base: u32,
    /// The budgets from which on the samples are doubled once, twice; [`NEVER`] is not in this round.
    pub due: [u32; MAX_DOUBLINGS],
}

impl Block {
    pub fn new(start: UVec2, size: UVec2) -> Self {
        let ranges = std::iter::once(0..0).collect();
        let (steps, due) = (Steps::default(), [NEVER; MAX_DOUBLINGS]);
        Self { start, size, spp: 0, ranges, mean_of: 0, steps, base: 0, due }
    }

    /// How many blocks a tile of this size has.
    pub fn count(tile: UVec2) -> usize {
        tile.x.div_ceil(BLOCK_SIZE) as usize * tile.y.div_ceil(BLOCK_SIZE) as usize
    }

    /// As new, to begin with sample number `first`.
    pub fn clear(&mut self, first: u32) {
        let Self { start: _, size: _, spp, ranges, mean_of, steps, base, due } = self;
        (*spp, *mean_of, *base, *steps, *due) = (0, 0, 0, Steps::default(), [NEVER; MAX_DOUBLINGS]);
        ranges.clear();
        ranges.push(first..first);
    }

    pub fn n_pixels(&self) -> usize {
        (self.size.x * self.size.y) as usize
    }

    /// The places of its pixels in a tile of this width, row by row.
    pub fn locals(&self, tile_width: u32) -> impl Iterator<Item = usize> + use<> {
        let Self { start, size, .. } = *self;
        (start.y..start.y + size.y)
            .flat_map(move |y| (start.x..start.x + size.x).map(move |x| (y * tile_width + x) as usize))
    }

    /// The number of the next sample.
    pub fn next_sample(&self) -> u32 {
        self.ranges.last().map_or(0, |range| range.end)
    }

    /// Samples that it has when a budget (mean samples per pixel of the film) is spent.
    pub fn target(&self, round: Option<&Round>, budget: u32) -> u32 {
        if round.is_none_or(|round| round.even) {
            return budget;
        }
        let doublings = self.due.iter().take_while(|&&due| due <= budget);
        doublings.fold(self.base, |spp, _| doubled(spp))
    }

    /// The budget that its last samples belong to.
    pub fn begun(&self, round: &Round) -> u32 {
        let reaches = |due: &&u32| self.target(Some(round), **due) >= self.spp;
        if self.spp <= self.base {
            round.from
        } else {
            *self.due.iter().find(reaches).unwrap_or(&self.spp.max(round.to))
        }
    }

    /// Samples that both have.
    pub fn shares_with(&self, other: &Self) -> Option<Range<u32>> {
        let pairs = self.ranges.iter().flat_map(|a| other.ranges.iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| a.start.max(b.start)..a.end.min(b.end)).find(|shared| !shared.is_empty())
    }

    /// Whether what `other` knows of its error comes closer to what rendering in one go would have measured: that is
    /// known where the second half doubles the first.
    pub fn knows_less_than(&self, other: &Self) -> bool {
        let start = |block: &Self| std::cmp::Reverse(block.ranges.first().map_or(0, |range| range.start));
        (other.spp, start(other)) > (self.spp, start(self))
    }

    /// Has the samples of both from now on.
    pub fn merge_samples(&mut self, other: &Self) {
        self.spp += other.spp;
        let next = self.next_sample();
        self.ranges = joined(self.ranges.iter().chain(&other.ranges), next);
    }
}

/// The next power of two above a number of samples.
pub(crate) fn doubled(spp: u32) -> u32 {
    spp.saturating_add(1).checked_next_power_of_two().unwrap_or(u32::MAX)
}

/// Ranges in order, those that touch as one; an empty one at `next` where there is none.
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

/// What the latest doublings of the samples changed, the newest first: sums over pixels and channels of
/// |I₂ₙ − Iₙ|² / (level² + 0.01); NaN where it is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Steps {
    /// Samples after the newest; 0 before the first.
    pub at: u32,
    pub values: [f32; Self::KEPT],
}

impl Steps {
    /// As many as the slope of the error is told from.
    pub const KEPT: usize = 3;

    /// Adds what the doubling to `at` samples changed.
    pub fn push(&mut self, at: u32, value: f64) {
        let older = self.values;
        // Doublings in between were not looked at.
        let gap = if self.at > 0 { at.ilog2().saturating_sub(self.at.ilog2()).max(1) as usize } else { Self::KEPT };
        let old = |k: usize| k.checked_sub(gap).map_or(f32::NAN, |k| older[k]);
        self.values = std::array::from_fn(|k| if k == 0 { value as f32 } else { old(k) });
        self.at = at;
    }

    /// The one that came so many doublings before the newest, if it is known.
    pub fn ago(&self, n: usize) -> Option<f64> {
        let value = *self.values.get(n)?;
        (self.at > 0 && !value.is_nan()).then_some(f64::from(value))
    }
}
