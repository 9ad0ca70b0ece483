//! Kd-tree over the bounds of objects that have their own tree, used when there are many of them.

use super::block_tree::BlockTree;
use super::blocks::TriangleBlock;
use super::build::{LeafMaker, append_part, build};
use super::leaf::{BLOCK, Prims};
use super::mesh_tree::{BuildPreset, Triangles};
use super::node8::{DescentRay, LEAF, Node8, STACK, collapse};
use super::nodes::KdNodes;
use super::reference::{BuildConfig, Primitives};
use super::shape::{Shape, placed_bounds};
use super::simd::{KernelSimd, Mask};
use super::sphere_tree::SphereTree;
use super::support::Support;
use super::surface::PlacedShapes;
use crate::geometry::Aabb;
use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

#[derive(Debug)]
pub(super) struct InstanceTree {
    /// Binary nodes, for single rays and as the reference.
    pub nodes: KdNodes,
    /// The same tree as [`Node8`], for streams.
    pub nodes8: Vec<Node8>,
    /// The largest side of the bounds.
    pub extent: f32,
    blocks: Vec<BoxBlock>,
    placements: Vec<Placement>,
    /// The trees of the objects, each once.
    own_trees: Vec<OwnTree>,
}

/// What a ray needs to enter an object, in one cache line.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Placement {
    /// The columns of `Instance::object_from_world`.
    columns: [[f32; 3]; 4],
    pub object: u32,
    /// Index into `own_trees`.
    own_tree: u32,
}
const _: () = assert!(size_of::<Placement>() == 64);

impl Placement {
    #[inline(always)]
    pub fn object_from_world(&self) -> Affine3A {
        let [x, y, z, translation] = self.columns.map(Vec3A::from_array);
        Affine3A { matrix3: Mat3A::from_cols(x, y, z), translation }
    }
}

/// The tree of an object.
#[derive(Clone, Debug)]
pub(super) enum OwnTree {
    Mesh(OwnMesh),
    Spheres(Arc<SphereTree>),
}

/// The triangles of a mesh and the tree over them.
#[derive(Clone, Debug)]
pub(super) struct OwnMesh {
    mesh: Arc<Triangles>,
    pub blocks: Arc<BlockTree<TriangleBlock>>,
}

impl OwnTree {
    /// Returns the tree of a shape; `None` for a shape without one.
    pub fn of(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Mesh { tree, .. } => {
                Some(Self::Mesh(OwnMesh { mesh: tree.mesh.clone(), blocks: tree.blocks().clone() }))
            }
            Shape::Spheres { tree, .. } => Some(Self::Spheres(tree.clone())),
            _ => None,
        }
    }

    /// The same for the same tree.
    fn support(&self) -> Support {
        match self {
            Self::Mesh(own) => Support::of(own.mesh.positions.iter().map(|&position| (position, 0.0))),
            Self::Spheres(tree) => Support::of((0..tree.len() as u32).map(|prim| tree.sphere(prim))),
        }
    }

    fn bounds(&self) -> Aabb {
        match self {
            Self::Mesh(own) => own.mesh.bounds,
            Self::Spheres(tree) => tree.bounds(),
        }
    }

    fn address(&self) -> usize {
        match self {
            Self::Mesh(own) => Arc::as_ptr(&own.blocks).addr(),
            Self::Spheres(tree) => Arc::as_ptr(tree).addr(),
        }
    }
}

/// The objects, or their placements, that were tested last, so that one that spans many cells is not tested in each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Recent {
    /// Index plus 1; 0 for an empty slot.
    objects: [u32; 8],
}

impl Recent {
    pub const NEW: Self = Self { objects: [0; 8] };

    #[inline(always)]
    pub fn is_new(&mut self, object: u32) -> bool {
        let slot = &mut self.objects[object as usize % 8];
        std::mem::replace(slot, object + 1) != object + 1
    }
}

/// The bounds of up to sixteen placements.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct BoxBlock {
    /// The lower and the upper faces, `[side][axis][lane]`; 0 in empty lanes.
    faces: [[[f32; BLOCK]; 3]; 2],
    /// Indices of the placements.
    pub placements: Prims,
}

impl BoxBlock {
    /// - `placements`: ascending indices into `boxes`.
    fn new(placements: &[u32], boxes: &[Aabb]) -> Self {
        let mut faces = [[[0.0; BLOCK]; 3]; 2];
        for (lane, &placement) in placements.iter().enumerate() {
            let Aabb { min, max } = boxes[placement as usize];
            for (side, corner) in faces.iter_mut().zip([min, max]) {
                side.iter_mut().zip(corner.to_array()).for_each(|(axis, x)| axis[lane] = x);
            }
        }
        Self { faces, placements: Prims::new(placements) }
    }

    /// Returns the lanes whose bounds the ray passes within `t0..=t1`, padded, and where it enters them: does
    /// `TreeRay::clip` for all lanes.
    #[inline(always)]
    pub fn entries<S: KernelSimd>(&self, s: S, ray: &DescentRay, t0: f32, t1: f32) -> (Mask, [f32; BLOCK]) {
        let (mut from, mut until) = (s.splat(t0), s.splat(t1));
        let padding = s.splat(ray.padding);
        for axis in 0..3 {
            let down = usize::from(ray.inv_lo[axis].is_sign_negative());
            let (entry, exit) = (s.load(&self.faces[down][axis]), s.load(&self.faces[1 - down][axis]));
            let origin = s.splat(ray.origin[axis]);
            let (lo, hi) = (s.splat(ray.inv_lo[axis]), s.splat(-ray.minus_inv_hi[axis]));
            // NaN, for a ray in a face, leaves the other number.
            from = s.max(s.sub(s.mul(s.sub(entry, origin), lo), padding), from);
            until = s.min(s.add(s.mul(s.sub(exit, origin), hi), padding), until);
        }
        let mut t = [0.0; BLOCK];
        s.store(from, &mut t);
        (self.placements.lanes(s) & s.le(from, until), t)
    }
}

/// Entries that a leaf adds to a stack at most: its next block, and the objects of this one.
pub(super) const LEAF_ENTRIES: usize = BLOCK + 1;

/// Boxes that a thread computes at a time.
const MIN_PARALLEL: usize = 64;

impl InstanceTree {
    /// Builds the tree.
    ///
    /// - `objects`: indices of the objects, ascending, each with its own tree.
    pub fn build(scene: &PlacedShapes, objects: &[u32]) -> Self {
        let (mut own_trees, mut known) = (Vec::new(), HashMap::new());
        let place = |&object: &u32| {
            let tree = OwnTree::of(&scene.shapes[object as usize])?;
            let own_tree = *known.entry(tree.address()).or_insert_with(|| {
                own_trees.push(tree);
                own_trees.len() as u32 - 1
            });
            let Affine3A { matrix3: m, translation } = scene.instances[object as usize].object_from_world;
            let columns = [m.x_axis, m.y_axis, m.z_axis, translation].map(|column| column.to_array());
            Some(Placement { columns, object, own_tree })
        };
        let placements: Vec<Placement> = objects.iter().filter_map(place).collect();
        let supports: Vec<Support> = own_trees.par_iter().map(OwnTree::support).collect();
        let bounds_of = |placement: &Placement| {
            let (own_tree, map) =
                (placement.own_tree as usize, scene.shapes[placement.object as usize].world_from_object());
            placed_bounds(own_trees[own_tree].bounds(), &map, Some(&supports[own_tree]))
        };
        let boxes: Vec<Aabb> = placements.par_iter().with_min_len(MIN_PARALLEL).map(bounds_of).collect();
        let config =
            BuildConfig { exact_below: 8, block_cost: 6.0, max_growth: 2.0, ..BuildPreset::Best.config(BLOCK) };
        let (nodes, blocks) = build(&Boxes(&boxes), &config, &BoxBlocks(&boxes));
        assert!(nodes.depth().div_ceil(3) * 7 + 9 + LEAF_ENTRIES < STACK, "a tree too deep for the stack");
        Self { extent: nodes.extent(), nodes8: collapse(&nodes), nodes, blocks, placements, own_trees }
    }

    /// Returns the objects of a leaf.
    pub fn leaf(&self, first: u32, count: u32) -> impl Iterator<Item = u32> {
        let blocks = &self.blocks[first as usize..][..count as usize];
        let placements = blocks.iter().flat_map(|block| block.placements.iter());
        placements.map(|placement| self.placements[placement as usize].object)
    }

    #[inline(always)]
    pub fn placement(&self, index: u32) -> &Placement {
        &self.placements[index as usize]
    }

    #[inline(always)]
    pub fn own_tree(&self, placement: &Placement) -> &OwnTree {
        &self.own_trees[placement.own_tree as usize]
    }

    /// Returns the block of a child of a [`Node8`].
    #[inline(always)]
    pub fn block(&self, child: u32) -> &BoxBlock {
        &self.blocks[(child & !LEAF) as usize]
    }
}

/// Leaves are ranges of blocks.
struct BoxBlocks<'a>(&'a [Aabb]);

impl LeafMaker for BoxBlocks<'_> {
    type Leaves = Vec<BoxBlock>;

    fn make(&self, blocks: &mut Vec<BoxBlock>, leaf: &[u32]) -> (u32, u32) {
        let first = blocks.len();
        blocks.extend(leaf.chunks(BLOCK).map(|part| BoxBlock::new(part, self.0)));
        let count = blocks.len() - first;
        blocks[first..].iter_mut().take(count.saturating_sub(1)).for_each(|block| block.placements.set_followed());
        (first as u32, count as u32)
    }

    fn add_part(&self, blocks: &mut Vec<BoxBlock>, part: Vec<BoxBlock>, share: f64) -> impl Fn(u32) -> u32 {
        let n_before = blocks.len() as u32;
        append_part(blocks, part, share);
        move |first| first + n_before
    }
}

struct Boxes<'a>(&'a [Aabb]);

impl Primitives for Boxes<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.0[prim as usize]
    }

    fn clipped(&self, _: u32, _: usize, _: f32, _: bool, _: f32) -> Option<Aabb> {
        Some(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY })
    }
}
