//! Which techniques look for caustics in a picture: chosen by variance times cost, which a small pilot picture tells.
//!
//! Light paths find caustics that camera paths hardly find, and cost rays that many a picture would be better off
//! without. A pilot traces few paths of each kind, with random numbers of their own, and they are thrown away, so
//! that the choice does not depend on any sample that is kept. It follows from scene, camera, size of the film and
//! settings but the seed: parts of a picture agree on it. Its cost is counted in rays, never in seconds.
//!
//! What camera paths alone would make of a caustic cannot be measured by them: few find it, and those that do are the
//! variance. Light paths tell it. Let a light path bring c into a pixel, as one of as many as there are pixels, and let r be the
//! density of such paths over that of the same camera path (see [`super::weight`]). Sums over light paths of
//!
//! - c² r w² are the second moment of what camera paths find with weight w,
//! - c² w² / φ that of what φ light paths a pixel find with weight w,
//!
//! where the weights are of the ratio φ r. So one pilot tells the variance of every number of light paths, none included.
//! Start reading at [`choose`].

use crate::core::caustic_plan::{CausticChoice, CausticPlan};
use crate::core::filter::PixelFilter;
use crate::core::settings::RenderSettings;
use crate::integrators::caustics::lens_connections::MeasuredSplat;
use crate::integrators::caustics::pass::{CausticPass, casters_of};
use crate::integrators::caustics::pilot::prepare_guide;
use crate::integrators::caustics::trace::LightWave;
use crate::integrators::path::{CameraPath, PathWave};
use crate::integrators::work::Work;
use crate::prepare::plan_cache::PlanKey;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::lights::power_weight;
use glam::{DVec3, UVec2, Vec2, Vec3};
use rayon::prelude::*;

/// Of all pilot paths; no picture has it but by chance.
const PILOT_SEED: u32 = 0x7069_6c6f;

/// Pixels of the film for each pixel that the pilot looks at, about, and how many it looks at.
const PIXELS_PER_SPOT: f64 = 200.0;
const SPOTS: (f64, f64) = (1024.0, 2048.0);

/// Camera paths of each such pixel.
const SPOT_SAMPLES: u32 = 4;

/// Spots that one worker takes at once.
const SPOTS_AT_ONCE: usize = 64;

/// Light paths for each spot, and how many one worker takes at once.
const LIGHT_PATHS_PER_SPOT: u32 = 3;
const LIGHT_PATHS_AT_ONCE: u32 = 256;

/// To choose where a light path begins, in the unit of [`Work`].
const LIGHT_PATH_START: f64 = 2.0;

/// By how much more the rest varies than a few thousand camera paths show: much of it comes from rare bright samples.
/// About that of the built-in scenes with glass, and of glass meshes.
const RARE: f64 = 2.5;

/// What camera paths cost more where they are weighed against light paths.
const TRACKING: f64 = 1.04;

/// Guiding must promise this factor, and be better in so many of so many parts of the pilot's pixels: what it costs is known,
/// but a single bright sample without it can seem to be worth as much as all that it saves.
const CLEARLY: f64 = 1.2;
const IN_PARTS: (usize, usize) = (5, 8);

/// What a splat's variance is relative to is told by cells of which so many lie along the side of a spot.
const CELLS: u32 = 4;

/// Sees to it that it is known how caustics are looked for in a picture; `None` if `stop` said so before it was.
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

/// The same, without tracing anything; `None` where that would be needed.
pub(crate) fn known(scene: &Prepared, settings: &RenderSettings, size: UVec2) -> Option<CausticChoice> {
    let Some(casters) = casters_of(scene, settings) else { return Some(CausticChoice::NONE) };
    let given = settings.techniques.caustic_plan;
    // Without weights all light that light paths may find is theirs, in any number.
    let fixed = given.or((!settings.techniques.mis).then_some(CausticPlan::UNKNOWN));
    fixed
        .map(|plan| CausticChoice { plan, ..CausticChoice::NONE })
        .or_else(|| casters.plans.find(&PlanKey::new(&scene.camera, settings, size)))
}

/// What will do for pictures that nothing may delay: the plan of the last view of the scene that was looked at.
pub(crate) fn for_preview(scene: &Prepared, settings: &RenderSettings) -> CausticPlan {
    let Some(casters) = casters_of(scene, settings) else { return CausticPlan::NONE };
    let given = settings.techniques.caustic_plan;
    given.or(casters.plans.newest().map(|choice| choice.plan)).unwrap_or(CausticPlan::UNKNOWN)
}

/// The part of the picture around one pixel that was looked at.
#[derive(Clone, Copy, Debug, Default)]
struct Spot {
    mean: DVec3,
    /// Of one sample.
    variance: DVec3,
}

/// What camera paths have found.
#[derive(Clone)]
struct CameraPilot {
    spots: Vec<Spot>,
    /// Of one sample of the whole picture.
    cost: f64,
}

/// What pilot paths have found.
struct Pilot {
    grid: UVec2,
    size: UVec2,
    plain: CameraPilot,
    guided: CameraPilot,
    splats: Vec<MeasuredSplat>,
    n_light_paths: f64,
    /// Of as many light paths as there are pixels.
    light_cost: f64,
    /// Some light can be found by light paths alone.
    needs_light_paths: bool,
}

/// Light path strides that may be chosen, none included.
const STRIDES: [u32; 7] = [0, 1, 2, 4, 8, 16, 32];

impl Pilot {
    fn of(scene: &Prepared, settings: &RenderSettings, size: UVec2, stop: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let settings = &RenderSettings {
            seed: PILOT_SEED,
            filter: PixelFilter::Box,
            // Whatever the picture is shaded with: one path at a time rounds otherwise.
            simd: RenderSettings::default().simd,
            ..*settings
        };
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
        // As if there were one for each pixel.
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
        })
    }

    fn choose(&self) -> CausticChoice {
        let light: Vec<_> = STRIDES.iter().map(|&stride| (stride, self.found_by_light(stride))).collect();
        let found = |of: u32| light.iter().find(|(stride, _)| *stride == of).expect("all are there").1;
        let known = CausticPlan::UNKNOWN;
        let value = |plan: CausticPlan| {
            let CameraPilot { spots, cost } = if plan.guided { &self.guided } else { &self.plain };
            let variance = self.mean_over_spots(spots, |spot| spot.variance);
            // All but what light paths could find.
            let rest = (variance - found(known.light_path_stride).camera).max(0.5 * variance) * RARE;
            let Found { camera, light } = found(plan.light_path_stride);
            let tracking = if plan.is_none() { 1.0 } else { TRACKING };
            let paths = if plan.has_light_paths() { 1.0 / f64::from(plan.light_path_stride) } else { 0.0 };
            (rest + camera + light, cost * tracking + paths * self.light_cost)
        };
        let product = |plan: CausticPlan| {
            let (variance, cost) = value(plan);
            variance * cost * if plan.guided { CLEARLY } else { 1.0 }
        };
        let plans = STRIDES
            .into_iter()
            .flat_map(|light_path_stride| [false, true].map(|guided| CausticPlan { light_path_stride, guided }));
        let guiding_pays = self.guiding_pays();
        let known = CausticPlan { guided: guiding_pays, ..known };
        let (mut best, mut least) = (known, product(known));
        for plan in plans.clone().filter(|plan| plan.has_light_paths() || !self.needs_light_paths) {
            if plan.guided && !guiding_pays {
                continue;
            }
            if product(plan) < least {
                (best, least) = (plan, product(plan));
            }
        }
        if self.needs_light_paths {
            return CausticChoice { plan: best, ..CausticChoice::NONE };
        }
        let without = CausticPlan { light_path_stride: 0, ..best };
        let shown = if best.has_light_paths() { best } else { CausticPlan { light_path_stride: 8, ..best } };
        let ((variance, cost), (less, more)) = (value(without), value(shown));
        CausticChoice { plan: best, cost: (more / cost) as f32, gain: (variance / less) as f32 }
    }

    /// Whether camera paths had better be guided, whatever light paths there are.
    fn guiding_pays(&self) -> bool {
        let (least, n) = IN_PARTS;
        let levels = self.levels();
        let is_better = |part: &usize| {
            let of = |pilot: &CameraPilot| {
                let spots = pilot.spots.iter().zip(&levels).skip(*part).step_by(n);
                pilot.cost * spots.map(|(spot, level)| relative(spot.variance, *level)).sum::<f64>()
            };
            of(&self.guided) < of(&self.plain)
        };
        (0..n).filter(is_better).count() >= least
    }

    /// Place in the list of spots of a point of the film.
    fn spot_at(&self, film: Vec2) -> usize {
        cell_at(film, self.size, self.grid)
    }

    /// What variances in each spot are relative to: the mean of the spot and those around it.
    fn levels(&self) -> Vec<DVec3> {
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

    /// What a splat adds to the mean of the pixels of a cell of a grid, over its light.
    fn per_splat(&self, grid: UVec2) -> f64 {
        let n_pixels = f64::from(self.size.x) * f64::from(self.size.y);
        f64::from(grid.x) * f64::from(grid.y) / (self.n_light_paths * n_pixels)
    }

    /// The light of a splat that is not left to camera paths.
    fn kept(&self, splat: &MeasuredSplat) -> DVec3 {
        let ratio = splat.ratio / CausticPlan::UNKNOWN.light_path_stride as f32;
        splat.light.as_dvec3() * (1.0 - f64::from(power_weight(ratio)))
    }

    fn mean_over_spots(&self, spots: &[Spot], value: impl Fn(&Spot) -> DVec3) -> f64 {
        let levels = self.levels();
        spots.iter().zip(levels).map(|(spot, level)| relative(value(spot), level)).sum::<f64>() / spots.len() as f64
    }

    /// Variance of what camera and light paths find of caustics, of a sample of the picture with a light path for every `stride`
    /// camera paths; 0 for none.
    fn found_by_light(&self, stride: u32) -> Found {
        let paths = if stride == 0 { 0.0 } else { 1.0 / f64::from(stride) };
        let n_pixels = f64::from(self.size.x) * f64::from(self.size.y);
        let levels = self.levels();
        // Caustics are bright in fewer pixels than a spot stands for: without its own light, a splat knows its cell.
        let cells = self.grid * CELLS;
        let mut means = vec![DVec3::ZERO; (cells.x * cells.y) as usize];
        let per_splat = self.per_splat(cells);
        for splat in &self.splats {
            means[cell_at(splat.film, self.size, cells)] += self.kept(splat) * per_splat;
        }
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); levels.len()];
        let mut found = Found { camera: 0.0, light: 0.0 };
        for splat in &self.splats {
            let (light, ratio) = (splat.light.as_dvec3(), f64::from(splat.ratio));
            let spot = self.spot_at(splat.film);
            let others = means[cell_at(splat.film, self.size, cells)] - self.kept(splat) * per_splat;
            let level = levels[spot].max(others);
            // No camera path finds light without size.
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
            sums.into_iter().zip(levels).map(|((sum, own), level)| relative(sum * sum - own, level)).sum();
        Found { camera: (found.camera * per_moment - squares * per_square).max(0.0), light: found.light * per_moment }
    }
}

/// Variances of a sample, relative, mean over pixels.
#[derive(Clone, Copy, Debug)]
struct Found {
    camera: f64,
    light: f64,
}

/// Over squared radiance, as relMSE has it; mean over channels.
fn relative(value: DVec3, level: DVec3) -> f64 {
    (value / (level * level + 0.01)).element_sum() / 3.0
}

/// Index of the cell of a grid over the film in which a point of it lies.
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

/// Looks at one pixel in the middle of each part of a grid over the film.
fn trace_spots(
    pass: &CausticPass,
    settings: &RenderSettings,
    size: UVec2,
    grid: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<Spot>, f64)> {
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
            // Anywhere in its part: the middles of all would see the same of a pattern.
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
            Spot { mean, variance: good.map(|sample| (sample - mean).powf(2.0)).sum::<DVec3>() / (n - 1.0) }
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
