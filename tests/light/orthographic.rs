//! Parallel rays: what they see, and that light paths find the same through their lens.

use crate::common::*;
use firstlight::render::{Camera, Environment, Film, Material, Prepared, RenderSettings, Techniques, advance};
use glam::Vec3;

/// As high as `height` metres, from the front and above.
fn parallel(height: f32, lens_radius: f32) -> Camera {
    let from = camera(Vec3::new(0.0, 2.0, 5.0), Vec3::new(0.0, 0.3, 0.0), 40.0);
    Camera { orthographic: Some(0.5 * height), lens_radius, focus_distance: 5.0, ..from }
}

#[test]
fn a_thing_is_as_large_at_any_distance() {
    for distance in [0.5, 5.0, 500.0] {
        let wall = quad(Vec3::new(-0.5, -0.5, -distance), Vec3::X, Vec3::Y);
        let camera = Camera { orthographic: Some(1.0), ..camera(Vec3::ZERO, Vec3::NEG_Z, 40.0) };
        let scene = scene(vec![(wall, 0)], vec![emissive(3.0)], Environment::Black, camera);
        // A square metre of 2 by 4: a quarter of the height, half of that of the width.
        let film = render(&scene, &RenderSettings::default(), 64, 32, 4).0;
        let (mean, _) = picture_mean(&film);
        assert!((mean - 3.0 / 8.0).abs() < 1e-6, "{mean} at {distance}");
    }
}

#[test]
fn only_what_lies_in_the_focal_plane_is_sharp() {
    let edge = |distance: f32| {
        let wall = quad(Vec3::new(-5.0, -5.0, -distance), Vec3::X * 5.0, Vec3::Y * 10.0);
        let front = camera(Vec3::ZERO, Vec3::NEG_Z, 40.0);
        let camera = Camera { orthographic: Some(1.0), lens_radius: 0.4, focus_distance: 4.0, ..front };
        let scene = scene(vec![(wall, 0)], vec![emissive(1.0)], Environment::Black, camera);
        let film = render(&scene, &RenderSettings::default(), 40, 40, 64).0;
        film.means()[..40].iter().filter(|light| light.y > 0.01 && light.y < 0.99).count()
    };
    assert_eq!(edge(4.0), 0);
    // A circle of 2 · 0.4 · |1 − 8/4| metres, where the picture has 20 pixels a metre.
    assert!((12..=16).contains(&edge(8.0)), "{}", edge(8.0));
}

/// Light below a glass sphere and off a mirror, by paths from both ends and by those of the camera alone.
#[test]
fn light_paths_through_the_lens_keep_the_mean() {
    let shapes = vec![
        (quad(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::Z * -6.0), 0),
        (sphere(Vec3::new(0.2, 0.6, 0.0), 0.5), 1),
        (quad(Vec3::new(-1.4, 0.0, -0.6), Vec3::new(0.4, 0.0, 0.8), Vec3::Y), 2),
        (sphere(Vec3::new(0.8, 2.5, 0.6), 0.35), 3),
    ];
    let mirror = Material::Mirror { reflectance: firstlight::render::ColorInput::Constant(Vec3::splat(0.9)) };
    let materials = vec![
        diffuse(0.7),
        Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 },
        mirror,
        emissive(20.0),
    ];
    for lens_radius in [0.0, 0.25] {
        let scene = scene(shapes.clone(), materials.clone(), Environment::Black, parallel(2.4, lens_radius));
        assert!(scene.features().caustics);
        let all = means(&scene, Techniques::ALL, 16, true);
        let scalar = means(&scene, Techniques::ALL, 16, false);
        let plain = means(&scene, Techniques { caustics: false, ..Techniques::ALL }, 256, true);
        let ((a, va), (b, vb), (c, vc)) = (spread(&all), spread(&plain), spread(&scalar));
        let t = (a - b) / (va + vb).sqrt();
        assert!(t.abs() < 4.0 && (va + vb).sqrt() < 0.03 * b, "{a} and {b}, t {t}, lens {lens_radius}");
        // The same random numbers: sixteen at a time differ in rounding alone.
        assert!((a - c).abs() < 0.2 * (va + vc).sqrt(), "{a} and {c}, lens {lens_radius}");
    }
}

/// Of renders with seeds of their own.
fn means(scene: &Prepared, techniques: Techniques, spp: u32, simd: bool) -> Vec<f64> {
    let settings = RenderSettings { techniques, ..RenderSettings::default() };
    let render = |seed: u32| {
        let settings = RenderSettings { seed, simd: settings.simd.filter(|_| simd), ..settings };
        let mut film = Film::new(24, 18);
        assert!(advance(scene, &settings, &mut film, spp, &|| false).completed);
        picture_mean(&film).0
    };
    (0..16).map(render).collect()
}

/// Their mean, and its variance.
fn spread(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
}
