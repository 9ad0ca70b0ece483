//! What denoising costs, and what it brings: `cargo bench -p firstlight-benches --bench denoise`.
//!
//! `-- [SCENE]...` measures other scenes, built-in or files. For images of a moving camera, at one sample per pixel: CPU
//! and wall milliseconds of the filter, the least of many runs; by how much noting surfaces lengthens a sample, as a
//! share of its CPU time, in turns; relMSE of raw and smoothed image against a reference of 256 samples per pixel.

mod common;

use common::{scenes, world_of};
use firstlight::render::{Film, MovingFilter, Prepared, RenderSettings, advance, smooth_film};
use firstlight::report::cpu_seconds;
use firstlight::scene::{Extraction, SceneInputs};
use glam::Vec3;
use std::time::Instant;

const SIZES: [(u32, u32); 2] = [(427, 240), (1280, 720)];
const RUNS: usize = 20;

fn main() {
    let scenes = scenes(|| ["cornell", "gallery", "soft-shadow"].map(str::to_owned).to_vec());
    println!("threads: {}", rayon::current_num_threads());
    println!("| scene | size | filter, CPU ms | wall ms | surfaces | relMSE raw | smoothed | energy |");
    println!("|---|---|---:|---:|---:|---:|---:|---:|");
    for scene in &scenes {
        for size in SIZES {
            row(scene, size);
        }
    }
}

fn row(name: &str, size: (u32, u32)) {
    let (scene, mut world) = world_of(name);
    let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    let mut film = Film::new(size.0, size.1);
    sample_once(&prepared, &mut film, true);
    let settings = RenderSettings::default();
    let mut filter = MovingFilter::default();
    let smooth = smooth_film(&mut filter, &prepared, &settings, &film, &|| false).expect("surfaces are noted").to_vec();
    let (cpu, wall) = least(|| {
        smooth_film(&mut filter, &prepared, &settings, &film, &|| false);
    });
    // In turns, so that other programs disturb both alike.
    let mut again = Film::new(size.0, size.1);
    let turns: Vec<[f64; 2]> =
        (0..RUNS).map(|_| [true, false].map(|notes| time(|| sample_once(&prepared, &mut again, notes)).0)).collect();
    let [noted, plain] = [0, 1].map(|k| turns.iter().map(|turn| turn[k]).fold(f64::INFINITY, f64::min));
    let mut reference = Film::new(size.0, size.1);
    advance(&prepared, &RenderSettings { seed: 77, ..settings }, &mut reference, 64, &|| false);
    let (reference, raw) = (reference.means(), film.means());
    let mean = |colors: &[Vec3]| colors.iter().map(|color| f64::from(color.element_sum())).sum::<f64>();
    let title = std::path::Path::new(name).file_stem().map_or(name.into(), |stem| stem.to_string_lossy());
    println!(
        "| {title} | {} × {} | {:.1} | {:.1} | {:.1} % | {:.4} | {:.4} | {:.3} |",
        size.0,
        size.1,
        1e3 * cpu,
        1e3 * wall,
        100.0 * (noted / plain - 1.0),
        relative_mse(&raw, &reference),
        relative_mse(&smooth, &reference),
        mean(&smooth) / mean(&raw),
    );
    if let Ok(folder) = std::env::var("FIRSTLIGHT_BENCH_IMAGES") {
        for (kind, colors) in [("raw", &raw), ("smooth", &smooth), ("reference", &reference)] {
            let rgb: Vec<u8> = colors
                .iter()
                .flat_map(|color| firstlight::render::develop_pixel(*color, &firstlight::render::Display::default()))
                .collect();
            let path = format!("{folder}/{title}-{}-{kind}.png", size.0);
            image::save_buffer(&path, &rgb, size.0, size.1, image::ColorType::Rgb8)
                .unwrap_or_else(|error| panic!("{path}: {error}"));
        }
    }
}

/// Takes the first sample of each pixel; a film that is used again keeps its memory, as in the window.
fn sample_once(prepared: &Prepared, film: &mut Film, notes_surfaces: bool) {
    film.clear();
    film.set_preview(true);
    if notes_surfaces {
        film.note_surfaces();
    }
    advance(prepared, &RenderSettings::default(), film, 1, &|| false);
}

/// CPU and wall seconds.
fn time(run: impl FnOnce()) -> (f64, f64) {
    let (before, start) = (cpu_seconds(), Instant::now());
    run();
    let wall = start.elapsed().as_secs_f64();
    (cpu_seconds().zip(before).map_or(f64::NAN, |(after, before)| after - before), wall)
}

fn least(mut run: impl FnMut()) -> (f64, f64) {
    (0..RUNS)
        .map(|_| time(&mut run))
        .fold((f64::INFINITY, f64::INFINITY), |least, one| (least.0.min(one.0), least.1.min(one.1)))
}

fn relative_mse(colors: &[Vec3], reference: &[Vec3]) -> f64 {
    let of = |(color, truth): (&Vec3, &Vec3)| {
        let off = *color - *truth;
        f64::from((off * off / (*truth * *truth + 0.01)).element_sum())
    };
    colors.iter().zip(reference).map(of).sum::<f64>() / (3 * colors.len()) as f64
}
