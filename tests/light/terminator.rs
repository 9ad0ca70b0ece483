//! Smooth normals on a coarse mesh: how far its shading is from that of the smooth surface which they tell of.
//!
//! A sphere of flat triangles with the normals of a true one, lit from the side, so that the line between light and
//! shadow runs across the picture. Where a shadow ray starts on the flat triangle, those in the way are the sphere's own
//! and the line comes out as saw teeth. `cargo test --test light terminator:: -- --nocapture` prints the table of
//! `docs/scenes.md`.

use crate::common::{camera, emissive, render};
use firstlight::geometry::{Ray, robust::offset_ray_origin};
use firstlight::kdtree::{BuildPreset, HitSpace, MeshTree, SceneTree, Shape};
use firstlight::mesh::Mesh;
use firstlight::mesh::procedural::icosphere;
use firstlight::render::{Environment, Geometry, Integrator, Object, Prepared, RenderSettings, Shading, Snapshot};
use glam::{Affine3A, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

const SIDE: u32 = 192;
const ALBEDO: f32 = 0.8;
const EYE: Vec3 = Vec3::new(0.0, 0.0, 60.0);
const LIGHT: Vec3 = Vec3::new(-40.0, 0.0, 0.0);
const LIGHT_RADIUS: f32 = 0.01;

fn ball(frequency: u32) -> Arc<Mesh> {
    let mesh = icosphere(frequency);
    let normals = mesh.positions.iter().map(|position| position.normalize()).collect();
    Arc::new(Mesh { normals, ..mesh })
}

fn tree(mesh: &Mesh) -> Arc<MeshTree> {
    Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best))
}

/// The renderer's picture of a shape of diffuse paint under one point light, one sample a pixel.
fn rendered(shape: Shape, mesh: Option<Arc<Mesh>>) -> Vec<f32> {
    let light = Shape::Sphere { center: LIGHT, radius: LIGHT_RADIUS };
    let objects = vec![Object { mesh, ..Object::plain(0) }, Object { is_point_light: true, ..Object::plain(1) }];
    let geometry = Geometry::build(vec![shape, light], objects);
    // No ambient light: its even share would only hide the difference.
    let paint = firstlight::render::Material::Phong {
        diffuse: firstlight::render::ColorInput::Constant(Vec3::splat(ALBEDO)),
        ambient: 0.0,
        specular: firstlight::render::ScalarInput::Constant(0.0),
        shininess: 1.0,
        transparency: 0.0,
        ior: 1.5,
        absorption: Vec3::ZERO,
    };
    let materials = vec![paint, emissive(intensity() / (PI * LIGHT_RADIUS * LIGHT_RADIUS))];
    let shading = Shading::new(materials, Vec::new(), Environment::Black);
    let prepared = Prepared::new(Snapshot::new(geometry, shading, eye()));
    let settings = RenderSettings { integrator: Integrator::Phong, ..RenderSettings::default() };
    render(&prepared, &settings, SIDE, SIDE, 1).0.means().iter().map(|light| light.x).collect()
}

fn eye() -> firstlight::render::Camera {
    camera(EYE, Vec3::ZERO, 2.0)
}

/// W/sr, so that a surface that faces the light gets an irradiance of about 1.
fn intensity() -> f32 {
    LIGHT.length_squared()
}

/// The same without any care for the terminator: the shadow ray starts where the camera ray met the triangle.
fn plain(mesh: &Mesh) -> Vec<f32> {
    let scene = SceneTree::build(vec![Shape::Mesh {
        tree: tree(mesh),
        world_from_object: Affine3A::IDENTITY,
        space: HitSpace::Object,
    }]);
    let shade = |i: u32| {
        let film = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5);
        let ray = eye().ray(film, Vec2::splat(SIDE as f32), Vec2::ZERO);
        let hit = scene.closest_hit(&ray)?;
        let [a, b, c] = mesh.triangles[hit.prim as usize].map(|v| mesh.normals[v as usize]);
        let normal = ((1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c).normalize();
        let point = scene.surface_point(&ray, &hit);
        let way = LIGHT - point.position;
        let cos = normal.dot(way.normalize()).max(0.0);
        let origin = offset_ray_origin(point.position, point.error, point.geometric_normal, point.geometric_normal);
        let shadow = Ray { origin, dir: LIGHT - origin, t_max: 1.0 };
        let lit = point.geometric_normal.dot(way) > 0.0 && !scene.any_hit(&shadow);
        Some(if lit { ALBEDO * FRAC_1_PI * cos * intensity() / way.length_squared() } else { 0.0 })
    };
    (0..SIDE * SIDE).map(|i| shade(i).unwrap_or(0.0)).collect()
}

/// The true sphere on paper, through the middles of the pixels as [`plain`] looks.
fn true_at_centers() -> Vec<f32> {
    let shade = |i: u32| {
        let film = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5);
        let dir = eye().ray(film, Vec2::splat(SIDE as f32), Vec2::ZERO).dir.as_dvec3();
        let origin = EYE.as_dvec3();
        let half = origin.dot(dir);
        let under_root = half * half - (origin.length_squared() - 1.0);
        let point = (origin + (-half - under_root.max(0.0).sqrt()) * dir).as_vec3();
        let way = LIGHT - point;
        let cos = point.normalize().dot(way.normalize()).max(0.0);
        if under_root > 0.0 { ALBEDO * FRAC_1_PI * cos * intensity() / way.length_squared() } else { 0.0 }
    };
    (0..SIDE * SIDE).map(shade).collect()
}

/// RMS and largest difference, percent of the brightest pixel, over the inner part of the disc, where rays meet
/// sphere and mesh alike.
fn difference(picture: &[f32], truth: &[f32]) -> (f64, f64) {
    // Half of the picture is 60 m · tan 1° = 1.047 spheres.
    let inner = |i: u32| {
        let at = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
        at.length() * 1.047 < 0.9
    };
    let brightest = f64::from(truth.iter().copied().fold(0.0, f32::max));
    let differences: Vec<f64> = (0..SIDE * SIDE)
        .filter(|&i| inner(i))
        .map(|i| 100.0 * f64::from((picture[i as usize] - truth[i as usize]).abs()) / brightest)
        .collect();
    let square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
    (square.sqrt(), differences.iter().copied().fold(0.0, f64::max))
}

#[test]
fn coarse_balls_are_shaded_like_true_ones() {
    let truth = rendered(Shape::Sphere { center: Vec3::ZERO, radius: 1.0 }, None);
    println!("| triangles | RMS, plain | largest, plain | RMS | largest |\n|---:|---:|---:|---:|---:|");
    for frequency in [3, 4, 8, 16, 32] {
        let mesh = ball(frequency);
        let shape = Shape::Mesh { tree: tree(&mesh), world_from_object: Affine3A::IDENTITY, space: HitSpace::Object };
        let (rms, largest) = difference(&rendered(shape, Some(mesh.clone())), &truth);
        let (plain_rms, plain_largest) = difference(&plain(&mesh), &true_at_centers());
        println!(
            "| {} | {plain_rms:.2} % | {plain_largest:.1} % | {rms:.2} % | {largest:.1} % |",
            mesh.triangles.len()
        );
        // What is left in the mean is what flat places and blended normals cost anywhere on the sphere, teeth or not.
        assert!(rms < plain_rms, "{frequency}: {rms} against {plain_rms}");
        // Nothing left of the teeth: no pixel is wrong by more than a grazing facet may turn.
        assert!(largest < 0.5 * plain_largest, "{frequency}: {largest} against {plain_largest}");
    }
}
