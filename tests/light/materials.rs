//! Plastics, conductors, translucent sheets and panes in whole images: one way of finding their light against another.

use crate::common::*;
use firstlight::kdtree::InstructionSet;
use firstlight::render::{
    ColorInput, Environment, Integrator, Material, Prepared, RenderSettings, ScalarInput, Techniques,
};
use glam::Vec3;

fn color(r: f32, g: f32, b: f32) -> ColorInput {
    ColorInput::Constant(Vec3::new(r, g, b))
}

fn plastic(alpha: f32) -> Material {
    let (diffuse, alpha) = (color(0.7, 0.3, 0.1), ScalarInput::Constant(alpha));
    Material::Plastic { diffuse, alpha, ior: 1.5, specular: 1.0.into(), nonlinear: true, beckmann: false }
}

/// Spheres and sheets of each kind, alone and blended, on a floor below a light and a sky.
fn room() -> Prepared {
    let gold = |alpha: f32, compensate| Material::Conductor {
        alpha: ScalarInput::Constant(alpha),
        alpha_v: 0.0.into(),
        beckmann: false,
        eta: Vec3::new(0.143, 0.375, 1.442),
        k: Vec3::new(3.983, 2.386, 1.603),
        reflectance: color(1.0, 0.9, 0.8),
        compensate,
    };
    let leaf = Material::Translucent { reflectance: color(0.1, 0.4, 0.1), transmittance: color(0.2, 0.5, 0.05) };
    let pane = Material::ThinGlass { ior: 1.5, reflectance: color(1.0, 1.0, 1.0), transmittance: color(0.6, 0.9, 0.8) };
    let mut materials = vec![
        diffuse(0.5),
        emissive(12.0),
        plastic(0.0),
        plastic(0.25),
        gold(0.3, true),
        leaf,
        pane,
        Material::blend(ScalarInput::Constant(0.5), 5, 3),
        Material::blend(ScalarInput::Constant(0.0), 5, 5),
        gold(0.0, false),
    ];
    if let Material::Blend { opacity, .. } = &mut materials[8] {
        *opacity = ScalarInput::Constant(0.6);
    }
    let ball = |i: u32, material| (sphere(Vec3::new(0.7 * i as f32 - 1.4, 0.3, 0.2), 0.3), material);
    let sheet = |x: f32, material| (quad(Vec3::new(x, 0.3, -0.8), 0.6 * Vec3::X, Vec3::new(0.0, 0.7, 0.3)), material);
    let shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (sphere(Vec3::new(0.2, 1.6, -1.8), 0.5), 1),
        ball(0, 2),
        ball(1, 3),
        ball(2, 4),
        ball(3, 7),
        ball(4, 9),
        sheet(-1.5, 5),
        sheet(-0.7, 6),
        sheet(0.1, 7),
        sheet(0.9, 8),
    ];
    let sky = Environment::Constant(Vec3::new(0.1, 0.12, 0.2));
    scene(shapes, materials, sky, camera(Vec3::new(0.1, 1.1, 4.5), Vec3::new(0.0, 0.5, 0.0), 38.0))
}

#[test]
fn light_is_the_same_by_bounces_and_by_asking_for_it() {
    let mean = |techniques, spp| {
        mean_of_renders(&room(), RenderSettings { techniques, ..RenderSettings::default() }, (40, 24), spp, 8)
    };
    let plain = Techniques { light_sampling: false, caustics: false, ..Techniques::ALL };
    let ((found, error), (expected, other)) = (mean(Techniques::ALL, 64), mean(plain, 256));
    let deviation = error.hypot(other);
    println!("{found:.5} ± {error:.5} for {expected:.5} ± {other:.5}");
    assert!((found - expected).abs() < 4.0 * deviation, "{found} ± {error} for {expected} ± {other}");
    assert!(deviation < 0.01 * expected, "too noisy to tell: {deviation} of {expected}");
}

#[test]
fn all_instruction_sets_draw_the_same_image() {
    for integrator in [Integrator::Path, Integrator::Phong] {
        let image = |simd| {
            let settings = RenderSettings { integrator, simd, ..RenderSettings::default() };
            render(&room(), &settings, 40, 24, 4).0.means()
        };
        let portable = image(Some(InstructionSet::Portable));
        for set in InstructionSet::available() {
            assert!(image(Some(set)) == portable, "{set:?}");
        }
    }
}

/// A wall that lets half of the light through looks the same from both sides in an even world, and no closed form of
/// this page makes light.
#[test]
fn furnaces_return_what_falls_in() {
    let white = || color(1.0, 1.0, 1.0);
    let cases = [
        (Material::Translucent { reflectance: color(0.5, 0.2, 1.0), transmittance: color(0.5, 0.8, 0.0) }, 1.0),
        (Material::Translucent { reflectance: white(), transmittance: white() }, 1.0),
        (Material::ThinGlass { ior: 1.7, reflectance: white(), transmittance: white() }, 1.0),
        (
            Material::Plastic {
                diffuse: white(),
                alpha: 0.0.into(),
                ior: 1.5,
                specular: 1.0.into(),
                nonlinear: false,
                beckmann: false,
            },
            1.0,
        ),
    ];
    for (material, expected) in cases {
        let name = format!("{material:?}");
        let shapes = vec![(sphere(Vec3::ZERO, 1.0), 0)];
        let eye = camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 40.0);
        let scene = scene(shapes, vec![material], Environment::Constant(Vec3::ONE), eye);
        let (mean, _) = picture_mean(&render(&scene, &RenderSettings::default(), 16, 16, 64).0);
        assert!((mean - expected).abs() < 3e-3, "{name}: {mean}");
    }
}

#[test]
fn a_blend_by_side_has_one_material_at_the_front_and_another_behind() {
    let back = Material::Emissive { radiance: color(0.0, 0.0, 0.0) };
    let mut sided = Material::blend(ScalarInput::Constant(0.5), 0, 1);
    if let Material::Blend { by_side, .. } = &mut sided {
        *by_side = true;
    }
    for integrator in [Integrator::Path, Integrator::Phong] {
        for (z, expected) in [(3.0, 0.5), (-3.0, 0.0)] {
            let sheet = quad(Vec3::new(-9.0, -9.0, 0.0), 18.0 * Vec3::X, 18.0 * Vec3::Y);
            let materials = vec![diffuse(0.5), back.clone(), sided.clone()];
            let eye = camera(Vec3::new(0.1, 0.2, z), Vec3::ZERO, 30.0);
            let scene = scene(vec![(sheet, 2)], materials, Environment::Constant(Vec3::ONE), eye);
            let settings = RenderSettings { integrator, ..RenderSettings::default() };
            let (mean, _) = picture_mean(&render(&scene, &settings, 8, 8, 64).0);
            assert!((mean - expected).abs() < 0.01, "{integrator:?} from {z}: {mean}");
        }
    }
}
