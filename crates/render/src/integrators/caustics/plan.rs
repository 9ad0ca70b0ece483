//! Selects the techniques for caustics of an image by variance times cost, which a small pilot measures.
//!
//! Light paths find caustics that camera paths rarely find, and cost rays that many images would better spend
//! otherwise. A pilot traces few paths of each kind, with separate random numbers, and discards them, so that the
//! choice does not depend on any sample of the image. It is a function of scene, camera, film size and settings except
//! the seed: all parts of an image agree on it. Its cost is counted in rays, never in seconds.
//!
//! The variance of a caustic for camera paths alone cannot be measured by camera paths: few find it, and those few are
//! the variance. Light paths measure it. Let a light path contribute c to a pixel, as one of as many paths as there are
//! pixels, and let r be its pdf over that of the same camera path (see [`crate::integrators::common::caustics_weight`]). Sums over light paths of
//!
//! - c² r w² are the second moment of the contributions of camera paths with weight w,
//! - c² w² / φ that of φ light paths per pixel with weight w,
//!
//! where the weights depend on the ratio φ r. So one pilot gives the variance for every number of light paths,
//! including none. Start reading at [`choose`].

use crate::core::caustic_plan::{CausticChoice, CausticPlan};
use crate::core::filter::PixelFilter;
use crate::core::settings::RenderSettings;
use crate::integrators::caustics::lens_connections::MeasuredSplat;
use crate::integrators::caustics::pilot::prepare_guide;
use crate::integrators::caustics::trace::LightWave;
use crate::integrators::common::caustics_pass::{CausticPass, casters_of};
use crate::integrators::common::work::Work;
use crate::integrators::path::{CameraPath, PathWave};
use crate::integrators::portals::prepare_portals;
use crate::prepare::plan_cache::PlanKey;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::lights::power_weight;
use glam::{DVec3, UVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::cell::OnceCell;

/// Seed of all pilot paths, unlikely to be that of an image.
const PILOT_SEED: u32 = 0x7069_6c6f;

/// Approximate number of film pixels per pilot pixel, and range of the number of pilot pixels.
const PIXELS_PER_SPOT: f64 = 200.0;
const SPOTS: (f64, f64) = (1024.0, 2048.0);

/// Camera paths per pilot pixel.
const SPOT_SAMPLES: u32 = 4;

/// Pilot pixels per batch of a worker.
const SPOTS_AT_ONCE: usize = 64;

/// Light paths per pilot pixel, and per batch of a worker.
const LIGHT_PATHS_PER_SPOT: u32 = 3;
const LIGHT_PATHS_AT_ONCE: u32 = 256;

/// Cost of sampling the start of a light path, in the unit of [`Work`].
const LIGHT_PATH_START: f64 = 2.0;

/// The variance of the rest is known within this factor: rare bright samples, which the pilot misses, can make it larger;
/// samples of the image that are more even than the few of the pilot can make it smaller. About the range over the
/// built-in scenes and glass meshes.
const REST_WITHIN: f64 = 3.0;

/// The factor that fits most of them, for what is told of a choice.
const REST_MOSTLY: f64 = 2.0;

/// Cost factor of camera paths that are weighted against light paths.
const TRACKING: f64 = 1.04;

/// Guiding must gain this factor, and be better in this many of this many subsets of the pilot pixels: its cost is
/// known, but a single bright sample without it can look like a gain.
const CLEARLY: f64 = 1.2;
const IN_PARTS: (usize, usize) = (5, 8);

/// The level of a splat is measured in cells; number of cells along the side of a spot.
const CELLS: u32 = 4;

/// Chooses how caustics are rendered in an image; `None` if `stop` returned true first.
pub(crate) fn choose(
    scene: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<CausticChoice> {
    if let Some(known) = known(scene, settings, size) {
        return Some(known);
    }
    let choice = Pilot::of(scene, settings, size, stop)?.choose();
    if let Some(casters) = casters_of(scene, settings) {
        casters.plans.keep(PlanKey::new(&scene.camera, settings, size), choice);
    }
    Some(choice)
}

/// Like [`choose`], without tracing anything; `None` if that would be necessary.
pub(crate) fn known(scene: &Prepared, settings: &RenderSettings, size: UVec2) -> Option<CausticChoice> {
    let Some(casters) = casters_of(scene, settings) else { return Some(CausticChoice::NONE) };
    let given = settings.techniques.caustic_plan;
    // Without MIS, all light that light paths can find is left to them, in any number.
    let fixed = given.or((!settings.techniques.mis).then_some(CausticPlan::UNKNOWN));
    fixed
        .map(|plan| CausticChoice { plan, ..CausticChoice::NONE })
        .or_else(|| casters.plans.find(&PlanKey::new(&scene.camera, settings, size)))
}

/// Returns a plan for previews, which must not be delayed: that of the last view that has one, of this scene or of the
/// one before its last change, and guiding only if its cache is there.
pub(crate) fn for_preview(scene: &Prepared, settings: &RenderSettings) -> CausticPlan {
    let Some(casters) = casters_of(scene, settings) else { return CausticPlan::NONE };
    if let Some(given) = settings.techniques.caustic_plan {
        return given;
    }
    let newest = casters.plans.newest().map(|choice| choice.plan);
    let plan = newest.filter(|plan| plan.has_light_paths() || !scene.tables.lights.has_delta());
    let plan = plan.unwrap_or(CausticPlan::UNKNOWN);
    CausticPlan { guided: plan.guided && casters.guide.get().is_some(), ..plan }
}

/// A part of the image, represented by one pilot pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PilotPixel {
    mean: DVec3,
    /// Variance of one sample.
    variance: DVec3,
}

/// Result of the pilot camera paths.
#[derive(Clone)]
struct CameraPilot {
    spots: Vec<PilotPixel>,
    /// Cost of one sample of the whole image.
    cost: f64,
}

/// Result of all pilot paths.
struct Pilot {
    grid: UVec2,
    size: UVec2,
    plain: CameraPilot,
    guided: CameraPilot,
    splats: Vec<MeasuredSplat>,
    n_light_paths: f64,
    /// Cost of as many light paths as there are pixels.
    light_cost: f64,
    /// Whether some light can be found by light paths only.
    needs_light_paths: bool,
    /// See [`Self::levels`].
    levels: OnceCell<Vec<DVec3>>,
}

/// Candidates for the light path stride; 0 for no light paths.
const STRIDES: [u32; 7] = [0, 1, 2, 4, 8, 16, 32];

impl Pilot {
    fn of(scene: &Prepared, settings: &RenderSettings, size: UVec2, stop: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let settings = &RenderSettings {
            seed: PILOT_SEED,
            filter: PixelFilter::Box,
            // Independent of the instruction set of the image: the scalar code rounds differently.
            simd: RenderSettings::default().simd,
            ..*settings
        };
        prepare_portals(scene, settings);
        let camera_media = scene.camera_media();
        let pass = CausticPass::of(scene, settings, size, &camera_media, CausticPlan::UNKNOWN)?;
        if !prepare_guide(&pass, stop) {
            return None;
        }
        let n_pixels = f64::from(size.x) * f64::from(size.y);
        let n_spots = (n_pixels / PIXELS_PER_SPOT).clamp(SPOTS.0, SPOTS.1).min(n_pixels);
        let side = |length: u32, n: f64| (n.round() as u32).clamp(1, length);
        let columns = side(size.x, (n_spots * f64::from(size.x) / f64::from(size.y)).sqrt());
        let grid = UVec2::new(columns, side(size.y, n_spots / f64::from(columns)));
        let guided = CameraPilot::of(&pass, settings, size, grid, stop)?;
        let plain = CausticPass {
            plan: CausticPlan { guided: false, ..pass.plan },
            camera_media: camera_media.clone(),
            ..pass
        };
        let plain =
            if pass.guide().is_some() { CameraPilot::of(&plain, settings, size, grid, stop)? } else { guided.clone() };
        let n_light_paths = (grid.x * grid.y * LIGHT_PATHS_PER_SPOT).next_multiple_of(LIGHT_PATHS_AT_ONCE);
        // Normalised to one light path per pixel.
        let measured = CausticPass { is_measured: true, paths_per_sample: n_pixels, camera_media, ..pass };
        let batches: Option<Vec<(Vec<MeasuredSplat>, f64)>> = (0..n_light_paths / LIGHT_PATHS_AT_ONCE)
            .into_par_iter()
            .map_init(LightWave::default, |wave, batch| {
                wave.work = Some(Box::new(Work::new(scene)));
                let first = u64::from(batch * LIGHT_PATHS_AT_ONCE);
                let splats = wave.trace_measured(&measured, first, LIGHT_PATHS_AT_ONCE, stop)?;
                Some((splats, wave.work.take()?.total))
            })
            .collect();
        let (mut splats, mut work) = (Vec::new(), 0.0);
        for (some, of_batch) in batches? {
            splats.extend(some.into_iter().filter(|splat| splat.light.is_finite()));
            work += of_batch;
        }
        let n_light_paths = f64::from(n_light_paths);
        Some(Self {
            grid,
            size,
            plain,
            guided,
            splats,
            n_light_paths,
            light_cost: (LIGHT_PATH_START + work / n_light_paths) * n_pixels,
            needs_light_paths: scene.tables.lights.has_delta(),
            levels: OnceCell::new(),
        })
    }

    fn choose(&self) -> CausticChoice {
        let light: Vec<_> = STRIDES.iter().map(|&stride| (stride, self.found_by_light(stride))).collect();
        let found = |of: u32| light.iter().find(|(stride, _)| *stride == of).expect("all are there").1;
        let known = CausticPlan::UNKNOWN;
        // Variance and cost of a plan, with the variance of the rest multiplied by a factor.
        let value = |plan: CausticPlan, factor: f64| {
            let CameraPilot { spots, cost } = if plan.guided { &self.guided } else { &self.plain };
            let variance = self.mean_over_spots(spots, |spot| spot.variance);
            // Everything that light paths cannot find.
            let rest = (variance - found(known.light_path_stride).camera).max(0.5 * variance);
            let FoundPlan { camera, light } = found(plan.light_path_stride);
            let tracking = if plan.is_none() { 1.0 } else { TRACKING };
            let paths = if plan.has_light_paths() { 1.0 / f64::from(plan.light_path_stride) } else { 0.0 };
            (factor * rest + camera + light, cost * tracking + paths * self.light_cost)
        };
        let guiding_pays = self.guiding_pays();
        let plans = STRIDES
            .into_iter()
            .flat_map(|light_path_stride| [false, true].map(|guided| CausticPlan { light_path_stride, guided }))
            .filter(|plan| plan.has_light_paths() || !self.needs_light_paths)
            .filter(|plan| !plan.guided || guiding_pays);
        // The mean over both ends of the range, on a logarithmic scale.
        let product = |plan: &CausticPlan| {
            let [few, many] = [1.0 / REST_WITHIN, REST_WITHIN].map(|factor| {
                let (variance, cost) = value(*plan, factor);
                variance * cost
            });
            (few * many).sqrt() * if plan.guided { CLEARLY } else { 1.0 }
        };
        // Where the pilot found nothing, all products are zero: the first one is taken.
        let known = CausticPlan { guided: guiding_pays, ..known };
        let best = std::iter::once(known).chain(plans).min_by(|a, b| product(a).total_cmp(&product(b)));
        let best = best.unwrap_or(known);
        if self.needs_light_paths {
            return CausticChoice { plan: best, ..CausticChoice::NONE };
        }
        let without = CausticPlan { light_path_stride: 0, ..best };
        let shown = if best.has_light_paths() { best } else { CausticPlan { light_path_stride: 8, ..best } };
        let ((variance, cost), (less, more)) = (value(without, REST_MOSTLY), value(shown, REST_MOSTLY));
        CausticChoice { plan: best, cost: (more / cost) as f32, gain: (variance / less) as f32 }
    }

    /// Whether guiding camera paths pays, for any number of light paths.
    fn guiding_pays(&self) -> bool {
        let (least, n) = IN_PARTS;
        let levels = self.levels();
        let is_better = |part: &usize| {
            let of = |pilot: &CameraPilot| {
                let spots = pilot.spots.iter().zip(levels).skip(*part).step_by(n);
                pilot.cost * spots.map(|(spot, level)| relative(spot.variance, *level)).sum::<f64>()
            };
            of(&self.guided) < of(&self.plain)
        };
        (0..n).filter(is_better).count() >= least
    }

    /// Index of the spot that contains a film position.
    fn spot_at(&self, film: Vec2) -> usize {
        cell_at(film, self.size, self.grid)
    }

    /// Level of each spot, to which variances are relative: the mean over the spot and its neighbours.
    fn levels(&self) -> &[DVec3] {
        self.levels.get_or_init(|| self.find_levels())
    }

    fn find_levels(&self) -> Vec<DVec3> {
        let mut found = vec![DVec3::ZERO; self.guided.spots.len()];
        let per_splat = self.per_splat(self.grid);
        for splat in &self.splats {
            found[self.spot_at(splat.film)] += self.kept(splat) * per_splat;
        }
        let (width, height) = (i64::from(self.grid.x), i64::from(self.grid.y));
        let at = |x: i64, y: i64| {
            let i = (y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize;
            self.guided.spots[i].mean + found[i]
        };
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| at(x + dx, y + dy)));
                0.5 * at(x, y) + around.sum::<DVec3>() / 18.0
            })
            .collect()
    }

    /// Factor from a splat's contribution to the mean of the pixels in a cell of a grid.
    fn per_splat(&self, grid: UVec2) -> f64 {
        let n_pixels = f64::from(self.size.x) * f64::from(self.size.y);
        f64::from(grid.x) * f64::from(grid.y) / (self.n_light_paths * n_pixels)
    }

    /// The part of a splat that is not left to camera paths by the MIS weight.
    fn kept(&self, splat: &MeasuredSplat) -> DVec3 {
        let ratio = splat.ratio / CausticPlan::UNKNOWN.light_path_stride as f32;
        splat.light.as_dvec3() * (1.0 - f64::from(power_weight(ratio)))
    }

    fn mean_over_spots(&self, spots: &[PilotPixel], value: impl Fn(&PilotPixel) -> DVec3) -> f64 {
        let levels = self.levels();
        spots.iter().zip(levels).map(|(spot, level)| relative(value(spot), *level)).sum::<f64>() / spots.len() as f64
    }

    /// Variance of the caustics found by camera and light paths, for one sample of the image with a light path per
    /// `stride` camera paths; 0 for no light paths.
    fn found_by_light(&self, stride: u32) -> FoundPlan {
        let paths = if stride == 0 { 0.0 } else { 1.0 / f64::from(stride) };
        let n_pixels = f64::from(self.size.x) * f64::from(self.size.y);
        let levels = self.levels();
        // Caustics are bright in fewer pixels than a spot represents: the level comes from a splat's cell, without the
        // splat itself.
        let cells = self.grid * CELLS;
        let mut means = vec![DVec3::ZERO; (cells.x * cells.y) as usize];
        let per_splat = self.per_splat(cells);
        for splat in &self.splats {
            means[cell_at(splat.film, self.size, cells)] += self.kept(splat) * per_splat;
        }
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); levels.len()];
        let mut found = FoundPlan { camera: 0.0, light: 0.0 };
        for splat in &self.splats {
            let (light, ratio) = (splat.light.as_dvec3(), f64::from(splat.ratio));
            let spot = self.spot_at(splat.film);
            let others = means[cell_at(splat.film, self.size, cells)] - self.kept(splat) * per_splat;
            let level = levels[spot].max(others);
            // No camera path finds a delta light.
            let by_camera = if ratio.is_finite() { f64::from(power_weight((paths * ratio) as f32)) } else { 0.0 };
            if by_camera > 0.0 {
                let of_camera = light * by_camera;
                found.camera += relative(of_camera * of_camera * (ratio * f64::from(splat.kept)), level);
                sums[spot].0 += of_camera;
                sums[spot].1 += of_camera * of_camera;
            }
            if paths > 0.0 {
                let of_light = light * (1.0 - by_camera);
                found.light += relative(of_light * of_light / paths, level);
            }
        }
        let per_moment = 1.0 / (self.n_light_paths * n_pixels * n_pixels);
        let per_square = self.per_splat(self.grid).powi(2) / levels.len() as f64;
        let squares: f64 =
            sums.into_iter().zip(levels).map(|((sum, own), level)| relative(sum * sum - own, *level)).sum();
        FoundPlan {
            camera: (found.camera * per_moment - squares * per_square).max(0.0),
            light: found.light * per_moment,
        }
    }
}

/// Relative variances of a sample, mean over pixels.
#[derive(Clone, Copy, Debug)]
struct FoundPlan {
    camera: f64,
    light: f64,
}

/// Relative to squared radiance, as in relMSE; mean over channels.
fn relative(value: DVec3, level: DVec3) -> f64 {
    (value / (level * level + 0.01)).element_sum() / 3.0
}

/// Index of the grid cell that contains a film position.
fn cell_at(film: Vec2, size: UVec2, grid: UVec2) -> usize {
    let at = (film / size.as_vec2() * grid.as_vec2()).max(Vec2::ZERO).as_uvec2().min(grid - 1);
    (at.y * grid.x + at.x) as usize
}

impl CameraPilot {
    fn of(
        pass: &CausticPass,
        settings: &RenderSettings,
        size: UVec2,
        grid: UVec2,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let (spots, work) = trace_spots(pass, settings, size, grid, stop)?;
        let n_pixels = f64::from(size.x) * f64::from(size.y);
        let cost = work * n_pixels / (spots.len() * SPOT_SAMPLES as usize) as f64;
        Some(Self { spots, cost })
    }
}

/// Traces one pixel in each part of a grid over the film.
fn trace_spots(
    pass: &CausticPass,
    settings: &RenderSettings,
    size: UVec2,
    grid: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<PilotPixel>, f64)> {
    let n_spots = (grid.x * grid.y) as usize;
    let scene = pass.scene;
    let trace = |wave: &mut PathWave, first: usize| {
        let n = SPOTS_AT_ONCE.min(n_spots - first);
        let mut radiance = vec![Vec3::ZERO; n * SPOT_SAMPLES as usize];
        wave.begin_in(scene, &pass.camera_media);
        let slots = 0..radiance.len() as u32;
        let paths = slots.map(|slot| {
            let spot = (first as u32) + slot / SPOT_SAMPLES;
            let at = UVec2::new(spot % grid.x, spot / grid.x);
            // A random position in its part: regular positions would alias with patterns.
            let anywhere = Sampler::independent(PILOT_SEED, at.x, at.y, 0).pair(0);
            let pixel = ((at.as_vec2() + anywhere) / grid.as_vec2() * size.as_vec2()).as_uvec2().min(size - 1);
            let sampler = Sampler::new(PILOT_SEED, pixel.x, pixel.y, slot % SPOT_SAMPLES);
            let lens = if scene.camera.lens_radius > 0.0 { sampler.pair(1) } else { Vec2::ZERO };
            let ray = scene.camera.ray(pixel.as_vec2() + sampler.pair(0), size.as_vec2(), lens);
            CameraPath { ray, sampler, slot, weight: 1.0 }
        });
        let start = |batch: &mut crate::shading::paths::PathBatch| {
            paths.for_each(|camera| batch.push(&{ camera.ray }, &camera.into()));
        };
        wave.work = Some(Box::new(Work::new(scene)));
        wave.trace(scene, settings, Some(pass), start, &mut radiance, stop)?;
        let spots = radiance.chunks_exact(SPOT_SAMPLES as usize).map(|samples| {
            let n = f64::from(SPOT_SAMPLES);
            let good = samples.iter().map(|sample| if sample.is_finite() { sample.as_dvec3() } else { DVec3::ZERO });
            let mean = good.clone().sum::<DVec3>() / n;
            PilotPixel { mean, variance: good.map(|sample| (sample - mean).powf(2.0)).sum::<DVec3>() / (n - 1.0) }
        });
        Some((spots.collect::<Vec<_>>(), wave.work.take()?.total))
    };
    let firsts: Vec<usize> = (0..n_spots).step_by(SPOTS_AT_ONCE).collect();
    let parts: Option<Vec<_>> = firsts.into_par_iter().map_init(PathWave::default, trace).collect();
    let (mut spots, mut total) = (Vec::with_capacity(n_spots), 0.0);
    for (some, work) in parts? {
        spots.extend(some);
        total += work;
    }
    Some((spots, total))
}
