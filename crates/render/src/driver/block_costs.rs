//! Cost of a sample in each block of an image, which the sample allocation weighs against its variance.
//!
//! A few pilot paths per block count their work ([`Work`]); nothing is timed. They have random numbers of their own and
//! are discarded. So the costs are a function of scene, camera, film size and settings except the seed, and need not be
//! saved with a film.

use crate::core::settings::{Integrator, RenderSettings};
use crate::driver::wave::Pass;
use crate::film::block::BLOCK_SIZE;
use crate::integrators::common::work::Work;
use crate::integrators::path::{CameraPath, PathWave};
use crate::integrators::simd::camera::CameraRays;
use crate::sampling::Sampler;
use crate::shading::paths::PathBatch;
use glam::{UVec2, Vec3};
use rayon::prelude::*;

/// Seed of all pilot paths, unlikely to be that of an image.
const PILOT_SEED: u32 = 0x636f_7374;

/// Pilot paths per block.
const PATHS: u32 = 8;

/// Blocks per wave.
const BLOCKS_AT_ONCE: u32 = 128;

/// Cost of a path apart from its rays: its start and its place in the film.
const START: f64 = 0.25;

/// Returns the cost of a sample per block, row by row; `None` if `stop` returned true first.
pub(super) fn block_costs(pass: &Pass, stop: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f64>> {
    let n_blocks = pass.size.map(|side| side.div_ceil(BLOCK_SIZE));
    let n = n_blocks.x * n_blocks.y;
    if pass.settings.integrator != Integrator::Path {
        return Some(vec![1.0; n as usize]);
    }
    // Independent of the instruction set of the image: the scalar code rounds differently.
    let settings = RenderSettings { seed: PILOT_SEED, simd: RenderSettings::default().simd, ..*pass.settings };
    let lens = CameraRays { seed: PILOT_SEED, ..pass.lens() };
    let trace = |wave: &mut PathWave, first: u32| {
        let blocks = first..n.min(first + BLOCKS_AT_ONCE);
        let mut radiance = vec![Vec3::ZERO; blocks.len() * PATHS as usize];
        let start = |paths: &mut PathBatch| {
            for (slot, i) in (0..).zip(blocks.clone().flat_map(|block| (0..PATHS).map(move |i| (block, i)))) {
                let (ray, sampler, weight) = lens.ray(pixel_of(i, n_blocks.x, pass.size), i.1);
                paths.push(&ray, &CameraPath { ray, sampler, slot, weight }.into());
            }
        };
        wave.begin_in(pass.snapshot, &pass.camera_media);
        wave.work = Some(Box::new(Work::per_slot(pass.snapshot, radiance.len())));
        wave.trace(pass.snapshot, &settings, pass.caustics.as_ref(), start, &mut radiance, stop)?;
        let of_slot = wave.work.take()?.of_slot;
        let sums =
            of_slot.chunks_exact(PATHS as usize).map(|costs| START + costs.iter().sum::<f64>() / f64::from(PATHS));
        Some(sums.collect::<Vec<_>>())
    };
    let firsts: Vec<u32> = (0..n).step_by(BLOCKS_AT_ONCE as usize).collect();
    let parts: Option<Vec<_>> = firsts.into_par_iter().map_init(PathWave::default, trace).collect();
    Some(parts?.concat())
}

/// Returns a random pixel of a block.
fn pixel_of((block, i): (u32, u32), n_columns: u32, size: UVec2) -> UVec2 {
    let start = UVec2::new(block % n_columns, block / n_columns) * BLOCK_SIZE;
    let inside = (size - start).min(UVec2::splat(BLOCK_SIZE));
    let anywhere = Sampler::new(PILOT_SEED, start.x, start.y, i).pair(0);
    start + (anywhere * inside.as_vec2()).as_uvec2().min(inside - 1)
}
