//! Scenes with an answer on paper.

use crate::common::*;
use firstlight::render::{ColorInput, Environment, Fresnel, Material, RenderSettings, ScalarInput, replay_sample};
use glam::{UVec2, Vec3};

fn settings(seed: u32) -> RenderSettings {
    RenderSettings { seed, ..RenderSettings::default() }
}

/// Irradiance at a floor point from a sphere overhead is π L (r/d)² cos θ while all of it is above the horizon, so the
/// floor shows albedo · L · (r/d)² cos θ. The values of the 2013 system's check: 0.444, 0.318, 0.0605.
#[test]
fn floor_under_a_ball_light_has_its_closed_form() {
    let (height, radius, radiance, albedo) = (12.0_f64, 4.0_f64, 8.0_f64, 0.5_f64);
    for (x, expected_2013) in [(0.0, 0.4444), (6.0, 0.3177), (20.0, 0.0605)] {
        let scene = scene(
            vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(0.0, height as f32, 0.0), radius as f32), 1)],
            vec![diffuse(albedo as f32), emissive(radiance as f32)],
            Environment::Black,
            camera(Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 0.0), 0.01),
        );
        let (film, _) = render(&scene, &settings(1), 8, 8, 64);
        let d2 = f64::from(x * x) + height * height;
        let expected = albedo * radiance * radius * radius / d2 * height / d2.sqrt();
        let (mean, _) = picture_mean(&film);
        assert!((expected - expected_2013).abs() < 1e-3 && (mean / expected - 1.0).abs() < 2e-3, "{mean} {expected}");
    }
}

/// An infinite plane has no area to choose points from: bounces alone must find it.
#[test]
fn floor_under_a_glowing_ceiling_shows_its_albedo() {
    let scene = scene(
        vec![(plane(Vec3::ZERO, Vec3::Y), 0), (plane(Vec3::Y * 3.0, Vec3::NEG_Y), 1)],
        vec![diffuse(0.4), emissive(2.5)],
        Environment::Black,
        camera(Vec3::Y, Vec3::new(0.3, 0.0, 0.1), 40.0),
    );
    let (film, _) = render(&scene, &settings(2), 16, 16, 64);
    let (mean, _) = picture_mean(&film);
    assert!((mean - 1.0).abs() < 1e-3, "{mean}");
}

/// A surface that loses nothing cannot be seen in an evenly bright world.
#[test]
fn white_furnace_returns_exactly_what_falls_in() {
    let materials = [
        ("diffuse", diffuse(1.0)),
        ("mirror", Material::Mirror { reflectance: ColorInput::Constant(Vec3::ONE) }),
        ("glass", Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 }),
        ("glass of index 1", Material::Glass { ior: 1.0, absorption: Vec3::ZERO, dispersion: 0.0 }),
    ];
    for (name, material) in materials {
        let scene = scene(
            vec![(sphere(Vec3::ZERO, 1.0), 0)],
            vec![material],
            Environment::Constant(Vec3::ONE),
            camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 40.0),
        );
        let (film, _) = render(&scene, &settings(3), 24, 24, 64);
        for mean in film.means() {
            assert!((mean.y - 1.0).abs() < 1e-4, "{name}: a pixel of {mean}");
        }
    }
}

#[test]
fn rough_metal_in_the_furnace_loses_light_or_has_it_back() {
    for (compensate, low, high) in [(false, 0.4, 0.6), (true, 0.97, 1.03)] {
        let metal = Material::Metal {
            alpha: ScalarInput::Constant(0.8),
            reflectance: ColorInput::Constant(Vec3::ONE),
            fresnel: Fresnel::Constant,
            compensate,
        };
        let scene = scene(
            vec![(sphere(Vec3::ZERO, 1.0), 0)],
            vec![metal],
            Environment::Constant(Vec3::ONE),
            camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 20.0),
        );
        let (film, _) = render(&scene, &settings(3), 16, 16, 256);
        let (mean, _) = picture_mean(&film);
        assert!((low..high).contains(&mean), "compensation {compensate}: {mean}");
    }
}

/// Walls that emit Lₑ and reflect ρ of what falls on them: the series of bounces sums to Lₑ / (1 − ρ), anywhere.
#[test]
fn inside_a_glowing_grey_room() {
    let (albedo, emitted) = (0.6_f32, 0.5_f32);
    // A blend has (1 − w) of the albedo of one part and w of the emission of the other.
    let materials = vec![
        diffuse(1.0),
        emissive(emitted / (1.0 - albedo)),
        Material::blend(ScalarInput::Constant(1.0 - albedo), 0, 1),
    ];
    let s = 2.0;
    let walls = |material| {
        vec![
            (quad(Vec3::new(0.0, 0.0, s), Vec3::X * s, Vec3::Z * -s), material),
            (quad(Vec3::new(0.0, s, 0.0), Vec3::X * s, Vec3::Z * s), material),
            (quad(Vec3::new(0.0, 0.0, 0.0), Vec3::X * s, Vec3::Y * s), material),
            (quad(Vec3::new(s, 0.0, s), Vec3::X * -s, Vec3::Y * s), material),
            (quad(Vec3::new(0.0, 0.0, s), Vec3::Z * -s, Vec3::Y * s), material),
            (quad(Vec3::new(s, 0.0, 0.0), Vec3::Z * s, Vec3::Y * s), material),
        ]
    };
    let eye = camera(Vec3::new(0.4, 0.5, 0.6), Vec3::new(2.0, 1.3, 1.1), 70.0);
    let room = scene(walls(2), materials, Environment::Black, eye);
    let (film, _) = render(&room, &settings(4), 16, 16, 256);
    let (mean, standard_error) = picture_mean(&film);
    let expected = f64::from(emitted / (1.0 - albedo));
    assert!(standard_error < 0.01 * expected, "{standard_error}");
    assert!((mean - expected).abs() < 4.0 * standard_error, "{mean} ± {standard_error} for {expected}");
}

/// Up between two mirrors to a glowing ceiling: each reflection takes its tenth, and roulette must not bend the mean.
#[test]
fn a_corridor_of_mirrors_dims_by_the_reflectance_each_time() {
    let reflectance = 0.9_f32;
    let scene = scene(
        vec![
            (plane(Vec3::Z * 2.0, Vec3::NEG_Z), 0),
            (plane(Vec3::Z * -2.0, Vec3::Z), 0),
            (plane(Vec3::Y * 100.0, Vec3::NEG_Y), 1),
        ],
        vec![Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(reflectance)) }, emissive(1.0)],
        Environment::Black,
        camera(Vec3::ZERO, Vec3::new(0.0, 1.0, 1.0), 0.01),
    );
    // 45° upwards: from the middle to a mirror 2 m away is 2 m up, then 4 m up a bounce: (100 − 2) / 4 = 24.5, so the
    // 25th reflection happens at 2 + 24 · 4 = 98 m and the ceiling follows.
    let (film, _) = render(&scene, &settings(5), 4, 4, 4096);
    let expected = f64::from(reflectance).powi(25);
    let (mean, standard_error) = picture_mean(&film);
    assert!((mean - expected).abs() < 4.0 * standard_error + 1e-4, "{mean} ± {standard_error} for {expected}");
}

#[test]
fn absorption_follows_beer_and_lambert() {
    // Straight through the middle of a sphere of index 1: only absorption is left.
    let scene = scene(
        vec![(sphere(Vec3::ZERO, 1.0), 0)],
        vec![Material::Glass { ior: 1.0, absorption: Vec3::new(0.2, 0.5, 0.0), dispersion: 0.0 }],
        Environment::Constant(Vec3::ONE),
        camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.01),
    );
    let (film, _) = render(&scene, &settings(6), 4, 4, 4);
    let expected = Vec3::new((-0.4_f32).exp(), (-1.0_f32).exp(), 1.0);
    assert!((film.mean(1, 1) - expected).length() < 1e-3, "{}", film.mean(1, 1));
}

#[test]
fn lights_on_both_sides_of_every_decision_agree() {
    // A dome of quad lights found by light sampling and bounces together, against a sky of the same radiance, which
    // bounces find alone.
    let floor = |material: Material, sky: bool| {
        let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0)];
        let mut environment = Environment::Black;
        if sky {
            environment = Environment::Constant(Vec3::splat(2.0));
        } else {
            // A dome of five quads around everything: what the sky is, as lights.
            let s = 50.0;
            shapes.extend([
                (quad(Vec3::new(-s, s, -s), Vec3::X * 2.0 * s, Vec3::Z * 2.0 * s), 1),
                (quad(Vec3::new(-s, 0.0, -s), Vec3::X * 2.0 * s, Vec3::Y * s), 1),
                (quad(Vec3::new(-s, 0.0, s), Vec3::Y * s, Vec3::X * 2.0 * s), 1),
                (quad(Vec3::new(-s, 0.0, -s), Vec3::Y * s, Vec3::Z * 2.0 * s), 1),
                (quad(Vec3::new(s, 0.0, -s), Vec3::Z * 2.0 * s, Vec3::Y * s), 1),
            ]);
        }
        scene(shapes, vec![material, emissive(2.0)], environment, camera(Vec3::new(0.0, 2.0, 3.0), Vec3::ZERO, 20.0))
    };
    let metal = Material::Metal {
        alpha: ScalarInput::Constant(0.3),
        reflectance: ColorInput::Constant(Vec3::splat(0.8)),
        fresnel: Fresnel::Constant,
        compensate: false,
    };
    for material in [diffuse(0.5), metal] {
        let (by_lights, error_a) = picture_mean(&render(&floor(material.clone(), false), &settings(7), 16, 16, 256).0);
        let (by_bounces, error_b) = picture_mean(&render(&floor(material, true), &settings(8), 16, 16, 256).0);
        let error = (error_a * error_a + error_b * error_b).sqrt();
        assert!((by_lights - by_bounces).abs() < 4.0 * error + 1e-3, "{by_lights} {by_bounces} ± {error}");
    }
}

#[test]
fn one_sample_can_be_replayed_alone() {
    let scene = scene(
        vec![
            (plane(Vec3::ZERO, Vec3::Y), 0),
            (sphere(Vec3::new(0.0, 1.0, 0.0), 0.5), 2),
            (sphere(Vec3::Y * 4.0, 0.5), 1),
        ],
        vec![diffuse(0.5), emissive(5.0), Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 }],
        Environment::Constant(Vec3::splat(0.1)),
        camera(Vec3::new(0.0, 1.0, 3.0), Vec3::new(0.0, 0.7, 0.0), 40.0),
    );
    let (film, _) = render(&scene, &settings(9), 16, 12, 4);
    for (x, y) in [(0, 0), (8, 6), (15, 11), (7, 7)] {
        let sum: glam::DVec3 = (0..4)
            .map(|sample| {
                let at = firstlight::render::BadSample { x, y, sample };
                replay_sample(&scene, &settings(9), UVec2::new(16, 12), at).as_dvec3()
            })
            .sum();
        assert_eq!((sum / 4.0 + film.light_traced(x, y)).as_vec3(), film.mean(x, y), "pixel {x}, {y}");
    }
}

/// Many small lights side by side are one large light, whichever of them is asked.
#[test]
fn a_light_in_pieces_shines_like_the_whole() {
    let room = |side: u32| {
        let (corner, edge) = (Vec3::new(-1.0, 2.0, -0.5), Vec3::new(2.0, 0.4, 0.0));
        let (u, v) = (edge / side as f32, Vec3::Z / side as f32);
        let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(0.4, 0.4, 0.2), 0.4), 2)];
        shapes
            .extend((0..side * side).map(|i| (quad(corner + (i % side) as f32 * u + (i / side) as f32 * v, u, v), 1)));
        let metal = Material::Metal {
            alpha: ScalarInput::Constant(0.15),
            reflectance: ColorInput::Constant(Vec3::splat(0.8)),
            fresnel: Fresnel::Constant,
            compensate: false,
        };
        let materials = vec![diffuse(0.5), emissive(5.0), metal];
        scene(shapes, materials, Environment::Black, camera(Vec3::new(0.0, 1.5, 4.0), Vec3::Y * 0.3, 50.0))
    };
    let mean = |side, seed: u32| {
        let means: Vec<f64> =
            (0..8).map(|k| picture_mean(&render(&room(side), &settings(seed + k), 20, 16, 64).0).0).collect();
        let mean = means.iter().sum::<f64>() / 8.0;
        (mean, (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 7.0 / 8.0).sqrt())
    };
    let (whole, error) = mean(1, 20);
    // One too few for the tree, and many.
    for (side, seed) in [(4, 30), (20, 40)] {
        let (found, other) = mean(side, seed);
        let t = (found - whole) / error.hypot(other);
        assert!(t.abs() < 4.5, "{} pieces: {found} ± {other} for {whole} ± {error}", side * side);
        assert!(other < 0.01 * whole, "with noise like this nothing is seen: {other}");
    }
}
