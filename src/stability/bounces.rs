//! Long paths of diffuse bounces in closed boxes: none may escape, not even in a corner.

use crate::geometry::{Ray, robust::offset_ray_origin};
use crate::kdtree::{BuildPreset, HitBatch, HitSpace, MeshTree, RayBatch, RayClass, SceneTree, Shape};
use crate::mesh::procedural;
use crate::stability::random::Random;
use crate::stability::tally::Tally;
use crate::stability::test_scene::describe;
use glam::{Affine3A, DVec3, Quat, Vec3, vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Returns closed boxes of side 2 about the origin.
fn boxes() -> Vec<(&'static str, SceneTree)> {
    let (o, s) = (Vec3::splat(-1.0), 2.0);
    let (x, y, z) = (Vec3::X * s, Vec3::Y * s, Vec3::Z * s);
    let quad = |corner, edge_u, edge_v| Shape::Quad { corner, edge_u, edge_v };
    let walls =
        vec![quad(o, x, y), quad(o + z, x, y), quad(o, y, z), quad(o + x, y, z), quad(o, z, x), quad(o + y, z, x)];
    let mesh = procedural::cuboid(DVec3::splat(2.0));
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
    let turned = Affine3A::from_quat(Quat::from_axis_angle(vec3(0.6, 0.8, 0.0), 0.7));
    let ball = Shape::Sphere { center: Vec3::ZERO, radius: 1.0 };
    let hull = procedural::icosphere(4);
    let hull = Arc::new(MeshTree::build(&hull.positions, &hull.triangles, BuildPreset::Best));
    let placed = |tree: &Arc<MeshTree>, world_from_object, space| {
        SceneTree::build(vec![Shape::Mesh { tree: tree.clone(), world_from_object, space }])
    };
    vec![
        ("box of quads", SceneTree::build(walls)),
        ("box of triangles", placed(&tree, Affine3A::IDENTITY, HitSpace::World)),
        ("turned box of triangles", placed(&tree, turned, HitSpace::World)),
        ("turned box with its own tree", placed(&tree, turned, HitSpace::Object)),
        ("ball", SceneTree::build(vec![ball])),
        ("sphere of triangles", placed(&hull, Affine3A::IDENTITY, HitSpace::World)),
    ]
}

/// Bounces of each path.
pub const BOUNCES: u64 = 100_000;

/// Traces paths of [`BOUNCES`] diffuse bounces in every box, `n` rays in all; counts those that escaped.
pub fn run(n: u64, tick: &(dyn Fn(u64) + Sync)) -> Tally {
    let boxes = boxes();
    let paths = (n / BOUNCES / boxes.len() as u64).clamp(1, 1 << 20);
    boxes
        .par_iter()
        .enumerate()
        .flat_map(|(test_scene, (name, scene))| {
            (0..paths.div_ceil(PATHS)).into_par_iter().map(move |batch| {
                let count = PATHS.min(paths - batch * PATHS);
                bounce(test_scene, name, scene, batch * PATHS, count, tick)
            })
        })
        .reduce(Tally::default, Tally::merged)
}

/// Paths per batch.
const PATHS: u64 = 256;

fn bounce(
    test_scene: usize,
    name: &str,
    scene: &SceneTree,
    first: u64,
    count: u64,
    tick: &(dyn Fn(u64) + Sync),
) -> Tally {
    let mut tally = Tally { rays: count * BOUNCES, ..Tally::default() };
    let mut randoms: Vec<Random> = (0..count).map(|i| Random::new(0xB0 + test_scene as u64, first + i)).collect();
    let start = |random: &mut Random| Ray::new(random.point() * 0.5, random.direction());
    let mut rays: RayBatch = randoms.iter_mut().map(start).collect::<Vec<_>>().iter().collect();
    let (mut hits, mut next) = (HitBatch::default(), RayBatch::default());
    for depth in 0..BOUNCES {
        scene.closest_hits(&rays, RayClass::Incoherent, &mut hits);
        next.clear();
        for (i, random) in randoms.iter_mut().enumerate() {
            let ray = rays.get(i);
            let Some(hit) = hits.get(i) else {
                tally.leaks += 1;
                tally.offer(1e9, test_scene, first + i as u64, || {
                    format!("{name}, bounce {depth}: {}", describe(&ray, &None))
                });
                next.push(&start(random));
                continue;
            };
            let point = scene.surface_point(&ray, &hit);
            let inwards = if point.geometric_normal.dot(ray.dir) > 0.0 { -1.0 } else { 1.0 } * point.geometric_normal;
            // Sometimes aimed exactly at an edge or a corner of the box.
            let dir = match random.below(8) {
                0 => {
                    let mut at = random.point();
                    let (axis, other) = (random.below(3), random.below(3));
                    (at[axis], at[other]) = (1f32.copysign(at[axis]), 1f32.copysign(at[other]));
                    at - point.position
                }
                _ => (inwards + random.direction() * 0.999).normalize(),
            };
            let dir = if dir.dot(inwards) > 1e-6 { dir } else { inwards };
            next.push(&Ray::new(offset_ray_origin(point.position, point.error, inwards, dir), dir));
        }
        std::mem::swap(&mut rays, &mut next);
        if depth % 1000 == 999 {
            tick(1000 * count);
        }
    }
    tally
}
