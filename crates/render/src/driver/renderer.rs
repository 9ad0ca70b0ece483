//! One pass over the film: takes missing samples of its tiles, in parallel on the current rayon pool.

use crate::core::settings::{Integrator, RenderSettings, SampleAllocation};
use crate::driver::block_costs::block_costs;
use crate::driver::caustic_choice::plan_of_film;
use crate::driver::moving::advance_moving;
use crate::driver::report::PassReport;
use crate::driver::wave::{Pass, Wave};
use crate::film::region::Region;
use crate::film::round::Round;
use crate::film::surfaces::SurfaceSums;
use crate::film::tile::FilmTile;
use crate::film::tiles::Film;
use crate::integrators::caustics::pilot::prepare_guide;
use crate::integrators::common::survival::at_depth;
use crate::prepare::exposed::Exposed;
use crate::prepare::prepared::Prepared;
use crate::shading::precomputed;
use glam::UVec2;
use rayon::prelude::*;

/// Takes samples until every pixel has `target_spp` of them (in an adaptive film: the mean over all pixels), or until
/// `stop` returns true.
///
/// Tiles are rendered in parallel on the current rayon pool. `stop` is called often, by all workers; the samples of an
/// unfinished wave are discarded.
///
/// # Panics
/// If [`RenderSettings::check`] or [`Camera::check`](crate::core::camera::Camera::check) fails: the image would be
/// black, and its error estimate meaningless.
pub fn advance<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film: &mut Film,
    target_spp: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    advance_region(scene, settings, film, None, target_spp, stop)
}

/// Computes the tables of integrals that the materials of a scene need: up to half a second of one processor, divided
/// among all, once per process. [`advance`] does it if nobody else has.
pub fn compute_tables(scene: &Prepared) {
    precomputed::compute_for(scene);
}

/// Like [`advance`], for the tiles of a region only; all of its pixels get the same number of samples. Light paths are
/// traced for the whole image, so other pixels may get contributions from them.
///
/// # Panics
/// As [`advance`].
pub fn advance_region<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film: &mut Film,
    region: Option<&Region>,
    target_spp: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    let scene = scene.into();
    let with_last_portals = film.is_preview.then(|| scene.middle().with_last_portals());
    let snapshot = with_last_portals.as_ref().unwrap_or(scene.middle());
    settings.check().unwrap_or_else(|error| panic!("{error}"));
    snapshot.camera.check().unwrap_or_else(|error| panic!("{error}"));
    if settings.integrator == Integrator::Path {
        compute_tables(snapshot);
    }
    let size = UVec2::new(film.width(), film.height());
    let Some(plan) = plan_of_film(snapshot, settings, film, stop) else { return PassReport::default() };
    film.set_radiance_unit(snapshot.tables.radiance_unit);
    let mut pass = Pass::new(snapshot, settings, size, plan);
    pass.notes_surfaces = film.notes_surfaces() && settings.integrator == Integrator::Path;
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
    let mut total = PassReport::nothing();
    while total.completed && film.spp_in(region) < target_spp {
        if let Some(metric) = metric {
            if film.round_is_due() && film.block_costs.is_none() {
                film.block_costs = block_costs(&pass, stop);
                if film.block_costs.is_none() {
                    total.completed = false;
                    break;
                }
            }
            film.begin_round_if_due(metric);
        }
        // Rounds end at powers of two, and the error of light tracing is recorded there.
        let next = (film.spp_in(region) + 1).checked_next_power_of_two();
        let goal = match &pass.caustics {
            None if metric.is_none() => target_spp,
            _ => next.unwrap_or(u32::MAX).min(target_spp),
        };
        let report = if scene.is_moving() {
            advance_moving(&scene, &pass, film, region, goal, stop)
        } else {
            advance_still(&pass, film, region, goal, stop)
        };
        total.add(report);
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

fn advance_still(
    pass: &Pass,
    film: &mut Film,
    region: Option<&Region>,
    goal: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    let caustics = pass.caustics.as_ref().zip(film.light.take());
    let (mut report, light) = rayon::join(
        || advance_tiles(pass, film, region, goal, stop),
        || caustics.map(|(caustics, mut layer)| (layer.advance(caustics, goal, stop), layer)),
    );
    if let Some((light, layer)) = light {
        film.light = Some(layer);
        report.add_light(light);
    }
    report
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
    let reports: Vec<(usize, PassReport)> = film
        .tiles
        .iter_mut()
        .enumerate()
        .filter(|(_, tile)| region.is_none_or(|region| tile.lies_in(region)))
        .par_bridge()
        .map_init(Wave::default, |wave, (i, tile)| (i, advance_tile(pass, tile, round.as_ref(), budget, stop, wave)))
        .collect();
    PassReport::sum(reports)
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
    let mut report = PassReport::nothing();
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
    let emits = |material: u32| pass.snapshot.tables.emission[material as usize].is_some();
    while missing.iter().any(|missing| *missing > 0) {
        wave.take_runs(tile, &missing, round.is_some());
        let (mut radiance, runs) = (std::mem::take(&mut wave.radiance), std::mem::take(&mut wave.runs));
        let notes_surfaces = pass.notes_surfaces && runs.iter().any(|run| run.sample < SurfaceSums::MOST);
        wave.note_surfaces(notes_surfaces);
        let Some(rays) = wave.trace(pass, &runs, &mut radiance, stop) else {
            report.completed = false;
            break;
        };
        report.rays += rays;
        let bound = pass.bound.map(|bound| at_depth(bound, wave.path.depth, pass.endless));
        let (mut runs_left, mut of_block) = (runs.as_slice(), 0);
        while let Some((run, rest)) = runs_left.split_first() {
            while wave.blocks[of_block] != run.pixels {
                of_block += 1;
            }
            let seen = &radiance[run.slot as usize..][..run.pixels.len()];
            if let Some(noted) = wave.path.first_surfaces.as_ref().filter(|_| run.sample < SurfaceSums::MOST) {
                tile.add_surfaces(of_block, &noted.seen[run.slot as usize..][..run.pixels.len()], &emits);
            }
            report.add_sample(tile, of_block, run.sample, seen, bound);
            missing[of_block] -= 1;
            runs_left = rest;
        }
        tile.record(pass.is_even());
        (wave.radiance, wave.runs) = (radiance, runs);
    }
    report
}
