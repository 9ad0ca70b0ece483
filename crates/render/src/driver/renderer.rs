//! One pass over the film: takes missing samples of its tiles, in parallel on the current rayon pool.

use crate::core::caustic_plan::CausticPlan;
use crate::core::counts::RayCounts;
use crate::core::filter::FilterSampler;
use crate::core::settings::{Integrator, RenderSettings, SampleAllocation};
use crate::core::techniques::Techniques;
use crate::driver::caustic_choice::plan_of_film;
use crate::film::block::{BLOCK_SIZE, doubled};
use crate::film::region::Region;
use crate::film::round::Round;
use crate::film::tile::FilmTile;
use crate::film::tiles::Film;
use crate::integrators::caustics::pass::CausticPass;
use crate::integrators::caustics::pilot::prepare_guide;
use crate::integrators::caustics::plan::choose;
use crate::integrators::path::{CameraPath, PathWave};
use crate::integrators::phong::PhongWave;
use crate::integrators::record::{Record, TracedPath};
use crate::integrators::simd::camera::{CameraRays, Pixels};
use crate::integrators::survival::{at_depth, endless_depth};
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use glam::{UVec2, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// An invalid sample; replay it with the same scene, seed and settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadSample {
    /// Column of the pixel, from the left.
    pub x: u32,
    /// Row of the pixel, from the top.
    pub y: u32,
    /// Number of the sample within the pixel.
    pub sample: u32,
}

/// Result of [`advance`].
#[derive(Clone, Debug, Default)]
pub struct PassReport {
    /// False if it was stopped before every tile reached the target.
    pub completed: bool,
    /// Traced rays by class.
    pub rays: RayCounts,
    /// Number of samples that were rejected because they were not finite.
    pub n_bad: u64,
    /// The first few of them.
    pub bad: Vec<BadSample>,
    /// Number of samples brighter than any radiance in the scene can be, which is a bug of the program.
    pub n_above: u64,
    /// The first few of them.
    pub above: Vec<BadSample>,
}

/// Takes samples until every pixel has `target_spp` of them (in an adaptive film: the mean over all pixels), or until
/// `stop` returns true.
///
/// Tiles are rendered in parallel on the current rayon pool. `stop` is called often, by all workers; the samples of an
/// unfinished wave are discarded.
///
/// # Panics
/// If [`RenderSettings::check`] or [`Camera::check`](crate::core::camera::Camera::check) fails: the image would be
/// black, and its error estimate meaningless.
pub fn advance(
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &mut Film,
    target_spp: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    advance_region(snapshot, settings, film, None, target_spp, stop)
}

/// Like [`advance`], for the tiles of a region only; all of its pixels get the same number of samples. Light paths are
/// traced for the whole image, so other pixels may get contributions from them.
///
/// # Panics
/// As [`advance`].
pub fn advance_region(
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &mut Film,
    region: Option<&Region>,
    target_spp: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    settings.check().unwrap_or_else(|error| panic!("{error}"));
    snapshot.camera.check().unwrap_or_else(|error| panic!("{error}"));
    let size = UVec2::new(film.width(), film.height());
    let Some(plan) = plan_of_film(snapshot, settings, film, stop) else { return PassReport::default() };
    let pass = Pass::new(snapshot, settings, size, plan);
    let metric = match settings.allocation {
        SampleAllocation::Adaptive(metric) if region.is_none() => Some(metric),
        SampleAllocation::Adaptive(_) if film.round.is_some() => {
            film.leave_round();
            None
        }
        SampleAllocation::Adaptive(_) => None,
        SampleAllocation::Uniform => {
            film.round = None;
            None
        }
    };
    if let Some(caustics) = &pass.caustics {
        if !prepare_guide(caustics, stop) || stop() {
            return PassReport::default();
        }
        if plan.has_light_paths() {
            film.want_light(plan.light_path_stride);
        }
    }
    let mut total = PassReport { completed: true, ..PassReport::default() };
    while total.completed && film.spp_in(region) < target_spp {
        if let Some(metric) = metric {
            film.begin_round_if_due(metric);
        }
        // Rounds end at powers of two, and the error of light tracing is recorded there.
        let next = (film.spp_in(region) + 1).checked_next_power_of_two();
        let goal = match &pass.caustics {
            None if metric.is_none() => target_spp,
            _ => next.unwrap_or(u32::MAX).min(target_spp),
        };
        let caustics = pass.caustics.as_ref().zip(film.light.take());
        let (tiles, light) = rayon::join(
            || advance_tiles(&pass, film, region, goal, stop),
            || caustics.map(|(caustics, mut layer)| (layer.advance(caustics, goal, stop), layer)),
        );
        total.completed = tiles.completed;
        total.add(tiles);
        if let Some((light, layer)) = light {
            film.light = Some(layer);
            total.completed &= light.completed;
            total.rays += light.rays;
            total.n_bad += light.n_bad;
        }
        if total.completed {
            film.has_spent(goal);
            // After a stop, light paths may be ahead of the tiles. They are recorded when the tiles have caught up:
            // earlier, the levels to which blocks are compared would depend on where the pass was stopped.
            if film.light.as_ref().is_some_and(|layer| layer.spp == goal) {
                film.record_light();
            }
        }
    }
    total
}

fn advance_tiles(
    pass: &Pass,
    film: &mut Film,
    region: Option<&Region>,
    budget: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    // A region is always sampled evenly.
    let round = film.round.filter(|_| region.is_none());
    // Tiles are handed out one by one: with a fixed division, all workers would wait for the half that contains the
    // model.
    let mut reports: Vec<(usize, PassReport)> = film
        .tiles
        .iter_mut()
        .enumerate()
        .filter(|(_, tile)| region.is_none_or(|region| tile.lies_in(region)))
        .par_bridge()
        .map_init(Wave::default, |wave, (i, tile)| (i, advance_tile(pass, tile, round.as_ref(), budget, stop, wave)))
        .collect();
    reports.sort_unstable_by_key(|(i, _)| *i);
    let mut total = PassReport { completed: true, ..PassReport::default() };
    for (_, report) in reports {
        total.completed &= report.completed;
        total.add(report);
    }
    total
}

impl PassReport {
    /// Adds rays and invalid samples of another report.
    fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.n_bad += other.n_bad;
        self.bad.extend(other.bad.into_iter().take(MAX_LISTED_BAD - self.bad.len()));
        self.n_above += other.n_above;
        self.above.extend(other.above.into_iter().take(MAX_LISTED_BAD - self.above.len()));
    }
}

/// Maximum number of invalid samples that a report lists.
const MAX_LISTED_BAD: usize = 16;

/// Paths in flight at once: enough to fill the SIMD kernels, few enough for their state to stay in the cache.
const WAVE_SIZE: usize = 4096;

/// Scratch memory of one worker.
#[derive(Default)]
struct Wave {
    path: PathWave,
    phong: PhongWave,
    /// Pixels block by block; `local` is the index in the block.
    pixels: Pixels,
    /// Origin and size of the tile of these pixels.
    origin: UVec2,
    size: UVec2,
    /// Range of `pixels` per block.
    blocks: Vec<Range<usize>>,
    runs: Vec<Run>,
    radiance: Vec<Vec3>,
}

/// One sample of each pixel of a range.
#[derive(Clone, Debug)]
struct Run {
    /// Range in the wave's pixels.
    pixels: Range<usize>,
    sample: u32,
    /// Index in `radiance` of the pixel with local index 0.
    slot: u32,
}

impl Wave {
    fn of_pixel(pixel: UVec2) -> Self {
        Self { pixels: Pixels { x: vec![pixel.x], y: vec![pixel.y], local: vec![0] }, ..Self::default() }
    }

    /// Returns one run of all pixels per sample; the slots of consecutive runs are `stride` apart.
    fn runs_of(&self, samples: Range<u32>, stride: u32) -> Vec<Run> {
        let all = 0..self.pixels.local.len();
        let slots = (0..).map(|i| i * stride);
        samples.zip(slots).map(|(sample, slot)| Run { pixels: all.clone(), sample, slot }).collect()
    }

    /// Takes the pixels of a tile; those of a tile of the same size as the previous one are only shifted.
    fn take_tile(&mut self, tile: &FilmTile) {
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
    /// some, so that all blocks advance together. `missing` is the number of missing samples per block.
    fn take_runs(&mut self, tile: &FilmTile, missing: &[u32]) {
        self.runs.clear();
        let n_pixels: usize = tile.blocks.iter().zip(missing).filter(|(_, n)| **n > 0).map(|(b, _)| b.n_pixels()).sum();
        let at_once = (WAVE_SIZE / n_pixels.max(1)).max(1) as u32;
        let mut slot = 0;
        for ((block, pixels), missing) in tile.blocks.iter().zip(&self.blocks).zip(missing) {
            let first = block.next_sample();
            // Not beyond the next power of two, where the error estimate records the block.
            let to_power = doubled(block.spp) - block.spp;
            for sample in first..first + at_once.min(*missing).min(to_power) {
                self.runs.push(Run { pixels: pixels.clone(), sample, slot });
                slot += pixels.len() as u32;
            }
        }
        self.radiance.clear();
        self.radiance.resize(slot as usize, Vec3::ZERO);
    }

    /// Traces the runs and adds the radiance of their pixels to `radiance`; `None` if `stop` returned true.
    fn trace(
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
struct Pass<'a> {
    snapshot: &'a Prepared,
    settings: &'a RenderSettings,
    caustics: Option<CausticPass<'a>>,
    camera_media: Vec<u32>,
    filter: FilterSampler,
    size: UVec2,
    /// Upper bound of the radiance of a sample, see [`crate::prepare::bound`].
    bound: Option<f32>,
    /// Depth from which on all paths are subject to Russian roulette.
    endless: u32,
}

impl FilmTile {
    fn sample_at(&self, local: u32, sample: u32) -> BadSample {
        let pixel = self.origin + UVec2::new(local % self.size.x, local / self.size.x);
        BadSample { x: pixel.x, y: pixel.y, sample }
    }
}

/// - `round`: decides which blocks of the tile get samples; without a round, all of them.
fn advance_tile(
    pass: &Pass,
    tile: &mut FilmTile,
    round: Option<&Round>,
    budget: u32,
    stop: &(dyn Fn() -> bool + Sync),
    wave: &mut Wave,
) -> PassReport {
    let mut report = PassReport { completed: true, ..PassReport::default() };
    let mut missing: Vec<u32> =
        tile.blocks.iter().map(|block| block.target(round, budget).saturating_sub(block.spp)).collect();
    if missing.iter().all(|missing| *missing == 0) {
        return report;
    }
    // Checked before starting work that would be discarded: with hundreds of tiles left, their first rays alone take
    // milliseconds.
    if stop() {
        report.completed = false;
        return report;
    }
    wave.take_tile(tile);
    while missing.iter().any(|missing| *missing > 0) {
        wave.take_runs(tile, &missing);
        let (mut radiance, runs) = (std::mem::take(&mut wave.radiance), std::mem::take(&mut wave.runs));
        let Some(rays) = wave.trace(pass, &runs, &mut radiance, stop) else {
            report.completed = false;
            break;
        };
        report.rays += rays;
        let bound = pass.bound.map(|bound| at_depth(bound, wave.path.depth, pass.endless));
        let n_bad_before = tile.bad.len();
        let (mut runs_left, mut of_block) = (runs.as_slice(), 0);
        while let Some((run, rest)) = runs_left.split_first() {
            while wave.blocks[of_block] != run.pixels {
                of_block += 1;
            }
            let seen = &radiance[run.slot as usize..][..run.pixels.len()];
            for (place, light) in seen.iter().enumerate() {
                if bound.is_some_and(|bound| light.is_finite() && light.abs().max_element() > bound) {
                    report.n_above += 1;
                    if report.above.len() < MAX_LISTED_BAD {
                        let local = tile.blocks[of_block].locals(tile.size.x).nth(place).expect("a pixel of the block");
                        report.above.push(tile.sample_at(local as u32, run.sample));
                    }
                }
            }
            tile.add_sample(of_block, run.sample, seen);
            missing[of_block] -= 1;
            runs_left = rest;
        }
        tile.record(round.is_none_or(|round| round.even));
        let new_bad = &tile.bad[n_bad_before..];
        report.n_bad += new_bad.len() as u64;
        let room = MAX_LISTED_BAD - report.bad.len();
        report.bad.extend(new_bad.iter().take(room).map(|&(local, sample)| tile.sample_at(local, sample)));
        (wave.radiance, wave.runs) = (radiance, runs);
    }
    report
}

/// Traces one sample of one pixel: the same radiance that [`advance`] adds to the film, without light paths, which
/// belong to no pixel.
pub fn replay_sample(snapshot: &Prepared, settings: &RenderSettings, film_size: UVec2, at: BadSample) -> Vec3 {
    let pass = Pass::planned(snapshot, settings, film_size);
    if let Some(caustics) = &pass.caustics {
        prepare_guide(caustics, &|| false);
    }
    let mut radiance = [Vec3::ZERO];
    let mut wave = Wave::of_pixel(UVec2::new(at.x, at.y));
    let runs = wave.runs_of(at.sample..at.sample + 1, 1);
    wave.trace(&pass, &runs, &mut radiance, &|| false);
    radiance[0]
}

/// Traces samples of one pixel as [`advance`] does, and records their paths.
pub(crate) fn trace_recorded(
    snapshot: &Prepared,
    settings: &RenderSettings,
    film_size: UVec2,
    pixel: UVec2,
    samples: Range<u32>,
) -> Vec<TracedPath> {
    let pass = Pass::planned(snapshot, settings, film_size);
    if let Some(caustics) = &pass.caustics {
        prepare_guide(caustics, &|| false);
    }
    let mut wave = Wave::of_pixel(pixel);
    let mut paths = Vec::with_capacity(samples.len());
    for first in samples.clone().step_by(WAVE_SIZE) {
        let part = first..samples.end.min(first.saturating_add(WAVE_SIZE as u32));
        let mut radiance = vec![Vec3::ZERO; part.len()];
        wave.path.record = Some(Box::new(Record::new(part.clone())));
        let runs = wave.runs_of(part, 1);
        wave.trace(&pass, &runs, &mut radiance, &|| false);
        let record = wave.path.record.take().expect("it only looks on");
        paths.extend(record.finish(&radiance));
    }
    paths
}

/// Returns the bounces of the first sample of each pixel, mean over blocks of 4 × 4 pixels; `None` if `stop` returned
/// true.
pub(crate) fn mean_bounces(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<f32>> {
    const SIDE: u32 = 4;
    // Camera paths only: light paths do not start at a pixel.
    let pass = Pass::new(snapshot, settings, size, CausticPlan::NONE);
    let blocks = UVec2::new(size.x.div_ceil(SIDE), size.y.div_ceil(SIDE));
    let means: Option<Vec<f32>> = (0..blocks.x * blocks.y)
        .into_par_iter()
        .map_init(Wave::default, |wave, block| {
            let first = UVec2::new(block % blocks.x, block / blocks.x) * SIDE;
            let end = (first + SIDE).min(size);
            wave.pixels = Pixels::default();
            for (y, x) in (first.y..end.y).flat_map(|y| (first.x..end.x).map(move |x| (y, x))) {
                wave.pixels.x.push(x);
                wave.pixels.y.push(y);
                wave.pixels.local.push(0);
            }
            let runs = wave.runs_of(0..1, 1);
            let rays = wave.trace(&pass, &runs, &mut [Vec3::ZERO], stop)?;
            Some(rays.bounce as f32 / rays.camera.max(1) as f32)
        })
        .collect();
    let means = means?;
    let block_of = |i: u32| i % size.x / SIDE + i / size.x / SIDE * blocks.x;
    Some((0..size.x * size.y).map(|i| means[block_of(i) as usize]).collect())
}

impl<'a> Pass<'a> {
    /// Returns the pass for an image, after choosing the plan for caustics if it is not known.
    fn planned(snapshot: &'a Prepared, settings: &'a RenderSettings, size: UVec2) -> Self {
        let choice = choose(snapshot, settings, size, &|| false).expect("nobody stops it");
        Self::new(snapshot, settings, size, choice.plan)
    }

    fn new(snapshot: &'a Prepared, settings: &'a RenderSettings, size: UVec2, plan: CausticPlan) -> Self {
        let camera_media = snapshot.camera_media();
        let caustics = CausticPass::of(snapshot, settings, size, &camera_media, plan);
        let filter = FilterSampler::new(settings.filter);
        let bound = (snapshot.tables.radiance_bound)
            .filter(|_| settings.integrator == Integrator::Path)
            .map(|bound| bound * filter.scale() * snapshot.tables.bodies.environment_scale(&camera_media));
        let endless = endless_depth(snapshot);
        Self { snapshot, settings, caustics, camera_media, filter, size, bound, endless }
    }

    fn lens(&self) -> CameraRays<'_> {
        let RenderSettings { seed, techniques: Techniques { even_samples, .. }, .. } = *self.settings;
        CameraRays { camera: &self.snapshot.camera, size: self.size, filter: &self.filter, seed, even_samples }
    }
}

/// Returns the pixels of a rectangle in squares of 4 × 4, so that 16 consecutive rays are coherent.
pub(super) fn pixels_in_blocks(origin: UVec2, size: UVec2) -> Pixels {
    let mut pixels = Pixels::default();
    add_pixels(origin, size, &mut pixels);
    pixels
}

/// Appends the pixels of a rectangle in squares of 4 × 4; `local` counts from 0 row by row.
fn add_pixels(origin: UVec2, size: UVec2, pixels: &mut Pixels) {
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
