//! Light that smooth surfaces gather, found by paths from the lamps and from the eye together.

mod common;

use common::*;
use firstlight::kdtree::Shape;
use firstlight::render::{
    Camera, ColorInput, Environment, Film, Material, PixelFilter, RenderSettings, ScalarInput, Snapshot, Techniques,
    advance,
};
use glam::{DVec3, Vec3};

const GLASS: Material = Material::Glass { ior: 1.5, absorption: Vec3::ZERO };

fn mirror(reflectance: f32) -> Material {
    Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(reflectance)) }
}

fn blend(a: u32, b: u32, weight: f32) -> Material {
    Material::Blend { weight: ScalarInput::Constant(weight), a, b }
}

fn settings(seed: u32, caustics: bool) -> RenderSettings {
    RenderSettings { seed, techniques: Techniques { caustics, ..Techniques::ALL }, ..RenderSettings::default() }
}

/// Mean of all pixels and channels over renders with seeds of their own, and its standard error.
fn mean_of_renders(scene: &Snapshot, settings: RenderSettings, size: (u32, u32), spp: u32, renders: u32) -> (f64, f64) {
    let means: Vec<f64> = (0..renders)
        .map(|k| {
            let settings = RenderSettings { seed: settings.seed + k, ..settings };
            let (film, _) = render(scene, &settings, size.0, size.1, spp);
            film.means().iter().map(|mean| mean.as_dvec3().element_sum() / 3.0).sum::<f64>() / f64::from(size.0 * size.1)
        })
        .collect();
    let n = f64::from(renders);
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// A room with a lamp, a floor and something smooth.
fn room(smooth: Vec<(Shape, u32)>, lamp: Shape, camera: Camera) -> Snapshot {
    let mut shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0), 0),
        (lamp, 1),
    ];
    shapes.extend(smooth);
    let materials = vec![diffuse(0.6), emissive(20.0), GLASS, mirror(0.9), blend(0, 3, 0.4)];
    scene(shapes, materials, Environment::Black, camera)
}

fn eye() -> Camera {
    camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0)
}

fn quad_lamp() -> Shape {
    quad(Vec3::new(-0.3, 2.6, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6)
}

#[test]
fn the_mean_is_that_of_paths_from_the_eye_alone() {
    let mut lens = eye();
    (lens.lens_radius, lens.focus_distance, lens.blades) = (0.2, 4.0, 5);
    let mirror_quad = quad(Vec3::new(-1.8, 0.0, 1.0), Vec3::new(0.2, 0.0, -2.0), Vec3::new(-0.3, 1.5, 0.0));
    let cases = [
        ("a glass ball", room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)], quad_lamp(), eye())),
        ("through a lens", room(vec![(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)], quad_lamp(), lens)),
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
                quad_lamp(),
                eye(),
            ),
        ),
    ];
    for (name, scene) in &cases {
        assert!(scene.shading.features.caustics);
        let (expected, error) = mean_of_renders(scene, settings(100, false), (24, 18), 2048, 12);
        let (found, other) = mean_of_renders(scene, settings(1, true), (24, 18), 256, 12);
        println!("{name}: {found:.5} ± {other:.5} for {expected:.5} ± {error:.5}");
        let t = (found - expected) / error.hypot(other);
        assert!(t.abs() < 4.5, "{name}: {found} ± {other} for {expected} ± {error}");
    }
}
