//! Three levels of the binary tree collapsed into one node: eight children and the seven planes between them.
//!
//! One visit replaces up to seven visits of the binary tree, without a branch that could be mispredicted. The walk in
//! `nodes` is the reference.

use super::nodes::{KdNodes, Node};

/// The planes and children of three levels.
///
/// Plane 0 is the root's, 1 and 2 are those of its lower and upper child, 3 to 6 those of the third level. The bits of
/// a child's index, the highest first, select the side at each level, 1 for the upper side. Where the binary tree ends
/// early, the missing planes lie at infinity and only the lowest of the lanes below has a child.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Node8 {
    pub splits: [f32; 7],
    /// Three bits per plane.
    pub axes: u32,
    /// [`EMPTY`], the index of a node, or with [`LEAF`] set the first block of a leaf.
    pub children: [u32; 8],
}
// One cache line.
const _: () = assert!(size_of::<Node8>() == 64);

/// A bit for each plane of a node.
pub(super) const PLANES: u32 = 0x7F;

/// The order of the children for each set of planes whose axis the ray descends: in the low 24 bits the children from
/// far to near, three bits each; above them one byte per level from the root, whose bits mark the children on the far
/// side of their plane.
pub(super) static CHILD_ORDERS: [u64; 128] = {
    let mut orders = [0; 128];
    let mut down = 0;
    while down < 128 {
        orders[down] = child_order(down as u64);
        down += 1;
    }
    orders
};

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
    let mut node = Node8 { splits: [f32::INFINITY; 7], axes: 0, children: [EMPTY; 8] };
    // The subtree at each position of a level; `None` below a leaf.
    let mut level = vec![Some(binary)];
    let mut plane = 0;
    for depth in 0..3 {
        let mut next = Vec::new();
        for (place, entry) in level.iter().enumerate() {
            match entry.map(|index| tree.nodes[index as usize].unpack()) {
                Some(Node::Inner { axis, split, first_child }) => {
                    node.splits[plane] = split;
                    node.axes |= (axis as u32) << (3 * plane);
                    next.extend([Some(first_child), Some(first_child + 1)]);
                }
                Some(Node::Leaf { first, count }) => {
                    if count > 0 {
                        node.children[place << (3 - depth)] = LEAF | first;
                    }
                    next.extend([None; 2]);
                }
                None => next.extend([None; 2]),
            }
            plane += 1;
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

/// Returns the entry of [`CHILD_ORDERS`] for the planes that the ray descends.
///
/// The rank of a child from the near end has one bit per level, 1 on the far side.
const fn child_order(down: u64) -> u64 {
    let mut order = 0;
    let mut child = 0;
    while child < 8 {
        let (mut rank, mut plane, mut depth) = (0, 0, 0);
        while depth < 3 {
            let side = child >> (2 - depth) & 1;
            let far = side ^ (down >> plane & 1);
            order |= far << (24 + 8 * depth + child);
            rank = rank << 1 | far;
            plane = 2 * plane + 1 + side;
            depth += 1;
        }
        order |= child << (3 * (7 - rank));
        child += 1;
    }
    order
}

/// Scalar reference of [`super::simd::KernelSimd::descend`].
///
/// Pushes the children that the ray enters within `t0..=t1`, farthest first (nearest first for a far-first ray), and
/// returns the new stack height.
#[inline(always)]
pub(super) fn descend_plain(
    node: &Node8,
    ray: &DescentRay,
    t0: f32,
    t1: f32,
    stack: &mut Stack,
    mut height: usize,
) -> usize {
    let axis = |plane: usize| (node.axes >> (3 * plane) & 7) as usize;
    let down: u32 = (0..7).map(|plane| u32::from(ray.inv_lo[axis(plane)].is_sign_negative()) << plane).sum();
    let mut order = CHILD_ORDERS[((down ^ ray.reversed) & PLANES) as usize];
    for _ in 0..8 {
        let lane = (order & 7) as usize;
        order >>= 3;
        let (mut t0, mut t1) = (t0, t1);
        let mut plane = 0;
        for depth in 0..3 {
            let axis = axis(plane);
            let distance = node.splits[plane] - ray.origin[axis];
            let side = lane >> (2 - depth) & 1;
            // NaN, for a ray in the plane, bounds neither side.
            if (side == 1) == (down >> plane & 1 == 1) {
                t1 = f32::min(t1, ray.padding - distance * ray.minus_inv_hi[axis]);
            } else {
                t0 = f32::max(t0, distance * ray.inv_lo[axis] - ray.padding);
            }
            plane = 2 * plane + 1 + side;
        }
        (stack.child[height], stack.t0[height], stack.t1[height]) = (node.children[lane], t0, t1);
        height += usize::from(t0 <= t1 && node.children[lane] != EMPTY);
    }
    height
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{InstructionSet, KernelSimd, dispatch};

    #[inline(always)]
    fn run<S: KernelSimd>(s: S, cases: &[(Node8, DescentRay, f32, f32)], out: &mut Vec<u64>) {
        for (node, ray, t0, t1) in cases {
            let mut stack = Stack::NEW;
            let height = s.descend(node, ray, *t0, *t1, &mut stack, 3);
            out.push(height as u64);
            for i in 3..height {
                // Adding 0 turns -0 into +0.
                let bits = |t: f32| (t + 0.0).to_bits();
                out.extend([stack.child[i], bits(stack.t0[i]), bits(stack.t1[i])].map(u64::from));
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
                let mut number = || [0.0, 1.0, -1.0, 0.5, next() as f32 / 8e6 - 1.0][next() as usize % 5];
                let mut node = Node8 { splits: std::array::from_fn(|_| number()), axes: 0, children: [0; 8] };
                let origin = [number(), number(), number()];
                let dir = [number(), number(), number()].map(|d| if d == 0.0 && next() % 2 == 0 { -0.0 } else { d });
                (0..7).for_each(|plane| node.axes |= (next() % 3) << (3 * plane));
                if next() % 4 == 0 {
                    node.splits[2] = f32::INFINITY;
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
            dispatch!(set, run(cases: &[(Node8, DescentRay, f32, f32)], into: &mut Vec<u64>));
            out
        };
        let expected = run_on(InstructionSet::Portable);
        assert!(expected.len() > 60_000, "too few children met");
        for set in InstructionSet::available() {
            assert!(run_on(set) == expected, "{set:?}");
        }
    }
}
