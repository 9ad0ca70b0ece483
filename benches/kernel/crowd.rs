//! Scenes of many objects: what a ray costs above the meshes, and what it costs to move everything.

use crate::WAVE;
use crate::clock::{cpu_seconds, median};
use crate::rays::Random;
use firstlight::geometry::Ray;
use firstlight::kdtree::{BuildPreset, HitBatch, HitSpace, MeshTree, RayBatch, RayClass, SceneTree, Shape, SphereTree};
use firstlight::mesh::procedural;
use glam::{Affine3A, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Rays of every class here: `N_RAYS` through the unit box.
const N_RAYS: usize = 1 << 16;

fn balls(random: &mut Random, n: usize) -> Vec<(Vec3, f32)> {
    let size = 0.5 / (n as f32).cbrt();
    (0..n).map(|_| (random.point(), size * (0.3 + 0.7 * random.unit()))).collect()
}

fn crowds() -> Vec<(String, Vec<Shape>)> {
    let mut random = Random(9);
    let mut crowds = Vec::new();
    for n in [100, 1000, 10_000] {
        let sphere = |(center, radius)| Shape::Sphere { center, radius };
        crowds.push((format!("{n} balls"), balls(&mut random, n).into_iter().map(sphere).collect()));
    }
    let cloud = balls(&mut random, 10_000);
    let (centers, radii): (Vec<_>, Vec<_>) = cloud.into_iter().unzip();
    let tree = Arc::new(SphereTree::build(&centers, &radii));
    let world_from_object = Affine3A::IDENTITY;
    crowds.push(("cloud of 10000".into(), vec![Shape::Spheres { tree, world_from_object }]));
    let quads = (0..500).map(|_| {
        let mut edge = || 0.1 * (random.point() - 0.5);
        let (edge_u, edge_v) = (edge(), edge());
        Shape::Quad { corner: random.point(), edge_u, edge_v }
    });
    crowds.push(("500 quads".into(), quads.collect()));
    let mesh = procedural::icosphere(16);
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
    for n in [13, 100, 1000, 10_000] {
        let mesh = |(center, radius)| Shape::Mesh {
            tree: tree.clone(),
            world_from_object: Affine3A::from_translation(center) * Affine3A::from_scale(Vec3::splat(radius)),
            space: HitSpace::Object,
        };
        crowds.push((format!("{n} meshes"), balls(&mut random, n).into_iter().map(mesh).collect()));
    }
    crowds
}

pub fn run(rounds: usize) {
    println!(
        "crowds in a unit box, ns a ray (closest, any; closest one ray at a time), ms to rebuild when all have moved on one thread, on all"
    );
    let all = rayon::ThreadPoolBuilder::new().build().expect("threads");
    for (name, shapes) in crowds() {
        let (mut on_one, mut on_all) = (Vec::new(), Vec::new());
        for _ in 0..5 {
            let (first, second) = (shapes.clone(), shapes.clone());
            let start = cpu_seconds();
            std::hint::black_box(SceneTree::build(first));
            on_one.push(1e3 * (cpu_seconds() - start));
            on_all.push(all.install(|| {
                let start = Instant::now();
                std::hint::black_box(SceneTree::build(second));
                1e3 * start.elapsed().as_secs_f64()
            }));
        }
        let rebuild = [median(&mut on_one), median(&mut on_all)];
        let scene = SceneTree::build(shapes);
        let mut random = Random(4);
        let camera = (0..N_RAYS).map(|i| {
            let at = Vec3::new((i % 256) as f32 / 256.0, (i / 256) as f32 / 256.0, 1.0);
            Ray::new(Vec3::new(0.5, 0.5, 3.0), (at - Vec3::new(0.5, 0.5, 3.0)).normalize())
        });
        let camera: Vec<Ray> = camera.collect();
        let inside: Vec<Ray> = (0..N_RAYS)
            .map(|_| {
                let (a, b) = (random.point(), random.point());
                Ray::new(a, (b - a).normalize())
            })
            .collect();
        for (kind, class, rays) in [("camera", RayClass::Coherent, &camera), ("random", RayClass::Incoherent, &inside)]
        {
            let waves: Vec<RayBatch> = rays.chunks(WAVE).map(|wave| wave.iter().collect()).collect();
            let (mut closest, mut any, mut alone) = (vec![], vec![], vec![]);
            let (mut hits, mut occluded) = (HitBatch::default(), vec![]);
            for _ in 0..rounds {
                let per_ray = |start: f64| 1e9 * (cpu_seconds() - start) / rays.len() as f64;
                let start = cpu_seconds();
                waves.iter().for_each(|wave| scene.closest_hits(wave, class, &mut hits));
                closest.push(per_ray(start));
                let start = cpu_seconds();
                waves.iter().for_each(|wave| scene.any_hits(wave, class, &mut occluded));
                any.push(per_ray(start));
                let start = cpu_seconds();
                rays.iter().step_by(16).for_each(|ray| {
                    std::hint::black_box(scene.closest_hit(ray));
                });
                alone.push(16.0 * per_ray(start));
            }
            let (closest, any, alone) = (median(&mut closest), median(&mut any), median(&mut alone));
            println!(
                "    {name:15} {kind:7} {closest:7.1} {any:7.1} {alone:8.1} (x{:.1})   {:6.2} {:6.2} ms",
                alone / closest,
                rebuild[0],
                rebuild[1]
            );
        }
    }
}
