//! The same scene, seed and samples give the same bytes, whoever computes them and in whatever portions.

use crate::common::*;
use firstlight::render::{
    ColorInput, Environment, Film, Fresnel, Integrator, Material, Prepared, RenderSettings, ScalarInput, advance,
};
use glam::Vec3;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

pub fn busy_scene() -> Prepared {
    let mut camera = camera(Vec3::new(0.0, 1.5, 5.0), Vec3::new(0.0, 0.5, 0.0), 40.0);
    camera.lens_radius = 0.05;
    camera.focus_distance = 5.0;
    scene(
        vec![
            (plane(Vec3::ZERO, Vec3::Y), 0),
            (sphere(Vec3::new(-0.8, 0.5, 0.0), 0.5), 2),
            (sphere(Vec3::new(0.5, 0.5, 0.4), 0.5), 0),
            (quad(Vec3::new(-1.0, 3.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), 1),
            (sphere(Vec3::new(3.0, 3.0, 2.0), 0.3), 1),
            (sphere(Vec3::new(-0.2, 0.25, 1.4), 0.25), 3),
            (sphere(Vec3::new(1.3, 0.3, 1.0), 0.3), 4),
        ],
        vec![
            diffuse(0.7),
            emissive(6.0),
            Material::Glass { ior: 1.5, absorption: Vec3::splat(0.3), dispersion: 0.0 },
            Material::Phong {
                diffuse: ColorInput::Constant(Vec3::new(0.2, 0.3, 0.6)),
                ambient: 0.8,
                specular: ScalarInput::Constant(0.4),
                shininess: 50.0,
                transparency: 0.0,
                ior: 1.5,
                absorption: Vec3::ZERO,
            },
            Material::Metal {
                alpha: ScalarInput::Constant(0.1),
                reflectance: ColorInput::Constant(Vec3::splat(0.8)),
                fresnel: Fresnel::Schlick,
                compensate: true,
            },
        ],
        Environment::Constant(Vec3::splat(0.2)),
        camera,
    )
}

fn bits(film: &Film) -> Vec<u32> {
    film.means().iter().flat_map(|mean| mean.to_array().map(f32::to_bits)).collect()
}

pub fn with_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(work)
}

#[test]
fn any_number_of_threads_and_any_tile_size_give_the_same_bits() {
    let scene = busy_scene();
    for integrator in [Integrator::Path, Integrator::Phong] {
        any_tiles_give_the_same_bits(&scene, RenderSettings { integrator, seed: 12, ..RenderSettings::default() });
    }
}

fn any_tiles_give_the_same_bits(scene: &Prepared, settings: RenderSettings) {
    let picture = |threads, tile_size| {
        with_threads(threads, || {
            let mut film = Film::with_tile_size(75, 50, tile_size);
            advance(scene, &settings, &mut film, 5, &|| false);
            bits(&film)
        })
    };
    let reference = picture(1, 32);
    for (threads, tile_size) in [(2, 32), (3, 32), (8, 32), (1, 16), (3, 7), (2, 128), (1, 1)] {
        assert!(picture(threads, tile_size) == reference, "{threads} threads, tiles of {tile_size}");
    }
    let other = RenderSettings { seed: 13, ..settings };
    let mut film = Film::new(75, 50);
    advance(scene, &other, &mut film, 5, &|| false);
    assert!(bits(&film) != reference, "another seed must give another picture");
}

#[test]
fn portions_and_interruptions_change_nothing() {
    let scene = busy_scene();
    for integrator in [Integrator::Path, Integrator::Phong] {
        portions_change_nothing(&scene, RenderSettings { integrator, ..RenderSettings::default() });
    }
}

fn portions_change_nothing(scene: &Prepared, settings: RenderSettings) {
    let mut whole = Film::new(75, 50);
    advance(scene, &settings, &mut whole, 6, &|| false);
    let mut portions = Film::new(75, 50);
    for target in [1, 2, 5, 6] {
        // Stopped after a while, a different while each time, and then finished.
        let asked = AtomicU32::new(0);
        let report =
            advance(scene, &settings, &mut portions, target, &|| asked.fetch_add(1, Ordering::Relaxed) > 3 * target);
        assert!(!report.completed || target == 1 || portions.spp() == target);
        assert!(advance(scene, &settings, &mut portions, target, &|| false).completed);
    }
    assert!(bits(&whole) == bits(&portions));
}

#[test]
fn a_cleared_film_is_like_a_new_one() {
    let (scene, settings) = (busy_scene(), RenderSettings::default());
    let new = || Film::new(75, 50).starting_at(3);
    let (mut expected, mut used) = (new(), Film::new(75, 50));
    advance(&scene, &settings, &mut expected, 4, &|| false);
    advance(&scene, &RenderSettings { seed: 9, ..settings }, &mut used, 5, &|| false);
    // Interrupted first.
    let asked = AtomicUsize::new(0);
    let stop = || asked.fetch_add(1, Ordering::Relaxed) >= 1;
    assert!(!used.clear_unless(&stop) && asked.load(Ordering::Relaxed) > 1);
    used.clear();
    assert_eq!((used.spp(), used.max_spp(), used.mean(40, 30)), (0, 0, Vec3::ZERO));
    assert!(used.error_estimate().is_none());
    let mut used = used.starting_at(3);
    advance(&scene, &settings, &mut used, 4, &|| false);
    assert!(bits(&used) == bits(&expected));
    assert_eq!(used.error_estimate().map(|e| e.relative), expected.error_estimate().map(|e| e.relative));
}
