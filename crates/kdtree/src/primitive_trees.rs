//! Kd-trees over the simple objects of a scene, one tree per kind, for kinds with too many objects to test one by one.

use super::block_tree::BlockTree;
use super::blocks::{QuadBlock, SphereBlock, TriangleBlock};
use super::build::clip_triangle;
use super::leaf::{BLOCK, LeafBlock};
use super::mesh_tree::BuildPreset;
use super::reference::Primitives;
use super::shape::Shape;
use super::shared_block::SharedBlock;
use super::sphere_tree::clip_sphere;
use crate::geometry::{Aabb, quad_corners};
use glam::Vec3;

/// Up to this many simple objects are tested by every ray; above, a tree pays.
pub(super) const MAX_SIMPLE: usize = 48;

/// Trees over spheres, quads and triangles. Their leaves store object indices.
#[derive(Debug, Default)]
pub(super) struct PrimitiveTrees {
    pub spheres: Option<BlockTree<SphereBlock>>,
    pub quads: Option<BlockTree<QuadBlock>>,
    pub triangles: Option<BlockTree<TriangleBlock>>,
}

impl PrimitiveTrees {
    /// Builds trees for the kinds that need one, the most frequent first, and returns the remaining objects.
    ///
    /// - `boxes`: bounds of all shapes.
    pub fn build(shapes: &[Shape], boxes: &[Aabb]) -> (Self, Vec<u32>) {
        let [mut simple, mut spheres, mut quads, mut triangles] = [const { Vec::new() }; 4];
        for (object, shape) in (0u32..).zip(shapes) {
            match shape {
                Shape::Plane { .. } => simple.push(object),
                Shape::Sphere { .. } => spheres.push(object),
                Shape::Quad { .. } => quads.push(object),
                Shape::Triangle { .. } => triangles.push(object),
                // They have trees of their own.
                Shape::Mesh { .. } | Shape::Spheres { .. } => {}
            }
        }
        let mut kinds = [spheres, quads, triangles];
        kinds.sort_by_key(Vec::len);
        let mut trees = Self::default();
        let mut n_simple = 0;
        for objects in kinds {
            n_simple += objects.len();
            if n_simple <= MAX_SIMPLE {
                simple.extend(objects);
            } else {
                trees.add(shapes, boxes, &objects);
            }
        }
        simple.sort_unstable();
        (trees, simple)
    }

    fn add(&mut self, shapes: &[Shape], boxes: &[Aabb], objects: &[u32]) {
        let loose = Loose { shapes, boxes, objects };
        match &shapes[objects[0] as usize] {
            Shape::Sphere { .. } => {
                let sphere = |object: u32| match &shapes[object as usize] {
                    Shape::Sphere { center, radius } => (*center, *radius),
                    _ => (Vec3::NAN, f32::NAN),
                };
                let make_block = |objects: &[u32]| SphereBlock::new(objects, sphere);
                self.spheres = Some(tree(&loose, make_block, |_| Vec::new()));
            }
            Shape::Quad { .. } => {
                let corners = |object: u32| match &shapes[object as usize] {
                    Shape::Quad { corner, edge_u, edge_v } => quad_corners(*corner, *edge_u, *edge_v),
                    _ => [Vec3::NAN; 4],
                };
                let make_block = |objects: &[u32]| QuadBlock::new(objects, corners);
                self.quads = Some(tree(&loose, make_block, |_| Vec::new()));
            }
            Shape::Triangle { .. } => {
                let vertices = |object: u32| match &shapes[object as usize] {
                    Shape::Triangle { vertices } => *vertices,
                    _ => [Vec3::NAN; 3],
                };
                let make_block = |objects: &[u32]| TriangleBlock::new(objects, vertices);
                let make_compact = |objects: &[u32]| SharedBlock::pack_if_small(objects, vertices);
                self.triangles = Some(tree(&loose, make_block, make_compact));
            }
            Shape::Plane { .. } | Shape::Mesh { .. } | Shape::Spheres { .. } => {}
        }
    }
}

fn tree<B: LeafBlock>(
    loose: &Loose,
    make_block: impl Fn(&[u32]) -> B + Sync,
    make_compact: impl Fn(&[u32]) -> Vec<B::Compact> + Sync,
) -> BlockTree<B> {
    let of_prims = |prims: &[u32]| -> Vec<u32> { prims.iter().map(|&prim| loose.objects[prim as usize]).collect() };
    let config = BuildPreset::Best.config(BLOCK);
    let make_block = |prims: &[u32]| make_block(&of_prims(prims));
    BlockTree::build(loose, &config, make_block, |prims| make_compact(&of_prims(prims)))
}

/// The builder's view of the objects of one kind.
struct Loose<'a> {
    shapes: &'a [Shape],
    boxes: &'a [Aabb],
    objects: &'a [u32],
}

impl Loose<'_> {
    fn shape(&self, prim: u32) -> &Shape {
        &self.shapes[self.objects[prim as usize] as usize]
    }
}

impl Primitives for Loose<'_> {
    fn len(&self) -> usize {
        self.objects.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.boxes[self.objects[prim as usize] as usize]
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        match self.shape(prim) {
            Shape::Triangle { vertices } => clip_triangle(vertices, axis, limit, below, padding),
            Shape::Sphere { center, radius } => Some(clip_sphere(*center, *radius, axis, limit, below, padding)),
            _ => Some(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY }),
        }
    }
}
