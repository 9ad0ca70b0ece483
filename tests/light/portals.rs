//! The environment sampled through the openings of a room: the same mean, with less noise, and the same bytes however
//! one computes them.

use crate::common::*;
use firstlight::kdtree::InstructionSet;
use firstlight::render::{
    ColorInput, Environment, Film, Fresnel, ImageTexture, Material, Prepared, RenderSettings, ScalarInput, Techniques,
    advance, portal_count,
};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

const SIZE: (u32, u32) = (32, 24);

fn gradient() -> Environment {
    let (zenith, horizon, ground) = (Vec3::new(2.0, 3.0, 6.0), Vec3::splat(5.0), Vec3::splat(0.6));
    Environment::Gradient { zenith, horizon, ground }
}

/// Brighter by day on one side, with a small sun.
fn picture() -> Environment {
    let texel = |i: u32| if i == 40 { Vec3::splat(60.0) } else { Vec3::splat(1.0 + (i % 16) as f32 / 8.0) };
    let image = Arc::new(ImageTexture::from_linear(16, 8, (0..128).map(texel).collect()));
    Environment::Image { image, scale: Vec3::ONE, rotation: 0.4 }
}

/// A closed room of 4 × 2.6 × 5 m whose left wall has windows between these places, with a metal ball, a leaf, and
/// perhaps a lamp.
fn room(environment: Environment, windows: &[(f32, f32)], lamp: bool) -> Prepared {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let mut shapes = vec![
        (quad(Vec3::new(-2.0, 0.0, 3.0), 4.0 * x, -5.0 * z), 0),
        (quad(Vec3::new(-2.0, 2.6, -2.0), 4.0 * x, 5.0 * z), 0),
        (quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * x, 2.6 * y), 0),
        (quad(Vec3::new(2.0, 0.0, -2.0), 5.0 * z, 2.6 * y), 0),
        (quad(Vec3::new(-2.0, 0.0, 3.0), 2.6 * y, 4.0 * x), 0),
        (quad(Vec3::new(-2.0, 0.0, 3.0), -5.0 * z, 0.8 * y), 0),
        (quad(Vec3::new(-2.0, 2.1, 3.0), -5.0 * z, 0.5 * y), 0),
        (sphere(Vec3::new(0.6, 0.5, -0.6), 0.5), 2),
        (quad(Vec3::new(-0.9, 0.3, -0.9), 0.6 * x + 0.2 * z, 0.7 * y), 3),
    ];
    let mut from = -2.0;
    for &(start, end) in windows.iter().chain([&(3.0, 3.0)]) {
        shapes.push((quad(Vec3::new(-2.0, 0.8, start), (from - start) * z, 1.3 * y), 0));
        from = end;
    }
    if lamp {
        shapes.push((sphere(Vec3::new(1.1, 1.9, -1.3), 0.08), 1));
    }
    let color = |r, g, b| ColorInput::Constant(Vec3::new(r, g, b));
    let metal = Material::Metal {
        alpha: ScalarInput::Constant(0.3),
        reflectance: color(0.9, 0.7, 0.4),
        fresnel: Fresnel::Constant,
        compensate: false,
    };
    let leaf = Material::Translucent { reflectance: color(0.3, 0.5, 0.2), transmittance: color(0.3, 0.4, 0.1) };
    scene(
        shapes,
        vec![diffuse(0.8), emissive(40.0), metal, leaf],
        environment,
        camera(Vec3::new(1.6, 1.5, 2.6), Vec3::new(-0.2, 0.9, -0.5), 45.0),
    )
}

const WINDOW: &[(f32, f32)] = &[(-1.0, 0.4)];
const WINDOWS: &[(f32, f32)] = &[(-1.5, -0.7), (0.5, 1.2)];

/// Mean level of an image and its standard error, and the mean variance of a pixel relative to that level.
fn measure(scene: &Prepared, techniques: Techniques, simd: bool) -> (f64, f64, f64) {
    const RENDERS: u32 = 32;
    let images: Vec<Vec<f64>> = (0..RENDERS)
        .into_par_iter()
        .map(|seed| {
            let mut settings = RenderSettings { seed, techniques, ..RenderSettings::default() };
            settings.simd = settings.simd.filter(|_| simd);
            let mut film = Film::new(SIZE.0, SIZE.1);
            assert!(advance(scene, &settings, &mut film, 16, &|| false).completed);
            film.means().iter().map(|mean| mean.as_dvec3().element_sum() / 3.0).collect()
        })
        .collect();
    let levels: Vec<f64> = images.iter().map(|image| image.iter().sum::<f64>() / image.len() as f64).collect();
    let (level, error) = mean_of(&levels);
    let n = images[0].len();
    let variance = |i: usize| {
        let (_, error) = mean_of(&images.iter().map(|image| image[i]).collect::<Vec<_>>());
        error * error * f64::from(RENDERS)
    };
    (level, error, (0..n).map(variance).sum::<f64>() / n as f64 / (level * level))
}

#[test]
fn portals_keep_the_mean_and_lower_the_noise() {
    let without = Techniques { portals: false, ..Techniques::ALL };
    for (name, scene, n, gain) in [
        ("window", room(gradient(), WINDOW, false), 1..=1, 5.0),
        ("window and lamp", room(gradient(), WINDOW, true), 1..=1, 1.4),
        ("windows", room(gradient(), WINDOWS, true), 2..=3, 1.3),
        ("picture", room(picture(), WINDOW, false), 1..=1, 3.0),
        ("picture and lamp", room(picture(), WINDOW, true), 1..=1, 1.3),
    ] {
        let found = portal_count(&scene, &RenderSettings::default());
        assert!(n.contains(&found), "{name}: {found} portals");
        let (level, error, noise) = measure(&scene, without, true);
        for simd in [true, false] {
            let (with, of_with, less) = measure(&scene, Techniques::ALL, simd);
            println!("{name}: {level:.4} ± {error:.4}, {with:.4} ± {of_with:.4}; noise {noise:.4}, {less:.4}");
            assert!((with - level).abs() < 4.0 * error.hypot(of_with), "{name}: {level} ± {error}, {with} ± {of_with}");
            assert!(less * gain < noise, "{name}: {noise} to {less}");
        }
    }
}

#[test]
fn open_scenes_and_closed_rooms_have_none() {
    let settings = RenderSettings::default();
    for (scene, name) in [
        (room(gradient(), &[], true), "closed"),
        (room(Environment::Black, WINDOW, true), "dark"),
        (crate::determinism::busy_scene(), "open"),
    ] {
        assert_eq!(portal_count(&scene, &settings), 0, "{name}");
    }
    let off = Techniques { portals: false, ..Techniques::ALL };
    let scene = room(gradient(), WINDOW, false);
    assert_eq!(portal_count(&scene, &RenderSettings { techniques: off, ..settings }), 0);
    // From outside of it, most of what is seen is under the open sky: little is seen through the window.
    let outside = scene.with_camera(camera(Vec3::new(-9.0, 1.5, 0.5), Vec3::new(-2.0, 1.3, 0.5), 45.0));
    assert_eq!(portal_count(&outside, &settings), 0);
}

#[test]
fn films_do_not_depend_on_what_was_rendered_before() {
    let bytes = |scene: &Prepared, settings: &RenderSettings| {
        let mut film = Film::new(SIZE.0, SIZE.1);
        assert!(advance(scene, settings, &mut film, 4, &|| false).completed);
        film.means().to_vec()
    };
    let settings = RenderSettings::default();
    let fresh = bytes(&room(gradient(), WINDOWS, true), &settings);
    let from_elsewhere = room(gradient(), WINDOWS, true).with_camera(camera(Vec3::new(1.0, 1.2, 0.0), Vec3::Y, 60.0));
    bytes(&from_elsewhere, &settings);
    let back = from_elsewhere.with_camera(room(gradient(), WINDOWS, true).camera);
    let mut preview = Film::new(SIZE.0, SIZE.1);
    preview.set_preview(true);
    assert!(advance(&back, &settings, &mut preview, 1, &|| false).completed);
    assert_eq!(bytes(&back, &settings), fresh);
    for set in InstructionSet::available() {
        assert_eq!(bytes(&back, &RenderSettings { simd: Some(set), ..settings }), fresh, "{set:?}");
    }
}
