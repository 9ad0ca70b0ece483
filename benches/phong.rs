//! Frames a second of the classic model at one sample a pixel: `cargo bench -p firstlight-benches --bench phong`.
//!
//! `-- [SCENE]...` measures other scenes, built-in or files, at the size that each asks for. The median of many
//! frames with their range, on all threads of the pool (`RAYON_NUM_THREADS`), and the CPU time of one.

mod common;

use common::{scenes, world_of};
use firstlight::render::{Film, Integrator, Prepared, RenderSettings, advance};
use firstlight::report::cpu_seconds;
use firstlight::scene::{Extraction, FilmSize, SceneInputs};
use std::time::Instant;

/// Two mirrors across a corner and spheres before them, on a diffuse checkered floor.
const MIRRORS: &str = r#"(
    camera: (eye: (-7, 5, 12), look_at: (2, 2, 0), vfov: 45),
    film: (width: 600, height: 600),
    integrator: phong,
    environment: gradient(zenith: (0.1, 0.16, 0.3), horizon: (0.3, 0.34, 0.4), ground: (0.05, 0.05, 0.05)),
    textures: { "squares": checker(a: (0.75, 0.75, 0.72), b: (0.03, 0.03, 0.035)) },
    materials: {
        "floor": diffuse(albedo: "squares"),
        "mirror": mirror(reflectance: 0.9),
        "pink": diffuse(albedo: (0.75, 0.35, 0.5)),
        "shiny blue": phong(diffuse: (0.1, 0.2, 0.8), specular: 0.2, shininess: 40),
    },
    objects: [
        plane(material: "floor"),
        plane(point: (0, 0, -6), normal: (0, 0, 1), material: "mirror"),
        plane(point: (8, 0, 0), normal: (-1, 0, 0.2), material: "mirror"),
        ball_grid(first: (-2, 1, 2), steps: [(4, (2.2, 0, -1.2))], radius: 1, material: "pink"),
        ball_grid(first: (0, 0.6, 4), steps: [(4, (1.6, 0, -1.2))], radius: 0.6, material: "shiny blue"),
    ],
    lights: [ point(position: (-4, 12, 10), intensity: 600) ],
)"#;

const FRAMES: usize = 60;

fn main() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let mirrors = folder.path().join("mirrors and balls.ron");
    std::fs::write(&mirrors, MIRRORS).expect("a file can be written there");
    let scenes = scenes(|| {
        let own = mirrors.display().to_string();
        [own.as_str(), "ten-thousand-balls", "kd-tree", "ball"].map(str::to_owned).to_vec()
    });
    println!("threads: {}", rayon::current_num_threads());
    println!("| scene | size | frames/s (range) | CPU s a frame | rays a pixel | ns a ray |");
    println!("|---|---|---:|---:|---:|---:|");
    for scene in &scenes {
        row(scene);
    }
}

fn row(name: &str) {
    let (scene, mut world) = world_of(name);
    let size = *world.resource::<FilmSize>();
    let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    frame(&prepared, size);
    let before = cpu_seconds();
    let mut rays = 0;
    let mut seconds: Vec<f64> = (0..FRAMES)
        .map(|_| {
            let start = Instant::now();
            rays = frame(&prepared, size);
            start.elapsed().as_secs_f64()
        })
        .collect();
    let cpu = cpu_seconds().zip(before).map_or(f64::NAN, |(after, before)| (after - before) / FRAMES as f64);
    seconds.sort_unstable_by(f64::total_cmp);
    let pixels = f64::from(size.width) * f64::from(size.height);
    let title = std::path::Path::new(name).file_stem().map_or(name.into(), |stem| stem.to_string_lossy());
    println!(
        "| {title} | {} × {} | {:.1} ({:.1}–{:.1}) | {cpu:.4} | {:.2} | {:.0} |",
        size.width,
        size.height,
        1.0 / seconds[FRAMES / 2],
        1.0 / seconds[FRAMES - 1],
        1.0 / seconds[0],
        rays as f64 / pixels,
        1e9 * cpu / rays as f64,
    );
}

/// One sample of every pixel on a new film; how many rays it took.
fn frame(prepared: &Prepared, size: FilmSize) -> u64 {
    let settings = RenderSettings { integrator: Integrator::Phong, ..RenderSettings::default() };
    let mut film = Film::new(size.width, size.height);
    let report = advance(prepared, &settings, &mut film, 1, &|| false);
    assert!(report.completed && report.n_bad == 0, "a frame was not finished");
    report.rays.total()
}
