//! Shading of sixteen paths at a time, held against one path at a time, sample by sample.

mod common;

use common::*;
use firstlight::kdtree::{BuildPreset, InstructionSet, MeshTree, Shape};
use firstlight::mesh::procedural;
use firstlight::render::{
    BadSample, ColorInput, Environment, Film, Fresnel, Geometry, Material, Object, PixelFilter, RenderSettings,
    ScalarInput, Shading, Snapshot, Techniques, Texture, TexturePattern, advance, replay_sample,
};
use glam::{Affine3A, Mat2, UVec2, Vec2, Vec3};
use std::sync::Arc;

fn metal(alpha: f32, fresnel: Fresnel, compensate: bool) -> Material {
    let reflectance = ColorInput::Constant(Vec3::new(0.9, 0.6, 0.3));
    Material::Metal { alpha: ScalarInput::Constant(alpha), reflectance, fresnel, compensate }
}

/// A room with a thing of each material, of each shape, under `lights`.
fn room(lights: Vec<Shape>, environment: Environment, air: Vec3) -> Snapshot {
    let mesh = procedural::icosphere(3).with_vertex_normals();
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
    let placed = Affine3A::from_translation(Vec3::new(1.2, 0.9, 0.4)) * Affine3A::from_scale(Vec3::splat(0.4));
    let triangle = [Vec3::new(-2.0, 0.1, -1.0), Vec3::new(0.0, 0.3, -1.4), Vec3::new(-1.0, 2.0, -1.2)];
    let mut shapes = vec![
        (quad(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::Z * -6.0), 0),
        (plane(Vec3::Z * -2.0, Vec3::Z), 1),
        (sphere(Vec3::new(-1.2, 0.5, 0.2), 0.5), 2),
        (sphere(Vec3::new(0.0, 0.5, 0.6), 0.5), 3),
        (Shape::Triangle { vertices: triangle }, 4),
        (sphere(Vec3::new(0.9, 0.3, 1.2), 0.3), 5),
        (Shape::Mesh { tree, world_from_object: placed }, 6),
        (sphere(Vec3::new(-0.6, 0.25, 1.3), 0.25), 7),
        (sphere(Vec3::new(0.0, 0.4, 0.6), 0.2), 8),
    ];
    shapes.extend(lights.into_iter().map(|light| (light, 9)));
    let checker = ColorInput::Texture(0);
    let materials = vec![
        Material::Diffuse { albedo: checker },
        diffuse(0.6),
        Material::Mirror { reflectance: ColorInput::Constant(Vec3::new(0.9, 0.95, 0.8)) },
        Material::Glass { ior: 1.5, absorption: Vec3::new(0.3, 0.1, 0.5) },
        metal(0.15, Fresnel::Constant, false),
        metal(0.4, Fresnel::Schlick, true),
        Material::Diffuse { albedo: ColorInput::Constant(Vec3::new(0.7, 0.2, 0.1)) },
        metal(1e-6, Fresnel::Schlick, false),
        Material::Glass { ior: 1.2, absorption: Vec3::ZERO },
        emissive(7.0),
    ];
    let objects = shapes.iter().enumerate().map(|(i, (_, material))| Object {
        mesh: (i == 6).then(|| Arc::new(mesh.clone())),
        ..Object::plain(*material)
    });
    let objects = objects.collect();
    let geometry = Geometry::build(shapes.into_iter().map(|(shape, _)| shape).collect(), objects);
    let pattern = TexturePattern::Checker { a: Vec3::splat(0.7), b: Vec3::new(0.1, 0.3, 0.5) };
    let textures = vec![Texture { pattern, uv_matrix: Mat2::from_diagonal(Vec2::splat(9.0)), uv_offset: Vec2::ZERO }];
    let shading = Shading::build(&geometry, materials, textures, environment).with_air(air);
    let mut camera = camera(Vec3::new(0.2, 1.6, 5.0), Vec3::new(0.0, 0.6, 0.0), 42.0);
    (camera.lens_radius, camera.focus_distance) = (0.03, 5.0);
    Snapshot { geometry: Arc::new(geometry), shading: Arc::new(shading), camera }
}

fn rooms() -> Vec<(&'static str, Snapshot)> {
    let ball = || sphere(Vec3::new(1.5, 2.5, 1.0), 0.4);
    let lamp = || quad(Vec3::new(-1.0, 3.0, -0.5), Vec3::X * 1.2, Vec3::Z * 0.9);
    let slanted = || quad(Vec3::new(-2.5, 1.0, 1.0), Vec3::new(0.1, 0.6, 0.1), Vec3::new(0.2, 0.1, 0.8));
    let many = (0..20).map(|i| sphere(Vec3::new(i as f32 * 0.2 - 2.0, 2.6, 0.5), 0.08)).collect();
    let triangle =
        Shape::Triangle { vertices: [Vec3::new(-1.0, 3.0, 0.0), Vec3::new(1.0, 3.0, 0.0), Vec3::new(0.0, 3.0, 1.0)] };
    let sky = Environment::Gradient { zenith: Vec3::new(0.2, 0.4, 0.9), horizon: Vec3::ONE, ground: Vec3::splat(0.1) };
    vec![
        ("one quad", room(vec![lamp()], Environment::Black, Vec3::ZERO)),
        ("one ball", room(vec![ball()], Environment::Constant(Vec3::splat(0.3)), Vec3::ZERO)),
        ("both and a slanted one", room(vec![ball(), lamp(), slanted()], sky, Vec3::splat(0.05))),
        ("a triangle", room(vec![triangle, ball()], Environment::Black, Vec3::ZERO)),
        ("many", room(many, Environment::Black, Vec3::ZERO)),
    ]
}

#[test]
fn lanes_find_what_one_path_at_a_time_finds() {
    for (name, scene) in rooms() {
        for techniques in std::iter::once(Techniques::ALL).chain(Techniques::ablations().map(|(_, t)| t)) {
            let lanes = RenderSettings { techniques, seed: 7, max_depth: 12, ..RenderSettings::default() };
            let single = RenderSettings { lanes: None, ..lanes };
            let size = UVec2::new(24, 24);
            let (mut n_differing, n) = (0, if techniques == Techniques::ALL { 24 * 24 * 4 } else { 24 * 24 });
            let (mut sums, mut differing_by) = ([0.0f64; 2], 0.0);
            for i in 0..n {
                let at = BadSample { x: i % 24, y: i / 24 % 24, sample: i / 576 };
                let [a, b] = [&lanes, &single].map(|settings| replay_sample(&scene, settings, size, at).y);
                // Rounding may send a path past an edge, or end it where it would have gone on.
                n_differing += u32::from((a - b).abs() > 1e-2 * b + 1e-5);
                // Rare bright samples say little about the rest.
                let [a, b] = [a, b].map(|y| f64::from(y.min(20.0)));
                sums[0] += a;
                sums[1] += b;
                differing_by += (a - b).powi(2);
            }
            let share = f64::from(n_differing) / f64::from(n);
            assert!(share < 0.02, "{name}, {techniques:?}: {share} of the samples differ");
            // The means differ by no more than the few samples that do.
            let difference = (sums[0] - sums[1]).abs();
            assert!(difference <= 4.0 * differing_by.sqrt() + 1e-3 * sums[1], "{name}, {techniques:?}: {sums:?}");
        }
    }
}

#[test]
fn all_instruction_sets_draw_the_same_picture() {
    for (name, scene) in rooms() {
        for filter in [PixelFilter::Box, PixelFilter::Tent] {
            let draw = |set| {
                let settings = RenderSettings { lanes: Some(set), filter, ..RenderSettings::default() };
                let mut film = Film::new(21, 19);
                advance(&scene, &settings, &mut film, 4, &|| false);
                film.means().iter().flat_map(|mean| mean.to_array().map(f32::to_bits)).collect::<Vec<_>>()
            };
            let expected = draw(InstructionSet::Portable);
            for set in InstructionSet::available() {
                assert!(draw(set) == expected, "{name}, {filter:?}: {set:?}");
            }
        }
    }
}
