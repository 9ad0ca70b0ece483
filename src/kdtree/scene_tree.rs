//! The upper level: a tree over the finite objects of a scene, with the infinite planes beside it.

use super::build::{BuildConfig, Primitives, build};
use super::mesh_tree::BuildPreset;
use super::nodes::KdNodes;
use super::ray::{Nearest, TreeRay};
use super::simd::InstructionSet;
use super::sphere_tree::{WideRay, ball_bounds};
use super::surface::Instance;
use super::trace::FlatScene;
use super::{HitBatch, MeshTree, RayBatch, SphereTree, Visits};
use crate::geometry::{Aabb, Ray, Shear, intersect_plane, intersect_quad, intersect_triangle, quad_corners};
use glam::{Affine3A, DAffine3, Vec3};
use std::sync::Arc;

/// The geometry of one object, in the space of the snapshot unless said otherwise.
#[derive(Clone, Debug)]
pub enum Shape {
    Sphere {
        center: Vec3,
        radius: f32,
    },
    /// Infinite; `normal` is unit.
    Plane {
        point: Vec3,
        normal: Vec3,
    },
    /// A parallelogram; its front looks along `edge_u × edge_v`.
    Quad {
        corner: Vec3,
        edge_u: Vec3,
        edge_v: Vec3,
    },
    Triangle {
        vertices: [Vec3; 3],
    },
    Mesh {
        tree: Arc<MeshTree>,
        world_from_object: Affine3A,
    },
    /// `world_from_object` rotates, moves and scales evenly.
    Spheres {
        tree: Arc<SphereTree>,
        world_from_object: Affine3A,
    },
}

/// What the caller knows of a batch: it picks the traversal, never the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayClass {
    /// Neighbours in the batch run side by side: camera rays and their shadow rays, in tile order.
    Coherent,
    /// Everything else.
    Incoherent,
}

/// One hit; fields as in [`HitBatch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub prim: u32,
    pub object: u32,
}

/// Which surface does a ray meet first?
///
/// Equal distances are decided by the lower object, then the lower primitive, so that every traversal and every
/// preset of the trees below answers with the same bits.
#[derive(Debug, Default)]
pub struct SceneTree {
    shapes: Vec<Shape>,
    pub(super) instances: Vec<Instance>,
    planes: Vec<u32>,
    nodes: Option<KdNodes>,
    /// What the leaves of `nodes` refer to.
    leaf_objects: Vec<u32>,
    extent: f32,
    /// In scenes of few objects, for batches.
    flat: Option<FlatScene>,
}

/// Inverted in `f64`: the result is as good as `f32` can hold.
pub(super) fn inverse(matrix: &Affine3A) -> Affine3A {
    let wide = DAffine3::from_mat3_translation(matrix.matrix3.as_dmat3(), matrix.translation.as_dvec3()).inverse();
    Affine3A::from_mat3_translation(wide.matrix3.as_mat3(), wide.translation.as_vec3())
}

/// In an order of roundings that every instruction set repeats.
#[inline]
pub(super) fn transform_vector(map: &Affine3A, v: Vec3) -> Vec3 {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(Vec3::from);
    (x * v.x + y * v.y) + z * v.z
}

#[inline]
pub(super) fn transform_point(map: &Affine3A, p: Vec3) -> Vec3 {
    transform_vector(map, p) + Vec3::from(map.translation)
}

struct Objects<'a>(&'a [Shape]);

impl Primitives for Objects<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        object_bounds(&self.0[prim as usize])
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        match &self.0[prim as usize] {
            Shape::Triangle { vertices } => super::build::clip_triangle(vertices, axis, limit, below, padding),
            _ => Some(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY }),
        }
    }
}

/// The box around an object in the world, wide enough for the rounding of rays that are moved into its own space.
/// Empty for planes and for objects without any surface.
fn object_bounds(shape: &Shape) -> Aabb {
    let placed = |bounds: Aabb, map: &Affine3A| {
        if bounds.is_empty() {
            return bounds;
        }
        let corners = (0..8).map(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            transform_point(map, Vec3::new(pick(0), pick(1), pick(2)))
        });
        let around = Aabb::from_points(corners);
        // The map back may stretch errors by the condition of the matrix.
        let back = inverse(map);
        let condition = max_row_sum(map) * max_row_sum(&back);
        let largest = around.min.abs().max(around.max.abs()).max_element() + map.translation.abs().max_element();
        let slack = super::ray::WIDEN * condition * largest;
        Aabb { min: around.min - slack, max: around.max + slack }
    };
    match shape {
        Shape::Plane { .. } => Aabb::EMPTY,
        Shape::Sphere { center, radius } => ball_bounds(*center, *radius),
        Shape::Quad { corner, edge_u, edge_v } => Aabb::from_points(quad_corners(*corner, *edge_u, *edge_v)),
        Shape::Triangle { vertices } => Aabb::from_points(*vertices),
        Shape::Mesh { tree, world_from_object } => placed(tree.bounds(), world_from_object),
        Shape::Spheres { tree, world_from_object } => placed(tree.bounds(), world_from_object),
    }
}

fn max_row_sum(map: &Affine3A) -> f32 {
    let m = map.matrix3;
    (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element()
}

impl SceneTree {
    /// Object `i` of all later hits is `shapes[i]`.
    pub fn build(shapes: Vec<Shape>) -> Self {
        let instances = shapes.iter().map(Instance::new).collect();
        let planes = (0u32..).zip(&shapes).filter(|(_, shape)| matches!(shape, Shape::Plane { .. }));
        let planes = planes.map(|(object, _)| object).collect();
        let config = BuildConfig { block_cost: 4.0, max_growth: 2.0, ..BuildPreset::Best.config(1) };
        let mut leaf_objects = Vec::new();
        let nodes = build(&Objects(&shapes), &config, |leaf| {
            leaf_objects.extend_from_slice(leaf);
            ((leaf_objects.len() - leaf.len()) as u32, leaf.len() as u32)
        });
        let extent = nodes.extent();
        let flat = FlatScene::new(&shapes);
        Self { shapes, instances, planes, nodes: Some(nodes), leaf_objects, extent, flat }
    }

    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The box around all finite objects; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.nodes.as_ref().map_or(Aabb::EMPTY, |nodes| nodes.bounds)
    }

    /// The nearest hit of each ray with `0 < t < t_max`; `hits` is reset to the size of the batch.
    pub fn closest_hits(&self, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        self.closest_hits_with(InstructionSet::detect(), rays, class, hits);
    }

    /// Whether anything lies on each ray with `0 < t < t_max`; `occluded` is resized to the batch.
    pub fn any_hits(&self, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) {
        self.any_hits_with(InstructionSet::detect(), rays, class, occluded);
    }

    /// The same by the instructions of the caller's choice, for tests and benchmarks.
    ///
    /// # Panics
    /// If the processor does not have them.
    #[doc(hidden)]
    pub fn closest_hits_with(&self, set: InstructionSet, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        assert!(set.is_available(), "this processor does not have {set:?}");
        hits.resize(rays.len());
        match &self.flat {
            Some(flat) => flat.closest_hits(set, self, rays, class, hits),
            None => (0..rays.len()).for_each(|i| hits.set(i, self.closest_hit(&rays.get(i)))),
        }
    }

    /// As [`Self::closest_hits_with`].
    #[doc(hidden)]
    pub fn any_hits_with(&self, set: InstructionSet, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) {
        assert!(set.is_available(), "this processor does not have {set:?}");
        occluded.resize(rays.len(), false);
        match &self.flat {
            Some(flat) => flat.any_hits(set, self, rays, class, occluded),
            None => (0..rays.len()).for_each(|i| occluded[i] = self.any_hit(&rays.get(i))),
        }
    }

    /// One ray, for the mouse.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.trace(ray, false)
    }

    /// Whether anything lies on the ray, one ray at a time.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.trace(ray, true).is_some()
    }

    /// The same as [`Self::closest_hit`] by trying every primitive of every object: the reference for all else.
    pub fn closest_hit_naive(&self, ray: &Ray) -> Option<Hit> {
        let scene_ray = SceneRay::new(ray);
        let mut best = None;
        for object in 0..self.shapes.len() as u32 {
            self.offer_object(object, &scene_ray, &mut best, Effort::Naive);
        }
        best
    }

    /// What the nearest hit of a ray costs, in this tree and those below it, whatever traversal finds it.
    pub fn count_visits(&self, ray: &Ray) -> Visits {
        let scene_ray = SceneRay::new(ray);
        let mut best = None;
        for &plane in &self.planes {
            self.offer_object(plane, &scene_ray, &mut best, Effort::Closest);
        }
        let mut visits = Visits::default();
        let Some(nodes) = &self.nodes else { return visits };
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &scene_ray.shear, self.extent);
        let mut tested = Recent::default();
        let (mut inner, mut below) = (0, Visits::default());
        let t_max = best.map_or(ray.t_max, |hit| hit.t);
        let visit = |first: u32, count: u32| {
            below.leaves += 1;
            for &object in &self.leaf_objects[first as usize..][..count as usize] {
                if tested.is_new(object) {
                    if let Shape::Mesh { tree, .. } = &self.shapes[object as usize] {
                        let t_max = best.map_or(ray.t_max, |hit: Hit| hit.t);
                        let own = tree.count_visits(&Ray { t_max, ..self.instances[object as usize].ray(ray) });
                        below.inner += own.inner;
                        below.leaves += own.leaves;
                        below.blocks += own.blocks;
                    }
                    self.offer_object(object, &scene_ray, &mut best, Effort::Closest);
                }
            }
            best.map_or(ray.t_max, |hit| hit.t)
        };
        nodes.walk_counting(&tree_ray, t_max, visit, || inner += 1);
        visits.inner = inner + below.inner;
        (visits.leaves, visits.blocks) = (below.leaves, below.blocks);
        visits
    }

    fn trace(&self, ray: &Ray, any: bool) -> Option<Hit> {
        let scene_ray = SceneRay::new(ray);
        let effort = if any { Effort::Any } else { Effort::Closest };
        let mut best = None;
        for &plane in &self.planes {
            self.offer_object(plane, &scene_ray, &mut best, effort);
        }
        let done = |best: &Option<Hit>| any && best.is_some();
        if let Some(nodes) = &self.nodes
            && !done(&best)
        {
            let tree_ray = TreeRay::new(ray.origin, ray.dir, &scene_ray.shear, self.extent);
            let mut tested = Recent::default();
            let t_max = best.map_or(ray.t_max, |hit| hit.t);
            nodes.walk(&tree_ray, t_max, |first, count| {
                for &object in &self.leaf_objects[first as usize..][..count as usize] {
                    if tested.is_new(object) {
                        self.offer_object(object, &scene_ray, &mut best, effort);
                    }
                }
                if done(&best) { f32::NEG_INFINITY } else { best.map_or(ray.t_max, |hit| hit.t) }
            });
        }
        best
    }

    fn offer_object(&self, object: u32, ray: &SceneRay, best: &mut Option<Hit>, effort: Effort) {
        let mut nearest = Nearest::before(best.map_or(ray.ray.t_max, |hit| hit.t));
        // At equal distance the lower object wins, whatever its primitive.
        if best.is_some_and(|hit| object < hit.object) {
            nearest.prim = u32::MAX;
        }
        match &self.shapes[object as usize] {
            Shape::Sphere { center, radius } => ray.wide.offer_sphere(*center, *radius, 0, &mut nearest),
            Shape::Plane { point, normal } => {
                nearest.offer(intersect_plane(ray.wide.origin, ray.wide.dir, *point, *normal), 0.0, 0.0, 0);
            }
            Shape::Quad { corner, edge_u, edge_v } => {
                let corners = quad_corners(*corner, *edge_u, *edge_v);
                if let Some(hit) = intersect_quad(ray.ray.origin, &ray.shear, &corners) {
                    nearest.offer(hit.t, hit.u, hit.v, 0);
                }
            }
            Shape::Triangle { vertices } => {
                if let Some(hit) = intersect_triangle(ray.ray.origin, &ray.shear, vertices) {
                    nearest.offer(hit.t, hit.u, hit.v, 0);
                }
            }
            Shape::Mesh { tree, .. } => {
                let ray = self.instances[object as usize].ray(&ray.ray);
                let shear = Shear::new(ray.dir);
                match effort {
                    Effort::Naive => tree.offer_hits_naive(&ray, &shear, &mut nearest),
                    _ => tree.offer_hits(&ray, &shear, &mut nearest, effort == Effort::Any),
                }
            }
            Shape::Spheres { tree, .. } => {
                let ray = self.instances[object as usize].ray(&ray.ray);
                match effort {
                    Effort::Naive => tree.offer_hits_naive(&ray, &mut nearest),
                    _ => tree.offer_hits(&ray, &Shear::new(ray.dir), &mut nearest, effort == Effort::Any),
                }
            }
        }
        if nearest.found {
            *best = Some(Hit { t: nearest.t, u: nearest.u, v: nearest.v, prim: nearest.prim, object });
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Effort {
    Closest,
    Any,
    Naive,
}

/// A ray with all that the objects of the world want to know about it.
struct SceneRay {
    ray: Ray,
    shear: Shear,
    wide: WideRay,
}

impl SceneRay {
    fn new(ray: &Ray) -> Self {
        Self { ray: *ray, shear: Shear::new(ray.dir), wide: WideRay::new(ray) }
    }
}

/// The objects tested last: one that spans many cells need not be tested in each.
#[derive(Default)]
struct Recent {
    /// Plus 1; 0 for none.
    objects: [u32; 8],
}

impl Recent {
    fn is_new(&mut self, object: u32) -> bool {
        let slot = &mut self.objects[object as usize % 8];
        std::mem::replace(slot, object + 1) != object + 1
    }
}
