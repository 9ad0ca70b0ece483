//! The top level: closest-hit and any-hit queries over all objects of a scene.

use super::batch::{HitBatch, RayBatch};
use super::block_tree::BlockTree;
use super::instance_tree::Recent;
use super::leaf::LeafBlock;
use super::ray::{Nearest, TreeRay};
use super::shape::{Hit, HitSpace, RayClass, Shape, object_bounds};
use super::simd::InstructionSet;
use super::sphere_tree::RayF64;
use super::static_tree::{StaticTree, placed_vertices};
use super::surface::{Instance, PlacedShapes, SurfacePoint};
use super::trace::{Instances, TopLevel};
use super::visits::Visits;
use crate::geometry::{Aabb, Ray, Shear, intersect_plane, intersect_quad, intersect_triangle, quad_corners};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Answers closest-hit and any-hit queries over the objects of a scene.
///
/// Ties at equal distance go to the lower object, then to the lower primitive, so every traversal and every build
/// preset of the trees below gives the same bits.
#[derive(Debug, Default)]
pub struct SceneTree {
    objects: PlacedShapes,
    bounds: Aabb,
    top: TopLevel,
}

/// Applies a function to each shape, in parallel if there are many: for a few, the overhead of other threads exceeds
/// the work.
fn map_shapes<T: Send>(shapes: &[Shape], compute: impl Fn(&Shape) -> T + Send + Sync) -> Vec<T> {
    const MIN_PARALLEL: usize = 512;
    if shapes.len() <= MIN_PARALLEL {
        return shapes.iter().map(compute).collect();
    }
    shapes.par_iter().with_min_len(MIN_PARALLEL).map(compute).collect()
}

impl SceneTree {
    /// Builds the tree. Object `i` of all later hits is `shapes[i]`.
    pub fn build(shapes: Vec<Shape>) -> Self {
        Self::build_with(shapes, &[])
    }

    /// Like [`build`](Self::build), with trees for shapes of [`HitSpace::World`]. Shapes that are in none get one now;
    /// hits do not depend on which trees are given.
    pub fn build_with(shapes: Vec<Shape>, statics: &[Arc<StaticTree>]) -> Self {
        let instances = map_shapes(&shapes, Instance::new);
        let boxes = map_shapes(&shapes, object_bounds);
        let bounds = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        let objects = PlacedShapes { shapes, instances };
        let top = TopLevel::new(&objects, &boxes, statics);
        Self { objects, bounds, top }
    }

    /// The shapes passed to [`Self::build`]; a hit's `object` is an index into them.
    pub fn shapes(&self) -> &[Shape] {
        &self.objects.shapes
    }

    /// The trees that its meshes share. [`Self::build_with`] makes trees over some of the shapes of them without building
    /// any.
    pub fn statics(&self) -> Vec<Arc<StaticTree>> {
        self.top.statics.iter().map(|placed| placed.tree.clone()).collect()
    }

    /// The transforms of an object, by its index.
    pub fn instance(&self, object: usize) -> &Instance {
        &self.objects.instances[object]
    }

    /// Returns the surface point of a hit that this tree reported for this ray.
    #[inline]
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.objects.surface_point(ray, hit)
    }

    /// The bounds of all finite objects; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Finds the closest hit of each ray with `0 < t < t_max`; `hits` is resized to the batch.
    pub fn closest_hits(&self, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        self.closest_hits_with(InstructionSet::detect(), rays, class, hits);
    }

    /// Finds whether each ray has any hit with `0 < t < t_max`; `occluded` is resized to the batch.
    pub fn any_hits(&self, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) {
        self.any_hits_with(InstructionSet::detect(), rays, class, occluded);
    }

    /// Like [`closest_hits`](Self::closest_hits), with the given instruction set, for tests and benchmarks.
    ///
    /// # Panics
    /// If the processor does not support the instruction set.
    #[doc(hidden)]
    pub fn closest_hits_with(&self, set: InstructionSet, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        assert!(set.is_available(), "this processor does not have {set:?}");
        hits.resize(rays.len());
        self.top.closest_hits(set, &self.objects, rays, class, hits);
    }

    /// Like [`any_hits`](Self::any_hits), with the given instruction set; panics as [`Self::closest_hits_with`].
    #[doc(hidden)]
    pub fn any_hits_with(&self, set: InstructionSet, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) {
        assert!(set.is_available(), "this processor does not have {set:?}");
        occluded.resize(rays.len(), false);
        self.top.any_hits(set, &self.objects, rays, class, occluded);
    }

    /// Finds the closest hit of a single ray, for picking.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.trace(ray, 0.0, false)
    }

    /// Like [`Self::closest_hit`], for a ray that is known to hit nothing before `t_min`: cells before it are left out.
    pub fn closest_hit_from(&self, ray: &Ray, t_min: f32) -> Option<Hit> {
        self.trace(ray, t_min, false)
    }

    /// Whether a single ray has any hit.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.trace(ray, 0.0, true).is_some()
    }

    /// Like [`Self::closest_hit`], by brute force over every primitive of every object: the reference for all
    /// traversals.
    pub fn closest_hit_naive(&self, ray: &Ray) -> Option<Hit> {
        let scene_ray = SceneRay::new(ray);
        let mut best = None;
        for object in 0..self.objects.shapes.len() as u32 {
            self.offer_object(object, &scene_ray, &mut best, Effort::Naive);
        }
        best
    }

    /// Counts the visits of a closest-hit query in the trees of meshes and in the top-level trees, independent of the
    /// traversal used.
    pub fn count_visits(&self, ray: &Ray) -> Visits {
        let scene_ray = SceneRay::new(ray);
        let mut best = None;
        for &object in &self.top.simple_objects {
            self.offer_object(object, &scene_ray, &mut best, Effort::Closest);
        }
        let loose = &self.top.loose;
        self.walk_loose(loose.spheres.as_ref(), &scene_ray, &mut best, Effort::Closest);
        self.walk_loose(loose.quads.as_ref(), &scene_ray, &mut best, Effort::Closest);
        self.walk_loose(loose.triangles.as_ref(), &scene_ray, &mut best, Effort::Closest);
        let mut visits = self.walk_statics(&scene_ray, 0.0, &mut best, Effort::Closest);
        let mut offer = |object: u32, best: &mut Option<Hit>| {
            if let Shape::Mesh { tree, .. } = &self.objects.shapes[object as usize] {
                let t_max = best.map_or(ray.t_max, |hit| hit.t);
                let own = tree.count_visits(&Ray { t_max, ..self.objects.instances[object as usize].ray(ray) });
                visits.inner += own.inner;
                visits.leaves += own.leaves;
                visits.blocks += own.blocks;
            }
            self.offer_object(object, &scene_ray, best, Effort::Closest);
        };
        let mut above = Visits::default();
        match &self.top.instances {
            Instances::Few(instances) => instances.iter().for_each(|&object| offer(object, &mut best)),
            Instances::Many(tree) => {
                let tree_ray = TreeRay::new(ray.origin, ray.dir, &scene_ray.shear, tree.extent);
                let mut tested = Recent::default();
                let (mut leaves, mut inner) = (0, 0);
                let t_max = best.map_or(ray.t_max, |hit| hit.t);
                let visit = |first, count, _| {
                    leaves += 1;
                    for object in tree.leaf(first, count).filter(|&object| tested.is_new(object)) {
                        offer(object, &mut best);
                    }
                    limit(&best, ray, Effort::Closest)
                };
                tree.nodes.walk_cells(&tree_ray, 0.0, t_max, visit, || inner += 1);
                (above.leaves, above.inner) = (leaves, inner);
            }
        }
        Visits { inner: visits.inner + above.inner, leaves: visits.leaves + above.leaves, ..visits }
    }

    fn trace(&self, ray: &Ray, t_min: f32, any: bool) -> Option<Hit> {
        let scene_ray = SceneRay::new(ray);
        let effort = if any { Effort::Any } else { Effort::Closest };
        let mut best = None;
        for &object in &self.top.simple_objects {
            self.offer_object(object, &scene_ray, &mut best, effort);
        }
        let loose = &self.top.loose;
        self.walk_loose(loose.spheres.as_ref(), &scene_ray, &mut best, effort);
        self.walk_loose(loose.quads.as_ref(), &scene_ray, &mut best, effort);
        self.walk_loose(loose.triangles.as_ref(), &scene_ray, &mut best, effort);
        self.walk_statics(&scene_ray, t_min, &mut best, effort);
        match &self.top.instances {
            Instances::Few(instances) => {
                instances.iter().for_each(|&object| self.offer_object(object, &scene_ray, &mut best, effort));
            }
            Instances::Many(tree) => {
                let tree_ray = TreeRay::new(ray.origin, ray.dir, &scene_ray.shear, tree.extent);
                let mut tested = Recent::default();
                tree.nodes.walk(&tree_ray, best.map_or(ray.t_max, |hit| hit.t), |first, count| {
                    for object in tree.leaf(first, count).filter(|&object| tested.is_new(object)) {
                        self.offer_object(object, &scene_ray, &mut best, effort);
                    }
                    limit(&best, ray, effort)
                });
            }
        }
        best
    }

    fn walk_loose<B: LeafBlock>(
        &self,
        tree: Option<&BlockTree<B>>,
        ray: &SceneRay,
        best: &mut Option<Hit>,
        effort: Effort,
    ) {
        let Some(tree) = tree else { return };
        let tree_ray = TreeRay::new(ray.ray.origin, ray.ray.dir, &ray.shear, tree.extent);
        tree.nodes.walk(&tree_ray, best.map_or(ray.ray.t_max, |hit| hit.t), |first, count| {
            for object in tree.leaf(first, count).prims() {
                self.offer_object(object, ray, best, effort);
            }
            limit(best, &ray.ray, effort)
        });
    }

    fn walk_statics(&self, ray: &SceneRay, t_min: f32, best: &mut Option<Hit>, effort: Effort) -> Visits {
        let mut visits = Visits::default();
        for placed in &self.top.statics {
            let blocks = &placed.tree.blocks;
            let tree_ray = TreeRay::new(ray.ray.origin, ray.ray.dir, &ray.shear, blocks.extent);
            let (mut leaves, mut n_blocks, mut inner) = (0, 0, 0);
            let (t_in, t_max) = tree_ray.clip(placed.bounds(), best.map_or(ray.ray.t_max, |hit| hit.t));
            let visit = |first, count, _| {
                (leaves, n_blocks) = (leaves + 1, n_blocks + count as usize);
                for prim in blocks.leaf(first, count).prims() {
                    if placed.present().is_none_or(|present| present.has(prim)) {
                        let (object, own) = placed.object_of(prim);
                        offer_triangle(&placed.vertices(prim), ray, best, object, own);
                    }
                }
                limit(best, &ray.ray, effort).min(t_max)
            };
            blocks.nodes.walk_cells(&tree_ray, t_min.max(t_in), t_max, visit, || inner += 1);
            visits.inner += inner;
            visits.leaves += leaves;
            visits.blocks += n_blocks;
        }
        visits
    }

    fn offer_object(&self, object: u32, ray: &SceneRay, best: &mut Option<Hit>, effort: Effort) {
        let mut nearest = Nearest::before(best.map_or(ray.ray.t_max, |hit| hit.t));
        // At equal distance the lower object wins, whatever its primitive.
        if best.is_some_and(|hit| object < hit.object) {
            nearest.prim = u32::MAX;
        }
        match &self.objects.shapes[object as usize] {
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
            // In a static tree.
            Shape::Mesh { space: HitSpace::World, .. } if effort != Effort::Naive => {}
            Shape::Mesh { tree, world_from_object, space: HitSpace::World } => {
                for prim in 0..tree.n_triangles() as u32 {
                    let vertices = placed_vertices(tree.vertices(prim), world_from_object);
                    offer_triangle(&vertices, ray, best, object, prim);
                }
            }
            Shape::Mesh { tree, .. } => {
                let ray = self.objects.instances[object as usize].ray(&ray.ray);
                let shear = Shear::new(ray.dir);
                match effort {
                    Effort::Naive => tree.offer_hits_naive(&ray, &shear, &mut nearest),
                    _ => tree.offer_hits(&ray, &shear, &mut nearest, effort == Effort::Any),
                }
            }
            Shape::Spheres { tree, .. } => {
                let ray = self.objects.instances[object as usize].ray(&ray.ray);
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

/// Offers a triangle of a static tree; ties go to the lower object, then to the lower primitive.
fn offer_triangle(vertices: &[Vec3; 3], ray: &SceneRay, best: &mut Option<Hit>, object: u32, prim: u32) {
    let Some(hit) = intersect_triangle(ray.ray.origin, &ray.shear, vertices) else { return };
    let limit = best.map_or(ray.ray.t_max, |best| best.t);
    let wins_tie = best.is_some_and(|best| (object, prim) < (best.object, best.prim));
    if hit.t > 0.0 && (hit.t < limit || hit.t == limit && wins_tie) {
        *best = Some(Hit { t: hit.t, u: hit.u, v: hit.v, prim, object });
    }
}

/// The `t` beyond which a traversal stops.
fn limit(best: &Option<Hit>, ray: &Ray, effort: Effort) -> f32 {
    match best {
        Some(_) if effort == Effort::Any => f32::NEG_INFINITY,
        Some(hit) => hit.t,
        None => ray.t_max,
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Effort {
    Closest,
    Any,
    Naive,
}

/// A ray with the data that tests in world space need.
struct SceneRay {
    ray: Ray,
    shear: Shear,
    wide: RayF64,
}

impl SceneRay {
    fn new(ray: &Ray) -> Self {
        Self { ray: *ray, shear: Shear::new(ray.dir), wide: RayF64::new(ray) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BuildPreset, MeshTree};
    use glam::Affine3A;

    /// While a thread waits for its helpers, it may take over work that traces rays too.
    #[test]
    fn rays_are_traced_by_a_thread_that_builds_a_tree_for_rays() {
        const SIDE: u32 = 150;
        let vertex = |i: u32| Vec3::new((i % SIDE) as f32, ((i * 7) % 5) as f32, (i / SIDE) as f32);
        let positions: Vec<Vec3> = (0..SIDE * SIDE).map(vertex).collect();
        let cells = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| y * SIDE + x));
        let triangles: Vec<[u32; 3]> =
            cells.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]]).collect();
        let mut rays = RayBatch::default();
        (0..64).for_each(|i| rays.push(&Ray::new(Vec3::new(2.3 * i as f32 + 0.1, 9.0, 70.2), Vec3::NEG_Y)));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
        for _ in 0..16 {
            let tree = Arc::new(MeshTree::deferred(&positions, &triangles, BuildPreset::Best));
            let place = |tree| Shape::Mesh { tree, world_from_object: Affine3A::IDENTITY, space: HitSpace::Object };
            let scene = SceneTree::build(vec![place(tree.clone())]);
            assert!(!tree.is_built());
            let found: Vec<Vec<Option<Hit>>> = pool.install(|| {
                let trace = |_: i32| {
                    let mut hits = HitBatch::default();
                    scene.closest_hits(&rays, RayClass::Coherent, &mut hits);
                    (0..64).map(|i| hits.get(i)).collect()
                };
                (0..512).into_par_iter().map(trace).collect()
            });
            assert!(found[0].iter().all(Option::is_some) && found.iter().all(|hits| *hits == found[0]));
        }
    }
}
