//! Stream traversal: many rays in state through one tree, for incoherent rays.
//!
//! A single ray is bound by latency: of its node, of its comparisons, of mispredicted branches. In a stream a ray makes
//! one step (a node or a leaf block) and goes to the back of a queue while the others make theirs. So the processor
//! always has several independent steps, and the only branches are those of the queues.
//!
//! Start reading at [`run`].

use super::block_tree::BlockTree;
use super::blocks::PreciseRay;
use super::leaf::{LeafBlock, LeafRay, ShearedRay};
use super::node8::{DONE, Stack, Walk};
use super::present::PresentPrimitives;
use super::ray::Nearest;
use super::ray_setup::{RaySetup, Source};
use super::simd::KernelSimd;
use crate::geometry::Aabb;

/// Rays in state. Half as many are 6 % slower on bounces, twice as many 3 %.
pub(super) const SLOTS: usize = 64;

/// A ray in state.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Slot<R> {
    walk: Walk,
    leaf: R,
    nearest: Nearest,
    id: u32,
    is_busy: bool,
}
// Two cache lines.
const _: () = assert!(size_of::<Slot<ShearedRay>>() == 128);

/// The slots in one state. A slot is written to every list and counted only in the list that it belongs to, which takes
/// no branch; hence the spare element.
pub(super) struct List {
    slots: [u8; SLOTS + 1],
    len: usize,
}

impl List {
    pub const NEW: Self = Self { slots: [0; SLOTS + 1], len: 0 };

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn push_if(&mut self, belongs: bool, slot: u8) {
        self.slots[self.len] = slot;
        self.len += usize::from(belongs);
    }

    /// Empties the list and returns its content.
    #[inline(always)]
    pub fn take(&mut self) -> ([u8; SLOTS + 1], usize) {
        (self.slots, std::mem::take(&mut self.len))
    }
}

/// Slots of the rays in state and their stacks. Reused for many streams, because clearing it takes longer than tracing
/// a few rays.
pub(super) struct StreamState {
    stacks: Box<[Stack]>,
    sheared: Box<[Slot<ShearedRay>]>,
    precise: Box<[Slot<PreciseRay>]>,
}

impl StreamState {
    pub fn new() -> Self {
        let mut stacks: Box<[Stack]> = (0..SLOTS).map(|_| Stack::NEW).collect();
        for stack in &mut stacks {
            (stack.child[0], stack.t0[0]) = (DONE, f32::NEG_INFINITY);
        }
        Self { stacks, sheared: vec![Slot::IDLE; SLOTS].into(), precise: vec![Slot::IDLE; SLOTS].into() }
    }
}

/// A kind of ray that streams support.
pub(super) trait StreamRay: LeafRay {
    /// The slots for rays of this kind.
    fn slots<'a>(sheared: &'a mut [Slot<ShearedRay>], precise: &'a mut [Slot<PreciseRay>]) -> &'a mut [Slot<Self>];

    /// Returns the ray of a lane, in the tree's own space.
    fn of_lane(setup: &RaySetup, lane: usize) -> Self;
}

impl StreamRay for ShearedRay {
    #[inline(always)]
    fn slots<'a>(sheared: &'a mut [Slot<Self>], _: &'a mut [Slot<PreciseRay>]) -> &'a mut [Slot<Self>] {
        sheared
    }

    #[inline(always)]
    fn of_lane(setup: &RaySetup, lane: usize) -> Self {
        setup.sheared(lane)
    }
}

impl StreamRay for PreciseRay {
    #[inline(always)]
    fn slots<'a>(_: &'a mut [Slot<ShearedRay>], precise: &'a mut [Slot<Self>]) -> &'a mut [Slot<Self>] {
        precise
    }

    #[inline(always)]
    fn of_lane(setup: &RaySetup, lane: usize) -> Self {
        let (origin, dir) = setup.ray(lane);
        Self::of(origin.as_dvec3().to_array(), dir.as_dvec3().to_array())
    }
}

/// Traces all rays of the source; with `ANY` a ray ends at its first hit and traversal starts from its far end.
///
/// - `present`: the primitives that take part; `None` for all.
///
/// A ray that leaves a surface first passes nearby geometry, most of which does not block it. An occluder, such as a
/// wall of a room, is as likely to be found from the other end.
#[inline(always)]
pub(super) fn run<S: KernelSimd, B: LeafBlock, const ANY: bool>(
    s: S,
    tree: &BlockTree<B>,
    present: Option<&PresentPrimitives>,
    source: &mut impl Source,
    state: &mut StreamState,
) where
    B::Ray: StreamRay,
{
    let nodes8 = &tree.nodes8[..];
    if nodes8.is_empty() {
        return;
    }
    let bounds = present.map_or(&tree.nodes.bounds, |present| &present.bounds);
    let prefetch = tree.is_large();
    let stacks: &mut [Stack; SLOTS] = (&mut *state.stacks).try_into().expect("one for each slot");
    let slots = B::Ray::slots(&mut state.sheared, &mut state.precise);
    let slots: &mut [Slot<B::Ray>; SLOTS] = slots.try_into().expect("as many as there are");
    let (mut inner, mut leaf, mut idle) = (List::NEW, List::NEW, List::NEW);
    for (i, slot) in (0..).zip(slots.iter_mut().take(source.left())) {
        // A stream that ended by a panic leaves busy slots behind.
        slot.is_busy = false;
        idle.push_if(true, i);
    }
    let constants = s.visit_constants();
    let mut setup = RaySetup::new();
    loop {
        let (list, len) = idle.take();
        for &i in &list[..len] {
            let slot = &mut slots[i as usize % SLOTS];
            if slot.is_busy {
                source.finish(slot.id, &slot.nearest);
            }
            slot.is_busy = refill::<S, B, ANY>(s, (tree, bounds), slot, &mut setup, source);
            inner.push_if(slot.is_busy, i);
        }
        if inner.len + leaf.len == 0 {
            return;
        }
        let (list, len) = inner.take();
        let (pairs, single) = list[..len].as_chunks();
        for pair in pairs {
            let pair = pair.map(|i| i as usize % SLOTS);
            let [a, b] = slots.get_disjoint_mut(pair).expect("a slot is in a list once");
            let stacks = stacks.get_disjoint_mut(pair).expect("one for each slot");
            let nodes = [&nodes8[a.walk.child as usize], &nodes8[b.walk.child as usize]];
            s.descend_two(constants, nodes, [&mut a.walk, &mut b.walk], stacks);
        }
        for &i in single {
            let (walk, stack) = (&mut slots[i as usize % SLOTS].walk, &mut stacks[i as usize % SLOTS]);
            s.descend(&nodes8[walk.child as usize], walk, stack);
        }
        // A separate loop, so that a misprediction discards little work.
        for &i in &list[..len] {
            let slot = &mut slots[i as usize % SLOTS];
            slot.walk.pop(&stacks[i as usize % SLOTS]);
            if prefetch {
                tree.prefetch::<S, 1>(s, slot.walk.child);
            }
            inner.push_if(slot.walk.child < DONE, i);
            leaf.push_if(slot.walk.child > DONE, i);
            idle.push_if(slot.walk.child == DONE, i);
        }
        let (list, len) = leaf.take();
        for &i in &list[..len] {
            let child = slots[i as usize % SLOTS].walk.child;
            if prefetch {
                tree.prefetch::<S, 0>(s, child);
            }
        }
        for &i in &list[..len] {
            let slot = &mut slots[i as usize % SLOTS];
            tree.test_leaf(s, slot.walk.child, &slot.leaf, &mut slot.nearest, present);
            slot.walk.descent.end = slot.nearest.t;
        }
        for &i in &list[..len] {
            let slot = &mut slots[i as usize % SLOTS];
            slot.walk.pop(&stacks[i as usize % SLOTS]);
            if ANY && slot.nearest.found {
                slot.walk.child = DONE;
            }
            if prefetch {
                tree.prefetch::<S, 1>(s, slot.walk.child);
            }
            inner.push_if(slot.walk.child < DONE, i);
            leaf.push_if(slot.walk.child > DONE, i);
            idle.push_if(slot.walk.child == DONE, i);
        }
    }
}

/// Starts the next ray that enters the bounds; false if there are no more.
#[inline(always)]
fn refill<S: KernelSimd, B: LeafBlock, const ANY: bool>(
    s: S,
    (tree, bounds): (&BlockTree<B>, &Aabb),
    slot: &mut Slot<B::Ray>,
    setup: &mut RaySetup,
    source: &mut impl Source,
) -> bool
where
    B::Ray: StreamRay,
{
    let Some(lane) = setup.next(s, bounds, tree.extent, source) else { return false };
    let (t0, t1) = setup.within(lane);
    let descent = if ANY { setup.descent(lane).far_first() } else { setup.descent(lane) };
    *slot = Slot {
        walk: Walk { descent, child: 0, t0, t1, height: 1 },
        leaf: <B::Ray as StreamRay>::of_lane(setup, lane),
        nearest: setup.nearest(lane),
        id: setup.id(lane),
        is_busy: true,
    };
    true
}

impl<R: LeafRay> Slot<R> {
    const IDLE: Self = Self {
        walk: Walk::IDLE,
        leaf: R::IDLE,
        nearest: Nearest { t: 0.0, u: 0.0, v: 0.0, prim: 0, found: false },
        id: 0,
        is_busy: false,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Ray;
    use crate::ray_setup::FetchedRays;
    use crate::simd::{LANES, Mask};
    use crate::{BuildPreset, MeshTree};
    use firstlight_simd::Portable;
    use glam::Affine3A;
    use glam::Vec3;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    /// A source that reads rays from a list and records their results; `finish` panics at the ray `poisoned`.
    struct Listed<'a> {
        rays: &'a [Ray],
        next: usize,
        poisoned: Option<u32>,
        finished: Vec<(u32, bool, u32)>,
    }

    impl Source for Listed<'_> {
        fn left(&self) -> usize {
            self.rays.len() - self.next
        }

        fn fetch<S: KernelSimd>(&mut self, _: S, to: &mut FetchedRays) -> Option<Mask> {
            let n = self.left().min(LANES);
            for (lane, ray) in self.rays[self.next..][..n].iter().enumerate() {
                (0..3).for_each(|axis| (to.origin[axis][lane], to.dir[axis][lane]) = (ray.origin[axis], ray.dir[axis]));
                (to.t[lane], to.prim[lane], to.id[lane]) = (f32::INFINITY, 0, (self.next + lane) as u32);
            }
            self.next += n;
            (n > 0).then(|| Mask::MAX >> (LANES - n))
        }

        fn own_from_world(&self) -> Option<&Affine3A> {
            None
        }

        fn finish(&mut self, ray: u32, nearest: &Nearest) {
            assert!(self.poisoned != Some(ray), "poisoned");
            self.finished.push((ray, nearest.found, nearest.t.to_bits()));
        }
    }

    fn trace(tree: &MeshTree, rays: &[Ray], poisoned: Option<u32>, state: &mut StreamState) -> Vec<(u32, bool, u32)> {
        let mut source = Listed { rays, next: 0, poisoned, finished: Vec::new() };
        run::<Portable, _, false>(Portable, tree.blocks(), None, &mut source, state);
        source.finished.sort_unstable();
        source.finished
    }

    #[test]
    fn a_stream_cut_short_by_a_panic_leaves_nothing_to_the_next() {
        // A staircase, so that rays take different numbers of steps.
        let corners: Vec<Vec3> = (0..600)
            .map(|i| Vec3::new((i % 20) as f32 + (i % 3) as f32 * 0.9, (i / 20) as f32, ((i * 7) % 11) as f32 * 0.1))
            .collect();
        let triangles: Vec<[u32; 3]> = (0..560).map(|i| [i, i + 1, i + 20]).collect();
        let tree = MeshTree::build(&corners, &triangles, BuildPreset::Best);
        let rays: Vec<Ray> = (0..300)
            .map(|i| {
                let to = Vec3::new((i * 13 % 20) as f32, (i * 29 % 28) as f32, 0.3);
                Ray::new(Vec3::new(3.0, 2.0, 40.0), (to - Vec3::new(3.0, 2.0, 40.0)).normalize())
            })
            .collect();
        let whole = trace(&tree, &rays, None, &mut StreamState::new());
        assert!(whole.iter().filter(|(_, found, _)| *found).count() > 50);
        let mut state = StreamState::new();
        for poisoned in [0, 70, 150] {
            let poisoned = whole.iter().map(|(ray, ..)| *ray).find(|ray| *ray >= poisoned);
            let cut = catch_unwind(AssertUnwindSafe(|| trace(&tree, &rays, poisoned, &mut state)));
            assert!(cut.is_err(), "the ray {poisoned:?} was to be finished");
            // First fewer rays than were in state, then all.
            for n in [3, rays.len()] {
                let fresh = trace(&tree, &rays[..n], None, &mut StreamState::new());
                assert_eq!(trace(&tree, &rays[..n], None, &mut state), fresh);
            }
        }
    }
}
