//! Translation and scale invariance: one scene at the origin and elsewhere, scaled and in map coordinates, loaded from
//! the text of the scene file.

use crate::kdtree::Hit;
use crate::mesh::procedural;
use crate::render::{Film, Prepared, RenderSettings, advance};
use crate::scene::{Extraction, LoadOptions, SceneInputs, SceneSource, load};
use crate::stability::random::Random;
use crate::stability::tally::{Energy, Tally};
use crate::stability::test_scene::{describe, towards};
use bevy_ecs::world::World;
use glam::{DVec3, dvec3};
use std::fmt::Write;

/// Text of a room with diffuse, rough, transparent and glossy objects, some of them meshes; all lengths are multiplied
/// by `scale`, all positions moved by `shift`.
fn scene_text(scale: f64, shift: DVec3) -> String {
    let at = |x: f64, y: f64, z: f64| {
        let p = shift + scale * dvec3(x, y, z);
        format!("({:?}, {:?}, {:?})", p.x, p.y, p.z)
    };
    let way = |x: f64, y: f64, z: f64| format!("({:?}, {:?}, {:?})", scale * x, scale * y, scale * z);
    format!(
        r#"(
    camera: (eye: {eye}, look_at: {look_at}, vfov: 45, lens_radius: {lens:?}, focus_distance: {focus:?}),
    environment: gradient(zenith: (0.3, 0.4, 0.8), horizon: 0.8, ground: 0.1),
    materials: {{ "matte": diffuse(albedo: (0.7, 0.5, 0.4)), "rough": metal(alpha: 0.2, reflectance: 0.8),
                  "glass": glass(ior: 1.5, absorption: ({absorption:?}, 0, 0)), "light": emissive(radiance: 4) }},
    objects: [
        plane(point: {floor}, material: "matte"),
        quad(corner: {wall}, edge_u: {wall_u}, edge_v: {wall_v}, material: "matte"),
        sphere(center: {ball}, radius: {ball_radius:?}, material: "glass"),
        sphere(center: {light_center}, radius: {light_radius:?}, material: "light"),
        mesh(source: builtin("cube"), material: "rough", transform: (translate: {cube}, rotate: (20, 30, 0), scale: {cube_size:?})),
        mesh(source: builtin("torus"), material: "matte", transform: (translate: {ring}, rotate: (60, 0, 0), scale: {ring_size:?})),
        spheres(centers: [{small_a}, {small_b}], radii: all({small:?}), material: "rough"),
    ],
)"#,
        eye = at(0.5, 1.5, 5.0),
        look_at = at(0.0, 0.8, 0.0),
        lens = 0.02 * scale,
        focus = 4.5 * scale,
        absorption = 0.5 / scale,
        floor = at(0.0, 0.0, 0.0),
        wall = at(-3.0, 0.0, -2.0),
        wall_u = way(6.0, 0.0, 0.0),
        wall_v = way(0.0, 3.0, 0.0),
        ball = at(-0.9, 0.7, 0.6),
        ball_radius = 0.7 * scale,
        light_center = at(1.0, 2.6, 1.0),
        light_radius = 0.3 * scale,
        cube = at(1.2, 0.6, 0.0),
        cube_size = 0.7 * scale,
        ring = at(0.0, 1.2, -1.0),
        ring_size = 0.6 * scale,
        small_a = at(0.1, 0.2, 1.5),
        small_b = at(0.6, 0.2, 1.8),
        small = 0.2 * scale,
    )
}

/// Writes the files, loads the first one, and prepares it for rendering.
fn prepared(files: &[(&str, String)]) -> Result<Prepared, String> {
    let folder = tempfile::tempdir().map_err(|error| format!("a folder for scenes cannot be made: {error}"))?;
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).map_err(|error| format!("{name}: {error}"))?;
    }
    let source = SceneSource::Scene(folder.path().join(files[0].0));
    let scene = load(&source, &LoadOptions::default()).map_err(|error| error.to_string())?;
    let mut world = World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    match extraction.problems.first() {
        Some(problem) => Err(problem.to_string()),
        None => Ok(extraction.prepared),
    }
}

/// The tally of a case that cannot start, which counts as a finding.
fn failed(message: String) -> Tally {
    let mut tally = Tally { energy: Some(Energy { error: f64::NAN, allowed: 1.0 }), ..Tally::default() };
    tally.offer(f64::INFINITY, 0, 0, || message);
    tally
}

/// Number of renders with different seeds, from which the noise is estimated.
const SEEDS: u32 = 8;
const SIDE: u32 = 32;
/// Pixels along a side of the blocks that are compared.
const BLOCK: u32 = 4;

/// Returns the means of all blocks for each seed.
fn blocks(scene: &Prepared, first_seed: u32, spp: u32) -> (Vec<Vec<f64>>, u64) {
    let mut n_bad = 0;
    let of_seed = |seed: u32| {
        let mut film = Film::new(SIDE, SIDE);
        let settings = RenderSettings { seed: first_seed + seed, ..RenderSettings::default() };
        n_bad += advance(scene, &settings, &mut film, spp, &|| false).n_bad;
        let mut sums = vec![0.0; (SIDE / BLOCK * SIDE / BLOCK) as usize];
        for (i, mean) in (0..).zip(film.means()) {
            let (x, y) = (i % SIDE / BLOCK, i / SIDE / BLOCK);
            sums[(y * (SIDE / BLOCK) + x) as usize] += f64::from(mean.element_sum()) / f64::from(BLOCK * BLOCK);
        }
        sums
    };
    ((0..SEEDS).map(of_seed).collect(), n_bad)
}

/// Returns the largest |t| of Welch's test over all blocks, and that of the mean of the image.
fn largest_t(a: &[Vec<f64>], b: &[Vec<f64>]) -> (f64, f64) {
    let n = a.len() as f64;
    let t_of = |value: &dyn Fn(&[f64]) -> f64| {
        let moments = |pictures: &[Vec<f64>]| {
            let values: Vec<f64> = pictures.iter().map(|picture| value(picture)).collect();
            let mean = values.iter().sum::<f64>() / n;
            (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
        };
        let ((mean_a, var_a), (mean_b, var_b)) = (moments(a), moments(b));
        let difference = (mean_a - mean_b).abs();
        // Without noise only the rounding of f32 remains.
        difference / (var_a + var_b).sqrt().max(1e-6 * mean_a.abs()).max(f64::MIN_POSITIVE)
    };
    let of_blocks = (0..a[0].len()).map(|block| t_of(&|picture: &[f64]| picture[block])).fold(0.0, f64::max);
    (of_blocks, t_of(&|picture: &[f64]| picture.iter().sum()))
}

/// Renders the scene at the origin and elsewhere, and compares by |t|: with 14 degrees of freedom, 64 blocks and ten
/// positions, 7.5 is exceeded once in a thousand sets of equal images.
pub fn run(n: u64, tick: &(dyn Fn(u64) + Sync)) -> Tally {
    let places = [
        (1.0, DVec3::X * 1e6),
        (1.0, dvec3(1e6, -1e6, 1e6)),
        (1.0, dvec3(5e5, 120.0, 4.5e6)),
        (1e-3, DVec3::ZERO),
        (1e-2, dvec3(3.0, 2.0, 1.0)),
        (10.0, DVec3::ZERO),
        (1e3, DVec3::ZERO),
        (1e3, DVec3::splat(1e6)),
        (1e-3, DVec3::splat(1e3)),
        (1e-6, DVec3::ZERO),
        (1e6, DVec3::ZERO),
    ];
    let samples = u64::from(SEEDS * SIDE * SIDE) * (places.len() as u64 + 1);
    let spp = (n / samples).clamp(32, 4096) as u32;
    let here = match prepared(&[("scene.ron", scene_text(1.0, DVec3::ZERO))]) {
        Ok(scene) => scene,
        Err(message) => return failed(message),
    };
    let (expected, n_bad) = blocks(&here, 0, spp);
    let per_place = u64::from(spp * SEEDS * SIDE * SIDE);
    tick(per_place);
    let mut tally = Tally { rays: per_place, non_finite: n_bad, ..Tally::default() };
    for (i, (scale, shift)) in places.into_iter().enumerate() {
        let scene = match prepared(&[("scene.ron", scene_text(scale, shift))]) {
            Ok(scene) => scene,
            Err(message) => return tally.merged(failed(message)),
        };
        let (found, n_bad) = blocks(&scene, 100 + 100 * i as u32, spp);
        tick(per_place);
        let (of_blocks, of_mean) = largest_t(&expected, &found);
        let energy = Energy { error: of_blocks.max(of_mean), allowed: 7.5 };
        let mut here = Tally { rays: per_place, non_finite: n_bad, energy: Some(energy), ..Tally::default() };
        here.offer(energy.error / energy.allowed, i, 0, || {
            format!("scaled by {scale:e}, moved by {shift}: |t| {of_blocks:.2} of a block, {of_mean:.2} of the mean")
        });
        tally = tally.merged(here);
    }
    tally
}

/// A stone in map coordinates, with the precision of a survey: millimetres.
fn survey(shift: DVec3) -> String {
    let stone = procedural::icosphere(12);
    let mut text = String::new();
    for p in &stone.positions {
        let p = p.as_dvec3() * dvec3(40.0, 25.0, 30.0);
        // Rounded before it is moved, so that both files describe the same stone.
        let [x, y, z] = (p * 1000.0).round().to_array().map(|v| v / 1000.0);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "v {:.3} {:.3} {:.3}", x + shift.x, y + shift.y, z + shift.z);
    }
    for [a, b, c] in &stone.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

/// Loads the model at the origin and at (500000, 4500000, 120), and traces the same rays in both: from inside none may
/// escape, and depths may differ by at most the rounding of coordinates relative to the camera.
pub fn georeferenced(n: u64, tick: &(dyn Fn(u64) + Sync)) -> Tally {
    let shift = dvec3(500_000.0, 4_500_000.0, 120.0);
    let load_at = |shift: DVec3| {
        let eye = shift + dvec3(0.0, 0.0, 90.0);
        let scene = format!(
            "(camera: (eye: ({:?}, {:?}, {:?}), look_at: ({:?}, {:?}, {:?})), materials: {{ \"m\": diffuse(albedo: 0.5) }},
              objects: [mesh(source: obj(\"stone.obj\"), material: \"m\")])",
            eye.x, eye.y, eye.z, shift.x, shift.y, shift.z
        );
        prepared(&[("scene.ron", scene), ("stone.obj", survey(shift))])
    };
    let (here, there) = match (load_at(DVec3::ZERO), load_at(shift)) {
        (Ok(here), Ok(there)) => (here, there),
        (Err(message), _) | (_, Err(message)) => return failed(message),
    };
    let mut tally = Tally { rays: 2 * n, ..Tally::default() };
    for i in 0..n {
        let mut random = Random::new(0x6E0, i);
        // Relative to the camera, because the origin of a snapshot may be slightly away from it.
        let center = glam::vec3(0.0, 0.0, -90.0);
        let (from, to) = (center + random.point() * 10.0, center + random.direction() * 100.0);
        let trace = |scene: &Prepared| -> (crate::geometry::Ray, Option<Hit>) {
            let ray = towards(scene.camera.eye + from, scene.camera.eye + to);
            (ray, scene.geometry.tree.closest_hit(&ray))
        };
        let ((ray_a, a), (ray_b, b)) = (trace(&here), trace(&there));
        for (ray, hit) in [(ray_a, a), (ray_b, b)] {
            if hit.is_none() {
                tally.leaks += 1;
                tally.offer(1e9, 0, i, || describe(&ray, &hit));
            }
        }
        if let (Some(a), Some(b)) = (a, b) {
            // The bound stated by `scene::origin_for`: 887 · 2⁻²⁴ of the viewing distance.
            let off = f64::from((a.t - b.t).abs()) / (887.0 * 90.0 / f64::from(1 << 24));
            tally.wrong_t += u64::from(off > 1.0);
            tally.offer(off, 0, i, || format!("{} against {}", describe(&ray_b, &Some(b)), describe(&ray_a, &Some(a))));
        }
    }
    tick(2 * n);
    tally
}
