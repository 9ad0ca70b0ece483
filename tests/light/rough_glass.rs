//! Rough glass in whole pictures: one way of finding its light against another, against smooth glass, and in a furnace.

use crate::common::*;
use firstlight::kdtree::Shape;
use firstlight::render::{
    Camera, CausticPlan, ColorInput, Environment, Fresnel, Integrator, Material, Prepared, RenderSettings, ScalarInput,
    Techniques,
};
use glam::Vec3;

fn rough(alpha: f32, ior: f32) -> Material {
    Material::RoughGlass {
        alpha: ScalarInput::Constant(alpha),
        ior,
        absorption: Vec3::ZERO,
        dispersion: 0.0,
        compensate: false,
        beckmann: false,
    }
}

fn smooth(ior: f32) -> Material {
    Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 }
}

fn mirror() -> Material {
    Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(0.9)) }
}

/// A pane of six quads that face outwards.
fn pane(center: Vec3, half: Vec3, material: u32) -> Vec<(Shape, u32)> {
    let (o, x, y, z) = (center - half, 2.0 * half.x * Vec3::X, 2.0 * half.y * Vec3::Y, 2.0 * half.z * Vec3::Z);
    let faces = [(o, y, x), (o + z, x, y), (o, z, y), (o + x, y, z), (o, x, z), (o + y, z, x)];
    faces.map(|(corner, u, v)| (quad(corner, u, v), material)).into()
}

fn eye() -> Camera {
    camera(Vec3::new(0.2, 1.2, 4.0), Vec3::new(0.0, 0.6, 0.0), 35.0)
}

/// Asserts that two settings have the same mean, known to within `precision` of it.
fn assert_same_mean(name: &str, scene: &Prepared, [a, b]: [(Techniques, u32); 2], precision: f64) {
    let mean = |seed, (techniques, spp)| {
        mean_of_renders(scene, RenderSettings { seed, techniques, ..RenderSettings::default() }, (16, 12), spp, 10)
    };
    let ((found, error), (expected, other)) = (mean(1, a), mean(100, b));
    let deviation = error.hypot(other);
    println!("{name}: {found:.5} ± {error:.5} for {expected:.5} ± {other:.5}");
    assert!((found - expected).abs() < 4.5 * deviation, "{name}: {found} ± {error} for {expected} ± {other}");
    assert!(deviation < precision * expected, "{name}: too noisy to tell: {deviation} of {expected}");
}

/// A frosted pane before lights and a floor, a frosted sphere, and what else is told.
fn room(sky: f32, lamps: Vec<Shape>, alpha: f32, others: Vec<(Shape, u32)>) -> Prepared {
    let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0)];
    shapes.extend(lamps.into_iter().map(|lamp| (lamp, 1)));
    shapes.extend(pane(Vec3::new(-0.6, 0.8, 0.4), Vec3::new(0.5, 0.6, 0.05), 2));
    shapes.push((sphere(Vec3::new(0.7, 0.5, 0.2), 0.5), 3));
    shapes.extend(others);
    let blend = Material::blend(ScalarInput::Constant(0.6), 0, 2);
    let absorbing = Material::RoughGlass {
        alpha: ScalarInput::Constant(alpha),
        ior: 1.33,
        absorption: Vec3::new(0.8, 0.3, 0.1),
        dispersion: 0.0,
        compensate: true,
        beckmann: false,
    };
    let materials = vec![
        diffuse(0.6),
        emissive(6.0),
        rough(alpha, 1.5),
        absorbing,
        blend,
        mirror(),
        smooth(1.5),
        rough(alpha, 1.2),
    ];
    scene(
        shapes,
        materials,
        if sky > 0.0 { Environment::Constant(Vec3::splat(sky)) } else { Environment::Black },
        eye(),
    )
}

fn large_light() -> Vec<Shape> {
    vec![sphere(Vec3::new(-0.5, 1.6, -1.6), 0.7)]
}

#[test]
fn light_is_the_same_by_bounces_and_by_asking_for_it() {
    let plain = Techniques { light_sampling: false, ..Techniques::ALL };
    let several = |n: usize| -> Vec<Shape> {
        (0..n)
            .map(|i| sphere(Vec3::new(i as f32 * 2.4 / n as f32 - 1.2, 1.6 + 0.2 * (i % 3) as f32, -1.2), 0.35))
            .collect()
    };
    let in_glass = vec![(sphere(Vec3::new(0.7, 0.5, 0.2), 0.3), 7), (sphere(Vec3::new(0.1, 0.25, 1.0), 0.25), 4)];
    for (name, lamps, alpha) in [
        ("one lamp", large_light(), 0.3),
        ("one lamp, narrow lobes", large_light(), 0.02),
        ("one lamp, wide lobes", large_light(), 1.0),
        ("three lamps", several(3), 0.3),
        ("twenty lamps", several(20), 0.2),
    ] {
        let scene = room(0.1, lamps, alpha, in_glass.clone());
        assert_same_mean(name, &scene, [(Techniques::ALL, 64), (plain, 256)], 0.01);
    }
}

/// With light paths, whatever a pilot would choose.
const LIGHT_PATHS: Techniques = Techniques { caustic_plan: Some(CausticPlan::UNKNOWN), ..Techniques::ALL };

/// A light that only a mirror and a smooth sphere send light of, through rough surfaces on the way to the camera: its light is found
/// from both ends.
#[test]
fn paths_from_lights_and_from_the_eye_agree() {
    let mirror_quad = quad(Vec3::new(-1.8, 0.0, -1.0), Vec3::new(2.4, 0.0, -0.4), Vec3::new(0.0, 1.6, 0.3));
    let lamp = || vec![quad(Vec3::new(-0.4, 2.4, 1.2), Vec3::X * 0.8, Vec3::Z * 0.8)];
    let off = Techniques { caustics: false, ..Techniques::ALL };
    let cases = [
        ("a mirror behind frosted glass", room(0.0, lamp(), 0.3, vec![(mirror_quad.clone(), 5)])),
        ("the same, wide lobes", room(0.0, lamp(), 0.9, vec![(mirror_quad.clone(), 5)])),
        ("a smooth ball in a rough one", room(0.0, lamp(), 0.25, vec![(sphere(Vec3::new(0.7, 0.5, 0.2), 0.3), 6)])),
        (
            "a smooth ball, a blend and a mirror",
            room(
                0.0,
                lamp(),
                0.4,
                vec![
                    (mirror_quad, 5),
                    (sphere(Vec3::new(-0.5, 1.9, 0.8), 0.25), 6),
                    (sphere(Vec3::new(0.1, 0.25, 1.0), 0.25), 4),
                ],
            ),
        ),
    ];
    for (name, scene) in &cases {
        assert!(scene.features().caustics);
        assert_same_mean(name, scene, [(LIGHT_PATHS, 128), (off, 1024)], 0.01);
    }
}

/// A hollow of index 1 behind a rough front: light goes in through a smooth wall and out through a rough one, so that the two
/// ends must agree on n² in between.
#[test]
fn glass_with_one_smooth_side_has_the_same_light_from_both_ends() {
    let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0)];
    shapes.push((quad(Vec3::new(-0.5, 0.3, -1.6), Vec3::X, Vec3::Y), 1));
    shapes.extend(pane(Vec3::new(0.0, 0.9, 0.2), Vec3::new(0.9, 0.7, 0.3), 2));
    shapes.push((sphere(Vec3::new(0.0, 0.9, -0.2), 0.6), 3));
    let materials = vec![diffuse(0.6), emissive(8.0), rough(0.3, 1.7), smooth(1.0)];
    let scene = scene(shapes, materials, Environment::Black, eye());
    let off = Techniques { caustics: false, ..Techniques::ALL };
    assert_same_mean("smooth and rough", &scene, [(LIGHT_PATHS, 256), (off, 2048)], 0.02);
}

#[test]
fn a_little_roughness_looks_like_none() {
    let picture = |material: Material| {
        let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(-0.5, 1.6, -1.6), 0.7), 1)];
        shapes.push((sphere(Vec3::new(0.0, 0.6, 0.6), 0.6), 2));
        let scene = scene(shapes, vec![diffuse(0.6), emissive(6.0), material], Environment::Constant(Vec3::ONE), eye());
        // Without light paths: they know of smooth glass alone.
        let techniques = Techniques { caustics: false, ..Techniques::ALL };
        let settings = RenderSettings { techniques, ..RenderSettings::default() };
        render(&scene, &settings, 32, 24, 256).0.means()
    };
    let glass = picture(smooth(1.5));
    // Below the smallest width it is smooth glass, and just above it hardly differs.
    for (alpha, most) in [(0.0, 1e-6), (5e-5, 1e-6), (1.5e-4, 0.01), (1e-3, 0.015)] {
        let found = picture(rough(alpha, 1.5));
        let difference: f32 = glass.iter().zip(&found).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
        let total: f32 = glass.iter().map(|a| a.element_sum()).sum();
        println!("α {alpha}: {:.5} of the light is elsewhere", difference / total);
        assert!(difference <= most * total, "α {alpha}: {difference} of {total}");
        let brightest = |means: &[Vec3]| means.iter().map(|mean| mean.max_element()).fold(0.0, f32::max);
        assert!(brightest(&found) < 1.1 * brightest(&glass), "α {alpha}: a firefly");
    }
    // Index 1 cannot be seen, however rough.
    let (nothing, found) = (picture(smooth(1.0)), picture(rough(0.7, 1.0)));
    let farthest = nothing.iter().zip(&found).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
    assert!(farthest < 1e-6, "{farthest}");
}

#[test]
fn in_an_even_world_it_takes_light_away_and_adds_none() {
    for (alpha, ior) in [(0.01, 1.5), (0.1, 1.5), (0.3, 1.5), (0.3, 0.7), (0.3, 1.01), (1.0, 1.5), (1.0, 2.4)] {
        let mut last = f64::INFINITY;
        // A sphere, in glass, and seen from inside: there the world is n² as bright.
        for (inside, lanes) in [(false, true), (false, false), (true, true)] {
            let shapes = vec![(sphere(Vec3::ZERO, 1.0), 0), (sphere(Vec3::new(0.1, 0.0, 0.0), 0.5), 1)];
            let eye = if inside {
                camera(Vec3::new(0.0, 0.8, 0.1), Vec3::new(0.0, 0.0, 0.3), 70.0)
            } else {
                camera(Vec3::new(0.0, 0.4, 4.0), Vec3::ZERO, 30.0)
            };
            let scene = scene(shapes, vec![rough(alpha, ior), rough(0.5, 1.2)], Environment::Constant(Vec3::ONE), eye);
            let mut settings = RenderSettings::default();
            if !lanes {
                settings.simd = None;
            }
            let (film, report) = render(&scene, &settings, 16, 16, 64);
            // No sample is brighter than its world: the bound of such scenes.
            assert_eq!(report.n_above, 0, "α {alpha}, index {ior}: {:?}", report.above);
            let most = f64::from(if inside { ior * ior } else { 1.0 });
            let mean = picture_mean(&film).0 / most;
            assert!(mean <= 1.0 + 1e-5, "α {alpha}, index {ior}: {mean}");
            if !inside {
                assert!((mean - last).abs() < 0.01 || last.is_infinite(), "α {alpha}, index {ior}: {mean} and {last}");
                last = mean;
            }
            println!("α {alpha}, index {ior}, inside {inside}: {mean:.4}");
        }
    }
}

#[test]
fn compensated_it_can_hardly_be_seen_in_an_even_world() {
    for (alpha, ior) in [(0.05, 1.5), (0.3, 1.5), (0.3, 0.7), (1.0, 1.5), (0.6, 2.0)] {
        let material = Material::RoughGlass {
            alpha: ScalarInput::Constant(alpha),
            ior,
            absorption: Vec3::ZERO,
            dispersion: 0.0,
            compensate: true,
            beckmann: false,
        };
        let eye = camera(Vec3::new(0.0, 0.4, 4.0), Vec3::ZERO, 20.0);
        let scene = scene(vec![(sphere(Vec3::ZERO, 1.0), 0)], vec![material], Environment::Constant(Vec3::ONE), eye);
        let (mean, error) = picture_mean(&render(&scene, &RenderSettings::default(), 16, 16, 256).0);
        println!("α {alpha}, index {ior}: {mean:.4} ± {error:.4}");
        // Several surfaces on the way, each with the error of the table.
        assert!((mean - 1.0).abs() < 0.03 + 4.0 * error, "α {alpha}, index {ior}: {mean} ± {error}");
    }
}

#[test]
fn the_classic_model_takes_it_for_glass() {
    let picture = |material| {
        let metal = Material::Metal {
            alpha: ScalarInput::Constant(0.2),
            reflectance: ColorInput::Constant(Vec3::splat(0.8)),
            fresnel: Fresnel::Schlick,
            compensate: false,
        };
        let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(-1.5, 2.6, 0.6), 0.4), 1)];
        shapes.extend([(sphere(Vec3::new(0.0, 0.6, 0.6), 0.6), 2), (sphere(Vec3::new(0.9, 0.4, 0.0), 0.4), 3)]);
        let materials = vec![diffuse(0.6), emissive(6.0), material, metal];
        let scene = scene(shapes, materials, Environment::Constant(Vec3::splat(0.3)), eye());
        let settings = RenderSettings { integrator: Integrator::Phong, ..RenderSettings::default() };
        render(&scene, &settings, 16, 12, 16).0.means()
    };
    assert_eq!(picture(smooth(1.5)), picture(rough(0.5, 1.5)));
}
