//! Three levels of the binary tree collapsed into one node: eight children and the seven planes between them.
//!
//! One visit replaces up to seven visits of the binary tree, without a branch that could be mispredicted. The walk in
//! `nodes` is the reference.

use super::nodes::{KdNodes, Node};

/// The planes and children of three levels.
///
/// Planes and children are numbered in order: plane `i` separates the children up to `i` from those above it, so plane 3
/// is the root's, 1 and 5 are those of its lower and upper child, and the even ones are those of the third level. Where
/// the binary tree ends early, the missing planes lie at infinity and only the lowest of the children below is there.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Node8 {
    pub splits: [f32; 7],
    pub axes: PlaneAxes,
    /// [`EMPTY`], the index of a node, or with [`LEAF`] set the first block of a leaf.
    pub children: [u32; 8],
}
// One cache line.
const _: () = assert!(size_of::<Node8>() == 64);

/// The axes of the planes of a node, twice: bits `2 i` and `2 i + 1` are the axis of plane `i`; bit `14 + i` is set if
/// that is x, bit `21 + i` if it is y.
///
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub(super) struct PlaneAxes(pub u32);

impl PlaneAxes {
    const ALL_X: Self = Self(NORMAL | PLANES << ARE_X);

    fn set(&mut self, plane: usize, axis: usize) {
        let old = 3 << (2 * plane) | 1 << (ARE_X + plane) | 1 << (ARE_Y + plane);
        let are = [1 << ARE_X, 1 << ARE_Y, 0][axis];
        self.0 = self.0 & !old | (axis as u32) << (2 * plane) | are << plane;
    }

    #[inline(always)]
    fn get(self, plane: usize) -> usize {
        (self.0 >> (2 * plane) & 3) as usize
    }

    /// Returns the planes whose axis the ray descends, one bit each.
    #[inline(always)]
    pub fn descended(self, signs: Signs) -> usize {
        let flipped = self.0 & signs.0;
        ((signs.0 ^ flipped >> ARE_X ^ flipped >> ARE_Y) & PLANES) as usize
    }
}

/// A bit for each plane of a node.
const PLANES: u32 = 0x7F;
const ARE_X: usize = 14;
const ARE_Y: usize = 21;

/// Makes the bits below it a normal number when they are read as an `f32`: SIMD computes with them in a lane that is not
/// used, and takes long over subnormal ones.
const NORMAL: u32 = 1 << 30;

/// The signs of a ray's direction, for [`PlaneAxes::descended`]: the low seven bits are set if it descends z; the seven
/// bits from `ARE_X` and from `ARE_Y` on are set if it descends x, or y, but not z, or the other way round.
///
/// The highest bit is set for a far-first ray.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct Signs(pub u32);

impl Signs {
    const FAR_FIRST: u32 = 1 << 31;

    /// Of near-first rays: bit 0 of the index is set if the ray descends x, bit 1 if y, bit 2 if z.
    pub const TABLE: [u32; 8] = {
        let mut table = [0; 8];
        let mut down = 0;
        while down < 8 {
            let (x, y, z) = (down & 1, down >> 1 & 1, down >> 2);
            table[down as usize] = NORMAL | (PLANES * (z | (x ^ z) << ARE_X | (y ^ z) << ARE_Y));
            down += 1;
        }
        table
    };

    #[inline(always)]
    fn new(down: [bool; 3]) -> Self {
        let [x, y, z] = down.map(usize::from);
        Self(Self::TABLE[x | y << 1 | z << 2])
    }

    /// 1 for a far-first ray, otherwise 0.
    #[inline(always)]
    pub fn far_first(self) -> usize {
        (self.0 >> 31) as usize
    }
}

/// The order of the children, three bits each, from far to near, for each set of planes whose axis the ray descends.
pub(super) static CHILD_ORDERS: [u32; 128] = {
    let mut orders = [0; 128];
    let mut down = 0;
    while down < 128 {
        orders[down] = child_order(down);
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
    pub signs: Signs,
    /// Negated lengthened reciprocals: multiplied by a distance they give the negative of the latest crossing.
    pub minus_inv_hi: [f32; 3],
    /// Distance beyond which nothing matters: that of the nearest hit.
    pub end: f32,
}
// Three rows of four.
const _: () = assert!(size_of::<DescentRay>() == 48);

impl DescentRay {
    pub const IDLE: Self = Self {
        origin: [0.0; 3],
        padding: 0.0,
        inv_lo: [0.0; 3],
        signs: Signs(NORMAL),
        minus_inv_hi: [0.0; 3],
        end: 0.0,
    };

    #[inline(always)]
    pub fn new(origin: [f32; 3], inv_lo: [f32; 3], inv_hi: [f32; 3], padding: f32, end: f32) -> Self {
        let signs = Signs::new(inv_lo.map(f32::is_sign_negative));
        Self { origin, padding, inv_lo, signs, minus_inv_hi: inv_hi.map(|inv| -inv), end }
    }

    /// Returns the ray with the far child visited first.
    #[inline(always)]
    pub fn far_first(self) -> Self {
        Self { signs: Signs(self.signs.0 | Signs::FAR_FIRST), ..self }
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
    let mut node = Node8 { splits: [f32::INFINITY; 7], axes: PlaneAxes::ALL_X, children: [EMPTY; 8] };
    // The subtree at each position of a level; `None` below a leaf.
    let mut level = vec![Some(binary)];
    for depth in 0..3 {
        let mut next = Vec::new();
        for (place, entry) in level.iter().enumerate() {
            let first_child = place << (3 - depth);
            match entry.map(|index| tree.nodes[index as usize].unpack()) {
                Some(Node::Inner { axis, split, first_child: pair }) => {
                    let plane = plane_above(first_child, depth);
                    node.splits[plane] = split;
                    node.axes.set(plane, axis);
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

/// Returns the plane at a level, 0 for the root, on the way to a child.
const fn plane_above(child: usize, level: usize) -> usize {
    let below = 4 >> level;
    child & (8 - 2 * below) | (below - 1)
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
    let down = node.axes.descended(ray.signs);
    let order = CHILD_ORDERS[down];
    let mut top = *height as usize;
    for i in 0..8 {
        let place = if ray.signs.far_first() == 1 { 7 - i } else { i };
        let child = (order >> (3 * place) & 7) as usize;
        let (mut t0, mut t1) = (*t0, *t1);
        for level in 0..3 {
            let plane = plane_above(child, level);
            let axis = node.axes.get(plane);
            let distance = node.splits[plane] - ray.origin[axis];
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
                let mut number = || [0.0, 1.0, -1.0, 0.5, next() as f32 / 8e6 - 1.0][next() as usize % 5];
                let splits = std::array::from_fn(|_| number());
                let mut node = Node8 { splits, axes: PlaneAxes::ALL_X, children: [0; 8] };
                let origin = [number(), number(), number()];
                let dir = [number(), number(), number()].map(|d| if d == 0.0 && next() % 2 == 0 { -0.0 } else { d });
                (0..7).for_each(|plane| node.axes.set(plane, next() as usize % 3));
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
