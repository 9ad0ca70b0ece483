//! Sums of light tracing: over the whole image, because a light path may contribute to any pixel.
//!
//! Each sample of the image has its own light paths, in batches that any worker may trace. Sums do not depend on their
//! order, so neither threads nor portions change them, and layers of different samples can be merged like films.

use crate::core::counts::RayCounts;
use crate::film::exact_sum::ExactSum;
use crate::integrators::caustics::lens_connections::Splat;
use crate::integrators::caustics::trace::LightWave;
use crate::integrators::common::batches::Batches;
use crate::integrators::common::caustics_pass::CausticPass;
use glam::{DVec3, UVec2};
use rayon::prelude::*;
use std::ops::Range;

/// Sums over all light paths so far.
#[derive(Clone, Debug)]
pub(crate) struct LightLayer {
    /// Sum per pixel, row by row from the top.
    pub sums: Vec<ExactSum>,
    batches: Batches,
    /// Numbers of the traced batches, ascending, with gaps between the ranges; new batches extend the last range.
    pub done: Vec<Range<u64>>,
    /// Samples per pixel of the whole image that are complete.
    pub spp: u32,
}

/// Result of [`LightLayer::advance`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LayerReport {
    pub completed: bool,
    pub rays: RayCounts,
    /// Number of splats that were rejected because they were not finite.
    pub n_bad: u64,
}

impl LightLayer {
    /// - `first_sample`: number of the first sample.
    /// - `stride`: camera paths per light path, at least 1.
    pub fn new(size: UVec2, first_sample: u32, stride: u32) -> Self {
        Self::in_memory(Vec::new(), size, first_sample, stride)
    }

    /// Like [`Self::new`], reusing the memory of `sums`, whose values are discarded.
    pub fn in_memory(mut sums: Vec<ExactSum>, size: UVec2, first_sample: u32, stride: u32) -> Self {
        let n_pixels = (size.x * size.y) as usize;
        sums.truncate(n_pixels);
        sums.par_iter_mut().for_each(|sum| *sum = ExactSum::default());
        // In parallel, because the first access to new memory is slow.
        sums.par_extend(rayon::iter::repeat_n(ExactSum::default(), n_pixels - sums.len()));
        let batches = Batches::of_film(sums.len(), stride);
        let first = batches.of_sample(first_sample);
        Self { sums, batches, done: std::iter::once(first..first).collect(), spp: 0 }
    }

    /// Samples per pixel that have any of their light paths: more than are complete after a stop.
    pub fn begun(&self) -> u32 {
        self.n_done().div_ceil(u64::from(self.batches.per_sample)) as u32
    }

    /// Samples per pixel whose light paths are complete; the value that [`Self::spp`] should have.
    pub fn complete(&self) -> u32 {
        (self.n_done() / u64::from(self.batches.per_sample)) as u32
    }

    /// Number of batches of the samples below `sample`.
    pub fn batches_before(&self, sample: u32) -> u64 {
        self.batches.of_sample(sample)
    }

    fn n_done(&self) -> u64 {
        self.done.iter().map(|range| range.end - range.start).sum()
    }

    /// Mean radiance of a pixel over the light paths so far, W·m⁻²·sr⁻¹.
    pub fn mean(&self, pixel: usize) -> DVec3 {
        match self.n_done() {
            0 => DVec3::ZERO,
            n => self.sums[pixel].sum / (n as f64 * f64::from(self.batches.size)),
        }
    }

    /// Like [`Block::knows_less_than`](crate::film::block::Block::knows_less_than).
    pub fn knows_less_than(&self, other: &Self) -> bool {
        let start = |layer: &Self| std::cmp::Reverse(layer.done.first().map_or(0, |range| range.start));
        (other.spp, start(other)) > (self.spp, start(self))
    }

    /// Adds the paths of another layer of the same image; the layers must have no batch in common.
    pub fn merge(&mut self, other: &Self) {
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, other)| sum.merge(other));
        let last = self.done.last().map_or(0, |range| range.end);
        let mut done: Vec<Range<u64>> = self.done.iter().chain(&other.done).cloned().collect();
        done.retain(|range| !range.is_empty());
        done.sort_by_key(|range| range.start);
        self.done = done.into_iter().fold(Vec::new(), |mut joined: Vec<Range<u64>>, range| {
            match joined.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => joined.push(range),
            }
            joined
        });
        if self.done.is_empty() {
            self.done.push(last..last);
        }
        self.spp = self.complete();
    }

    /// Returns the numbers of the image samples whose light paths are missing up to `target_spp` samples per pixel.
    pub fn missing(&self, target_spp: u32) -> Range<u32> {
        let next = self.done.last().map_or(0, |range| range.end);
        let end = next + self.batches.of_sample(target_spp).saturating_sub(self.n_done());
        let per_sample = u64::from(self.batches.per_sample);
        (next / per_sample) as u32..end.div_ceil(per_sample) as u32
    }

    /// Traces light paths up to `target_spp` samples per pixel of the image, or until `stop` returns true; unfinished
    /// batches are discarded.
    pub fn advance(&mut self, pass: &CausticPass, target_spp: u32, stop: &(dyn Fn() -> bool + Sync)) -> LayerReport {
        self.advance_with(target_spp, stop, &|_| Some(pass))
    }

    /// Like [`Self::advance`], for a scene that differs from sample to sample.
    ///
    /// - `pass_of`: the pass for an image sample; `None` if light paths contribute nothing to it.
    pub fn advance_with<'a>(
        &mut self,
        target_spp: u32,
        stop: &(dyn Fn() -> bool + Sync),
        pass_of: &(dyn Fn(u32) -> Option<&'a CausticPass<'a>> + Sync),
    ) -> LayerReport {
        let mut report = LayerReport { completed: true, ..LayerReport::default() };
        let (size, per_sample) = (self.batches.size, u64::from(self.batches.per_sample));
        let mut left = self.batches.of_sample(target_spp).saturating_sub(self.n_done());
        let mut next = self.done.last().map_or(0, |range| range.end);
        // Enough at once to keep all workers busy, few enough that a stop discards little.
        let at_once = 4 * rayon::current_num_threads() as u64;
        'all: while left > 0 {
            let traced: Vec<Option<(Vec<Splat>, RayCounts)>> = (next..next + left.min(at_once))
                .into_par_iter()
                .map_init(LightWave::default, |wave, batch| match pass_of((batch / per_sample) as u32) {
                    Some(pass) => wave.trace(pass, batch * u64::from(size), size, stop),
                    None => Some(Default::default()),
                })
                .collect();
            for batch in traced {
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
                (next, left) = (next + 1, left - 1);
            }
        }
        if let Some(last) = self.done.last_mut() {
            last.end = next;
        }
        self.spp = self.complete();
        report
    }
}
