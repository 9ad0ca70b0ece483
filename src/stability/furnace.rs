//! White furnaces: in a uniform environment no lossless object is visible, whatever it is inside of.
//!
//! A camera inside glass of index n sees n² times the radiance. [`nested`] has the cases on which tracking of media
//! fails: many shells, equal and alternating indices, bodies that overlap, touch or share their walls, a camera at
//! every level, both integrators, with and without SIMD. [`random`] has randomly generated scenes.

use crate::kdtree::{BuildPreset, HitSpace, MeshTree, Shape, SphereTree};
use crate::mesh::{Mesh, procedural};
use crate::render::{Camera, Environment, Fresnel, Integrator, Material, Object, RenderSettings, ScalarInput};
use crate::stability::light::{LightCase, camera, diffuse, grey, prepared};
use crate::stability::random::Random;
use glam::{Affine3A, Quat, Vec3, vec3};
use std::sync::Arc;

/// A shape, its material, and its mesh if it is one.
type PlacedShape = (Shape, u32, Option<Arc<Mesh>>);

/// Combinations of integrator and SIMD.
const MODES: [(Integrator, bool); 3] = [(Integrator::Path, true), (Integrator::Path, false), (Integrator::Phong, true)];

pub fn glass(ior: f32) -> Material {
    Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 }
}

fn metal(alpha: f32) -> Material {
    let alpha = ScalarInput::Constant(alpha);
    Material::Metal { alpha, reflectance: grey(1.0), fresnel: Fresnel::Constant, compensate: true }
}

fn blend(weight: f32, a: u32, b: u32) -> Material {
    Material::blend(ScalarInput::Constant(weight), a, b)
}

fn classic(specular: f32, transparency: f32, ior: f32) -> Material {
    Material::Phong {
        diffuse: grey(1.0),
        ambient: 1.0,
        specular: ScalarInput::Constant(specular),
        shininess: 20.0,
        transparency,
        ior,
        absorption: Vec3::ZERO,
    }
}

fn ball(center: Vec3, radius: f32, material: u32) -> PlacedShape {
    (Shape::Sphere { center, radius }, material, None)
}

fn mesh(mesh: Mesh, world_from_object: Affine3A, material: u32) -> PlacedShape {
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
    (Shape::Mesh { tree, world_from_object, space: HitSpace::Object }, material, Some(Arc::new(mesh)))
}

/// A box of six outward-facing quads.
fn quad_box(center: Vec3, half: Vec3, material: u32) -> Vec<PlacedShape> {
    let (o, x, y, z) = (center - half, 2.0 * half.x * Vec3::X, 2.0 * half.y * Vec3::Y, 2.0 * half.z * Vec3::Z);
    let faces = [(o, y, x), (o + z, x, y), (o, z, y), (o + x, y, z), (o, x, z), (o + y, z, x)];
    faces.map(|(corner, edge_u, edge_v)| (Shape::Quad { corner, edge_u, edge_v }, material, None)).into()
}

/// Makes a case.
///
/// - `index`: of the medium that contains the camera.
fn furnace(
    name: String,
    shapes: Vec<PlacedShape>,
    materials: Vec<Material>,
    view: Camera,
    index: f32,
    (integrator, simd): (Integrator, bool),
) -> LightCase {
    let (shapes, objects) =
        shapes.into_iter().map(|(shape, material, mesh)| (shape, Object { mesh, ..Object::plain(material) })).unzip();
    let mut settings = RenderSettings { integrator, ..RenderSettings::default() };
    if !simd {
        settings.simd = None;
    }
    let mode = match (integrator, simd) {
        (Integrator::Phong, _) => ", phong",
        (_, true) => "",
        (_, false) => ", one path at a time",
    };
    LightCase {
        name: name + mode,
        scene: prepared(shapes, objects, materials, Environment::Constant(Vec3::ONE), view),
        settings,
        width: 16,
        height: 16,
        spp: 16,
        expected: f64::from(index * index),
        // Of the mean, in addition to its noise: paths ended by Russian roulette contribute whole samples.
        allowed: 1e-3,
        allowed_loss: 1e-3,
        every_pixel: false,
    }
}

fn outside() -> Camera {
    camera(vec3(0.0, 0.4, 4.0), Vec3::ZERO, 40.0)
}

/// Index of refraction of shell `i`, outermost first.
type Indices = (&'static str, fn(usize) -> f32);

const INDICES: [Indices; 3] = [
    ("equal", |_| 1.5),
    ("alternating", |i| if i.is_multiple_of(2) { 1.5 } else { 1.0 }),
    ("rising", |i| 1.0 + 0.03 * (i % 40 + 1) as f32),
];

/// Nested spheres.
fn shells(n: usize, index: fn(usize) -> f32) -> (Vec<PlacedShape>, Vec<Material>) {
    let shapes = (0..n).map(|i| ball(Vec3::ZERO, 1.0 - i as f32 / (n + 1) as f32, i as u32)).collect();
    (shapes, (0..n).map(|i| glass(index(i))).collect())
}

/// Returns the fixed cases; see the [module](self).
pub fn nested() -> Vec<LightCase> {
    let mut pictures = Vec::new();
    for mode in MODES {
        for n in [1, 2, 3, 4, 5, 6, 8, 12, 20, 50, 100] {
            for (which, index) in INDICES {
                // In the classic model rays split at each surface.
                if mode.0 == Integrator::Phong && n > 12 && which != "equal" {
                    continue;
                }
                let (shapes, materials) = shells(n, index);
                pictures.push(furnace(format!("{n} shells, {which}"), shapes, materials, outside(), 1.0, mode));
            }
        }
        // One material for all: a boundary between equal media is invisible.
        let shapes = (0..30).map(|i| ball(Vec3::ZERO, 1.0 - 0.03 * i as f32, 0)).collect();
        pictures.push(furnace("30 shells of one material".into(), shapes, vec![glass(1.5)], outside(), 1.0, mode));
        let shapes = (0..30).map(|i| ball(Vec3::ZERO, 1.0 - 0.03 * i as f32, i % 2)).collect();
        let two = vec![glass(1.5), glass(1.33)];
        pictures.push(furnace("30 shells of two materials".into(), shapes, two, outside(), 1.0, mode));
        // A camera in the middle of every layer.
        for level in 0..6 {
            let (shapes, materials) = shells(6, INDICES[2].1);
            let eye = vec3(0.02, 0.01, 1.0 - (level as f32 + 0.5) / 7.0);
            let view = camera(eye, vec3(0.3, 0.2, -1.0), 90.0);
            let name = format!("a camera inside of {} of 6 shells", level + 1);
            pictures.push(furnace(name, shapes, materials, view, INDICES[2].1(level), mode));
        }
        let two = |outer: PlacedShape, inner: PlacedShape| vec![outer, inner];
        let (o, r) = (Vec3::ZERO, 0.9);
        let cases: Vec<(&str, Vec<PlacedShape>)> = vec![
            ("overlapping spheres", two(ball(Vec3::X * 0.4, 0.7, 0), ball(Vec3::X * -0.3, 0.6, 1))),
            ("touching spheres", two(ball(Vec3::X * 0.5, 0.5, 0), ball(Vec3::X * -0.5, 0.5, 1))),
            ("a shared surface", two(ball(o, r, 0), ball(o, r, 1))),
            ("a sphere that touches from inside", two(ball(o, r, 0), ball(Vec3::Y * 0.4, 0.5, 1))),
            ("a sphere half outside of another", two(ball(o, r, 0), ball(Vec3::Y * 0.9, 0.5, 1))),
            ("boxes that share a wall", {
                let mut walls = quad_box(vec3(-0.5, 0.0, 0.0), Vec3::splat(0.5), 0);
                walls.extend(quad_box(vec3(0.5, 0.0, 0.0), Vec3::splat(0.5), 1));
                walls
            }),
            ("a box in a box with three common walls", {
                let mut walls = quad_box(o, Vec3::splat(0.8), 0);
                walls.extend(quad_box(Vec3::splat(-0.3), Vec3::splat(0.5), 1));
                walls
            }),
            ("meshes within each other", {
                let turned = |scale: f32| {
                    Affine3A::from_scale_rotation_translation(
                        Vec3::splat(scale),
                        Quat::from_axis_angle(vec3(0.6, 0.8, 0.0), scale),
                        Vec3::ZERO,
                    )
                };
                (0..8).map(|i| mesh(procedural::icosphere(3).flat(), turned(1.0 - 0.11 * i as f32), i % 2)).collect()
            }),
            ("an open sheet from before", vec![sheet(Vec3::Z)]),
            ("an open sheet from behind", vec![sheet(Vec3::NEG_Z)]),
            ("a half-space", vec![(Shape::Plane { point: Vec3::ZERO, normal: Vec3::Y }, 0, None)]),
        ];
        for (name, shapes) in cases {
            pictures.push(furnace(name.into(), shapes, vec![glass(1.5), glass(1.2)], outside(), 1.0, mode));
        }
        // The medium inside a blend with glass is that glass.
        let others = [diffuse(1.0), Material::Mirror { reflectance: grey(1.0) }, glass(1.7), metal(0.3)];
        for (name, other) in ["diffuse", "mirror", "a second glass", "metal"].into_iter().zip(others) {
            let materials = vec![glass(1.5), glass(1.3), other, blend(0.5, 1, 2)];
            let alone = vec![ball(o, 0.6, 3)];
            pictures.push(furnace(format!("glass and {name}"), alone, materials.clone(), outside(), 1.0, mode));
            let inside = two(ball(o, r, 0), ball(o, 0.6, 3));
            pictures.push(furnace(
                format!("glass and {name}, in glass"),
                inside,
                materials.clone(),
                outside(),
                1.0,
                mode,
            ));
            let around = two(ball(o, r, 3), ball(o, 0.6, 0));
            pictures.push(furnace(format!("glass and {name}, around glass"), around, materials, outside(), 1.0, mode));
        }
    }
    pictures
}

fn sheet(normal: Vec3) -> PlacedShape {
    let edge_u = 1.6 * Vec3::X * normal.z;
    (Shape::Quad { corner: -0.5 * edge_u - 0.8 * Vec3::Y, edge_u, edge_v: 1.6 * Vec3::Y }, 0, None)
}

/// Number of scenes that [`random`] makes.
pub const N_RANDOM: u64 = 2000;

/// Random lossless scenes: spheres, clouds, meshes and boxes, nested, overlapping and apart, of every material.
pub fn random() -> Vec<LightCase> {
    (0..N_RANDOM).map(random_scene).collect()
}

/// A closed body with an inside test.
struct Body {
    center: Vec3,
    /// Radius of the sphere, or half the sides of the box.
    half: Vec3,
    is_box: bool,
    material: usize,
}

impl Body {
    fn has(&self, point: Vec3) -> bool {
        let d = point - self.center;
        if self.is_box { d.abs().cmplt(self.half).all() } else { d.length() < self.half.x }
    }

    /// Whether a point is so close to the surface that the inside test of a mesh of this body may differ.
    fn is_near(&self, point: Vec3) -> bool {
        let d = (point - self.center).abs();
        let distance = if self.is_box { (d - self.half).max_element() } else { d.length() - self.half.x };
        distance.abs() < 0.2 * self.half.min_element()
    }

    fn volume(&self) -> f32 {
        if self.is_box {
            8.0 * self.half.element_product()
        } else {
            4.0 / 3.0 * std::f32::consts::PI * self.half.x.powi(3)
        }
    }
}

fn random_scene(seed: u64) -> LightCase {
    let mut random = Random::new(0xF0_12AC, seed);
    let mut materials = Vec::new();
    for _ in 0..4 {
        let ior = [1.0, 1.0 + 1e-4, 1.2, 1.33, 1.5, 1.9, 2.4, 0.8][random.below(8)];
        materials.push(match random.below(10) {
            0..=5 => glass(ior),
            6 => diffuse(1.0),
            7 => Material::Mirror { reflectance: grey(1.0) },
            8 => metal([0.0, 0.02, 0.1, 0.2, 0.4][random.below(5)]),
            _ => classic(random.unit(), random.unit(), ior),
        });
    }
    // Drawn from a separate generator, so that scenes without rough glass do not change.
    let mut roughening = Random::new(0x20_0676, seed);
    let mut is_lossy = false;
    for material in &mut materials {
        if let Material::Glass { ior, absorption, .. } = *material
            && roughening.below(6) == 0
        {
            let alpha = [0.0, 1e-4, 1e-3, 0.03, 0.2, 0.5, 1.0][roughening.below(7)];
            *material = Material::RoughGlass {
                alpha: ScalarInput::Constant(alpha),
                ior,
                absorption,
                dispersion: 0.0,
                compensate: false,
                beckmann: false,
            };
            is_lossy = true;
        }
    }
    for _ in 0..3 {
        let parts = materials.len();
        // A blend of blends has at most eight lobes, and each classic material has three.
        let (a, b) = (random.below(4.min(parts)) as u32, random.below(4) as u32);
        materials.push(blend([0.02, 0.3, 0.5, 0.9][random.below(4)], a, b));
    }
    let n = 1 + random.below(7);
    let is_concentric = random.below(2) == 0;
    let mut bodies: Vec<Body> = Vec::new();
    for i in 0..n {
        let (center, size) = if is_concentric {
            (0.02 * random.point(), 1.0 - 0.9 * i as f32 / n as f32)
        } else {
            (0.6 * random.point(), 0.2 + 0.6 * random.unit())
        };
        let is_box = random.below(4) == 0;
        let half = if is_box { Vec3::splat(size * 0.57) } else { Vec3::splat(size) };
        bodies.push(Body { center, half, is_box, material: random.below(materials.len()) });
    }
    let mut shapes = Vec::new();
    for body in &bodies {
        let Body { center, half, material, .. } = *body;
        let id = material as u32;
        match (body.is_box, random.below(4)) {
            (true, 0..=1) => {
                let place = Affine3A::from_translation(center);
                shapes.push(mesh(procedural::cuboid((2.0 * half).as_dvec3()), place, id));
            }
            (true, _) => {
                // Boxes of quads with one material form one body: each box gets its own copy of the material.
                materials.push(materials[material].clone());
                shapes.extend(quad_box(center, half, materials.len() as u32 - 1));
            }
            (false, 0) => {
                let place = Affine3A::from_scale_rotation_translation(
                    half,
                    Quat::from_axis_angle(random.direction(), 3.0 * random.unit()),
                    center,
                );
                shapes.push(mesh(procedural::icosphere(3).flat(), place, id));
            }
            (false, 1) => {
                let (far, tiny) = (vec3(50.0, 0.0, 0.0), 1e-3);
                let tree = Arc::new(SphereTree::build(&[center, far], &[half.x, tiny]));
                shapes.push((Shape::Spheres { tree, world_from_object: Affine3A::IDENTITY }, id, None));
            }
            (false, _) => shapes.push(ball(center, half.x, id)),
        }
    }
    let (view, index, is_inside) = random_camera(&mut random, &bodies, &materials);
    let mode = MODES[random.below(3)];
    let mut picture = furnace(format!("scene {seed}"), shapes, materials, view, index, mode);
    (picture.width, picture.height, picture.spp) = (12, 12, 8);
    // Dense glass with many corners traps some paths beyond their longest life; from inside, some never escape. Light
    // that bounces more than once between microfacets is lost.
    picture.allowed_loss = if is_inside || is_lossy { 1.0 } else { 0.05 };
    picture
}

/// Returns a camera outside, or inside of transparent bodies; the index at its position, which is that of the smallest
/// body; and whether it is inside.
fn random_camera(random: &mut Random, bodies: &[Body], materials: &[Material]) -> (Camera, f32, bool) {
    let towards = 0.3 * random.point();
    for _ in 0..20 {
        if random.below(3) > 0 {
            break;
        }
        let eye = 0.8 * random.point();
        if bodies.iter().any(|body| body.is_near(eye)) {
            continue;
        }
        let mut within: Vec<&Body> = bodies.iter().filter(|body| body.has(eye)).collect();
        within.sort_by(|a, b| b.volume().total_cmp(&a.volume()));
        let iors: Option<Vec<f32>> = within.iter().map(|body| first_ior(materials, body.material)).collect();
        if let Some(iors) = iors {
            let view = camera(eye, eye + random.direction(), 70.0);
            return (view, iors.last().copied().unwrap_or(1.0), !iors.is_empty());
        }
    }
    (camera(towards + 4.0 * random.direction(), towards, 40.0), 1.0, false)
}

/// Index of the first transparent part of a material; `None` if it has none.
fn first_ior(materials: &[Material], id: usize) -> Option<f32> {
    match &materials[id] {
        Material::Glass { ior, .. } | Material::RoughGlass { ior, .. } => Some(*ior),
        Material::Phong { ior, transparency, .. } => (*transparency > 0.0).then_some(*ior),
        Material::Blend { a, b, .. } => first_ior(materials, *a as usize).or_else(|| first_ior(materials, *b as usize)),
        _ => None,
    }
}
