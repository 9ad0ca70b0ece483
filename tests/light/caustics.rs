//! Light that smooth surfaces gather, found by light paths and from the camera together.

use crate::common::*;
use firstlight::kdtree::{BuildPreset, HitSpace, MeshTree, Shape};
use firstlight::mesh::procedural;
use firstlight::render::{
    Camera, CausticPlan, ColorInput, Environment, Film, Geometry, ImageTexture, Material, MaterialKind, Object,
    PixelFilter, Prepared, RenderSettings, ScalarInput, Shading, Snapshot, Techniques, advance,
};
use glam::{Affine3A, DVec3, Quat, Vec3};
use std::sync::Arc;

const GLASS: Material = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };

/// Glass by layers, as in glTF.
pub fn layered_glass() -> Material {
    let mut material = Material::of_kind(MaterialKind::Principled, ColorInput::Constant(Vec3::ONE)).unwrap();
    let Material::Principled { transmission, roughness, .. } = &mut material else { panic!() };
    (*transmission, *roughness) = (1.0.into(), 0.0.into());
    material
}

fn mirror(reflectance: f32) -> Material {
    Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(reflectance)) }
}

fn blend(a: u32, b: u32, weight: f32) -> Material {
    Material::blend(ScalarInput::Constant(weight), a, b)
}

fn settings(seed: u32, caustics: bool) -> RenderSettings {
    RenderSettings {
        seed,
        techniques: Techniques { caustics, caustic_plan: Some(CausticPlan::UNKNOWN), ..Techniques::ALL },
        ..RenderSettings::default()
    }
}

/// A room with a light, a floor and something smooth.
fn room(smooth: Vec<(Shape, u32)>, lamp: Shape, camera: Camera) -> Prepared {
    room_under(Environment::Black, smooth, lamp, camera)
}

fn room_under(sky: Environment, smooth: Vec<(Shape, u32)>, lamp: Shape, camera: Camera) -> Prepared {
    let mut shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0), 0),
        (lamp, 1),
    ];
    shapes.extend(smooth);
    let materials = vec![diffuse(0.6), emissive(20.0), GLASS, mirror(0.9), blend(0, 3, 0.4), layered_glass()];
    scene(shapes, materials, sky, camera)
}

/// An image of a sky with a sun of 11°, wide enough for camera paths to find.
fn sun_and_sky() -> Environment {
    let (width, height) = (64, 32);
    let is_sun = |i: u32| (20..22).contains(&(i % width)) && (9..11).contains(&(i / width));
    let texel = |i| if is_sun(i) { Vec3::new(60.0, 50.0, 40.0) } else { Vec3::new(0.2, 0.3, 0.5) };
    let image = Arc::new(ImageTexture::from_linear(width, height, (0..width * height).map(texel).collect()));
    Environment::Image { image, scale: Vec3::splat(1.5), rotation: 2.4 }
}

fn eye() -> Camera {
    camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0)
}

fn quad_light() -> Shape {
    quad(Vec3::new(-0.3, 2.6, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6)
}

#[test]
fn the_mean_is_that_of_paths_from_the_eye_alone() {
    let mut lens = eye();
    (lens.lens_radius, lens.focus_distance, lens.blades) = (0.2, 4.0, 5);
    let mirror_quad = quad(Vec3::new(-1.8, 0.0, 1.0), Vec3::new(0.2, 0.0, -2.0), Vec3::new(-0.3, 1.5, 0.0));
    let cases = [
        ("a glass ball", room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)], quad_light(), eye())),
        ("by layers", room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 5)], quad_light(), eye())),
        ("through a lens", room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)], quad_light(), lens)),
        (
            "a mirror ball under a ball lamp",
            room(vec![(sphere(Vec3::new(0.4, 0.5, 0.0), 0.5), 3)], sphere(Vec3::new(-1.0, 2.0, 0.5), 0.3), eye()),
        ),
        (
            "a flat mirror, a coat, glass in glass",
            room(
                vec![
                    (mirror_quad, 3),
                    (sphere(Vec3::new(-0.7, 0.4, 0.3), 0.4), 4),
                    (sphere(Vec3::new(0.7, 0.5, 0.0), 0.5), 2),
                    (sphere(Vec3::new(0.7, 0.5, 0.0), 0.2), 2),
                ],
                quad_light(),
                eye(),
            ),
        ),
    ];
    let ball = || vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2), (sphere(Vec3::new(1.0, 0.3, 0.4), 0.3), 3)];
    let (under, above) = (quad(-10.0 * Vec3::Y, Vec3::X, Vec3::Z), quad(Vec3::new(1.0, 2.5, 1.0), Vec3::X, Vec3::Z));
    let cases = cases.into_iter().chain([
        ("balls under a sun", room_under(sun_and_sky(), ball(), under, eye())),
        ("balls under a sun and a light, behind a lens", room_under(sun_and_sky(), ball(), above, lens)),
    ]);
    for (name, scene) in &cases.collect::<Vec<_>>() {
        assert!(scene.features().caustics);
        let (expected, error) = mean_of_renders(scene, settings(100, false), (24, 18), 1024, 10);
        let (found, other) = mean_of_renders(scene, settings(1, true), (24, 18), 128, 10);
        println!("{name}: {found:.5} ± {other:.5} for {expected:.5} ± {error:.5}");
        let t = (found - expected) / error.hypot(other);
        assert!(t.abs() < 4.5, "{name}: {found} ± {other} for {expected} ± {error}");
    }
}

/// Every filter gives light that falls onto the film to the same pixels, with the same weight, as light that is looked
/// for.
/// Paths from the light are joined to a camera inside of glass from within that glass alone.
#[test]
fn a_camera_under_water_sees_the_same_with_and_without_them() {
    let water = Material::Glass { ior: 1.33, absorption: Vec3::new(0.3, 0.1, 0.02), dispersion: 0.0 };
    let shapes = vec![
        (sphere(Vec3::ZERO, 2.0), 0),
        (sphere(Vec3::new(0.0, -0.9, -0.3), 0.7), 1),
        (sphere(Vec3::new(0.3, 0.1, -0.6), 0.25), 2),
        (sphere(Vec3::new(0.0, 4.0, 0.0), 0.8), 3),
    ];
    let eye = camera(Vec3::new(0.2, 0.3, 1.2), Vec3::new(0.0, -0.5, -0.3), 40.0);
    let scene = scene(shapes, vec![water, diffuse(0.7), GLASS, emissive(10.0)], Environment::Black, eye);
    let found = mean_of_renders(&scene, settings(1, true), (24, 24), 256, 8);
    let expected = mean_of_renders(&scene, settings(100, false), (24, 24), 1024, 8);
    let error = (found.1.powi(2) + expected.1.powi(2)).sqrt();
    println!("{found:?} {expected:?}");
    assert!((found.0 - expected.0).abs() < 4.0 * error, "{found:?} for {expected:?}");
    assert!(error < 0.02 * expected.0, "too noisy to tell: {error}");
}

#[test]
fn every_filter_sees_the_same_light() {
    let scene = room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)], quad_light(), eye());
    for filter in [PixelFilter::Tent, PixelFilter::BlackmanHarris, PixelFilter::Mitchell] {
        let mean = |settings: RenderSettings, spp| {
            mean_of_renders(&scene, RenderSettings { filter, ..settings }, (12, 9), spp, 12)
        };
        let (expected, error) = mean(settings(100, false), 1024);
        let (found, other) = mean(settings(1, true), 256);
        let t = (found - expected) / error.hypot(other);
        assert!(t.abs() < 4.5, "{filter:?}: {found} ± {other} for {expected} ± {error}");
    }
}

/// Root of relMSE of a film against the truth.
pub fn error(film: &Film, truth: &Film) -> f64 {
    let pairs = film.means().into_iter().zip(truth.means());
    let terms = pairs.map(|(found, truth)| {
        let (found, truth) = (found.as_dvec3(), truth.as_dvec3());
        ((found - truth) * (found - truth) / (truth * truth + DVec3::splat(0.01))).element_sum() / 3.0
    });
    (terms.sum::<f64>() / f64::from(film.width() * film.height())).sqrt()
}

#[test]
fn a_caustic_comes_many_times_sooner() {
    // The floor behind the sphere, where the light of the emitter is gathered; the sphere itself is out of sight.
    let view = camera(Vec3::new(0.0, 0.4, -1.95), Vec3::new(0.0, 0.0, -1.0), 30.0);
    let lamp = quad(Vec3::new(-0.15, 1.5, 2.0), Vec3::new(0.0, 0.2, 0.2), Vec3::X * 0.3);
    let ball = (sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2);
    let scene = room(vec![ball], lamp, view);
    let (truth, _) = render(&scene, &settings(50, true), 32, 24, 8192);
    let (with, _) = render(&scene, &settings(1, true), 32, 24, 64);
    let (without, _) = render(&scene, &settings(1, false), 32, 24, 64);
    let (with, without) = (error(&with, &truth), error(&without, &truth));
    println!("error with {with:.4}, without {without:.4}");
    // Twenty times fewer samples for the same error, at less than twice the time each.
    assert!(without * without > 20.0 * with * with, "with {with}, without {without}");
}

#[test]
fn scenes_without_smooth_surfaces_or_lights_take_no_notice() {
    let matte = room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 0)], quad_light(), eye());
    // Light from everywhere: bounces find it as well as anything could.
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::Y * 0.5, 0.5), 1)];
    let dark = scene(shapes, vec![diffuse(0.6), GLASS], Environment::Constant(Vec3::ONE), eye());
    for scene in [matte, dark] {
        assert!(!scene.features().caustics);
        let (with, report) = render(&scene, &settings(1, true), 24, 18, 8);
        let (without, plain) = render(&scene, &settings(1, false), 24, 18, 8);
        assert_eq!((with.means(), report.rays), (without.means(), plain.rays));
    }
}

#[test]
fn any_number_of_threads_and_any_portions_give_the_same_bits() {
    let mut lens = eye();
    (lens.lens_radius, lens.focus_distance) = (0.2, 4.0);
    let scene = room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)], quad_light(), lens);
    let settings = RenderSettings { filter: PixelFilter::Gaussian, ..settings(3, true) };
    let picture = |threads, tile_size, portions: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut film = Film::with_tile_size(150, 100, tile_size);
            for &target in portions {
                // Stopped in the middle, and taken up again.
                let asked = std::sync::atomic::AtomicU32::new(0);
                let stop = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 5 * target;
                advance(&scene, &settings, &mut film, target, &stop);
                assert!(advance(&scene, &settings, &mut film, target, &|| false).completed);
            }
            let estimate = film.error_estimate().map(|estimate| estimate.relative.to_bits());
            (film.means(), estimate)
        })
    };
    let reference = picture(1, 32, &[5]);
    assert!(reference.1.is_some());
    for (threads, tile_size, portions) in [(2, 32, &[1, 2, 5][..]), (5, 32, &[3, 5]), (3, 32, &[4, 5])] {
        assert!(picture(threads, tile_size, portions) == reference, "{threads} threads, portions {portions:?}");
    }
    // The estimate sums tile by tile; the picture does not.
    assert!(picture(3, 13, &[5]).0 == reference.0);
}

/// A box of a material, as a mesh with flat faces.
fn block(center: Vec3, size: Vec3, material: u32) -> (Shape, Object) {
    let mesh = Arc::new(procedural::cuboid(DVec3::ONE).flat());
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
    let extent = tree.bounds().max - tree.bounds().min;
    let world_from_object = Affine3A::from_scale_rotation_translation(size / extent, Quat::IDENTITY, center);
    (
        Shape::Mesh { tree, world_from_object, space: HitSpace::Object },
        Object { mesh: Some(mesh), ..Object::plain(material) },
    )
}

/// A light above a floor, and bodies between them.
fn bench(bodies: Vec<(Shape, Object)>, ior: f32) -> Prepared {
    let mut parts = bodies;
    parts.push((plane(Vec3::new(0.0, -1.1, 0.0), Vec3::Y), Object::plain(0)));
    parts.push((quad(Vec3::new(-1.0, 3.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), Object::plain(1)));
    let glass = Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 };
    let materials = vec![diffuse(0.5), emissive(10.0), glass.clone(), glass];
    let (shapes, objects) = parts.into_iter().unzip();
    let geometry = Geometry::build(shapes, objects);
    let shading = Shading::new(materials, Vec::new(), Environment::Black);
    let camera = camera(Vec3::new(2.0, -0.4, 5.0), Vec3::new(0.0, -1.0, 0.0), 25.0);
    Prepared::new(Snapshot::new(geometry, shading, camera))
}

#[test]
fn bodies_that_touch_are_as_one() {
    let v = Vec3::new;
    let one = block(v(0.0, 0.5, 0.0), v(2.0, 1.0, 2.0), 2);
    let low = block(v(0.0, 0.25, 0.0), v(2.0, 0.5, 2.0), 2);
    let cases = [
        ("a body on another", one.clone(), vec![low.clone(), block(v(0.0, 0.75, 0.0), v(2.0, 0.5, 2.0), 2)]),
        ("a body on one of another material", one.clone(), vec![low, block(v(0.0, 0.75, 0.0), v(2.0, 0.5, 2.0), 3)]),
        (
            "bodies side by side whose walls end elsewhere",
            one.clone(),
            vec![
                block(v(-0.5, 0.5, 0.0), v(1.0, 1.0, 2.0), 3),
                block(v(0.5, 0.5, -0.7), v(1.0, 1.0, 0.6), 2),
                block(v(0.5, 0.5, 0.3), v(1.0, 1.0, 1.4), 2),
            ],
        ),
        ("the same body twice", one.clone(), vec![one.clone(), one]),
        (
            "the same sphere twice",
            (sphere(v(0.0, 0.0, 0.0), 0.8), Object::plain(2)),
            vec![(sphere(v(0.0, 0.0, 0.0), 0.8), Object::plain(2)), (sphere(v(0.0, 0.0, 0.0), 0.8), Object::plain(3))],
        ),
    ];
    for (name, one, many) in cases {
        let of = |bodies| mean_of_renders(&bench(bodies, 1.5), settings(11, true), (16, 16), 512, 8);
        let ((truth, truth_error), (mean, error)) = (of(vec![one]), of(many));
        println!("{name}: {mean:.5} ± {error:.5} for {truth:.5} ± {truth_error:.5}");
        assert!(error < 0.005 * truth, "{name}: ± {error}");
        assert!((mean - truth).abs() < 4.0 * error.hypot(truth_error), "{name}: {mean} ± {error} for {truth}");
    }
}

#[test]
fn glass_that_bends_nothing_takes_no_light_where_it_touches_something() {
    let v = Vec3::new;
    let standing = block(v(0.0, -0.55, 0.0), v(2.0, 1.1, 2.0), 2);
    let sheet = (quad(v(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), Object::plain(2));
    let (truth, truth_error) = mean_of_renders(&bench(Vec::new(), 1.0), settings(11, true), (16, 16), 512, 8);
    let cases = [("standing on the floor", vec![standing.clone()]), ("under a sheet", vec![standing, sheet])];
    for (name, bodies) in cases {
        let (mean, error) = mean_of_renders(&bench(bodies, 1.0), settings(11, true), (16, 16), 512, 8);
        println!("{name}: {mean:.5} ± {error:.5} for {truth:.5}");
        assert!(error < 0.005 * truth, "{name}: ± {error}");
        assert!((mean - truth).abs() < 4.0 * error.hypot(truth_error), "{name}: {mean} ± {error} for {truth}");
    }
}

/// A coarse mesh with smooth normals: shading and true normals differ by much.
fn smooth_body(material: u32) -> (Shape, Object) {
    let mesh = Arc::new(procedural::icosphere(2).with_vertex_normals());
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
    let world_from_object = Affine3A::from_scale(Vec3::splat(0.8));
    (
        Shape::Mesh { tree, world_from_object, space: HitSpace::Object },
        Object { mesh: Some(mesh), ..Object::plain(material) },
    )
}

#[test]
fn smooth_normals_gather_as_much_light_from_both_ends() {
    let scene = bench(vec![smooth_body(2)], 1.5);
    let (truth, truth_error) = mean_of_renders(&scene, settings(100, false), (16, 16), 4096, 8);
    for simd in [None, RenderSettings::default().simd] {
        let settings = RenderSettings { simd, ..settings(11, true) };
        let (mean, error) = mean_of_renders(&scene, settings, (16, 16), 1024, 8);
        println!("{simd:?}: {mean:.5} ± {error:.5} for {truth:.5} ± {truth_error:.5}");
        assert!(error.hypot(truth_error) < 0.01 * truth, "too noisy to tell: {error} {truth_error}");
        assert!((mean - truth).abs() < 4.0 * error.hypot(truth_error), "{simd:?}: {mean} ± {error} for {truth}");
    }
}
