//! Where light from the lamps is summed up: over the whole picture, because it may fall into any pixel.
//!
//! Paths come in batches of fixed size that are traced by any worker and added in their order, so that no sum depends
//! on threads or on the portions in which it was made.

use super::trace::LightWave;
use super::{CausticPass, LIGHT_PATHS_PER_PIXEL};
use crate::render::RayCounts;
use crate::render::exact_sum::ExactSum;
use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Paths in a batch.
const BATCH: u32 = 4096;

/// Light that arrives in one pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Splat {
    pub pixel: u32,
    pub light: Vec3,
}

/// Sums over all paths from lamps so far.
#[derive(Clone, Debug)]
pub(in crate::render) struct LightLayer {
    /// Row by row from the top.
    pub sums: Vec<ExactSum>,
    /// Numbers of the batches, ascending, with gaps between the ranges; new ones lengthen the last.
    pub batches: Vec<Range<u32>>,
    /// Samples of the whole picture that are complete.
    pub spp: u32,
    /// The number of the sample that comes next.
    pub next_sample: u32,
}

/// What [`LightLayer::advance`] did.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::render) struct LayerReport {
    pub completed: bool,
    pub rays: RayCounts,
    /// How many splats were not finite and were left out.
    pub n_bad: u64,
}

impl LightLayer {
    /// For a picture whose first sample has this number.
    pub fn new(size: UVec2, first_sample: u32) -> Self {
        let n_pixels = (size.x * size.y) as usize;
        let first = first_batch(n_pixels, first_sample);
        Self {
            sums: vec![ExactSum::default(); n_pixels],
            batches: std::iter::once(first..first).collect(),
            spp: 0,
            next_sample: first_sample,
        }
    }

    pub fn spp(&self) -> u32 {
        self.spp
    }

    /// Samples of the picture that some of the paths belong to, at least [`spp`](Self::spp): more when it was stopped.
    pub fn begun(&self) -> u32 {
        let end = self.batches.last().map_or(0, |range| range.end);
        let is_behind = |more: &u32| first_batch(self.sums.len(), self.next_sample.saturating_add(*more)) < end;
        self.spp + (0..).take_while(is_behind).count() as u32
    }

    /// Mean over the paths so far.
    pub fn mean(&self, pixel: usize) -> DVec3 {
        match self.batches.iter().map(|range| range.end - range.start).sum::<u32>() {
            0 => DVec3::ZERO,
            n => self.sums[pixel].sum / (f64::from(n) * f64::from(BATCH)),
        }
    }

    /// Traces paths until they are enough for `target_spp` samples of the picture, or until `stop` says so; what a
    /// batch had not finished is dropped.
    pub fn advance(&mut self, pass: &CausticPass, target_spp: u32, stop: &(dyn Fn() -> bool + Sync)) -> LayerReport {
        let goal_sample = self.next_sample.saturating_add(target_spp.saturating_sub(self.spp));
        let goal = first_batch(self.sums.len(), goal_sample);
        let Some(last) = self.batches.last_mut() else { return LayerReport::default() };
        let mut report = LayerReport { completed: true, ..LayerReport::default() };
        // Enough at once to keep all workers busy, few enough to have little to add in the end.
        let at_once = 4 * rayon::current_num_threads() as u32;
        'all: while last.end < goal {
            let first = last.end;
            let done: Vec<Option<(Vec<Splat>, RayCounts)>> = (first..goal.min(first + at_once))
                .into_par_iter()
                .map_init(LightWave::default, |wave, batch| wave.trace(pass, batch * BATCH, BATCH, stop))
                .collect();
            for batch in done {
                let Some((splats, rays)) = batch else {
                    report.completed = false;
                    break 'all;
                };
                for Splat { pixel, light } in splats {
                    if light.is_finite() {
                        self.sums[pixel as usize].add(light);
                    } else {
                        report.n_bad += 1;
                    }
                }
                report.rays += rays;
                last.end += 1;
            }
        }
        if report.completed {
            self.spp = self.spp.max(target_spp);
            self.next_sample = goal_sample;
        }
        report
    }

    /// Adds the paths of another layer of the same picture.
    ///
    /// # Errors
    /// When both have some of the same paths. Then nothing has been added.
    pub fn merge(&mut self, other: &Self) -> Result<(), String> {
        let pairs = self.batches.iter().flat_map(|a| other.batches.iter().map(move |b| (a, b)));
        if pairs.into_iter().any(|(a, b)| a.start.max(b.start) < a.end.min(b.end)) {
            return Err("both films have some of the same light from the lamps".to_owned());
        }
        for (sum, other) in self.sums.iter_mut().zip(&other.sums) {
            sum.merge(other);
        }
        self.batches = joined(self.batches.iter().chain(&other.batches).cloned());
        self.spp += other.spp;
        self.next_sample = self.next_sample.max(other.next_sample);
        Ok(())
    }
}

/// The batch with which a sample's light from the lamps begins; the samples before it have all earlier ones.
fn first_batch(n_pixels: usize, sample: u32) -> u32 {
    let paths_per_sample = f64::from(LIGHT_PATHS_PER_PIXEL) * n_pixels as f64;
    (f64::from(sample) * paths_per_sample / f64::from(BATCH)).ceil() as u32
}

/// Ranges without overlap in ascending order, those that meet made one; at least one, if only an empty one.
pub(in crate::render) fn joined(ranges: impl Iterator<Item = Range<u32>>) -> Vec<Range<u32>> {
    let mut ranges: Vec<Range<u32>> = ranges.collect();
    ranges.sort_by_key(|range| (range.start, range.end));
    let mut joined: Vec<Range<u32>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            Some(last) if last.start == last.end => *last = range,
            Some(_) if range.start == range.end => {}
            _ => joined.push(range),
        }
    }
    joined
}
