//! Small scenes: a box of ten quads and spheres without any mesh, and what a ray costs there.

use crate::WAVE;
use crate::clock::{cpu_seconds, median};
use crate::rays::{Random, tiles};
use firstlight::geometry::{Ray, robust::offset_ray_origin};
use firstlight::kdtree::{HitBatch, InstructionSet, RayBatch, RayClass, SceneTree, Shape};
use glam::{Vec3, vec3};

fn cornell() -> SceneTree {
    let quad = |corner, edge_u, edge_v| Shape::Quad { corner, edge_u, edge_v };
    let (x, y, z, o) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0, vec3(-1.0, 0.0, -1.0));
    SceneTree::build(vec![
        quad(o, z, x),
        quad(o + y, x, z),
        quad(o, x, y),
        quad(o, y, z),
        quad(o + x, z, y),
        quad(vec3(-0.3, 1.99, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6),
        quad(vec3(-0.7, 0.4, -0.5), vec3(0.5, 0.0, 0.1), vec3(-0.1, 0.0, 0.5)),
        quad(vec3(-0.7, 0.0, -0.5), vec3(0.5, 0.0, 0.1), vec3(0.0, 0.4, 0.0)),
        Shape::Sphere { center: vec3(0.4, 0.35, 0.2), radius: 0.35 },
        Shape::Sphere { center: vec3(-0.4, 0.65, -0.3), radius: 0.25 },
    ])
}

pub fn run(rounds: usize) {
    let scene = cornell();
    let mut random = Random(3);
    let eye = vec3(0.0, 1.0, 3.4);
    let primary: Vec<Ray> = tiles(384)
        .map(|(x, y)| {
            let at = vec3((x as f32 + random.unit()) / 192.0 - 1.0, (y as f32 + random.unit()) / 192.0, 1.0);
            Ray::new(eye, (at - eye).normalize())
        })
        .collect();
    let bounces: Vec<Ray> = primary
        .iter()
        .filter_map(|ray| {
            let point = scene.surface_point(ray, &scene.closest_hit(ray)?);
            let dir = random.cosine(point.geometric_normal);
            Some(Ray::new(offset_ray_origin(point.position, point.error, point.geometric_normal, dir), dir))
        })
        .collect();
    println!("box of 8 quads and 2 balls, ns a ray (closest, any), {:?}", InstructionSet::detect());
    for (name, rays) in [("primary", &primary), ("bounce", &bounces)] {
        let waves: Vec<RayBatch> = rays.chunks(WAVE).map(|wave| wave.iter().collect()).collect();
        for set in InstructionSet::available() {
            let (mut closest, mut any) = (vec![], vec![]);
            let (mut hits, mut occluded) = (HitBatch::default(), vec![]);
            for wave in &waves {
                scene.closest_hits_with(set, wave, RayClass::Incoherent, &mut hits);
                for i in 0..wave.len() {
                    assert_eq!(hits.get(i), scene.closest_hit_naive(&wave.get(i)));
                }
            }
            for _ in 0..rounds {
                let per_ray = |start: f64| 1e9 * (cpu_seconds() - start) / rays.len() as f64;
                let start = cpu_seconds();
                waves.iter().for_each(|wave| scene.closest_hits_with(set, wave, RayClass::Incoherent, &mut hits));
                closest.push(per_ray(start));
                let start = cpu_seconds();
                waves.iter().for_each(|wave| scene.any_hits_with(set, wave, RayClass::Incoherent, &mut occluded));
                any.push(per_ray(start));
            }
            println!("    {name:8} {:9} {:6.1} {:6.1}", format!("{set:?}"), median(&mut closest), median(&mut any));
        }
    }
}
