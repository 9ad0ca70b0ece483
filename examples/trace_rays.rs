//! Builds a tree over a mesh, traces a batch of rays, and reads back what they hit.
//!
//! ```text
//! cargo run --release --no-default-features --example trace_rays
//! ```

use firstlight::geometry::Ray;
use firstlight::geometry::robust::offset_ray_origin;
use firstlight::kdtree::{BuildPreset, HitBatch, HitSpace, MeshTree, RayBatch, RayClass, SceneTree, Shape};
use glam::{Affine3A, Vec3, vec3};
use std::sync::Arc;

fn main() {
    // A pyramid, built once in its own space and placed twice.
    let positions = [vec3(-1.0, 0.0, -1.0), vec3(1.0, 0.0, -1.0), vec3(1.0, 0.0, 1.0), vec3(-1.0, 0.0, 1.0), Vec3::Y];
    let triangles = [[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0], [0, 1, 2], [0, 2, 3]];
    let pyramid = Arc::new(MeshTree::build(&positions, &triangles, BuildPreset::Best));
    let placed = |at: Vec3| Shape::Mesh {
        tree: pyramid.clone(),
        world_from_object: Affine3A::from_translation(at),
        space: HitSpace::Object,
    };
    let scene = SceneTree::build(vec![
        placed(vec3(-1.5, 0.0, 0.0)),
        placed(vec3(1.5, 0.0, 0.0)),
        Shape::Plane { point: Vec3::ZERO, normal: Vec3::Y },
    ]);

    // Camera rays are neighbours: `Coherent` lets them travel in packets. It never changes the answer.
    let (width, height) = (64, 20);
    let eye = vec3(0.0, 1.6, 6.0);
    let rays: Vec<Ray> = (0..width * height)
        .map(|i| {
            let (x, y) = ((i % width) as f32 / width as f32 - 0.5, 0.5 - (i / width) as f32 / height as f32);
            Ray::new(eye, vec3(1.2 * x, 0.6 * y - 0.2, -1.0).normalize())
        })
        .collect();
    let batch: RayBatch = rays.iter().collect();
    let mut hits = HitBatch::default();
    scene.closest_hits(&batch, RayClass::Coherent, &mut hits);

    // Towards the light, from where the hits are: any obstacle will do, and none is the surface itself.
    let light = vec3(4.0, 6.0, 5.0);
    let mut shadow = RayBatch::default();
    let lit: Vec<(usize, char)> = (0..hits.len())
        .filter_map(|i| {
            let hit = hits.get(i)?;
            let point = scene.surface_point(&rays[i], &hit);
            let origin = offset_ray_origin(point.position, point.error, point.geometric_normal, light - point.position);
            shadow.push(&Ray { origin, dir: light - origin, t_max: 1.0 });
            Some((i, if hit.object == 2 { '.' } else { char::from(b'a' + hit.prim as u8) }))
        })
        .collect();
    let mut occluded = Vec::new();
    scene.any_hits(&shadow, RayClass::Coherent, &mut occluded);

    let mut picture = vec![' '; width * height];
    for ((i, letter), occluded) in lit.into_iter().zip(occluded) {
        picture[i] = if occluded { '#' } else { letter };
    }
    for row in picture.chunks(width) {
        println!("{}", row.iter().collect::<String>());
    }
    println!("letters: triangles of the pyramids; points: ground; #: in the shadow");
}
