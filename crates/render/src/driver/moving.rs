//! One pass over the film of a scene that moves while the shutter is open.
//!
//! Work is ordered by sample number, because each sample has its own moment, for which the scene is prepared: the tree
//! over the objects and the tables that depend on moving objects; the trees of meshes are shared. Several moments are
//! prepared in parallel. A wave has one sample per pixel, so it spans several tiles to be as large as for still scenes.
//!
//! Sample numbers per pixel and their sums are handled as for still scenes, so the film does not depend on the order of
//! work. Start reading at [`advance_moving`].

use crate::core::settings::RenderSettings;
use crate::driver::report::PassReport;
use crate::driver::wave::{Pass, Run, WAVE_SIZE, Wave, add_pixels};
use crate::film::block::BLOCK_PIXELS;
use crate::film::region::Region;
use crate::film::round::Round;
use crate::film::tile::FilmTile;
use crate::film::tiles::Film;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::survival::at_depth;
use crate::integrators::simd::camera::Pixels;
use crate::prepare::exposed::Exposed;
use crate::prepare::prepared::Prepared;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Moments prepared at once: enough to keep all workers busy, few enough to bound the memory for their tables.
const MOMENTS_AT_ONCE: usize = 16;

/// Takes samples up to `goal`, a budget in the sense of [`Film::spp`], or until `stop` returns true.
///
/// - `middle`: the pass for the middle of the shutter interval, with its guiding cache.
pub(super) fn advance_moving(
    scene: &Exposed,
    middle: &Pass,
    film: &mut Film,
    region: Option<&Region>,
    goal: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> PassReport {
    // A region is always sampled evenly.
    let round = film.round.filter(|_| region.is_none());
    let due = Due { round: round.as_ref(), region, goal };
    let mut report = PassReport::nothing();
    let mut samples = due.next_samples(film);
    let mut moments = prepare(scene, middle.settings, &samples, stop);
    while !samples.is_empty() {
        let Some(now) = moments else {
            report.completed = false;
            break;
        };
        let passes: Vec<_> = samples.iter().zip(&now).map(|(&sample, now)| (sample, middle.of_moment(now))).collect();
        let light = film.light.take();
        let (tiles, light) = rayon::join(
            || advance_tiles(&passes, film, &due, stop),
            || {
                light.map(|mut layer| {
                    let missing = layer.missing(goal);
                    let last = samples[samples.len() - 1];
                    // Only samples whose moments are prepared.
                    let later = missing.end.saturating_sub(missing.start.max(last.saturating_add(1)));
                    let pass_of = |sample: u32| -> Option<&CausticPass> {
                        let place = passes.binary_search_by_key(&sample, |(sample, _)| *sample);
                        passes[place.expect("only prepared samples")].1.caustics.as_ref()
                    };
                    (layer.advance_with(goal - later.min(goal), stop, &pass_of), layer)
                })
            },
        );
        report.add(tiles);
        if let Some((light, layer)) = light {
            film.light = Some(layer);
            report.add_light(light);
        }
        if !report.completed {
            break;
        }
        drop(passes);
        samples = due.next_samples(film);
        moments = prepare(scene, middle.settings, &samples, stop);
    }
    report
}

/// Returns the scene at the moments of these samples; `None` if `stop` returned true.
fn prepare(
    scene: &Exposed,
    settings: &RenderSettings,
    samples: &[u32],
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Prepared>> {
    samples.par_iter().map(|&sample| (!stop()).then(|| scene.of_sample(settings, sample))).collect()
}

/// The samples that are due.
struct Due<'a> {
    /// Decides which blocks get samples; without a round, all of them.
    round: Option<&'a Round>,
    /// Only tiles of this region get samples, if there is one.
    region: Option<&'a Region>,
    goal: u32,
}

impl Due<'_> {
    /// Returns the numbers of the missing samples of a block.
    fn missing(&self, tile: &FilmTile, block: usize) -> Range<u32> {
        if self.region.is_some_and(|region| !tile.lies_in(region)) {
            return 0..0;
        }
        let block = &tile.blocks[block];
        let next = block.next_sample();
        next..next + block.target(self.round, self.goal).saturating_sub(block.spp)
    }

    /// Returns the lowest numbers of samples that are missing in some block or in the light layer, ascending.
    fn next_samples(&self, film: &Film) -> Vec<u32> {
        let of_light = film.light.as_ref().map(|layer| layer.missing(self.goal));
        let mut ranges: Vec<(u32, u32)> = film
            .tiles
            .iter()
            .flat_map(|tile| (0..tile.blocks.len()).map(move |block| self.missing(tile, block)))
            .chain(of_light)
            .filter(|range| !range.is_empty())
            .map(|range| (range.start, range.end))
            .collect();
        ranges.sort_unstable();
        ranges.dedup();
        let mut samples = Vec::new();
        for (start, end) in ranges {
            let next = samples.last().map_or(0, |last| last + 1);
            let room = MOMENTS_AT_ONCE - samples.len();
            samples.extend((start.max(next)..end).take(room));
        }
        samples
    }
}

/// - `passes`: sample numbers, ascending, and their passes.
fn advance_tiles(passes: &[(u32, Pass)], film: &mut Film, due: &Due, stop: &(dyn Fn() -> bool + Sync)) -> PassReport {
    let last = passes.last().map_or(0, |(sample, _)| *sample);
    let n_pixels = |tile: &FilmTile| -> usize {
        let is_due = |block: &usize| due.missing(tile, *block).start <= last && !due.missing(tile, *block).is_empty();
        (0..tile.blocks.len()).filter(is_due).map(|block| tile.blocks[block].n_pixels()).sum()
    };
    let of_tiles: Vec<usize> = film.tiles.iter().map(n_pixels).collect();
    // A small film is divided among all workers.
    let fair = of_tiles.iter().sum::<usize>() / (4 * rayon::current_num_threads());
    let most = fair.clamp(BLOCK_PIXELS, WAVE_SIZE);
    let (mut groups, mut tiles_left, mut of_left) = (Vec::new(), &mut film.tiles[..], &of_tiles[..]);
    while !tiles_left.is_empty() {
        let mut sum = 0;
        let fits = |&&n: &&usize| {
            sum += n;
            sum <= most
        };
        let n = of_left.iter().take_while(fits).count().max(1);
        let (group, others) = tiles_left.split_at_mut(n);
        groups.push(group);
        (tiles_left, of_left) = (others, &of_left[n..]);
    }
    let reports: Vec<(usize, PassReport)> = groups
        .into_iter()
        .enumerate()
        .par_bridge()
        .map_init(Wave::default, |wave, (i, tiles)| (i, advance_group(passes, tiles, due, stop, wave)))
        .collect();
    PassReport::sum(reports)
}

/// A block and its missing samples.
struct PassPiece {
    tile: usize,
    block: usize,
    /// Range in the wave's pixels.
    pixels: Range<usize>,
    /// Numbers of the missing samples.
    samples: Range<u32>,
}

fn advance_group(
    passes: &[(u32, Pass)],
    tiles: &mut [FilmTile],
    due: &Due,
    stop: &(dyn Fn() -> bool + Sync),
    wave: &mut Wave,
) -> PassReport {
    let mut report = PassReport::nothing();
    let even = passes.iter().all(|(_, pass)| pass.is_even());
    wave.pixels = Pixels::default();
    let mut pieces = Vec::new();
    for (i, tile) in tiles.iter().enumerate() {
        for (k, block) in tile.blocks.iter().enumerate() {
            let samples = due.missing(tile, k);
            if samples.is_empty() {
                continue;
            }
            let first = wave.pixels.local.len();
            add_pixels(tile.origin + block.start, block.size, &mut wave.pixels);
            pieces.push(PassPiece { tile: i, block: k, pixels: first..wave.pixels.local.len(), samples });
        }
    }
    let (mut runs, mut radiance) = (Vec::new(), Vec::new());
    for (sample, pass) in passes {
        let is_due = |piece: &&PassPiece| piece.samples.contains(sample);
        let mut slot = 0;
        runs.clear();
        wave.path.shadow_thresholds.clear();
        for piece in pieces.iter().filter(is_due) {
            runs.push(Run { pixels: piece.pixels.clone(), sample: *sample, slot });
            slot += piece.pixels.len() as u32;
            if due.round.is_some() {
                let tile = &tiles[piece.tile];
                wave.path.shadow_thresholds.extend(tile.shadow_thresholds(&tile.blocks[piece.block]));
            }
        }
        if runs.is_empty() {
            continue;
        }
        radiance.clear();
        radiance.resize(slot as usize, Vec3::ZERO);
        // Checked before starting work that would be discarded.
        let rays = if stop() { None } else { wave.trace(pass, &runs, &mut radiance, stop) };
        let Some(rays) = rays else {
            report.completed = false;
            break;
        };
        report.rays += rays;
        let bound = pass.bound.map(|bound| at_depth(bound, wave.path.depth, pass.endless));
        for (piece, run) in pieces.iter().filter(is_due).zip(&runs) {
            let seen = &radiance[run.slot as usize..][..run.pixels.len()];
            report.add_sample(&mut tiles[piece.tile], piece.block, *sample, seen, bound);
        }
        tiles.iter_mut().for_each(|tile| tile.record(even));
    }
    report
}
