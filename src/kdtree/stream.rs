//! Many rays in flight through one mesh: for rays that have nothing in common.
//!
//! A single ray waits: for its node, for its comparison, for the branch that was guessed wrong. Here a ray makes one step
//! (a wide node or a leaf block) and goes to the back of a queue while the others make theirs, so the processor
//! always has several independent steps at hand, and the only branches are those of the queues.
//!
//! Start reading at [`run`].

use super::lanes::{may_hit, resolve, shear};
use super::mesh_tree::{BLOCK, MeshTree, TriangleBlock};
use super::ray::{Nearest, WIDEN};
use super::simd::Simd;
use super::wide::{DescentRay, LEAF, STACK, Stack};
use crate::geometry::{Ray, Shear};

/// Rays in flight.
const SLOTS: usize = 16;

/// Where the stream gets its rays, in the mesh's own space, and leaves what they hit.
pub(super) trait Source {
    /// The next ray, what it hit before, and a number that `finish` gets back.
    fn next(&mut self) -> Option<(Ray, Nearest, u32)>;
    /// `nearest.found` says whether this mesh has something nearer.
    fn finish(&mut self, ray: u32, nearest: &Nearest);
}

struct Slot {
    descent: DescentRay,
    leaf: LeafRay,
    nearest: Nearest,
    id: u32,
    height: usize,
    /// The entry that is visited next.
    child: u32,
    t0: f32,
    t1: f32,
}

/// A ray as the test of a leaf block wants it.
pub(super) struct LeafRay {
    /// Axes across, across and along.
    pub axes: [usize; 3],
    /// The origin along these.
    pub origin: [f32; 3],
    pub sx: f32,
    pub sy: f32,
    pub sz: f32,
}

impl LeafRay {
    fn new(ray: &Ray, shear: &Shear) -> Self {
        let axes = [shear.kx, shear.ky, shear.kz];
        Self { axes, origin: axes.map(|k| ray.origin[k]), sx: shear.sx, sy: shear.sy, sz: shear.sz }
    }
}

/// Tests one ray against a block.
#[inline(always)]
pub(super) fn test_block<S: Simd>(s: S, block: &TriangleBlock, ray: &LeafRay, nearest: &mut Nearest) {
    let [kx, ky, kz] = ray.axes.map(|axis| axis % 3);
    let origin = [s.splat(ray.origin[0]), s.splat(ray.origin[1]), s.splat(ray.origin[2])];
    let (sx, sy) = (s.splat(ray.sx), s.splat(ray.sy));
    let [a, b, c] = &block.vertices;
    let a = shear(s, [s.load(&a[kx]), s.load(&a[ky]), s.load(&a[kz])], origin, sx, sy);
    let b = shear(s, [s.load(&b[kx]), s.load(&b[ky]), s.load(&b[kz])], origin, sx, sy);
    let c = shear(s, [s.load(&c[kx]), s.load(&c[ky]), s.load(&c[kz])], origin, sx, sy);
    let mask = may_hit(s, &a, &b, &c);
    if mask == 0 {
        return;
    }
    let hits = resolve(s, mask, &a, &b, &c, s.splat(ray.sz));
    let valid = hits.mask & s.lt(s.splat(0.0), hits.t) & s.le(hits.t, s.splat(nearest.t));
    if valid == 0 {
        return;
    }
    let t = s.least(valid, hits.t);
    // Primitives ascend within a block: the first lane is the lowest of those at the same `t`.
    let lane = (valid & s.eq(hits.t, s.splat(t))).trailing_zeros() as usize;
    let (mut u, mut v) = ([0.0; BLOCK], [0.0; BLOCK]);
    s.store(hits.u, &mut u);
    s.store(hits.v, &mut v);
    nearest.offer(t, u[lane % BLOCK], v[lane % BLOCK], block.prim(lane % BLOCK));
}

/// Traces all rays of the source; with `ANY` a ray ends at its first hit.
#[inline(always)]
pub(super) fn run<S: Simd, const ANY: bool>(s: S, tree: &MeshTree, source: &mut impl Source) {
    let mut stream = Stream { s, tree, prefetch: tree.is_large(), stacks: Box::new([Stack::NEW; SLOTS]) };
    let mut slots: [Slot; SLOTS] = std::array::from_fn(|_| Slot::IDLE);
    // Slots whose next entry is a wide node, and those whose next entry is a leaf.
    // Both have room for one entry that is written and not kept.
    let (mut inner, mut n_inner) = ([0u8; SLOTS + 1], 0);
    let (mut leaf, mut n_leaf) = ([0u8; SLOTS + 1], 0);
    for i in 0..SLOTS {
        if stream.refill(&mut slots[i], source) {
            inner[n_inner] = i as u8;
            n_inner += 1;
        }
    }
    while n_inner + n_leaf > 0 {
        let mut kept = 0;
        for k in 0..n_inner {
            let i = inner[k] as usize % SLOTS;
            let slot = &mut slots[i];
            let stack = &mut stream.stacks[i];
            let t1 = slot.t1.min(slot.nearest.t);
            let node = &tree.wide[slot.child as usize];
            slot.height = s.descend(node, &slot.descent, slot.t0, t1, stack, slot.height);
            if !stream.pop(i, slot) {
                source.finish(slot.id, &slot.nearest);
                if !stream.refill(slot, source) {
                    continue;
                }
            }
            let is_leaf = slot.child & LEAF != 0;
            (inner[kept], leaf[n_leaf]) = (i as u8, i as u8);
            kept += usize::from(!is_leaf);
            n_leaf += usize::from(is_leaf);
        }
        n_inner = kept;
        let mut kept = 0;
        for k in 0..n_leaf {
            let i = leaf[k] as usize % SLOTS;
            let slot = &mut slots[i];
            let mut block = (slot.child & !LEAF) as usize;
            loop {
                test_block(s, &tree.blocks[block], &slot.leaf, &mut slot.nearest);
                if !tree.blocks[block].is_followed() {
                    break;
                }
                block += 1;
            }
            let done = ANY && slot.nearest.found;
            if done || !stream.pop(i, slot) {
                source.finish(slot.id, &slot.nearest);
                if !stream.refill(slot, source) {
                    continue;
                }
            }
            let is_leaf = slot.child & LEAF != 0;
            (leaf[kept], inner[n_inner]) = (i as u8, i as u8);
            kept += usize::from(is_leaf);
            n_inner += usize::from(!is_leaf);
        }
        n_leaf = kept;
    }
}

struct Stream<'a, S> {
    s: S,
    tree: &'a MeshTree,
    prefetch: bool,
    stacks: Box<[Stack; SLOTS]>,
}

impl<S: Simd> Stream<'_, S> {
    /// Takes the nearest entry that can still matter; false if there is none.
    #[inline(always)]
    fn pop(&self, i: usize, slot: &mut Slot) -> bool {
        let stack = &self.stacks[i];
        while slot.height > 0 {
            slot.height -= 1;
            let top = slot.height % STACK;
            if stack.t0[top] <= slot.nearest.t {
                (slot.child, slot.t0, slot.t1) = (stack.child[top], stack.t0[top], stack.t1[top]);
                if self.prefetch {
                    self.fetch(slot.child);
                }
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn fetch(&self, child: u32) {
        if child & LEAF != 0 {
            let at = self.tree.blocks.as_ptr().wrapping_add((child & !LEAF) as usize).cast::<u8>();
            for line in 0..size_of::<TriangleBlock>() / 64 {
                self.s.prefetch(at.wrapping_add(64 * line));
            }
        } else {
            let at = self.tree.wide.as_ptr().wrapping_add(child as usize).cast::<u8>();
            self.s.prefetch(at);
            self.s.prefetch(at.wrapping_add(64));
        }
    }

    /// Starts the next ray that meets the bounds; false if there are no more.
    #[inline(always)]
    fn refill(&mut self, slot: &mut Slot, source: &mut impl Source) -> bool {
        while let Some((ray, nearest, id)) = source.next() {
            let shear = Shear::new(ray.dir);
            let (mut origin, mut inv_lo, mut inv_hi) = ([0.0; 8], [0.0; 8], [0.0; 8]);
            let mut octant = 0;
            for axis in 0..3 {
                let inv = 1.0 / ray.dir[axis];
                origin[axis] = ray.origin[axis];
                inv_lo[axis] = inv * (1.0 - WIDEN);
                inv_hi[axis] = inv * (1.0 + WIDEN);
                octant |= usize::from(ray.dir[axis].is_sign_negative()) << axis;
            }
            let slack = (WIDEN * self.tree.extent) * shear.sz.abs();
            let bounds = [self.tree.nodes.bounds.min, self.tree.nodes.bounds.max];
            let (mut t0, mut t1) = (0.0, nearest.t);
            for axis in 0..3 {
                let down = octant >> axis & 1;
                t0 = f32::max(t0, (bounds[down][axis] - origin[axis]) * inv_lo[axis] - slack);
                t1 = f32::min(t1, (bounds[1 - down][axis] - origin[axis]) * inv_hi[axis] + slack);
            }
            if t0 <= t1 && !self.tree.wide.is_empty() {
                *slot = Slot {
                    descent: DescentRay { origin, inv_lo, inv_hi, slack, octant },
                    leaf: LeafRay::new(&ray, &shear),
                    nearest,
                    id,
                    height: 0,
                    child: 0,
                    t0,
                    t1,
                };
                return true;
            }
            source.finish(id, &nearest);
        }
        false
    }
}

impl Slot {
    const IDLE: Self = Self {
        descent: DescentRay { origin: [0.0; 8], inv_lo: [0.0; 8], inv_hi: [0.0; 8], slack: 0.0, octant: 0 },
        leaf: LeafRay { axes: [0, 1, 2], origin: [0.0; 3], sx: 0.0, sy: 0.0, sz: 0.0 },
        nearest: Nearest { t: 0.0, u: 0.0, v: 0.0, prim: 0, found: false },
        id: 0,
        height: 0,
        child: 0,
        t0: 0.0,
        t1: 0.0,
    };
}
