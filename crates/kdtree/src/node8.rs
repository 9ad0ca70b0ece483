//! Three levels of the binary tree collapsed into one node: eight children and the seven planes between them.
//!
//! One visit replaces up to seven visits of the binary tree, without a branch that could be mispredicted. The walk in
//! `nodes` is the reference.

use super::nodes::{KdNodes, Node};

/// The planes and children of three levels.
///
/// The bits of a child's index, the highest first, select the side at each level, 1 for the upper side. Where the binary
/// tree ends early, the missing planes lie at infinity and only the lowest of the children below is there.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Node8 {
    /// The positions of the planes, each at its [`plane_above`] the children that it bounds, and at [`AXES`] the bits of
    /// their axes.
    pub planes: [f32; 8],
    /// [`EMPTY`], the index of a node, or with [`LEAF`] set the first block of a leaf.
    pub children: [u32; 8],
}
// One cache line.
const _: () = assert!(size_of::<Node8>() == 64);

/// Where a node keeps the axes of its planes: bits `2 i` and `2 i + 1` are the axis of plane `i`, 0 here.
///
/// As an `f32` it is a normal number: SIMD computes with it in a lane that is not used, and takes long over subnormal ones.
pub(super) const AXES: usize = 5;
const NORMAL: u32 = 1 << 30;

/// Returns the plane at a level, 0 for the root, on the way to a child.
pub(super) const fn plane_above(child: usize, level: usize) -> usize {
    match level {
        0 => 1,
        1 => child | 3,
        _ => child & 6,
    }
}

/// The order of the children, three bits each, from far to near, for each set of planes whose axis the ray descends.
pub(super) static CHILD_ORDERS: [u32; 256] = {
    let mut orders = [0; 256];
    let mut down = 0;
    while down < 256 {
        orders[down] = child_order(down);
        down += 1;
    }
    orders
};

impl Node8 {
    const EMPTY: Self = Self {
        planes: {
            let mut planes = [f32::INFINITY; 8];
            planes[AXES] = f32::from_bits(NORMAL);
            planes
        },
        children: [EMPTY; 8],
    };

    fn set_plane(&mut self, plane: usize, axis: usize, split: f32) {
        let axes = self.planes[AXES].to_bits() & !(3 << (2 * plane)) | (axis as u32) << (2 * plane);
        self.planes[AXES] = f32::from_bits(axes);
        self.planes[plane] = split;
    }

    fn axis(&self, plane: usize) -> usize {
        (self.planes[AXES].to_bits() >> (2 * plane) & 3) as usize
    }
}

pub(super) const EMPTY: u32 = u32::MAX;
pub(super) const LEAF: u32 = 1 << 31;

/// Capacity of a traversal stack, including one full store beyond the last entry. An odd number of cache lines, so that
/// the stacks of many rays do not compete for the same few cache sets.
pub(super) const STACK: usize = 144;

/// Stack of pending nodes, nearest on top.
#[repr(C, align(64))]
pub(super) struct Stack {
    pub child: [u32; STACK],
    pub t0: [f32; STACK],
    pub t1: [f32; STACK],
}

impl Stack {
    pub const NEW: Self = Self { child: [0; STACK], t0: [0.0; STACK], t1: [0.0; STACK] };
}

/// A ray in the layout that [`super::simd::KernelSimd::descend`] reads: `ray::TreeRay` in rows of four.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct DescentRay {
    pub origin: [f32; 3],
    pub padding: f32,
    /// Shortened reciprocals of the direction: multiplied by a distance they give the earliest crossing.
    pub inv_lo: [f32; 3],
    /// All bits set if the far child is visited first, otherwise 0.
    pub reversed: u32,
    /// Negated lengthened reciprocals: multiplied by a distance they give the negative of the latest crossing.
    pub minus_inv_hi: [f32; 3],
    /// Distance beyond which nothing matters: that of the nearest hit.
    pub end: f32,
}
// Three rows of four.
const _: () = assert!(size_of::<DescentRay>() == 48);

impl DescentRay {
    pub const IDLE: Self =
        Self { origin: [0.0; 3], padding: 0.0, inv_lo: [0.0; 3], reversed: 0, minus_inv_hi: [0.0; 3], end: 0.0 };

    #[inline(always)]
    pub fn new(origin: [f32; 3], inv_lo: [f32; 3], inv_hi: [f32; 3], padding: f32, end: f32) -> Self {
        Self { origin, padding, inv_lo, reversed: 0, minus_inv_hi: inv_hi.map(|inv| -inv), end }
    }

    /// Returns the ray with the far child visited first.
    #[inline(always)]
    pub fn far_first(self) -> Self {
        Self { reversed: u32::MAX, ..self }
    }
}

/// The way of a ray through a tree: all that visits of nodes touch, in one cache line.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Walk {
    pub descent: DescentRay,
    /// The entry that is visited next.
    pub child: u32,
    pub t0: f32,
    pub t1: f32,
    /// Number of entries on the stack.
    pub height: u32,
}
const _: () = assert!(size_of::<Walk>() == 64);

impl Walk {
    pub const IDLE: Self = Self { descent: DescentRay::IDLE, child: 0, t0: 0.0, t1: 0.0, height: 1 };

    /// Pops the nearest entry that can still matter; the last entry is [`DONE`].
    #[inline(always)]
    pub fn pop(&mut self, stack: &Stack) {
        let (mut top, end) = (self.height as usize - 1, self.descent.end);
        while stack.t0[top] > end {
            top -= 1;
        }
        let t1 = stack.t1[top];
        self.height = top as u32;
        (self.child, self.t0, self.t1) = (stack.child[top], stack.t0[top], if end < t1 { end } else { t1 });
    }
}

/// The entry at the bottom of every stack: the ray is finished.
pub(super) const DONE: u32 = LEAF - 1;

/// Collapses a binary tree into nodes of three levels each, root first.
pub(super) fn collapse(tree: &KdNodes) -> Vec<Node8> {
    let mut nodes = Vec::new();
    if !tree.bounds.is_empty() {
        // Each node replaces three levels and leaves at most seven entries on the stack; one entry lies at the bottom.
        assert!(tree.depth().div_ceil(3) * 7 + 9 < STACK, "a tree too deep for the stack");
        let mut roots = vec![(0, 0)];
        nodes.push(None);
        while let Some((binary, slot)) = roots.pop() {
            let node = collapse_one(tree, binary, |child| {
                roots.push((child, nodes.len()));
                nodes.push(None);
                nodes.len() as u32 - 1
            });
            nodes[slot] = Some(node);
        }
    }
    nodes.into_iter().flatten().collect()
}

fn collapse_one(tree: &KdNodes, binary: u32, mut make_child: impl FnMut(u32) -> u32) -> Node8 {
    let mut node = Node8::EMPTY;
    // The subtree at each position of a level; `None` below a leaf.
    let mut level = vec![Some(binary)];
    for depth in 0..3 {
        let mut next = Vec::new();
        for (place, entry) in level.iter().enumerate() {
            let first_child = place << (3 - depth);
            match entry.map(|index| tree.nodes[index as usize].unpack()) {
                Some(Node::Inner { axis, split, first_child: pair }) => {
                    node.set_plane(plane_above(first_child, depth), axis, split);
                    next.extend([Some(pair), Some(pair + 1)]);
                }
                Some(Node::Leaf { first, count }) => {
                    if count > 0 {
                        node.children[first_child] = LEAF | first;
                    }
                    next.extend([None; 2]);
                }
                None => next.extend([None; 2]),
            }
        }
        level = next;
    }
    for (place, entry) in level.into_iter().enumerate() {
        let Some(index) = entry else { continue };
        node.children[place] = match tree.nodes[index as usize].unpack() {
            Node::Leaf { count: 0, .. } => EMPTY,
            Node::Leaf { first, .. } => LEAF | first,
            Node::Inner { .. } => make_child(index),
        };
    }
    node
}

/// Returns the entry of [`CHILD_ORDERS`] for the planes whose axis the ray descends.
///
/// The rank of a child from the near end has one bit per level, 1 on the far side.
const fn child_order(down: usize) -> u32 {
    let mut order = 0;
    let mut child = 0;
    while child < 8 {
        let (mut rank, mut level) = (0, 0);
        while level < 3 {
            let side = child >> (2 - level) & 1;
            rank = rank << 1 | side ^ (down >> plane_above(child, level) & 1);
            level += 1;
        }
        order |= (child as u32) << (3 * (7 - rank));
        child += 1;
    }
    order
}

/// Scalar reference of [`super::simd::KernelSimd::descend`].
///
/// Pushes the children that the ray enters within `t0..=t1`, farthest first (nearest first for a far-first ray).
#[inline(always)]
pub(super) fn descend_plain(node: &Node8, walk: &mut Walk, stack: &mut Stack) {
    let Walk { descent: ray, t0, t1, height, .. } = walk;
    let descends = |plane| ray.inv_lo[node.axis(plane)].is_sign_negative();
    let down: usize = (0..8).map(|plane| usize::from(descends(plane)) << plane).sum();
    let order = CHILD_ORDERS[down];
    let mut top = *height as usize;
    for i in 0..8 {
        let place = if ray.reversed != 0 { 7 - i } else { i };
        let child = (order >> (3 * place) & 7) as usize;
        let (mut t0, mut t1) = (*t0, *t1);
        for level in 0..3 {
            let plane = plane_above(child, level);
            let axis = node.axis(plane);
            let distance = node.planes[plane] - ray.origin[axis];
            // NaN, for a ray in the plane, bounds neither side.
            if (child >> (2 - level) & 1) == (down >> plane & 1) {
                t1 = f32::min(t1, ray.padding - distance * ray.minus_inv_hi[axis]);
            } else {
                t0 = f32::max(t0, distance * ray.inv_lo[axis] - ray.padding);
            }
        }
        (stack.child[top], stack.t0[top], stack.t1[top]) = (node.children[child], t0, t1);
        top += usize::from(t0 <= t1 && node.children[child] != EMPTY);
    }
    *height = top as u32;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{InstructionSet, KernelSimd, dispatch};

    type Case = (Node8, DescentRay, f32, f32);

    /// Visits the nodes of pairs of cases together, and each alone.
    #[inline(always)]
    fn run<S: KernelSimd>(s: S, cases: &[Case], out: &mut Vec<u64>) {
        for pair in cases.windows(2) {
            let walk = |(_, descent, t0, t1): &Case| Walk { descent: *descent, child: 0, t0: *t0, t1: *t1, height: 3 };
            let [mut a, mut b, mut alone] = [walk(&pair[0]), walk(&pair[1]), walk(&pair[0])];
            let mut stacks = [Stack::NEW, Stack::NEW, Stack::NEW];
            let [of_a, of_b, of_alone] = &mut stacks;
            s.descend_two(s.visit_constants(), [&pair[0].0, &pair[1].0], [&mut a, &mut b], [of_a, of_b]);
            s.descend(&pair[0].0, &mut alone, of_alone);
            for (walk, stack) in [a, b, alone].iter().zip(&stacks) {
                out.push(u64::from(walk.height));
                for i in 3..walk.height as usize {
                    // Adding 0 turns -0 into +0.
                    let bits = |t: f32| (t + 0.0).to_bits();
                    out.extend([stack.child[i], bits(stack.t0[i]), bits(stack.t1[i])].map(u64::from));
                }
            }
        }
    }

    #[test]
    fn all_instruction_sets_descend_alike() {
        let mut state = 1u64;
        let mut next = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as u32
        };
        let cases: Vec<_> = (0..20_000)
            .map(|_| {
                let mut node = Node8::EMPTY;
                for plane in (0..8).filter(|&plane| plane != AXES) {
                    let split = [0.0, 1.0, -1.0, 0.5, next() as f32 / 8e6 - 1.0][next() as usize % 5];
                    node.set_plane(plane, next() as usize % 3, split);
                }
                let mut number = || [0.0, 1.0, -1.0, 0.5, next() as f32 / 8e6 - 1.0][next() as usize % 5];
                let origin = [number(), number(), number()];
                let dir = [number(), number(), number()].map(|d| if d == 0.0 && next() % 2 == 0 { -0.0 } else { d });
                if next() % 4 == 0 {
                    node.planes[7] = f32::INFINITY;
                }
                node.children = std::array::from_fn(|c| if next() % 5 == 0 { EMPTY } else { c as u32 * 7 });
                let ray = DescentRay::new(origin, dir.map(|d| 0.999 / d), dir.map(|d| 1.001 / d), 1e-6, f32::INFINITY);
                let ray = if next() % 2 == 0 { ray } else { ray.far_first() };
                (node, ray, 0.0, if next() % 2 == 0 { f32::INFINITY } else { 1.5 })
            })
            .collect();
        let run_on = |set| {
            let mut out = Vec::new();
            let (into, cases) = (&mut out, &cases[..]);
            dispatch!(set, run(cases: &[Case], into: &mut Vec<u64>));
            out
        };
        let expected = run_on(InstructionSet::Portable);
        assert!(expected.len() > 60_000, "too few children met");
        for set in InstructionSet::available() {
            assert!(run_on(set) == expected, "{set:?}");
        }
    }
}
