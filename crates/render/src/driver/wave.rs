//! Waves of paths: the pixels and samples of each, and the input that all waves of a pass share.

use crate::core::caustic_plan::CausticPlan;
use crate::core::counts::RayCounts;
use crate::core::filter::FilterSampler;
use crate::core::settings::{Integrator, RenderSettings, SampleAllocation};
use crate::core::techniques::Techniques;
use crate::film::block::{BLOCK_SIZE, doubled};
use crate::film::tile::FilmTile;
use crate::integrators::caustics::plan::choose;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::survival::endless_depth;
use crate::integrators::path::{CameraPath, PathWave};
use crate::integrators::phong::PhongWave;
use crate::integrators::portals::prepare_portals;
use crate::integrators::simd::camera::{CameraRays, Pixels};
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use glam::{UVec2, Vec3};
use std::ops::Range;
use std::sync::Arc;

/// Paths in flight at once: enough to fill the SIMD kernels, few enough for their state to stay in the cache.
pub(super) const WAVE_SIZE: usize = 4096;

/// Scratch memory of one worker.
#[derive(Default)]
pub(super) struct Wave {
    pub path: PathWave,
    pub phong: PhongWave,
    /// Pixels block by block; `local` is the index in the block.
    pub pixels: Pixels,
    /// Origin and size of the tile of these pixels.
    origin: UVec2,
    size: UVec2,
    /// Range of `pixels` per block.
    pub blocks: Vec<Range<usize>>,
    pub runs: Vec<Run>,
    pub radiance: Vec<Vec3>,
}

/// One sample of each pixel of a range.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Range in the wave's pixels.
    pub pixels: Range<usize>,
    pub sample: u32,
    /// Index in `radiance` of the pixel with local index 0.
    pub slot: u32,
}

impl Wave {
    pub fn of_pixel(pixel: UVec2) -> Self {
        Self { pixels: Pixels { x: vec![pixel.x], y: vec![pixel.y], local: vec![0] }, ..Self::default() }
    }

    /// Turns the noting of first surfaces on or off.
    pub fn note_surfaces(&mut self, notes: bool) {
        if notes != self.path.first_surfaces.is_some() {
            self.path.first_surfaces = notes.then(Box::default);
        }
    }

    /// Returns one run of all pixels per sample; the slots of consecutive runs are `stride` apart.
    pub fn runs_of(&self, samples: Range<u32>, stride: u32) -> Vec<Run> {
        let all = 0..self.pixels.local.len();
        let slots = (0..).map(|i| i * stride);
        samples.zip(slots).map(|(sample, slot)| Run { pixels: all.clone(), sample, slot }).collect()
    }

    /// Takes the pixels of a tile; those of a tile of the same size as the previous one are only shifted.
    pub fn take_tile(&mut self, tile: &FilmTile) {
        let (origin, size) = (tile.origin, tile.size);
        if size != self.size || self.pixels.local.is_empty() {
            self.pixels = Pixels::default();
            self.blocks.clear();
            for block in &tile.blocks {
                let first = self.pixels.local.len();
                add_pixels(origin + block.start, block.size, &mut self.pixels);
                self.blocks.push(first..self.pixels.local.len());
            }
        } else {
            let (x, y) = (origin.x.wrapping_sub(self.origin.x), origin.y.wrapping_sub(self.origin.y));
            self.pixels.x.iter_mut().for_each(|pixel| *pixel = pixel.wrapping_add(x));
            self.pixels.y.iter_mut().for_each(|pixel| *pixel = pixel.wrapping_add(y));
        }
        (self.origin, self.size) = (origin, size);
    }

    /// Takes the next samples of the blocks of a tile, as many as are in flight at once; every unfinished block gets
    /// some, so that all blocks advance together.
    ///
    /// - `missing`: number of missing samples per block.
    /// - `has_roulette`: whether shadow rays are subject to the roulette of the blocks.
    pub fn take_runs(&mut self, tile: &FilmTile, missing: &[u32], has_roulette: bool) {
        self.runs.clear();
        self.path.shadow_thresholds.clear();
        let n_pixels: usize = tile.blocks.iter().zip(missing).filter(|(_, n)| **n > 0).map(|(b, _)| b.n_pixels()).sum();
        let at_once = (WAVE_SIZE / n_pixels.max(1)).max(1) as u32;
        let mut slot = 0;
        for ((block, pixels), missing) in tile.blocks.iter().zip(&self.blocks).zip(missing) {
            let first_slot = slot;
            let first = block.next_sample();
            // Not beyond the next power of two, where the error estimate records the block.
            let to_power = doubled(block.spp) - block.spp;
            for sample in first..first + at_once.min(*missing).min(to_power) {
                self.runs.push(Run { pixels: pixels.clone(), sample, slot });
                slot += pixels.len() as u32;
                if has_roulette && sample == first {
                    self.path.shadow_thresholds.extend(tile.shadow_thresholds(block));
                } else if has_roulette {
                    let of_first = first_slot as usize..first_slot as usize + pixels.len();
                    self.path.shadow_thresholds.extend_from_within(of_first);
                }
            }
        }
        self.radiance.clear();
        self.radiance.resize(slot as usize, Vec3::ZERO);
    }

    /// Traces the runs and adds the radiance of their pixels to `radiance`; `None` if `stop` returned true.
    pub fn trace(
        &mut self,
        pass: &Pass,
        runs: &[Run],
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        let Self { path, phong, pixels, .. } = self;
        let pixels = &*pixels;
        let lens = pass.lens();
        let camera_paths = runs.iter().flat_map(|run| {
            run.pixels.clone().map(|i| {
                let (ray, sampler, weight) = lens.ray(UVec2::new(pixels.x[i], pixels.y[i]), run.sample);
                CameraPath { ray, sampler, slot: run.slot + pixels.local[i], weight }
            })
        });
        let start = |paths: &mut PathBatch| {
            if let Some(set) = pass.settings.simd
                && lens.is_plain()
            {
                for run in runs {
                    lens.start_paths(set, pixels, run.pixels.clone(), run.sample, run.slot, paths);
                }
            } else {
                camera_paths.for_each(|camera| paths.push(&{ camera.ray }, &camera.into()));
            }
        };
        match pass.settings.integrator {
            Integrator::Phong => phong.trace(pass.snapshot, pass.settings, &pass.camera_media, start, radiance, stop),
            Integrator::Path => {
                let caustics = pass.caustics.as_ref();
                path.begin_in(pass.snapshot, &pass.camera_media);
                path.trace(pass.snapshot, pass.settings, caustics, start, radiance, stop)
            }
        }
    }
}

/// Input of all tiles.
pub(super) struct Pass<'a> {
    pub snapshot: &'a Prepared,
    pub settings: &'a RenderSettings,
    pub caustics: Option<CausticPass<'a>>,
    pub plan: CausticPlan,
    pub camera_media: Vec<u32>,
    filter: Arc<FilterSampler>,
    pub size: UVec2,
    /// Upper bound of the radiance of a sample, see [`crate::prepare::bound`].
    pub bound: Option<f32>,
    /// Depth from which on all paths are subject to Russian roulette.
    pub endless: u32,
    /// Whether the film gets the first surfaces of the first samples.
    pub notes_surfaces: bool,
}

impl<'a> Pass<'a> {
    /// Whether all pixels get the same number of samples, see [`FilmTile::record`]: not if they are allocated by error,
    /// also while they are even, so that no decision depends on the division into tiles.
    pub fn is_even(&self) -> bool {
        self.settings.allocation == SampleAllocation::Uniform
    }

    /// Returns the pass for an image, after choosing the plan for caustics if it is not known.
    pub fn planned(snapshot: &'a Prepared, settings: &'a RenderSettings, size: UVec2) -> Self {
        let choice = choose(snapshot, settings, size, &|| false).expect("the stop flag is constant false");
        Self::new(snapshot, settings, size, choice.plan)
    }

    pub fn new(snapshot: &'a Prepared, settings: &'a RenderSettings, size: UVec2, plan: CausticPlan) -> Self {
        Self::with_filter(snapshot, settings, size, plan, Arc::new(FilterSampler::new(settings.filter)))
    }

    fn with_filter(
        snapshot: &'a Prepared,
        settings: &'a RenderSettings,
        size: UVec2,
        plan: CausticPlan,
        filter: Arc<FilterSampler>,
    ) -> Self {
        prepare_portals(snapshot, settings);
        let camera_media = snapshot.camera_media();
        let caustics = CausticPass::of(snapshot, settings, size, &camera_media, plan);
        let bound = (snapshot.tables.radiance_bound)
            .filter(|_| settings.integrator == Integrator::Path && snapshot.portals().is_none())
            .map(|bound| bound * filter.scale() * snapshot.tables.bodies.environment_scale(&camera_media));
        let endless = endless_depth(snapshot);
        Self { snapshot, settings, caustics, plan, camera_media, filter, size, bound, endless, notes_surfaces: false }
    }

    /// Returns the pass for the same image at another moment. It uses the guiding cache of this pass, which changes
    /// sampling pdfs only.
    pub fn of_moment<'b>(&self, moment: &'b Prepared) -> Pass<'b>
    where
        'a: 'b,
    {
        moment.share_portals(self.snapshot);
        let mut pass = Pass::with_filter(moment, self.settings, self.size, self.plan, self.filter.clone());
        if let (Some(own), Some(caustics)) = (&self.caustics, &mut pass.caustics) {
            caustics.guide_of = own.guide_of;
        }
        pass
    }

    pub fn lens(&self) -> CameraRays<'_> {
        let RenderSettings { seed, techniques: Techniques { even_samples, .. }, .. } = *self.settings;
        let (camera, filter) = (&self.snapshot.camera, &self.filter);
        CameraRays { camera, size: self.size, filter, seed, even_samples, at: None }
    }
}

/// Returns the pixels of a rectangle in squares of 4 × 4, so that 16 consecutive rays are coherent.
pub(super) fn pixels_in_blocks(origin: UVec2, size: UVec2) -> Pixels {
    let mut pixels = Pixels::default();
    add_pixels(origin, size, &mut pixels);
    pixels
}

/// Appends the pixels of a rectangle in squares of 4 × 4; `local` counts from 0 row by row.
pub(super) fn add_pixels(origin: UVec2, size: UVec2, pixels: &mut Pixels) {
    const SIDE: u32 = 4;
    const _: () = assert!(BLOCK_SIZE.is_multiple_of(SIDE));
    for top in (0..size.y).step_by(SIDE as usize) {
        for left in (0..size.x).step_by(SIDE as usize) {
            for y in top..size.y.min(top + SIDE) {
                for x in left..size.x.min(left + SIDE) {
                    pixels.x.push(origin.x + x);
                    pixels.y.push(origin.y + y);
                    pixels.local.push(y * size.x + x);
                }
            }
        }
    }
}
