//! Light sampling through panes without thickness: closed forms, and one way of finding their light against another.

use crate::common::*;
use firstlight::render::{
    ColorInput, DeltaLight, Environment, Material, MaterialKind, Prepared, RenderSettings, ScalarInput, Techniques,
};
use glam::Vec3;

const TINT: Vec3 = Vec3::new(0.9, 0.6, 0.3);

fn pane(ior: f32) -> Material {
    let [reflectance, transmittance] = [Vec3::ONE, TINT].map(ColorInput::Constant);
    Material::ThinGlass { ior, reflectance, transmittance }
}

fn layered_pane(roughness: f32) -> Material {
    let mut material = Material::of_kind(MaterialKind::Principled, ColorInput::Constant(TINT)).unwrap();
    let Material::Principled { transmission, thin_walled, roughness: width, .. } = &mut material else { panic!() };
    (*transmission, *thin_walled, *width) = (1.0.into(), true, roughness.into());
    material
}

/// Share of light that is not reflected at an interface from air, at this cosine.
fn past_interface(ior: f32, cos: f32) -> f32 {
    let inside = (1.0 - (1.0 - cos * cos) / (ior * ior)).sqrt();
    let (s, p) = ((cos - ior * inside) / (cos + ior * inside), (ior * cos - inside) / (ior * cos + inside));
    1.0 - 0.5 * (s * s + p * p)
}

#[test]
fn lights_without_size_shine_through_panes_as_the_formula_says() {
    let towards = Vec3::new(0.5, 2.0, 0.3);
    let cos = towards.normalize().y;
    let once = 1.0 - past_interface(1.5, cos);
    let by_formula = (1.0 - 2.0 * once / (1.0 + once)) * TINT;
    let schlick = 1.0 - (0.04 + 0.96 * (1.0 - cos).powi(5));
    let mut half_open = Material::blend(ScalarInput::Constant(0.0), 2, 2);
    if let Material::Blend { weight, b, .. } = &mut half_open {
        (*weight, *b) = (ScalarInput::Constant(0.25), 0);
    }
    let cases = [
        (pane(1.5), by_formula),
        (layered_pane(0.0), schlick * TINT),
        (layered_pane(0.4), Vec3::ZERO),
        (half_open, 0.75 * by_formula),
        (diffuse(0.5), Vec3::ZERO),
    ];
    let eye = || camera(Vec3::new(0.6, 0.8, 0.0), Vec3::ZERO, 1e-3);
    for light in [
        DeltaLight::Point { position: towards, intensity: Vec3::ONE },
        DeltaLight::Directional { direction: -towards.normalize(), irradiance: Vec3::ONE },
    ] {
        let seen = |heights: &[f32], material: &Material, simd| {
            let sheet = |y: &f32| (quad(Vec3::new(-5.0, *y, -5.0), 10.0 * Vec3::X, 10.0 * Vec3::Z), 1);
            let shapes = std::iter::once((plane(Vec3::ZERO, Vec3::Y), 0)).chain(heights.iter().map(sheet)).collect();
            let dark = scene(shapes, vec![diffuse(0.5), material.clone(), pane(1.5)], Environment::Black, eye());
            let scene = with_lights(&dark, vec![light]);
            let usual = RenderSettings { max_depth: 2, ..RenderSettings::default() };
            let settings = if simd { usual } else { RenderSettings { simd: None, ..usual } };
            render(&scene, &settings, 1, 1, 1).0.mean(0, 0)
        };
        for (material, share) in &cases {
            for simd in [false, true] {
                let open = seen(&[], material, simd);
                for heights in [&[1.5][..], &[1.2, 1.5, 1.9]] {
                    let expected = open * share.powf(heights.len() as f32);
                    let found = seen(heights, material, simd);
                    let error = (found - expected).abs().max_element();
                    assert!(error < 1e-5 * open.x, "{material:?}: {found} for {expected}");
                }
            }
        }
    }
}

/// A lamp in a box of panes, another one and a sky behind a window, and things to be lit.
fn room() -> Prepared {
    let holed = {
        let mut material = Material::blend(ScalarInput::Constant(0.3), 2, 3);
        let Material::Blend { opacity, .. } = &mut material else { panic!() };
        *opacity = ScalarInput::Constant(0.7);
        material
    };
    let mut dull = Material::of_kind(MaterialKind::Metal, ColorInput::Constant(Vec3::splat(0.8))).unwrap();
    let Material::Metal { alpha, .. } = &mut dull else { panic!() };
    *alpha = 0.2.into();
    let materials = vec![diffuse(0.6), emissive(20.0), pane(1.5), layered_pane(0.0), holed, dull];
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let shapes = vec![
        (plane(Vec3::ZERO, y), 0),
        (quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * x, 3.0 * y), 0),
        (sphere(Vec3::new(-0.8, 0.4, 0.3), 0.4), 5),
        // The lamp.
        (quad(Vec3::new(0.3, 0.8, -0.1), 0.2 * x, 0.2 * z), 1),
        (quad(Vec3::new(0.1, 0.6, -0.3), 0.6 * x, 0.6 * z), 2),
        (quad(Vec3::new(0.1, 0.6, -0.3), 0.6 * y, 0.6 * z), 3),
        (quad(Vec3::new(0.7, 0.6, -0.3), 0.6 * z, 0.6 * y), 4),
        (quad(Vec3::new(0.1, 0.6, -0.3), 0.6 * x, 0.6 * y), 2),
        // The window.
        (sphere(Vec3::new(4.0, 2.0, 0.5), 0.3), 1),
        (quad(Vec3::new(2.0, 0.0, -2.0), 4.0 * z, 3.0 * y), 3),
        (quad(Vec3::new(2.1, 0.0, -2.0), 4.0 * z, 3.0 * y), 2),
    ];
    let sky = Environment::Constant(Vec3::new(0.2, 0.25, 0.4));
    scene(shapes, materials, sky, camera(Vec3::new(-1.0, 1.2, 4.0), Vec3::new(0.2, 0.6, 0.0), 45.0))
}

#[test]
fn light_behind_panes_is_the_same_by_bounces_and_by_asking_for_it() {
    let mean = |techniques, simd, spp| {
        let usual = RenderSettings { techniques, ..RenderSettings::default() };
        let settings = if simd { usual } else { RenderSettings { simd: None, ..usual } };
        mean_of_renders(&room(), settings, (40, 24), spp, 8)
    };
    let plain = Techniques { light_sampling: false, caustics: false, ..Techniques::ALL };
    let (expected, other) = mean(plain, true, 4096);
    for (techniques, simd) in [
        (Techniques::ALL, true),
        (Techniques::ALL, false),
        (Techniques { resampling: false, solid_angle: false, ..Techniques::ALL }, true),
        (Techniques { mis: false, ..Techniques::ALL }, true),
    ] {
        let (found, error) = mean(techniques, simd, 128);
        let deviation = error.hypot(other);
        println!("{found:.5} ± {error:.5} for {expected:.5} ± {other:.5}");
        assert!((found - expected).abs() < 4.0 * deviation, "{found} ± {error} for {expected} ± {other}");
        assert!(deviation < 0.005 * expected, "too noisy to tell: {deviation} of {expected}");
    }
}
