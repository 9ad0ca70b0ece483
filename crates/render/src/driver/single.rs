//! Samples of single pixels, traced as for the film.

use crate::core::caustic_plan::CausticPlan;
use crate::core::settings::RenderSettings;
use crate::driver::report::BadSample;
use crate::driver::wave::{Pass, WAVE_SIZE, Wave};
use crate::integrators::caustics::pilot::prepare_guide;
use crate::integrators::common::record::{Record, TracedPath};
use crate::integrators::simd::camera::Pixels;
use crate::prepare::exposed::Exposed;
use crate::prepare::prepared::Prepared;
use glam::{UVec2, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Traces one sample of one pixel: the same radiance that [`advance`](crate::advance) adds to the film, without light
/// paths, which belong to no pixel, and without the roulette of shadow rays in adaptive films.
pub fn replay_sample<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film_size: UVec2,
    at: BadSample,
) -> Vec3 {
    let scene = scene.into();
    let pass = prepared_pass(scene.middle(), settings, film_size);
    let mut wave = Wave::of_pixel(UVec2::new(at.x, at.y));
    let runs = wave.runs_of(at.sample..at.sample + 1, 1);
    let mut radiance = [Vec3::ZERO];
    if scene.is_moving() {
        wave.trace(&pass.of_moment(&scene.of_sample(settings, at.sample)), &runs, &mut radiance, &|| false);
    } else {
        wave.trace(&pass, &runs, &mut radiance, &|| false);
    }
    radiance[0]
}

fn prepared_pass<'a>(snapshot: &'a Prepared, settings: &'a RenderSettings, film_size: UVec2) -> Pass<'a> {
    let pass = Pass::planned(snapshot, settings, film_size);
    if let Some(caustics) = &pass.caustics {
        prepare_guide(caustics, &|| false);
    }
    pass
}

/// Traces samples of one pixel as [`advance`](crate::advance) does, and records their paths.
pub(crate) fn trace_recorded(
    scene: Exposed,
    settings: &RenderSettings,
    film_size: UVec2,
    pixel: UVec2,
    samples: Range<u32>,
) -> Vec<TracedPath> {
    let pass = prepared_pass(scene.middle(), settings, film_size);
    let mut wave = Wave::of_pixel(pixel);
    let mut paths = Vec::with_capacity(samples.len());
    let at_once = if scene.is_moving() { 1 } else { WAVE_SIZE };
    for first in samples.clone().step_by(at_once) {
        let part = first..samples.end.min(first.saturating_add(at_once as u32));
        let mut radiance = vec![Vec3::ZERO; part.len()];
        wave.path.record = Some(Box::new(Record::new(part.clone())));
        let runs = wave.runs_of(part, 1);
        if scene.is_moving() {
            wave.trace(&pass.of_moment(&scene.of_sample(settings, first)), &runs, &mut radiance, &|| false);
        } else {
            wave.trace(&pass, &runs, &mut radiance, &|| false);
        }
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
