//! Glass that refracts red, green and blue differently: Snell's law for each, no energy lost, light paths agree.

use crate::common::*;
use firstlight::render::{
    Camera, ColorInput, Environment, Film, Material, Prepared, RenderSettings, ScalarInput, Techniques,
};
use glam::{DVec2, Vec3};

const DISPERSION: f32 = 10.0;

fn glass() -> Material {
    Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: DISPERSION }
}

/// Mean of all pixels.
fn mean(film: &Film) -> Vec3 {
    film.means().iter().sum::<Vec3>() / film.means().len() as f32
}

/// Unpolarised reflectance; `cos_i` on the side of index `n`, with air beyond.
fn fresnel(n: f64, cos_i: f64) -> f64 {
    let cos_t = (1.0 - n * n * (1.0 - cos_i * cos_i)).sqrt();
    let (s, p) = ((n * cos_i - cos_t) / (n * cos_i + cos_t), (cos_i - n * cos_t) / (cos_i + n * cos_t));
    0.5 * (s * s + p * p)
}

/// A ray enters a prism perpendicularly and leaves it through a face that is tilted by 20°. Where it then goes follows
/// from Snell's law; a narrow light there is seen in one channel only, without the light that both faces reflect.
#[test]
fn a_prism_deflects_each_channel_by_its_own_angle() {
    let tilt = 20_f64.to_radians();
    let across = Vec3::new(tilt.cos() as f32, 0.0, tilt.sin() as f32);
    let faces = [
        quad(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0),
        quad(Vec3::new(0.0, -1.0, -1.0) - across, Vec3::Y * 2.0, across * 2.0),
    ];
    let front = camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 40.0);
    let eye = Camera { orthographic: Some(5e-4), ..front };
    for (channel, n) in [1.375_f64, 1.5, 1.625].into_iter().enumerate() {
        assert!(
            (f64::from(Material::<firstlight::render::InSnapshot>::iors(1.5, DISPERSION)[channel]) - n).abs() < 1e-6
        );
        let (cos_i, sin_t) = (tilt.cos(), n * tilt.sin());
        let along_normal = (1.0 - sin_t * sin_t).sqrt() - n * cos_i;
        // In the plane of x and z; the outward normal of the second face is (sin, -cos) of the tilt.
        let direction = DVec2::new(0.0, -n) + along_normal * DVec2::new(tilt.sin(), -tilt.cos());
        let x = direction.x / -direction.y * 3.0;
        let light = quad(Vec3::new(x as f32 - 0.01, -1.0, -4.0), Vec3::X * 0.02, Vec3::Y * 2.0);
        let shapes = vec![(faces[0].clone(), 0), (faces[1].clone(), 0), (light, 1)];
        let scene = scene(shapes, vec![glass(), emissive(2.0)], Environment::Black, eye);
        let settings = RenderSettings { max_depth: 3, ..RenderSettings::default() };
        let found = mean(&render(&scene, &settings, 16, 16, 512).0).to_array();
        let expected = 2.0 * (1.0 - fresnel(n, 1.0)) * (1.0 - fresnel(n, cos_i));
        for (other, found) in found.into_iter().enumerate() {
            let expected = if other == channel { expected } else { 0.0 };
            assert!(
                (f64::from(found) - expected).abs() < 0.015 * 2.0,
                "light of {channel}, {other}: {found}, {expected}"
            );
        }
    }
}

#[test]
fn a_white_furnace_loses_nothing_in_any_channel() {
    let mut solid = Material::principled(ColorInput::Constant(Vec3::ONE));
    if let Material::Principled { transmission, roughness, dispersion, sheen_color, .. } = &mut solid {
        (*transmission, *roughness) = (ScalarInput::Constant(0.7), ScalarInput::Constant(0.5));
        // Keeps it from becoming rough glass.
        *sheen_color = ColorInput::Constant(Vec3::splat(1e-6));
        *dispersion = DISPERSION;
    }
    let alpha = ScalarInput::Constant(0.2);
    let rough = Material::RoughGlass {
        alpha,
        ior: 1.5,
        absorption: Vec3::ZERO,
        dispersion: DISPERSION,
        compensate: true,
        beckmann: false,
    };
    for (name, material) in [("smooth", glass()), ("rough", rough), ("layers", solid)] {
        let from = camera(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 24.0);
        let scene = scene(vec![(sphere(Vec3::ZERO, 1.0), 0)], vec![material], Environment::Constant(Vec3::ONE), from);
        let found = mean(&render(&scene, &RenderSettings::default(), 32, 32, 256).0);
        assert!((found - 1.0).abs().max_element() < 0.012, "{name}: {found}");
    }
}

/// Inside, radiance is n² times that outside.
#[test]
fn a_camera_within_sees_the_index_of_each_channel() {
    let from = camera(Vec3::new(0.1, 0.2, 0.0), Vec3::NEG_Z, 60.0);
    let scene = scene(vec![(sphere(Vec3::ZERO, 1.0), 0)], vec![glass()], Environment::Constant(Vec3::ONE), from);
    let found = mean(&render(&scene, &RenderSettings::default(), 32, 32, 256).0);
    let expected = Vec3::new(1.375, 1.5, 1.625).powf(2.0);
    assert!((found / expected - 1.0).abs().max_element() < 0.012, "{found} for {expected}");
}

#[test]
fn light_paths_find_the_same_light_in_each_channel() {
    let shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (quad(Vec3::new(-0.3, 2.6, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6), 1),
        (sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2),
        // Without dispersion, and partly inside of it.
        (sphere(Vec3::new(0.5, 0.4, 0.3), 0.3), 3),
    ];
    let plain = Material::Glass { ior: 1.3, absorption: Vec3::ZERO, dispersion: 0.0 };
    let materials = vec![diffuse(0.6), emissive(20.0), glass(), plain];
    let from = camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0);
    let scene = scene(shapes, materials, Environment::Black, from);
    assert!(scene.features().caustics && scene.features().dispersion);
    let (plain, light_paths) = (renders(&scene, false, 512), renders(&scene, true, 64));
    for channel in 0..3 {
        let ((a, va), (b, vb)) = (spread(&plain, channel), spread(&light_paths, channel));
        let t = (a - b) / (va + vb).sqrt();
        assert!(t.abs() < 4.0 && (va + vb).sqrt() < 0.03 * a, "channel {channel}: {b} for {a}, t {t}");
    }
}

/// Means of images with seeds of their own.
fn renders(scene: &Prepared, caustics: bool, spp: u32) -> Vec<Vec3> {
    let techniques = Techniques { caustics, ..Techniques::ALL };
    let one =
        |seed| mean(&render(scene, &RenderSettings { seed, techniques, ..RenderSettings::default() }, 24, 18, spp).0);
    (0..12).map(one).collect()
}

/// Mean of a channel, and the variance of that mean.
fn spread(values: &[Vec3], channel: usize) -> (f64, f64) {
    let n = values.len() as f64;
    let of = || values.iter().map(|value| f64::from(value[channel]));
    let mean = of().sum::<f64>() / n;
    (mean, of().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
}
