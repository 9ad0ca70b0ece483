//! The classic model against what can be worked out on paper, and against the path tracer where both must agree.

use crate::common::{camera, diffuse, emissive, picture_mean, plane, quad, render, scene, sphere};
use firstlight::kdtree::Shape;
use firstlight::render::{
    ColorInput, Environment, Film, Fresnel, Geometry, ImageTexture, Integrator, Material, Object, Prepared,
    RenderSettings, ScalarInput, Shading, Snapshot, advance,
};
use glam::Vec3;
use std::f32::consts::PI;
use std::sync::{Arc, LazyLock};

static PHONG: LazyLock<RenderSettings> =
    LazyLock::new(|| RenderSettings { integrator: Integrator::Phong, ..RenderSettings::default() });

/// Without ambient light, to compare with what can be worked out.
fn matte(albedo: f32) -> Material {
    phong(albedo, 0.0, 0.0)
}

fn phong(diffuse: f32, specular: f32, transparency: f32) -> Material {
    Material::Phong {
        diffuse: ColorInput::Constant(Vec3::splat(diffuse)),
        ambient: 0.0,
        specular: ScalarInput::Constant(specular),
        shininess: 20.0,
        transparency,
        ior: 1.5,
        absorption: Vec3::ZERO,
    }
}

/// Like [`scene`], with all glowing spheres as point lights.
fn point_lit(shapes: Vec<(Shape, u32)>, materials: Vec<Material>, eye: Vec3, look_at: Vec3) -> Prepared {
    let is_light = |shape: &Shape, m: u32| {
        matches!(shape, Shape::Sphere { .. }) && matches!(materials[m as usize], Material::Emissive { .. })
    };
    let (shapes, objects) = shapes
        .into_iter()
        .map(|(shape, m)| {
            let is_point_light = is_light(&shape, m);
            (shape, Object { is_point_light, ..Object::plain(m) })
        })
        .unzip();
    let geometry = Geometry::build(shapes, objects);
    let shading = Shading::new(materials, Vec::new(), Environment::Black);
    Prepared::new(Snapshot::new(geometry, shading, camera(eye, look_at, 1e-3)))
}

/// A sphere of radiant intensity 1 in every direction.
const POINT: f32 = 0.01;

fn unit_point() -> Material {
    emissive(1.0 / (PI * POINT * POINT))
}

#[test]
fn a_point_light_shines_by_the_inverse_square_and_the_cosine() {
    for (x, height) in [(0.0, 3.0), (2.0, 3.0), (5.0, 1.0)] {
        let light = sphere(Vec3::new(0.0, height, 0.0), POINT);
        let floor = plane(Vec3::ZERO, Vec3::Y);
        let target = Vec3::new(x, 0.0, 0.0);
        let scene = point_lit(
            vec![(floor, 0), (light, 1)],
            vec![matte(0.5), unit_point()],
            target + Vec3::new(1.0, 2.0, 0.5),
            target,
        );
        let (film, report) = render(&scene, &PHONG, 1, 1, 1);
        let distance2 = x * x + height * height;
        let expected = 0.5 / PI * height / distance2.sqrt() / distance2;
        let found = film.mean(0, 0).x;
        assert!((found / expected - 1.0).abs() < 1e-4, "at {x}, {height}: {found} for {expected}");
        assert_eq!(report.rays.shadow, 1);
    }
}

#[test]
fn point_lights_within_the_scene_cast_hard_shadows() {
    // The light is inside the box of all objects: the program that came before lost such shadows.
    let shapes = vec![
        (quad(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::Z * -18.0), 0),
        (sphere(Vec3::Y, 0.5), 0),
        (sphere(Vec3::Y * 2.0, POINT), 1),
        (sphere(Vec3::Y * 9.0, 0.1), 0),
    ];
    // The sphere of radius 1/2 seen from one metre above it covers the floor up to 2 · tan(asin(1/2)) = 1.1547 m.
    for (x, lit) in [(0.3, false), (1.15, false), (1.16, true), (3.0, true)] {
        let target = Vec3::new(x, 0.0, 0.0);
        let scene =
            point_lit(shapes.clone(), vec![matte(0.5), unit_point()], target + Vec3::new(2.0, 0.6, 1.0), target);
        let (film, _) = render(&scene, &PHONG, 1, 1, 1);
        assert_eq!(film.mean(0, 0).x > 0.0, lit, "at {x}");
    }
}

#[test]
fn floor_under_a_ball_light_is_as_bright_as_the_formula_says() {
    // Centre 12 m up, radius 4 m, radiance 8, albedo 1/2: albedo · L · (r / d)² · cos.
    for x in [0.0_f32, 6.0, 20.0] {
        let target = Vec3::new(x, 0.0, 0.0);
        let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::Y * 12.0, 4.0), 1)];
        let view = camera(target + Vec3::new(0.0, 1.0, 0.1), target, 1e-3);
        let scene = scene(shapes, vec![matte(0.5), emissive(8.0)], Environment::Black, view);
        let (film, _) = render(&scene, &PHONG, 4, 4, 64);
        let distance = (144.0 + x * x).sqrt();
        let expected = f64::from(0.5 * 8.0 * 16.0 / distance.powi(2) * 12.0 / distance);
        let (found, _) = picture_mean(&film);
        assert!((found / expected - 1.0).abs() < 2e-3, "at {x}: {found} for {expected}");
    }
}

#[test]
fn direct_light_and_soft_shadows_agree_with_the_path_tracer() {
    let shapes = || {
        vec![
            (plane(Vec3::ZERO, Vec3::Y), 0),
            (sphere(Vec3::new(0.0, 1.0, 0.0), 0.7), 0),
            (quad(Vec3::new(-1.0, 4.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), 1),
            (sphere(Vec3::new(3.0, 3.0, 1.0), 0.6), 1),
        ]
    };
    let view = camera(Vec3::new(0.0, 3.0, 6.0), Vec3::new(0.0, 0.5, 0.0), 45.0);
    let build = |material| scene(shapes(), vec![material, emissive(5.0)], Environment::Black, view);
    let (classic, _) = render(&build(matte(0.6)), &PHONG, 24, 16, 256);
    let path = RenderSettings { max_depth: 2, seed: 1, ..RenderSettings::default() };
    let (truth, _) = render(&build(diffuse(0.6)), &path, 24, 16, 512);
    let difference: f32 = classic.means().iter().zip(truth.means()).map(|(a, b)| (a.x - b.x).powi(2)).sum();
    let rms = (difference / (24.0 * 16.0)).sqrt();
    let (mean, _) = picture_mean(&truth);
    assert!(f64::from(rms) < 0.02 * mean, "rms {rms}, mean {mean}");
    let (a, b) = (picture_mean(&classic).0, mean);
    assert!((a / b - 1.0).abs() < 4e-3, "{a} for {b}");
}

#[test]
fn a_white_furnace_stays_white() {
    let metal = Material::Metal {
        alpha: ScalarInput::Constant(0.2),
        reflectance: ColorInput::Constant(Vec3::ONE),
        fresnel: Fresnel::Constant,
        compensate: false,
    };
    let mirror = Material::Mirror { reflectance: ColorInput::Constant(Vec3::ONE) };
    let glass = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };
    let view = camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 28.0);
    let even = Environment::Constant(Vec3::ONE);
    let materials = [
        ("mirror", mirror, 1e-5),
        ("metal", metal.clone(), 1e-5),
        // What is left to chance is what counts for less than a sixty-fourth.
        ("glass", glass, 2e-3),
        ("matte", diffuse(1.0), 1e-3),
        ("clear phong", phong(1.0, 0.3, 0.6), 0.5),
    ];
    for (name, material, bound) in materials {
        let scene = scene(vec![(sphere(Vec3::ZERO, 0.9), 0)], vec![material], even.clone(), view);
        let (film, _) = render(&scene, &PHONG, 16, 16, 64);
        let (mean, _) = picture_mean(&film);
        // The diffuse part of the last one gives back no ambient light: it may only lose.
        assert!(mean < 1.0 + 2e-3 && mean > 1.0 - bound, "{name}: {mean}");
    }
    // Surroundings that are sampled: all of a metal's light comes by its highlight.
    let (width, height) = (16, 8);
    let image = ImageTexture::from_linear(width, height, vec![Vec3::ONE; (width * height) as usize]);
    let picture = Environment::Image { image: Arc::new(image), scale: Vec3::ONE, rotation: 0.0 };
    let ahead = camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 2.0);
    let scene = scene(vec![(sphere(Vec3::ZERO, 0.9), 0)], vec![metal], picture, ahead);
    let (film, _) = render(&scene, &PHONG, 16, 16, 256);
    let (mean, error) = picture_mean(&film);
    assert!((mean - 1.0).abs() < 0.01 + 4.0 * error, "highlight: {mean} ± {error}");
}

/// A highlight narrower than the light in it was found by chance alone: most samples were black, and a few very bright.
/// Each surface splits a ray in two; the rays of a sample stay a number that does not grow with the surfaces.
#[test]
fn fifty_shells_of_glass_do_not_multiply_the_rays() {
    let shells = (0..50).map(|i| (sphere(Vec3::ZERO, 1.0 - 0.019 * i as f32), i % 2)).collect();
    let materials = [1.5, 1.0].map(|ior| Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 }).into();
    let view = camera(Vec3::new(0.0, 0.4, 4.0), Vec3::ZERO, 30.0);
    let scene = scene(shells, materials, Environment::Constant(Vec3::ONE), view);
    let settings = RenderSettings { integrator: Integrator::Phong, ..RenderSettings::default() };
    let (film, report) = render(&scene, &settings, 24, 24, 16);
    let per_sample = report.rays.total() / report.rays.camera;
    let (mean, error) = picture_mean(&film);
    println!("{per_sample} rays a sample, mean {mean} ± {error}");
    assert!(per_sample < 4000, "{per_sample} rays a sample");
    assert!((mean - 1.0).abs() < 5.0 * error && error < 0.05, "{mean} ± {error}");
}

#[test]
fn polished_metal_shows_a_large_light_without_speckles() {
    let metal = |alpha: f32| Material::Metal {
        alpha: ScalarInput::Constant(alpha),
        reflectance: ColorInput::Constant(Vec3::ONE),
        fresnel: Fresnel::Constant,
        compensate: false,
    };
    // The mirror image of the light is far wider than the view and the lobe.
    let shapes = vec![
        (quad(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0), 0),
        (sphere(Vec3::new(0.0, 6.0, -6.0), 4.0), 1),
    ];
    let view = camera(Vec3::new(0.0, 2.0, 2.0), Vec3::ZERO, 4.0);
    for alpha in [0.005, 0.02, 0.05] {
        let scene = scene(shapes.clone(), vec![metal(alpha), emissive(3.0)], Environment::Black, view);
        let (film, _) = render(&scene, &PHONG, 12, 12, 4);
        // What one way brings where the other is as good is half of the light at most.
        let off: Vec<f32> = film.means().iter().map(|found| (found.x / 3.0 - 1.0).abs()).collect();
        let rms = (off.iter().map(|off| off * off).sum::<f32>() / off.len() as f32).sqrt();
        let most = off.iter().copied().fold(0.0, f32::max);
        assert!(rms < 0.1 && most <= 0.5, "alpha {alpha}: rms {rms}, most {most}");
    }
    // Dull metal reaches beyond the light's rim: both ways of finding it agree with much of one of them.
    let dull = |lamps: usize| {
        let mut shapes = shapes.clone();
        // So many lights that one of them is asked at a time.
        shapes.extend((1..lamps).map(|i| (sphere(Vec3::new(40.0 + i as f32, 0.2, 0.0), 0.1), 1)));
        let scene = scene(shapes, vec![metal(0.3), emissive(3.0)], Environment::Black, view);
        picture_mean(&render(&scene, &PHONG, 8, 8, 1024).0)
    };
    let ((one, error), (many, error_many)) = (dull(1), dull(20));
    assert!((one - many).abs() < 4.0 * error.hypot(error_many) + 1e-3, "{one} ± {error}, {many} ± {error_many}");
    // ∫ over the light of (n + 1) / 2π · cosⁿ, with n = (1 / 0.09 − 1) / 2, about its centre's direction.
    let n = 0.5 / 0.09 - 0.5;
    let cos_rim = (1.0 - 16.0 / 72.0_f64).sqrt();
    let expected = 3.0 * (1.0 - cos_rim.powf(n + 1.0));
    assert!((one / expected - 1.0).abs() < 0.02, "{one} ± {error} for {expected}");
}

fn in_air(scene: Prepared, air: Vec3) -> Prepared {
    scene.with_shading(Arc::new(Shading { air, ..(*scene.shading).clone() }))
}

#[test]
fn air_absorbs_by_distance_in_both_models() {
    let shapes = vec![(quad(Vec3::new(-50.0, -50.0, -5.0), Vec3::X * 100.0, Vec3::Y * 100.0), 0)];
    let view = camera(Vec3::ZERO, Vec3::NEG_Z, 1e-3);
    let scene = in_air(scene(shapes, vec![emissive(2.0)], Environment::Black, view), Vec3::new(0.0, 0.03, 0.3));
    for integrator in [Integrator::Path, Integrator::Phong] {
        let (film, _) = render(&scene, &RenderSettings { integrator, ..*PHONG }, 1, 1, 1);
        let expected = 2.0 * Vec3::new(1.0, (-0.15_f32).exp(), (-1.5_f32).exp());
        assert!((film.mean(0, 0) - expected).abs().max_element() < 1e-4, "{integrator:?}: {}", film.mean(0, 0));
    }
}

#[test]
fn air_dims_lights_alike_in_both_models() {
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(0.0, 5.0, 0.0), 1.0), 1)];
    let build = |material| {
        let view = camera(Vec3::new(0.0, 2.0, 3.0), Vec3::ZERO, 1e-3);
        in_air(scene(shapes.clone(), vec![material, emissive(9.0)], Environment::Black, view), Vec3::splat(0.1))
    };
    let (classic, _) = render(&build(matte(0.5)), &PHONG, 4, 4, 256);
    let (truth, _) =
        render(&build(diffuse(0.5)), &RenderSettings { max_depth: 2, ..RenderSettings::default() }, 4, 4, 1024);
    let (a, b) = (picture_mean(&classic).0, picture_mean(&truth).0);
    assert!((a / b - 1.0).abs() < 5e-3, "{a} for {b}");
}

#[test]
fn glass_dims_shadows_and_does_not_blacken_them() {
    let light = sphere(Vec3::new(0.0, 4.0, 0.0), POINT);
    let at = |absorption: f32, blocker: bool| {
        let glass = Material::Glass { ior: 1.5, absorption: Vec3::splat(absorption), dispersion: 0.0 };
        let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (light.clone(), 1)];
        if blocker {
            shapes.push((sphere(Vec3::Y * 2.0, 0.5), 2));
        }
        let scene = point_lit(shapes, vec![matte(0.5), unit_point(), glass], Vec3::new(2.0, 0.5, 0.0), Vec3::ZERO);
        render(&scene, &PHONG, 1, 1, 1).0.mean(0, 0).x
    };
    let open = at(0.0, false);
    // Straight down the axis: two surfaces that reflect 4 % each, and one metre of glass.
    assert!((at(0.0, true) / (open * 0.96 * 0.96) - 1.0).abs() < 1e-3, "{} of {open}", at(0.0, true));
    assert!((at(0.7, true) / (open * 0.96 * 0.96 * (-0.7_f32).exp()) - 1.0).abs() < 1e-3);
}

#[test]
fn an_explicit_surface_conserves_energy_as_paths_do() {
    let even = Environment::Constant(Vec3::ONE);
    let view = camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 20.0);
    let scene = scene(vec![(sphere(Vec3::ZERO, 0.9), 0)], vec![phong(1.0, 0.3, 0.6)], even, view);
    let (film, _) = render(&scene, &RenderSettings::default(), 8, 8, 256);
    let (mean, error) = picture_mean(&film);
    assert!((mean - 1.0).abs() < 1e-3 + 4.0 * error, "{mean} ± {error}");
}

#[test]
fn the_same_bits_with_any_threads_and_tiles() {
    let shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (sphere(Vec3::new(-1.0, 1.0, 0.0), 1.0), 2),
        (sphere(Vec3::new(1.2, 0.8, 0.5), 0.8), 3),
        (quad(Vec3::new(-1.0, 5.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), 1),
    ];
    let metal = Material::Metal {
        alpha: ScalarInput::Constant(0.2),
        reflectance: ColorInput::Constant(Vec3::new(0.9, 0.7, 0.4)),
        fresnel: Fresnel::Schlick,
        compensate: false,
    };
    let materials = vec![
        phong(0.6, 0.3, 0.0),
        emissive(6.0),
        Material::Glass { ior: 1.5, absorption: Vec3::ONE, dispersion: 0.0 },
        metal,
    ];
    let view = camera(Vec3::new(0.0, 2.0, 6.0), Vec3::Y * 0.8, 40.0);
    let scene = scene(shapes, materials, Environment::Constant(Vec3::splat(0.2)), view);
    let picture = |threads: usize, tile: u32, step: u32| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut film = Film::with_tile_size(50, 30, tile);
        for spp in (step..=8).step_by(step as usize) {
            assert!(pool.install(|| advance(&scene, &PHONG, &mut film, spp, &|| false)).completed);
        }
        film.means()
    };
    let first = picture(1, 32, 8);
    assert_eq!(first, picture(3, 7, 2));
    assert_eq!(first, picture(2, 64, 1));
}
