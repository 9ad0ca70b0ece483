//! Kd-tree builder: surface area heuristic (SAH) over references that are clipped to their cells.
//!
//! Builds top-down. Large nodes bin their references along each axis, small ones evaluate every face of every
//! reference. A split must lower the expected cost, so a fan of thousands of triangles around one vertex ends as one
//! leaf; the number of references is bounded as well ([`BuildConfig::max_growth`]). Large subtrees are built in
//! parallel; the result never depends on the number of threads. Leaves are made at the end, straight into their final
//! array: until then a leaf is a list of primitives, which takes less memory.
//!
//! Sources: Wald and Havran 2006 for cost and clipping; Hunt, Mark and Stoll 2006 for bins.
//! Start reading at [`build`].

use super::nodes::{KdNode, KdNodes};
use super::reference::{BuildConfig, Primitives, Reference, clip_padding};
use super::simd::InstructionSet;
use super::split::{Split, median_split};
use super::split_simd::find_split;
use crate::geometry::Aabb;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashSet;

/// Creates and stores the leaves of a tree.
pub(super) trait LeafMaker: Sync {
    /// The leaves of a part of the tree, in order.
    type Leaves: Default + Send;

    /// Adds the leaf with these primitives, ascending; returns the two numbers that its node stores.
    fn make(&self, leaves: &mut Self::Leaves, prims: &[u32]) -> (u32, u32);

    /// Appends the leaves of a part; returns the map from a leaf's first number in the part to that in the whole.
    ///
    /// - `share`: about how much of the whole is done with this part, above 0 and up to 1.
    fn add_part(&self, leaves: &mut Self::Leaves, part: Self::Leaves, share: f64) -> impl Fn(u32) -> u32;
}

/// Appends the leaves of a part, with room for the rest of the whole: blocks are copied wherever an array grows. What a
/// first part tells of the rest may be far off, so there is never room for many times what is there.
pub(super) fn append_part<T>(to: &mut Vec<T>, mut part: Vec<T>, share: f64) {
    let n = to.len() + part.len();
    if n > to.capacity() {
        let wanted = (1.05 * n as f64 / share) as usize;
        to.reserve_exact(wanted.min(8 * n).max(n) - to.len());
    }
    to.append(&mut part);
}

/// Builds the nodes and, in the order of the nodes, the leaves.
pub(super) fn build<M: LeafMaker>(
    primitives: &impl Primitives,
    config: &BuildConfig,
    maker: &M,
) -> (KdNodes, M::Leaves) {
    let reference = |prim| {
        let bounds = primitives.bounds(prim);
        (!bounds.is_empty()).then(|| Reference::new(&bounds, prim))
    };
    let mut references = Vec::with_capacity(primitives.len());
    references.par_extend((0..primitives.len() as u32).into_par_iter().with_min_len(FORK_ABOVE).filter_map(reference));
    let bounds =
        references.par_iter().with_min_len(FORK_ABOVE).map(Reference::bounds).reduce(|| Aabb::EMPTY, Aabb::union);
    let growth = (references.len() as f32 * config.max_growth) as usize + 64;
    let set = InstructionSet::detect();
    let builder = Builder { primitives, config, padding: clip_padding(&bounds), set };
    let mut root = builder.subtree(references, bounds, growth, 0);
    let leaves = make_leaves(&mut root, maker);
    let mut nodes = vec![KdNode::leaf(0, 0)];
    root.flatten(0, &mut nodes);
    nodes.shrink_to_fit();
    (KdNodes { nodes, bounds }, leaves)
}

/// A finished part of the tree, before it is copied into the array of nodes.
enum Subtree {
    Fork { axis: usize, split: f32, children: Box<[Subtree; 2]> },
    Done(Arena),
}

impl Subtree {
    fn collect_arenas<'a>(&'a mut self, arenas: &mut Vec<&'a mut Arena>) {
        match self {
            Self::Fork { children, .. } => children.iter_mut().for_each(|child| child.collect_arenas(arenas)),
            Self::Done(arena) => arenas.push(arena),
        }
    }

    fn flatten(self, slot: usize, nodes: &mut Vec<KdNode>) {
        match self {
            Self::Fork { axis, split, children } => {
                let first = nodes.len();
                nodes.extend([KdNode::leaf(0, 0); 2]);
                nodes[slot] = KdNode::inner(axis, split, first as u32);
                let [lower, upper] = *children;
                lower.flatten(first, nodes);
                upper.flatten(first + 1, nodes);
            }
            Self::Done(arena) => flatten(&arena.nodes, 0, slot, nodes),
        }
    }
}

/// A subtree built by one thread.
#[derive(Default)]
struct Arena {
    nodes: Vec<ArenaNode>,
    /// The primitives of all leaves, until these are made.
    prims: Vec<u32>,
}

enum ArenaNode {
    /// The lower child is the next node.
    Inner { axis: u8, split: f32, above: u32 },
    /// A range of [`Arena::prims`]; once the leaf is made, the two numbers that its node stores.
    Leaf { first: u32, count: u32 },
}

impl Arena {
    /// Frees memory that was set aside for more: there are thousands of parts.
    fn shrink(&mut self) {
        self.nodes.shrink_to_fit();
        self.prims.shrink_to_fit();
    }

    /// Makes the leaves, and frees the lists of their primitives.
    fn make_leaves<M: LeafMaker>(&mut self, maker: &M) -> M::Leaves {
        let (prims, mut leaves) = (std::mem::take(&mut self.prims), M::Leaves::default());
        for node in &mut self.nodes {
            if let ArenaNode::Leaf { first, count } = node {
                (*first, *count) = maker.make(&mut leaves, &prims[*first as usize..][..*count as usize]);
            }
        }
        leaves
    }

    /// Changes the first number of each leaf that is not empty.
    fn renumber(&mut self, in_whole: impl Fn(u32) -> u32) {
        for node in &mut self.nodes {
            match node {
                ArenaNode::Leaf { first, count } if *count > 0 => *first = in_whole(*first),
                _ => (),
            }
        }
    }
}

/// Makes the leaves of the whole tree, in the order of the nodes, some parts at a time.
fn make_leaves<M: LeafMaker>(root: &mut Subtree, maker: &M) -> M::Leaves {
    let mut arenas = Vec::new();
    root.collect_arenas(&mut arenas);
    let n_prims: usize = arenas.iter().map(|arena| arena.prims.len()).sum();
    let (mut leaves, mut n_done) = (M::Leaves::default(), 0);
    for some in arenas.chunks_mut(PARTS_AT_A_TIME) {
        n_done += some.iter().map(|arena| arena.prims.len()).sum::<usize>();
        let share = (n_done as f64 / n_prims as f64).max(f64::EPSILON);
        let made: Vec<_> = some.par_iter_mut().map(|arena| arena.make_leaves(maker)).collect();
        for (arena, part) in some.iter_mut().zip(made) {
            arena.renumber(maker.add_part(&mut leaves, part, share));
        }
    }
    leaves
}

/// Parts of the tree whose leaves are made in parallel: enough for many threads, and a few megabytes.
const PARTS_AT_A_TIME: usize = 64;

/// Copies the subtree at `index` of a part to `nodes[slot]` and the end of `nodes`.
fn flatten(part: &[ArenaNode], index: usize, slot: usize, nodes: &mut Vec<KdNode>) {
    match part[index] {
        ArenaNode::Inner { axis, split, above } => {
            let first = nodes.len();
            nodes.extend([KdNode::leaf(0, 0); 2]);
            nodes[slot] = KdNode::inner(axis.into(), split, first as u32);
            flatten(part, index + 1, first, nodes);
            flatten(part, above as usize, first + 1, nodes);
        }
        ArenaNode::Leaf { count: 0, .. } => nodes[slot] = KdNode::leaf(0, 0),
        ArenaNode::Leaf { first, count } => nodes[slot] = KdNode::leaf(first, count),
    }
}

/// Working memory of one thread.
struct BuildScratch {
    /// References of pending nodes, those of the next node on top.
    stack: Vec<Reference>,
    /// References below the split of one node: never more than the root has.
    below: Vec<Reference>,
    /// Primitives of the leaf that is being made.
    prims: Vec<u32>,
}

struct Builder<'a, P> {
    primitives: &'a P,
    config: &'a BuildConfig,
    padding: f32,
    set: InstructionSet,
}

/// Leaves of more primitives than this are searched for duplicates. No split separates duplicates, and a ray would test
/// all of them for a hit that is always the first one's.
const DEDUP_ABOVE: usize = 64;

/// Subtrees with more references than this are built in parallel.
const FORK_ABOVE: usize = 1024;

impl<P: Primitives> Builder<'_, P> {
    /// Builds a subtree, in parallel if it is large.
    ///
    /// - `growth`: references that this subtree may add to those given.
    fn subtree(&self, mut references: Vec<Reference>, cell: Aabb, growth: usize, depth: u32) -> Subtree {
        let count = references.len();
        let mut arena = Arena::default();
        if count > FORK_ABOVE
            && let Some(split) = self.choose(&references, &cell, depth)
        {
            let at_most = references.iter().filter(|it| it.is_below(split.axis, split.at)).count();
            let mut below = vec![references[0]; at_most + 1];
            let (n_below, n_above) = self.divide(&mut references, &mut below, &split);
            references.truncate(n_above);
            below.truncate(n_below);
            let Some((growth_below, growth_above)) = share(growth, count, n_below, n_above) else {
                references.append(&mut below);
                self.make_leaf(&references, &mut Vec::new(), &mut arena);
                arena.shrink();
                return Subtree::Done(arena);
            };
            references.shrink_to_fit();
            let (cell_below, cell_above) = split_cell(&cell, &split);
            let (lower, upper) = rayon::join(
                || self.subtree(below, cell_below, growth_below, depth + 1),
                || self.subtree(references, cell_above, growth_above, depth + 1),
            );
            return Subtree::Fork { axis: split.axis, split: split.at, children: Box::new([lower, upper]) };
        }
        let mut scratch = BuildScratch { below: references.clone(), stack: references, prims: Vec::new() };
        self.sequential(&mut scratch, 0, cell, growth, depth, &mut arena);
        arena.shrink();
        Subtree::Done(arena)
    }

    /// Builds the subtree over `scratch.stack[start..]`, which it consumes, on this thread.
    fn sequential(
        &self,
        scratch: &mut BuildScratch,
        start: usize,
        cell: Aabb,
        growth: usize,
        depth: u32,
        arena: &mut Arena,
    ) {
        let count = scratch.stack.len() - start;
        if let Some(split) = self.choose(&scratch.stack[start..], &cell, depth) {
            let (n_below, n_above) = self.divide(&mut scratch.stack[start..], &mut scratch.below, &split);
            scratch.stack.truncate(start + n_above);
            scratch.stack.extend_from_slice(&scratch.below[..n_below]);
            if let Some((growth_below, growth_above)) = share(growth, count, n_below, n_above) {
                let (cell_below, cell_above) = split_cell(&cell, &split);
                let index = arena.nodes.len();
                arena.nodes.push(ArenaNode::Inner { axis: split.axis as u8, split: split.at, above: 0 });
                self.sequential(scratch, start + n_above, cell_below, growth_below, depth + 1, arena);
                let above = arena.nodes.len() as u32;
                arena.nodes[index] = ArenaNode::Inner { axis: split.axis as u8, split: split.at, above };
                self.sequential(scratch, start, cell_above, growth_above, depth + 1, arena);
                return;
            }
        }
        self.make_leaf(&scratch.stack[start..], &mut scratch.prims, arena);
        scratch.stack.truncate(start);
    }

    /// Makes the leaf of these references. After a split that was rejected because it adds too many references, the
    /// references of both sides are among them and may name the same primitive.
    fn make_leaf(&self, references: &[Reference], prims: &mut Vec<u32>, arena: &mut Arena) {
        prims.clear();
        prims.extend(references.iter().map(|reference| reference.prim));
        prims.sort_unstable();
        prims.dedup();
        if prims.len() > DEDUP_ABOVE {
            let mut seen = HashSet::new();
            prims.retain(|&prim| self.primitives.shape(prim).is_none_or(|shape| seen.insert(shape)));
        }
        arena.nodes.push(ArenaNode::Leaf { first: arena.prims.len() as u32, count: prims.len() as u32 });
        arena.prims.extend_from_slice(prims);
    }

    fn choose(&self, references: &[Reference], cell: &Aabb, depth: u32) -> Option<Split> {
        if depth >= self.config.max_depth || references.len() <= self.config.leaf_limit {
            return None;
        }
        if self.config.median {
            median_split(references, cell)
        } else {
            find_split(self.set, references, cell, self.config)
        }
    }

    /// Moves the parts below the plane to the front of `below`, which has room for all that
    /// [`may be`](Reference::is_below) below and one more, those above to the front of `references`; returns the number
    /// of each. A side that a primitive does not reach gets no part.
    ///
    /// Most references lie on one side, and the branch is unpredictable: each is written to both sides and counted on
    /// one.
    fn divide(&self, references: &mut [Reference], below: &mut [Reference], split: &Split) -> (usize, usize) {
        let (mut n_above, mut n_below) = (0, 0);
        for i in 0..references.len() {
            let reference = references[i];
            let (mut upper, mut lower) = (reference, reference);
            let mut is_below = reference.is_below(split.axis, split.at);
            let mut is_above = !is_below | reference.is_above(split.axis, split.at);
            if is_below & is_above {
                let parts = (self.part(&reference, split, true), self.part(&reference, split, false));
                (is_below, is_above) = (parts.0.is_some(), parts.1.is_some());
                (lower, upper) = (parts.0.unwrap_or(reference), parts.1.unwrap_or(reference));
            }
            references[n_above] = upper;
            n_above += usize::from(is_above);
            below[n_below] = lower;
            n_below += usize::from(is_below);
        }
        (n_below, n_above)
    }

    fn part(&self, reference: &Reference, split: &Split, below: bool) -> Option<Reference> {
        let mut bounds = reference.bounds();
        if self.config.clip {
            // A point of the primitive within the padding of the plane may be moved across it.
            let limit = if below { split.at + self.padding } else { split.at - self.padding };
            let clipped = self.primitives.clipped(reference.prim, split.axis, limit, below, self.padding)?;
            bounds = bounds.intersection(clipped);
        }
        if below {
            bounds.max[split.axis] = bounds.max[split.axis].min(split.at);
        } else {
            bounds.min[split.axis] = bounds.min[split.axis].max(split.at);
        }
        (!bounds.is_empty()).then(|| Reference::new(&bounds, reference.prim))
    }
}

/// Divides the remaining allowed growth among the children; `None` if the split exceeds it or separates nothing.
fn share(growth: usize, count: usize, below: usize, above: usize) -> Option<(usize, usize)> {
    let left = (growth + count).checked_sub(below + above)?;
    if below.min(above) == count {
        return None;
    }
    let for_below = (left as u128 * below as u128 / (below + above).max(1) as u128) as usize;
    Some((for_below, left - for_below))
}

fn split_cell(cell: &Aabb, split: &Split) -> (Aabb, Aabb) {
    let (mut below, mut above) = (*cell, *cell);
    below.max[split.axis] = split.at;
    above.min[split.axis] = split.at;
    (below, above)
}

/// The padded bounds of the part of a triangle with `axis <= limit` or `axis >= limit`.
pub(super) fn clip_triangle(vertices: &[Vec3; 3], axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
    let mut bounds = Aabb::EMPTY;
    for i in 0..3 {
        let (p, q) = (vertices[i], vertices[(i + 1) % 3]);
        let inside = |p: Vec3| if below { p[axis] <= limit } else { p[axis] >= limit };
        if inside(p) {
            bounds = bounds.grown_by(p);
        }
        if inside(p) != inside(q) {
            bounds = bounds.grown_by(p + (q - p) * ((limit - p[axis]) / (q[axis] - p[axis])));
        }
    }
    (!bounds.is_empty()).then(|| Aabb { min: bounds.min - padding, max: bounds.max + padding })
}
