//! The binary tree in 8-byte nodes, and the scalar traversal that is the reference for the others.

use super::ray::TreeRay;
use crate::geometry::Aabb;

/// One node in 8 bytes, so that a cache line holds eight.
///
/// | field  | inner node                                            | leaf                                        |
/// |--------|-------------------------------------------------------|---------------------------------------------|
/// | `data` | bits of the split position (`f32`, the tree's metres) | how many blocks or objects                  |
/// | `tag`  | low 2 bits: axis; rest: lower child, the upper follows | low 2 bits: 3; rest: first block or object |
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KdNode {
    data: u32,
    tag: u32,
}
const _: () = assert!(size_of::<KdNode>() == 8);

/// A decoded node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Node {
    Inner { axis: usize, split: f32, first_child: u32 },
    Leaf { first: u32, count: u32 },
}

impl KdNode {
    pub fn inner(axis: usize, split: f32, first_child: u32) -> Self {
        assert!(first_child < 1 << 30, "a tree of more than 2^30 nodes");
        Self { data: split.to_bits(), tag: axis as u32 | first_child << 2 }
    }

    pub fn leaf(first: u32, count: u32) -> Self {
        assert!(first < 1 << 30, "a tree of more than 2^30 leaf blocks");
        Self { data: count, tag: 3 | first << 2 }
    }

    #[inline]
    pub fn unpack(self) -> Node {
        match self.tag & 3 {
            3 => Node::Leaf { first: self.tag >> 2, count: self.data },
            axis => Node::Inner { axis: axis as usize, split: f32::from_bits(self.data), first_child: self.tag >> 2 },
        }
    }
}

/// Greatest leaf depth that traversals must support.
pub(super) const MAX_DEPTH: usize = 64;

/// The nodes, root first, and the bounds of all primitives in them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct KdNodes {
    pub nodes: Vec<KdNode>,
    pub bounds: Aabb,
}

impl KdNodes {
    /// The largest side of the bounds; 0 for an empty tree.
    pub fn extent(&self) -> f32 {
        if self.bounds.is_empty() { 0.0 } else { self.bounds.size().max_element() }
    }

    /// Depth of the deepest leaf; the root has depth 0.
    pub fn depth(&self) -> usize {
        let mut depth = 0;
        self.visit_cells(&mut |_, _, at| depth = depth.max(at));
        depth
    }

    /// Calls `visit(first, count)` for the leaves along the ray, front to back, as long as they start no later than the
    /// limit that `visit` returns; the initial limit is `t_max`.
    #[inline]
    pub fn walk(&self, ray: &TreeRay, t_max: f32, mut visit: impl FnMut(u32, u32) -> f32) {
        self.walk_cells(ray, 0.0, t_max, |first, count, _| visit(first, count), || ());
    }

    /// Like [`walk`](Self::walk), starting at `t_min`. `visit` also gets the latest `t` at which the ray leaves the
    /// cell, and `at_inner` is called for every inner node.
    #[inline]
    pub fn walk_cells(
        &self,
        ray: &TreeRay,
        t_min: f32,
        t_max: f32,
        mut visit: impl FnMut(u32, u32, f32) -> f32,
        mut at_inner: impl FnMut(),
    ) {
        let (t0, mut t1) = ray.clip(&self.bounds, t_max);
        let mut t0 = t0.max(t_min);
        if t0 > t1 {
            return;
        }
        let mut limit = t_max;
        let mut stack = [(0u32, 0.0f32, 0.0f32); MAX_DEPTH];
        let mut height = 0;
        let mut index = 0u32;
        loop {
            match self.nodes[index as usize].unpack() {
                Node::Inner { axis, split, first_child } => {
                    at_inner();
                    let (lo, hi) = ray.crossing(axis, split);
                    let near = first_child + ray.down[axis] as u32;
                    let far = first_child + 1 - ray.down[axis] as u32;
                    // NaN, for a ray in the plane, must visit both children.
                    let skip_near = hi < t0;
                    let skip_far = lo > t1;
                    if skip_near {
                        // Both can only be skipped if the cell was empty: then either is right.
                        (index, t0) = (far, t0.max(lo));
                    } else if skip_far {
                        (index, t1) = (near, t1.min(hi));
                    } else {
                        stack[height] = (far, t0.max(lo), t1);
                        height += 1;
                        (index, t1) = (near, t1.min(hi));
                    }
                    continue;
                }
                Node::Leaf { first, count } => {
                    if count > 0 {
                        limit = visit(first, count, t1);
                    }
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                (index, t0, t1) = stack[height];
                if t0 <= limit {
                    break;
                }
            }
            t1 = t1.min(limit);
        }
    }
}
