//! One way to ask each engine for the distances of closest hits.

use crate::clock::cpu_seconds;
use crate::{RayBatch, RayClass, each};
use bvh::aabb::{Aabb, Bounded, IntersectsAabb};
use bvh::bounding_hierarchy::BHShape;
use firstlight::kdtree::{HitSpace, BuildPreset, HitBatch, MeshTree, SceneTree, Shape};
use glam::{Affine3A, Vec3};
use nalgebra::{Point3, Vector3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;
use peer_glam::Vec3A;
use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

pub trait Engine {
    fn name(&self) -> &'static str;

    /// CPU seconds of one thread.
    fn build_seconds(&self) -> f64;

    /// Distances of the closest hits, infinite where there is none.
    fn closest(&self, wave: &RayBatch, class: RayClass, to: &mut Vec<f32>);
}

fn timed<T>(make: impl FnOnce() -> T) -> (T, f64) {
    let start = cpu_seconds();
    let made = make();
    (made, cpu_seconds() - start)
}

pub struct Firstlight {
    pub scene: SceneTree,
    seconds: f64,
}

impl Firstlight {
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let (tree, seconds) = timed(|| MeshTree::build(positions, triangles, BuildPreset::Best));
        let shape = Shape::Mesh { tree: Arc::new(tree), world_from_object: Affine3A::IDENTITY, space: HitSpace::Object };
        Self { scene: SceneTree::build(vec![shape]), seconds }
    }
}

impl Engine for Firstlight {
    fn name(&self) -> &'static str {
        "firstlight"
    }

    fn build_seconds(&self) -> f64 {
        self.seconds
    }

    fn closest(&self, wave: &RayBatch, class: RayClass, to: &mut Vec<f32>) {
        let mut hits = HitBatch::default();
        self.scene.closest_hits(wave, class, &mut hits);
        to.clear();
        to.extend((0..wave.len()).map(|i| hits.get(i).map_or(f32::INFINITY, |hit| hit.t)));
    }
}

fn peer_triangles(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Triangle> {
    let corner = |i: u32| Vec3A::from_array(positions[i as usize].to_array());
    triangles.iter().map(|t| Triangle { v0: corner(t[0]), v1: corner(t[1]), v2: corner(t[2]) }).collect()
}

fn peer_ray(ray: &firstlight::geometry::Ray) -> obvhs::ray::Ray {
    let vector = |v: Vec3| Vec3A::from_array(v.to_array());
    obvhs::ray::Ray::new(vector(ray.origin), vector(ray.dir), 0.0, ray.t_max)
}

/// The distance that the crate reports: `RayHit::none` holds the largest number.
fn found(hit: bool, t: f32) -> f32 {
    if hit { t } else { f32::INFINITY }
}

/// The best preset of obvhs, with triangles in the order of the leaves, as its examples do.
macro_rules! obvhs_engine {
    ($(#[$doc:meta])* $engine:ident, $name:literal, $tree:ty, $build:path) => {
        $(#[$doc])*
        pub struct $engine {
            tree: $tree,
            triangles: Vec<Triangle>,
            seconds: f64,
        }

        impl $engine {
            pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
                let triangles = peer_triangles(positions, triangles);
                let build = || $build(&triangles, BvhBuildParams::very_slow_build(), &mut Duration::default());
                let (tree, seconds) = timed(build);
                let ordered = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
                Self { tree, triangles: ordered, seconds }
            }
        }

        impl Engine for $engine {
            fn name(&self) -> &'static str {
                $name
            }

            fn build_seconds(&self) -> f64 {
                self.seconds
            }

            fn closest(&self, wave: &RayBatch, _: RayClass, to: &mut Vec<f32>) {
                to.clear();
                to.extend(each(wave).map(|ray| {
                    let mut hit = RayHit::none();
                    let is_hit =
                        self.tree.ray_traverse(peer_ray(&ray), &mut hit, |ray, i| self.triangles[i].intersect(ray));
                    found(is_hit, hit.t)
                }));
            }
        }
    };
}

obvhs_engine!(
    /// Over its binary tree.
    ObvhsBinary,
    "obvhs Bvh2",
    obvhs::bvh2::Bvh2,
    build_bvh2_from_tris
);
obvhs_engine!(
    /// Over its compressed eight-wide tree.
    ObvhsWide,
    "obvhs CwBvh",
    obvhs::cwbvh::CwBvh,
    build_cwbvh_from_tris
);

struct BvhTriangle {
    triangle: Triangle,
    node: usize,
}

impl Bounded<f32, 3> for BvhTriangle {
    fn aabb(&self) -> Aabb<f32, 3> {
        let Triangle { v0, v1, v2 } = self.triangle;
        let point = |v: Vec3A| Point3::new(v.x, v.y, v.z);
        Aabb::with_bounds(point(v0.min(v1).min(v2)), point(v0.max(v1).max(v2)))
    }
}

impl BHShape<f32, 3> for BvhTriangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// A ray that leaves out boxes behind the nearest hit so far: the crate itself looks at every box on the way.
struct Pruned<'a> {
    ray: bvh::ray::Ray<f32, 3>,
    nearest: &'a Cell<f32>,
}

impl IntersectsAabb<f32, 3> for Pruned<'_> {
    fn intersects_aabb(&self, aabb: &Aabb<f32, 3>) -> bool {
        self.ray.intersection_slice_for_aabb(aabb).is_some_and(|(enter, _)| enter <= self.nearest.get())
    }
}

/// The crate `bvh`; its own triangle test leaves out back faces, so that of obvhs stands in.
pub struct Bvh {
    tree: bvh::bvh::Bvh<f32, 3>,
    triangles: Vec<BvhTriangle>,
    seconds: f64,
}

impl Bvh {
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let triangles = peer_triangles(positions, triangles).into_iter();
        let mut triangles: Vec<_> = triangles.map(|triangle| BvhTriangle { triangle, node: 0 }).collect();
        let (tree, seconds) = timed(|| bvh::bvh::Bvh::build(&mut triangles));
        Self { tree, triangles, seconds }
    }
}

impl Engine for Bvh {
    fn name(&self) -> &'static str {
        "bvh"
    }

    fn build_seconds(&self) -> f64 {
        self.seconds
    }

    fn closest(&self, wave: &RayBatch, _: RayClass, to: &mut Vec<f32>) {
        to.clear();
        to.extend(each(wave).map(|ray| {
            let nearest = Cell::new(ray.t_max);
            let vector = |v: Vec3| Vector3::new(v.x, v.y, v.z);
            let query =
                Pruned { ray: bvh::ray::Ray::new(vector(ray.origin).into(), vector(ray.dir)), nearest: &nearest };
            let mut to_test = peer_ray(&ray);
            let mut is_hit = false;
            for shape in self.tree.traverse_iterator(&query, &self.triangles) {
                let t = shape.triangle.intersect(&to_test);
                if t < to_test.tmax {
                    is_hit = true;
                    to_test.tmax = t;
                    nearest.set(t);
                }
            }
            found(is_hit, nearest.get())
        }));
    }
}
