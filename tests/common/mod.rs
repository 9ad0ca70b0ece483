//! Small scenes built by hand, straight from shapes and materials.
#![allow(dead_code, reason = "each test file uses its own part")]

use firstlight::kdtree::Shape;
use firstlight::render::{
    Camera, ColorInput, DeltaLight, Environment, Film, Geometry, Material, Object, PassReport, Prepared,
    RenderSettings, Shading, Snapshot, advance,
};
use glam::Vec3;
use std::sync::Arc;

pub fn diffuse(albedo: f32) -> Material {
    Material::Diffuse { albedo: ColorInput::Constant(Vec3::splat(albedo)) }
}

pub fn emissive(radiance: f32) -> Material {
    Material::Emissive { radiance: ColorInput::Constant(Vec3::splat(radiance)) }
}

pub fn sphere(center: Vec3, radius: f32) -> Shape {
    Shape::Sphere { center, radius }
}

pub fn plane(point: Vec3, normal: Vec3) -> Shape {
    Shape::Plane { point, normal }
}

pub fn quad(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Shape {
    Shape::Quad { corner, edge_u, edge_v }
}

/// A pinhole at `camera`; `vfov` in degrees.
pub fn camera(eye: Vec3, look_at: Vec3, vfov: f32) -> Camera {
    Camera::looking_at(eye, look_at, (0.5 * vfov.to_radians()).tan())
}

/// Each shape with the index of its material.
pub fn scene(
    shapes: Vec<(Shape, u32)>,
    materials: Vec<Material>,
    environment: Environment,
    camera: Camera,
) -> Prepared {
    let (shapes, objects) = shapes.into_iter().map(|(shape, m)| (shape, Object::plain(m))).unzip();
    let geometry = Geometry::build(shapes, objects);
    let shading = Shading::new(materials, Vec::new(), environment);
    Prepared::new(Snapshot::new(geometry, shading, camera))
}

/// The same with these lights without size.
pub fn with_lights(scene: &Prepared, delta_lights: Vec<DeltaLight>) -> Prepared {
    scene.with_shading(Arc::new(Shading { delta_lights, ..(*scene.shading).clone() }))
}

pub fn render(scene: &Prepared, settings: &RenderSettings, width: u32, height: u32, spp: u32) -> (Film, PassReport) {
    let mut film = Film::new(width, height);
    let report = advance(scene, settings, &mut film, spp, &|| false);
    assert!(report.completed && film.spp() == spp);
    assert_eq!(report.n_bad, 0, "samples that are not finite: {:?}", report.bad);
    (film, report)
}

/// Mean of the values, and its standard error.
pub fn mean_of(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

/// Mean over the image, and its standard error from the scatter between pixels.
pub fn picture_mean(film: &Film) -> (f64, f64) {
    mean_of(&film.means().iter().map(|color| f64::from(color.y)).collect::<Vec<_>>())
}

/// Mean of all pixels and channels over renders with seeds of their own, and its standard error.
pub fn mean_of_renders(
    scene: &Prepared,
    settings: RenderSettings,
    (width, height): (u32, u32),
    spp: u32,
    renders: u32,
) -> (f64, f64) {
    let mean = |k| {
        let means =
            render(scene, &RenderSettings { seed: settings.seed + k, ..settings }, width, height, spp).0.means();
        means.iter().map(|mean| mean.as_dvec3().element_sum() / 3.0).sum::<f64>() / means.len() as f64
    };
    mean_of(&(0..renders).map(mean).collect::<Vec<_>>())
}
