//! Lights without size: closed forms on a floor, hard shadows, choice among many, what glass and mirrors gather.

use crate::common::*;
use firstlight::kdtree::Shape;
use firstlight::render::{
    ColorInput, Cone, DeltaLight, Encoding, Environment, Falloff, Film, Fresnel, ImageTexture, Integrator, LightImage,
    Material, Prepared, RenderSettings, ScalarInput, Shading, Techniques, Texture, TexturePattern, Wrap, advance,
};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;

const GLASS: Material = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };

fn point(position: Vec3, intensity: f32) -> DeltaLight {
    DeltaLight::Point { position, intensity: Vec3::splat(intensity) }
}

fn spot(position: Vec3, towards: Vec3, intensity: f32, inner_deg: f64, outer_deg: f64) -> DeltaLight {
    let cone =
        Cone::new((towards - position).normalize(), inner_deg.to_radians(), outer_deg.to_radians(), Falloff::Quadratic);
    DeltaLight::Spot { position, intensity: Vec3::splat(intensity), cone, image: None }
}

fn directional(direction: Vec3, irradiance: f32) -> DeltaLight {
    DeltaLight::Directional { direction: direction.normalize(), irradiance: Vec3::splat(irradiance) }
}

fn matte(albedo: f32) -> Material {
    Material::Phong {
        diffuse: ColorInput::Constant(Vec3::splat(albedo)),
        ambient: 0.0,
        specular: ScalarInput::Constant(0.0),
        shininess: 20.0,
        transparency: 0.0,
        ior: 1.5,
        absorption: Vec3::ZERO,
    }
}

/// The one pixel of a picture of a point of some scene, from one sample.
fn seen(shapes: &[(Shape, u32)], materials: &[Material], light: &DeltaLight, target: Vec3, air: f32) -> [f32; 4] {
    let eye = camera(target + Vec3::new(0.6, 0.8, 0.0), target, 1e-3);
    let scene = scene(shapes.to_vec(), materials.to_vec(), Environment::Black, eye);
    let (air, delta_lights, textures) = (Vec3::splat(air), vec![*light], vec![slide()]);
    let shading = Shading { air, delta_lights, textures, ..(*scene.shading).clone() };
    let scene = scene.with_shading(Arc::new(shading));
    let usual = RenderSettings { max_depth: 2, ..RenderSettings::default() };
    let one_by_one = RenderSettings { simd: None, ..usual };
    [Integrator::Path, Integrator::Phong]
        .map(|integrator| [usual, one_by_one].map(|settings| RenderSettings { integrator, ..settings }))
        .as_flattened()
        .iter()
        .map(|settings| render(&scene, settings, 1, 1, 1).0.mean(0, 0).x)
        .collect::<Vec<_>>()
        .try_into()
        .unwrap()
}

/// Two columns and two rows of texels with sharp edges.
fn slide() -> Texture {
    let image = ImageTexture::from_linear(2, 2, [1.0, 2.0, 3.0, 4.0].map(Vec3::splat).to_vec());
    let (encoding, wrap) = (Encoding::Auto, [Wrap::Repeat; 2]);
    Texture::new(TexturePattern::Image { image: Arc::new(image), encoding, wrap, smooth: false })
}

#[test]
fn a_spot_projects_its_image_upright() {
    let floor = [(plane(Vec3::ZERO, Vec3::Y), 0)];
    let height = 2.0;
    // It shines down, with −Z upwards in the image, so that +X is to the right. The image covers 6 m × 4 m of the floor.
    let axes = [Vec3::X, Vec3::NEG_Z, Vec3::NEG_Y];
    let cone = Cone::new(Vec3::NEG_Y, 1.5, 1.5, Falloff::Quadratic);
    let light = |even, texture| DeltaLight::Spot {
        position: Vec3::new(0.0, height, 0.0),
        intensity: Vec3::splat(7.0),
        cone,
        image: Some(LightImage { texture, axes, half: Vec2::new(1.5, 1.0), even }),
    };
    for (materials, n_models) in [([diffuse(0.5)], 1), ([matte(0.5)], 2)] {
        for (x, z, texel) in [
            (-0.1, -0.1, 1.0),
            (2.9, -1.9, 2.0),
            (-2.9, 1.9, 3.0),
            (0.2, 1.3, 4.0),
            (3.1, 0.0, 0.0),
            (0.0, 2.1, 0.0),
            (-4.0, -4.0, 0.0),
        ] {
            let target = Vec3::new(x, 0.0, z);
            let distance2 = x * x + z * z + height * height;
            let cos = height / distance2.sqrt();
            for even in [false, true] {
                let falloff = if even { cos.powi(-3) } else { 1.0 };
                let expected = 7.0 * falloff * 0.5 / PI * cos / distance2;
                let what = format!("{x} {z} {even}");
                let found = seen(&floor, &materials, &light(even, Some(0)), target, 0.0);
                assert_close(&found[..2 * n_models], texel * expected, &what);
                let found = seen(&floor, &materials, &light(even, None), target, 0.0);
                assert_close(&found[..2 * n_models], if texel > 0.0 { expected } else { 0.0 }, &what);
            }
        }
    }
}

#[track_caller]
fn assert_close(found: &[f32], expected: f32, what: &str) {
    let close = found.iter().all(|found| (found - expected).abs() <= 1e-4 * expected);
    assert!(close, "{what}: {found:?} for {expected}");
}

#[test]
fn a_floor_is_as_bright_as_the_formulas_say() {
    let floor = [(plane(Vec3::ZERO, Vec3::Y), 0)];
    // The classic model adds ambient light to what is diffuse.
    for (materials, n_models) in [([diffuse(0.5)], 1), ([matte(0.5)], 2)] {
        let seen =
            |light: &DeltaLight, target, air| seen(&floor, &materials, light, target, air)[..2 * n_models].to_vec();
        for (x, height) in [(0.0, 3.0), (2.0, 3.0), (5.0, 1.0), (1.0, 0.02), (300.0, 4000.0)] {
            let (target, at) = (Vec3::new(x, 0.0, 0.0), Vec3::new(0.0, height, 0.0));
            let distance2 = x * x + height * height;
            let expected = 7.0 * 0.5 / PI * height / distance2.sqrt() / distance2;
            let what = format!("at {x}, {height}");
            assert_close(&seen(&point(at, 7.0), target, 0.0), expected, &what);
            // Half a metre of air to the camera is absorbed as well; the camera is 1 m away.
            let through_air = expected * (-0.1 * (1.0 + distance2.sqrt())).exp();
            if x < 100.0 {
                assert_close(&seen(&point(at, 7.0), target, 0.1), through_air, &what);
            }
            // A spot that shines straight down.
            for (inner, outer) in [(0.0, 45.0), (20.0, 40.0), (70.0, 90.0), (30.0, 30.0)] {
                let cosine = |deg: f64| deg.to_radians().cos();
                let cos = f64::from(height) / f64::from(distance2).sqrt();
                let t = ((cos - cosine(outer)) / (cosine(inner) - cosine(outer)).max(1e-12)).clamp(0.0, 1.0) as f32;
                let light = spot(at, Vec3::ZERO, 7.0, inner, outer);
                let found = seen(&light, target, 0.0);
                assert!(
                    found.iter().all(|found| (found - expected * t * t).abs() <= 1e-4 * expected),
                    "spot {inner} {outer} {what}: {found:?} for {}",
                    expected * t * t
                );
            }
            let direction = Vec3::new(x, -height, 0.0);
            let expected = 7.0 * 0.5 / PI * height / distance2.sqrt();
            assert_close(&seen(&directional(direction, 7.0), target, 0.0), expected, &what);
            // It has passed the air already.
            let through_air = expected * (-0.1f32).exp();
            assert_close(&seen(&directional(direction, 7.0), target, 0.1), through_air, &what);
        }
        let from_below = directional(Vec3::new(0.3, 1.0, 0.0), 7.0);
        assert_eq!(seen(&from_below, Vec3::ZERO, 0.0), vec![0.0; 2 * n_models]);
    }
}

#[test]
fn shadows_have_hard_edges() {
    // The blocker reaches from −1 to 1 at the height 1; the point at 2 throws it onto −2 to 2.
    let shapes = [(plane(Vec3::ZERO, Vec3::Y), 0), (quad(Vec3::new(-1.0, 1.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), 0)];
    let materials = [matte(0.5)];
    let up = Vec3::Y * 2.0;
    let slanted = directional(Vec3::new(1.0, -1.0, 0.0), 1.0);
    let cases = [(point(up, 5.0), 2.0), (spot(up, Vec3::ZERO, 5.0, 80.0, 85.0), 2.0), (slanted, 2.0)];
    for (light, edge) in cases {
        for (x, is_lit) in [(edge - 1e-4, false), (edge + 1e-4, true)] {
            let found = seen(&shapes, &materials, &light, Vec3::new(x, 0.0, 0.0), 0.0);
            assert!(found.iter().all(|&found| (found > 0.0) == is_lit), "{light:?} at {x}: {found:?}");
        }
    }
    // A point in the very surface of a ceiling, and one on the floor beside.
    let ceiling = [(plane(Vec3::ZERO, Vec3::Y), 0), (plane(Vec3::Y * 2.7, Vec3::NEG_Y), 0)];
    for x in [0.0, 0.3, 2.0, 9.0] {
        let found = seen(&ceiling, &materials, &point(Vec3::new(0.1, 2.7, 0.2), 5.0), Vec3::new(x, 0.0, 0.0), 0.0);
        assert!(found.iter().all(|&found| found > 0.0), "{x}: {found:?}");
    }
}

#[test]
fn no_ray_runs_into_one() {
    let mirror = Material::Mirror { reflectance: ColorInput::Constant(Vec3::ONE) };
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0)];
    for (eye, look_at) in [(Vec3::new(0.0, 1.0, 5.0), Vec3::Y), (Vec3::new(0.0, 1.0, 2.0), Vec3::new(0.0, 0.0, 1.0))] {
        let scene = scene(shapes.clone(), vec![mirror.clone()], Environment::Black, camera(eye, look_at, 20.0));
        let lights = vec![point(Vec3::Y, 5.0), directional((look_at - eye) * Vec3::new(1.0, 1.0, -1.0), 3.0)];
        let scene = with_lights(&scene, lights);
        assert!(scene.has_light() && scene.features().light_sampling);
        for integrator in [Integrator::Path, Integrator::Phong] {
            let settings = RenderSettings { integrator, ..RenderSettings::default() };
            assert!(render(&scene, &settings, 16, 12, 16).0.means().iter().all(|&mean| mean == Vec3::ZERO));
        }
    }
}

/// Mean over renders with seeds of their own, and its standard error.
fn mean_over_seeds(scene: &Prepared, settings: RenderSettings, spp: u32, renders: u32) -> (f64, f64) {
    let means: Vec<f64> = (0..renders)
        .map(|k| {
            let settings = RenderSettings { seed: settings.seed + k, ..settings };
            picture_mean(&render(scene, &settings, 24, 18, spp).0).0
        })
        .collect();
    mean_of(&means)
}

#[track_caller]
fn assert_equal(what: &str, found: (f64, f64), expected: (f64, f64), largest_error: f64) {
    let error = found.1.hypot(expected.1);
    println!("{what}: {:.6} ± {:.6} for {:.6} ± {:.6}", found.0, found.1, expected.0, expected.1);
    assert!(error < largest_error * expected.0, "{what}: too noisy to tell: {error} of {}", expected.0);
    // The errors themselves are known from few renders; spheres stand for points to a few parts in ten thousand.
    let slack = 4.5 * error + 5e-4 * expected.0;
    assert!((found.0 - expected.0).abs() < slack, "{what}: {found:?} for {expected:?}");
}

#[test]
fn rough_metal_shines_as_under_a_small_sphere() {
    let metal = Material::Metal {
        alpha: ScalarInput::Constant(0.3),
        reflectance: ColorInput::Constant(Vec3::splat(0.8)),
        fresnel: Fresnel::Schlick,
        compensate: true,
    };
    let (at, radius) = (Vec3::new(0.5, 2.5, 0.8), 0.02);
    let glow = emissive(6.0 / (PI * radius * radius));
    let of = |shapes: Vec<(Shape, u32)>| {
        let eye = camera(Vec3::new(0.3, 1.6, 3.0), Vec3::new(0.0, 0.3, 0.0), 30.0);
        scene(shapes, vec![metal.clone(), glow.clone(), diffuse(0.5)], Environment::Black, eye)
    };
    let things = vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 0), (plane(Vec3::ZERO, Vec3::Y), 0)];
    let mut with_sphere = things.clone();
    with_sphere.push((sphere(at, radius), 1));
    // The sphere itself is seen in no smooth surface, so what is left are rays that run into it: too few to matter.
    let settings = RenderSettings::default();
    let found = mean_over_seeds(&with_lights(&of(things), vec![point(at, 6.0)]), settings, 64, 8);
    let expected = mean_over_seeds(&of(with_sphere), settings, 256, 8);
    assert_equal("rough metal", found, expected, 0.005);
}

fn lights_of_all_kinds(n: usize) -> Vec<DeltaLight> {
    (0..n)
        .map(|i| {
            let t = i as f32 / n as f32;
            let at = Vec3::new(4.0 * (7.0 * t).sin(), 0.5 + 2.0 * (t * 17.0).sin().abs(), 3.0 * (11.0 * t).cos());
            match i % 5 {
                0 => directional(Vec3::new((9.0 * t).sin(), -1.0, (5.0 * t).cos()), 0.3 * t),
                1 | 2 => spot(at, Vec3::new(t, 0.0, 0.2), 3.0 * t, 60.0 * f64::from(t), 30.0 + 60.0 * f64::from(t)),
                _ => point(at, 0.5 + t),
            }
        })
        .collect()
}

fn table() -> Prepared {
    let shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 0),
        (quad(Vec3::new(-2.0, 0.3, 0.5), Vec3::X, Vec3::new(0.0, 0.4, -0.4)), 0),
    ];
    let eye = camera(Vec3::new(0.3, 3.0, 5.0), Vec3::new(0.0, 0.4, 0.0), 50.0);
    scene(shapes, vec![diffuse(0.5), emissive(4.0)], Environment::Black, eye)
}

#[test]
fn what_one_of_many_sends_is_the_sum_of_all_alone() {
    let table = table();
    for integrator in [Integrator::Path, Integrator::Phong] {
        let settings = RenderSettings { integrator, max_depth: 2, ..RenderSettings::default() };
        for n in [2, 11, 40] {
            let lights = lights_of_all_kinds(n);
            let expected = lights.iter().fold((0.0, 0.0f64), |(sum, error), &light| {
                let (mean, of_mean) = mean_over_seeds(&with_lights(&table, vec![light]), settings, 64, 4);
                (sum + mean, error.hypot(of_mean))
            });
            let all = with_lights(&table, lights);
            assert_equal(
                &format!("{n} lights, {integrator:?}"),
                mean_over_seeds(&all, settings, 64, 8),
                expected,
                0.01,
            );
        }
    }
    // Beside lights with a size, and with the choice among all of them even.
    let lit = |lights: &[DeltaLight]| {
        let mut shapes = vec![(sphere(Vec3::new(1.0, 2.0, 1.0), 0.3), 1)];
        shapes.extend(table.geometry.tree.shapes().iter().map(|shape| (shape.clone(), 0)));
        let scene =
            scene(shapes, table.shading.materials.clone(), Environment::Constant(Vec3::splat(0.1)), table.camera);
        with_lights(&scene, lights.to_vec())
    };
    let settings = RenderSettings { max_depth: 2, ..RenderSettings::default() };
    let lights = lights_of_all_kinds(7);
    let expected = mean_over_seeds(&lit(&[]), settings, 256, 4).0
        + mean_over_seeds(&with_lights(&table, lights.clone()), settings, 256, 4).0;
    for light_selection in [true, false] {
        let techniques = Techniques { light_selection, ..Techniques::ALL };
        let found = mean_over_seeds(&lit(&lights), RenderSettings { techniques, ..settings }, 256, 8);
        // The sphere hides a little of the floor from the others.
        assert!((found.0 / expected - 1.0).abs() < 0.02, "{found:?} for {expected}");
    }
}

#[test]
fn glass_gathers_the_light_of_points_spots_and_the_sun() {
    let (up, radius) = (Vec3::new(0.4, 3.0, 0.3), 0.01);
    let far = Vec3::new(300.0, 1000.0, 200.0);
    let sun_radius = 0.5;
    let irradiance = 3.0;
    let ball = Vec3::new(0.0, 0.7, 0.0);
    let eye = camera(Vec3::new(0.3, 2.0, 3.0), Vec3::new(0.0, 0.0, 0.0), 30.0);
    let mirror = Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(0.9)) };
    for (name, smooth) in [("glass", GLASS), ("mirror", mirror)] {
        let of = |lamp: Option<(Vec3, f32, f32)>| {
            let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(ball, 0.5), 2)];
            let radiance = lamp.map_or(0.0, |(at, radius, radiance)| {
                shapes.push((sphere(at, radius), 1));
                radiance
            });
            scene(shapes, vec![diffuse(0.6), emissive(radiance), smooth.clone()], Environment::Black, eye)
        };
        let settings = RenderSettings { seed: 1, ..RenderSettings::default() };
        let of_sphere = of(Some((up, radius, 8.0 / (PI * radius * radius))));
        let expected = mean_over_seeds(&of_sphere, RenderSettings { seed: 100, ..settings }, 256, 10);
        for (what, light) in [("point", point(up, 8.0)), ("spot", spot(up, ball, 8.0, 80.0, 89.0))] {
            let scene = with_lights(&of(None), vec![light]);
            assert!(scene.features().caustics);
            for simd in [settings.simd, None] {
                let found = mean_over_seeds(&scene, RenderSettings { simd, ..settings }, 128, 10);
                assert_equal(&format!("{name}, {what}"), found, expected, 0.02);
            }
        }
        let sun = irradiance * far.length_squared() / (PI * sun_radius * sun_radius);
        let expected =
            mean_over_seeds(&of(Some((far, sun_radius, sun))), RenderSettings { seed: 100, ..settings }, 256, 10);
        let scene = with_lights(&of(None), vec![directional(-far, irradiance)]);
        assert_equal(&format!("{name}, sun"), mean_over_seeds(&scene, settings, 128, 10), expected, 0.02);
    }
}

#[test]
fn gathered_light_is_as_bright_as_on_paper() {
    // All light of a point in the middle of a glass ball leaves it in the end, as if there were no ball.
    let up = Vec3::new(0.0, 2.0, 0.0);
    let eye = camera(Vec3::new(0.1, 1.0, 0.1), Vec3::ZERO, 20.0);
    let of = |shapes: Vec<(Shape, u32)>| scene(shapes, vec![diffuse(0.5), GLASS], Environment::Black, eye);
    let floor = (plane(Vec3::ZERO, Vec3::Y), 0);
    let lights = vec![point(up, 5.0)];
    let settings = RenderSettings { seed: 1, ..RenderSettings::default() };
    let expected = mean_over_seeds(&with_lights(&of(vec![floor.clone()]), lights.clone()), settings, 64, 4);
    let bulb = with_lights(&of(vec![floor.clone(), (sphere(up, 0.3), 1)]), lights);
    assert_equal("a bulb", mean_over_seeds(&bulb, settings, 256, 10), expected, 0.02);

    // The sun falls onto the floor by way of a mirror, through air that absorbs from there on.
    let mirror = Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(0.8)) };
    let eye = camera(Vec3::new(0.3, 1.0, 2.0), Vec3::new(0.0, 0.0, 0.0), 8.0);
    // At 45° above the floor: what comes along −x goes straight down.
    let slope = quad(Vec3::new(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::new(2.0, 2.0, 0.0));
    let shapes = vec![floor, (slope, 1)];
    let scene = scene(shapes, vec![diffuse(0.5), mirror], Environment::Black, eye);
    let shading = Shading {
        air: Vec3::splat(0.2),
        delta_lights: vec![directional(Vec3::NEG_X, 3.0)],
        ..(*scene.shading).clone()
    };
    let lit = scene.with_shading(Arc::new(shading));
    // A pixel in the middle looks at the origin from 2.256 m; the mirror is 2 m above that point.
    let distance = f64::from(Vec3::new(0.3, 1.0, 2.0).length());
    let expected = 3.0 * 0.8 * 0.5 / f64::from(PI) * (-0.2 * (2.0 + distance)).exp();
    for simd in [settings.simd, None] {
        let found = mean_over_seeds(&lit, RenderSettings { simd, ..settings }, 256, 8);
        println!("mirrored sun: {found:?} for {expected}");
        assert!((found.0 / expected - 1.0).abs() < 0.02 && found.1 < 0.01 * expected, "{found:?} for {expected}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mut shapes: Vec<(Shape, u32)> = table().geometry.tree.shapes().iter().map(|shape| (shape.clone(), 0)).collect();
    shapes.push((sphere(Vec3::new(0.9, 0.4, 1.0), 0.4), 1));
    let scene = scene(shapes, vec![diffuse(0.5), GLASS], Environment::Black, table().camera);
    for n in [3, 30] {
        let scene = with_lights(&scene, lights_of_all_kinds(n));
        for integrator in [Integrator::Path, Integrator::Phong] {
            let settings = RenderSettings { integrator, ..RenderSettings::default() };
            let bits = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let mut film = Film::new(40, 30);
                pool.install(|| advance(&scene, &settings, &mut film, 8, &|| false));
                film.means().iter().flat_map(|mean| mean.to_array().map(f32::to_bits)).collect::<Vec<_>>()
            };
            assert_eq!(bits(1), bits(3), "{n} lights, {integrator:?}");
        }
    }
}

/// What the picture of a scene file says.
#[test]
fn lights_of_a_scene_file_shine() {
    use firstlight::scene::{Extraction, LoadOptions, SceneInputs, SceneSource, load};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lights.ron");
    let text = r#"(
        camera: (eye: (0, 1, 0.5), look_at: (0, 0, 0), vfov: 0.001), max_depth: 2,
        materials: {"white": diffuse(albedo: 0.5)},
        objects: [plane(material: "white")],
        lights: [
            point(position: (0, 2, 0), intensity: 4, radius: 0),
            spot(position: (0, 2, 0), direction: (1, 0, 0), intensity: 4, transform: (rotate: (0, 0, -90))),
            directional(direction: (0, 0, 2), irradiance: 1, transform: (rotate: (90, 0, 0))),
        ],
    )"#;
    std::fs::write(&path, text).unwrap();
    let loaded = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut world = bevy_ecs::prelude::World::new();
    loaded.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees);
    assert_eq!((extraction.problems.len(), extraction.delta_lights.len()), (0, 3));
    let settings = RenderSettings { max_depth: 2, ..RenderSettings::default() };
    // The spot is turned about its own tip: its transform moves it to where its position says before that.
    let lights = &extraction.prepared.shading.delta_lights;
    let DeltaLight::Spot { position, cone, .. } = lights[1] else { panic!("{lights:?}") };
    assert!((position - Vec3::new(2.0, 0.0, 0.0)).length() < 1e-6 && (cone.axis - Vec3::NEG_Y).length() < 1e-6);
    let (film, _) = render(&extraction.prepared, &settings, 1, 1, 64);
    let expected = DVec3::splat(0.5 / f64::from(PI) * (4.0 / 4.0 + 1.0));
    assert!((film.mean(0, 0).as_dvec3() - expected).length() < 1e-4, "{:?} for {expected}", film.mean(0, 0));
}
