//! Where light from the lamps is summed up: over the whole picture, because it may fall into any pixel.
//!
//! Paths come in batches of fixed size that are traced by any worker and added in their order, so that no sum depends
//! on threads or on the portions in which it was made.

use super::CausticPass;
use super::trace::LightWave;
use crate::render::RayCounts;
use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;

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
    sums: Vec<DVec3>,
    n_batches: u32,
    /// Samples of the whole picture that are complete.
    spp: u32,
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
    pub fn new(size: UVec2) -> Self {
        Self { sums: vec![DVec3::ZERO; (size.x * size.y) as usize], n_batches: 0, spp: 0 }
    }

    pub fn spp(&self) -> u32 {
        self.spp
    }

    /// Mean over the paths so far.
    pub fn mean(&self, pixel: usize) -> DVec3 {
        match self.n_batches {
            0 => DVec3::ZERO,
            n => self.sums[pixel] / (f64::from(n) * f64::from(BATCH)),
        }
    }

    /// Traces paths until they are enough for `target_spp` samples of the picture, or until `stop` says so; what a
    /// batch had not finished is dropped.
    pub fn advance(&mut self, pass: &CausticPass, target_spp: u32, stop: &(dyn Fn() -> bool + Sync)) -> LayerReport {
        let batches = |spp: u32| (f64::from(spp) * pass.paths_per_sample / f64::from(BATCH)).ceil() as u32;
        let goal = batches(target_spp);
        let mut report = LayerReport { completed: true, ..LayerReport::default() };
        // Enough at once to keep all workers busy, few enough to have little to add in the end.
        let at_once = 4 * rayon::current_num_threads() as u32;
        'all: while self.n_batches < goal {
            let first = self.n_batches;
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
                        self.sums[pixel as usize] += light.as_dvec3();
                    } else {
                        report.n_bad += 1;
                    }
                }
                report.rays += rays;
                self.n_batches += 1;
            }
        }
        if report.completed {
            self.spp = self.spp.max(target_spp);
        }
        report
    }
}
