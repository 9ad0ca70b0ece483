//! Caustics of delta lights where they are seen in a mirror or through glass: what is seen in a mirror is what is seen
//! from behind it, where light paths find all.

use crate::caustics::layered_glass;
use crate::common::*;
use firstlight::kdtree::{BuildPreset, HitSpace, MeshTree, Shape};
use firstlight::mesh::procedural;
use firstlight::render::{
    Camera, ColorInput, Cone, DeltaLight, Environment, Falloff, Geometry, LightSource, Material, Object, Prepared,
    RenderSettings, Shading, Snapshot, Techniques, explain,
};
use glam::{Affine3A, UVec2, Vec3};
use std::sync::Arc;

const GLASS: Material = Material::Glass { ior: 1.5, absorption: Vec3::new(0.4, 0.2, 0.1), dispersion: 0.0 };
/// So far above the floor that the light has spread again where it arrives.
const BALL: Vec3 = Vec3::new(0.0, 1.3, 0.0);

/// A coarse mesh with smooth normals.
fn smooth_body() -> (Shape, Object) {
    let mesh = Arc::new(procedural::icosphere(8).with_vertex_normals());
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
    let world_from_object = Affine3A::from_scale_rotation_translation(Vec3::splat(0.5), glam::Quat::IDENTITY, BALL);
    let shape = Shape::Mesh { tree, world_from_object, space: HitSpace::Object };
    (shape, Object { mesh: Some(mesh), ..Object::plain(1) })
}

fn ball() -> (Shape, Object) {
    (sphere(BALL, 0.5), Object::plain(1))
}

/// A floor under `body` and `light`, looked at where the light is gathered: directly, and in a mirror.
fn views(body: (Shape, Object), material: Material, light: DeltaLight, target: Vec3) -> [Prepared; 2] {
    let eye = target + Vec3::new(0.5, 2.4, 0.0);
    let middle = 0.5 * (eye + target);
    let (down, sideways) = ((target - middle).normalize(), Vec3::X);
    let normal = (down + sideways).normalize();
    let behind = eye - 2.0 * (eye - middle).dot(normal) * normal;
    let across = normal.cross(Vec3::Z);
    let mirror = quad(middle - 0.2 * across - 0.2 * Vec3::Z, 0.4 * across, 0.4 * Vec3::Z);
    let of = |camera: Camera, with_mirror: bool| {
        // No larger than what is seen of it, so that the mirror shows it nothing else that is lit.
        let floor = quad(target + Vec3::new(-0.3, 0.0, 0.3), 0.6 * Vec3::X, -0.6 * Vec3::Z);
        let mut parts = vec![(floor, Object::plain(0)), body.clone()];
        if with_mirror {
            parts.push((mirror.clone(), Object::plain(2)));
        }
        let (shapes, objects) = parts.into_iter().unzip();
        let white = Material::Mirror { reflectance: ColorInput::Constant(Vec3::ONE) };
        let materials = vec![diffuse(0.6), material.clone(), white];
        let shading = Shading::new(materials, Vec::new(), Environment::Black);
        let scene = Prepared::new(Snapshot::new(Geometry::build(shapes, objects), shading, camera));
        with_lights(&scene, vec![light])
    };
    [of(camera(eye, target, 10.0), false), of(camera(behind, middle, 10.0), true)]
}

/// Mean and its error, without direct light: that is the same in both views.
fn gathered(scene: &Prepared, depth: u32, spp: u32, simd: bool) -> (f64, f64) {
    let usual = RenderSettings { max_depth: depth, techniques: Techniques::ALL, seed: 3, ..RenderSettings::default() };
    let settings = if simd { usual } else { RenderSettings { simd: None, ..usual } };
    mean_of_renders(scene, settings, (8, 8), spp, 12)
}

#[test]
fn a_mirror_shows_what_delta_lights_gather() {
    let at = Vec3::new(-1.2, 3.2, 0.9);
    let intensity = Vec3::new(3.0, 4.0, 5.0);
    let point = DeltaLight::Point { position: at, intensity };
    let cone = Cone::new((BALL - at).normalize(), 0.05, 0.6, Falloff::Smooth);
    let spot = DeltaLight::Spot { position: at, intensity, cone, image: None };
    let far = DeltaLight::Directional { direction: (BALL - at).normalize(), irradiance: Vec3::ONE };
    // The middle of the shadow.
    let target = BALL + BALL.y * (BALL - at) / (at.y - BALL.y);
    let dispersive = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.5 };
    let cases = [
        ("sphere, point", ball(), GLASS, point),
        ("sphere, spot", ball(), GLASS, spot),
        ("sphere, from infinity", ball(), GLASS, far),
        ("sphere that disperses, point", ball(), dispersive, point),
        ("sphere by layers, point", ball(), layered_glass(), point),
        ("mesh, point", smooth_body(), GLASS, point),
    ];
    for (name, body, material, light) in cases {
        let [direct, mirrored] = views(body, material, light, target);
        let (expected, error) = gathered(&direct, 4, 1024, true);
        for simd in [true, false] {
            let (found, other) = gathered(&mirrored, 5, 512, simd);
            println!("{name}: {found:.5} ± {other:.5} for {expected:.5} ± {error:.5}");
            let noise = error.hypot(other);
            assert!(noise < 0.01 * expected, "{name}: too noisy to tell: {noise}");
            assert!((found - expected).abs() < 4.5 * noise, "{name}: {found} ± {other} for {expected} ± {error}");
        }
    }
}

#[test]
fn what_a_chain_brings_is_said_to_be_of_its_light() {
    let at = Vec3::new(-1.2, 3.2, 0.9);
    let target = BALL + BALL.y * (BALL - at) / (at.y - BALL.y);
    let lights = [
        DeltaLight::Point { position: at, intensity: Vec3::splat(4.0) },
        DeltaLight::Directional { direction: (BALL - at).normalize(), irradiance: Vec3::ONE },
    ];
    for light in lights {
        let [_, mirrored] = views(ball(), GLASS, light, target);
        let settings = RenderSettings { max_depth: 5, ..RenderSettings::default() };
        let explanation = explain(&mirrored, &settings, UVec2::splat(8), UVec2::splat(4), 0..2048).unwrap();
        let parts = explanation.contributions();
        let [part] = &parts[..] else { panic!("{parts:?}") };
        assert_eq!((part.source, part.bounces), (LightSource::Delta(0), 4));
        assert!(part.radiance.min_element() > 0.0 && (part.radiance - explanation.mean()).length() < 1e-12);
    }
}
