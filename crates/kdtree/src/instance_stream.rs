//! Stream traversal of many instances: like [`super::stream`], over two levels.
//!
//! A ray descends the tree over the instances. In a leaf the placements whose bounds it passes join its stack, nearest on
//! top. When one is popped, the ray enters it: it is transformed and descends the tree of the instance, with a stack of
//! its own, and returns to the upper tree when that stack is empty. All rays of a batch are in one stream, whichever
//! instances they are in, so that also few rays in each of many instances keep the processor busy.
//!
//! Start reading at [`run`].

use super::block_tree::BlockTree;
use super::blocks::PreciseRay;
use super::instance_tree::{InstanceTree, OwnTree, Placement, Recent};
use super::leaf::{BLOCK, LeafBlock, LeafRay, ShearedRay};
use super::node8::{DONE, DescentRay, LEAF, Node8, Stack, Walk};
use super::ray::{Nearest, TreeRay};
use super::ray_setup::{RaySetup, Source};
use super::shape::{transform_point, transform_vector};
use super::simd::KernelSimd;
use super::stream::{List, SLOTS};
use crate::geometry::{Ray, Shear};
use glam::Vec3;

/// Marks an entry of the upper tree's stack that is a placement, whose index is in the bits below.
const PLACEMENT: u32 = LEAF | 1 << 30;

/// Receiver of the hits of rays among instances.
pub(super) trait InstanceSource: Source {
    /// Called for rays that have a nearer hit than that which [`Source::next`] returned.
    fn finish_in(&mut self, ray: u32, object: u32, nearest: &Nearest);
}

/// A ray in state.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct InstanceSlot {
    /// In the tree that the ray is in.
    walk: Walk,
    nearest: Nearest,
    /// For the instance that the ray is in.
    sheared: ShearedRay,
    precise: PreciseRay,
    /// In the space of the upper tree.
    upper: DescentRay,
    origin: Vec3,
    dir: Vec3,
    recent: Recent,
    /// Height of the upper tree's stack while the ray is in an instance.
    upper_height: u32,
    /// The object that the ray is in.
    object: u32,
    /// The object and primitive of the nearest hit.
    found: [u32; 2],
    has_hit: bool,
    id: u32,
    is_busy: bool,
}

impl InstanceSlot {
    const IDLE: Self = Self {
        walk: Walk::IDLE,
        nearest: Nearest { t: 0.0, u: 0.0, v: 0.0, prim: 0, found: false },
        sheared: ShearedRay::IDLE,
        precise: PreciseRay::IDLE,
        upper: DescentRay::IDLE,
        origin: Vec3::ZERO,
        dir: Vec3::ZERO,
        recent: Recent::NEW,
        upper_height: 1,
        object: 0,
        found: [0; 2],
        has_hit: false,
        id: 0,
        is_busy: false,
    };
}

/// What a ray does next: the index of its list.
const INNER: usize = 0;
const LEAVES: usize = 1;
const UPPER_LEAVES: usize = 2;
const ENTER: usize = 3;
const LEAVE: usize = 4;
const IDLE: usize = 5;

/// Slots of the rays in state and their stacks, reused for many streams.
pub(super) struct InstanceState {
    slots: Box<[InstanceSlot]>,
    /// For each slot the stack in the upper tree, and that in an instance.
    stacks: Box<[[Stack; 2]]>,
}

impl InstanceState {
    pub fn new() -> Self {
        let mut stacks: Box<[[Stack; 2]]> = (0..SLOTS).map(|_| [Stack::NEW, Stack::NEW]).collect();
        for stack in stacks.iter_mut().flatten() {
            (stack.child[0], stack.t0[0]) = (DONE, f32::NEG_INFINITY);
        }
        Self { slots: vec![InstanceSlot::IDLE; SLOTS].into(), stacks }
    }
}

/// The rays by what they do next.
struct InstanceLists([List; 6]);

impl InstanceLists {
    /// - `in_instance`: whether the slot's ray is in an instance.
    #[inline(always)]
    fn push(&mut self, i: u8, child: u32, in_instance: bool) {
        let kind = usize::from(child >= DONE) + usize::from(child > DONE) + usize::from(child >= PLACEMENT);
        const LISTS: [[usize; 4]; 2] = [[INNER, IDLE, UPPER_LEAVES, ENTER], [INNER, LEAVE, LEAVES, LEAVES]];
        self.0[LISTS[usize::from(in_instance)][kind]].push_if(true, i);
    }
}

/// Traces all rays of the source through the instances; with `ANY` a ray ends at its first hit.
///
/// - `source`: the index of a ray's nearest hit so far ([`Nearest::prim`]) is that of an object.
#[inline(always)]
pub(super) fn run<S: KernelSimd, const ANY: bool>(
    s: S,
    tree: &InstanceTree,
    source: &mut impl InstanceSource,
    state: &mut InstanceState,
) {
    let upper_nodes = &tree.nodes8[..];
    if upper_nodes.is_empty() {
        return;
    }
    let stacks: &mut [[Stack; 2]; SLOTS] = (&mut *state.stacks).try_into().expect("two for each slot");
    let slots: &mut [InstanceSlot; SLOTS] = (&mut *state.slots).try_into().expect("as many as there are");
    let mut nodes: [&[Node8]; SLOTS] = [upper_nodes; SLOTS];
    let mut trees: [Option<&OwnTree>; SLOTS] = [None; SLOTS];
    let mut lists = InstanceLists([List::NEW; 6]);
    for (i, slot) in (0..).zip(slots.iter_mut().take(source.left())) {
        // A stream that ended by a panic leaves busy slots behind.
        slot.is_busy = false;
        lists.0[IDLE].push_if(true, i);
    }
    let constants = s.visit_constants();
    let mut setup = RaySetup::new();
    loop {
        let (list, len) = lists.0[IDLE].take();
        for &i in &list[..len] {
            let slot = &mut slots[i as usize % SLOTS];
            if slot.is_busy && slot.has_hit {
                source.finish_in(slot.id, slot.found[0], &Nearest { prim: slot.found[1], ..slot.nearest });
            }
            slot.is_busy = false;
            let Some(lane) = setup.next(s, &tree.nodes.bounds, tree.extent, source) else { continue };
            let (t0, t1) = setup.within(lane);
            let walk = Walk { descent: setup.descent(lane), child: 0, t0, t1, height: 1 };
            let nearest = setup.nearest(lane);
            let (origin, dir) = setup.ray(lane);
            let (id, found) = (setup.id(lane), [nearest.prim, 0]);
            *slot = InstanceSlot {
                walk,
                nearest,
                upper: walk.descent,
                origin,
                dir,
                found,
                id,
                is_busy: true,
                ..InstanceSlot::IDLE
            };
            lists.0[INNER].push_if(true, i);
        }
        if lists.0.iter().all(|list| list.len() == 0) {
            return;
        }
        let (list, len) = lists.0[INNER].take();
        let (pairs, single) = list[..len].as_chunks();
        for pair in pairs {
            let pair = pair.map(|i| i as usize % SLOTS);
            let [a, b] = slots.get_disjoint_mut(pair).expect("a slot is in a list once");
            let [of_a, of_b] = stacks.get_disjoint_mut(pair).expect("two for each slot");
            let in_instance = pair.map(|at| usize::from(trees[at].is_some()));
            let stacks = [&mut of_a[in_instance[0]], &mut of_b[in_instance[1]]];
            let visited = [&nodes[pair[0]][a.walk.child as usize], &nodes[pair[1]][b.walk.child as usize]];
            s.descend_two(constants, visited, [&mut a.walk, &mut b.walk], stacks);
        }
        for &i in single {
            let at = i as usize % SLOTS;
            let (slot, stack) = (&mut slots[at], &mut stacks[at][usize::from(trees[at].is_some())]);
            s.descend(&nodes[at][slot.walk.child as usize], &mut slot.walk, stack);
        }
        // A separate loop, so that a misprediction discards little work.
        for &i in &list[..len] {
            let at = i as usize % SLOTS;
            let (slot, in_instance) = (&mut slots[at], trees[at].is_some());
            slot.walk.pop(&stacks[at][usize::from(in_instance)]);
            lists.push(i, slot.walk.child, in_instance);
        }
        let (list, len) = lists.0[UPPER_LEAVES].take();
        for &i in &list[..len] {
            let at = i as usize % SLOTS;
            let (slot, stack) = (&mut slots[at], &mut stacks[at][0]);
            test_boxes(s, tree, slot, stack);
            slot.walk.pop(stack);
            lists.push(i, slot.walk.child, false);
        }
        let (list, len) = lists.0[ENTER].take();
        for &i in &list[..len] {
            let at = i as usize % SLOTS;
            let slot = &mut slots[at];
            let placement = tree.placement(slot.walk.child & !PLACEMENT);
            let own_tree = tree.own_tree(placement);
            let entered = match own_tree {
                OwnTree::Mesh(tree) => enter::<_, ANY>(slot, &tree.blocks, placement),
                OwnTree::Spheres(tree) => enter::<_, ANY>(slot, &tree.tree, placement),
            };
            if let Some(own_nodes) = entered {
                (nodes[at], trees[at]) = (own_nodes, Some(own_tree));
                lists.0[INNER].push_if(true, i);
            } else {
                slot.walk.pop(&stacks[at][0]);
                lists.push(i, slot.walk.child, false);
            }
        }
        let (list, len) = lists.0[LEAVES].take();
        for &i in &list[..len] {
            let at = i as usize % SLOTS;
            let slot = &mut slots[at];
            match trees[at] {
                Some(OwnTree::Mesh(tree)) => {
                    tree.blocks.test_leaf(s, slot.walk.child, &slot.sheared, &mut slot.nearest, None);
                }
                Some(OwnTree::Spheres(tree)) => {
                    tree.tree.test_leaf(s, slot.walk.child, &slot.precise, &mut slot.nearest, None);
                }
                None => {}
            }
            slot.walk.descent.end = slot.nearest.t;
        }
        for &i in &list[..len] {
            let at = i as usize % SLOTS;
            let slot = &mut slots[at];
            slot.walk.pop(&stacks[at][1]);
            if ANY && slot.nearest.found {
                slot.walk.child = DONE;
            }
            lists.push(i, slot.walk.child, true);
        }
        let (list, len) = lists.0[LEAVE].take();
        for &i in &list[..len] {
            let at = i as usize % SLOTS;
            let slot = &mut slots[at];
            (nodes[at], trees[at]) = (upper_nodes, None);
            if slot.nearest.found {
                (slot.found, slot.has_hit) = ([slot.object, slot.nearest.prim], true);
                slot.nearest.found = false;
            }
            slot.walk.descent = DescentRay { end: slot.nearest.t, ..slot.upper };
            slot.walk.height = slot.upper_height;
            slot.walk.pop(&stacks[at][0]);
            if ANY && slot.has_hit {
                slot.walk.child = DONE;
            }
            lists.push(i, slot.walk.child, false);
        }
    }
}

/// Pushes the objects of a leaf's block that the ray passes within the leaf's cell, nearest on top, and below them the
/// leaf's next block.
#[inline(always)]
fn test_boxes<S: KernelSimd>(s: S, tree: &InstanceTree, slot: &mut InstanceSlot, stack: &mut Stack) {
    let block = tree.block(slot.walk.child);
    let (mut met, t) = block.entries(s, &slot.walk.descent, slot.walk.t0, slot.walk.t1);
    let mut height = slot.walk.height as usize;
    if block.placements.is_followed() {
        (stack.child[height], stack.t0[height], stack.t1[height]) = (slot.walk.child + 1, slot.walk.t0, slot.walk.t1);
        height += 1;
    }
    let first = height;
    while met != 0 {
        let lane = met.trailing_zeros() as usize % BLOCK;
        met &= met - 1;
        let placement = block.placements.get(lane);
        if !slot.recent.is_new(placement) {
            continue;
        }
        s.prefetch(std::ptr::from_ref(tree.placement(placement)).cast());
        let mut at = height;
        while at > first && stack.t0[at - 1] < t[lane] {
            (stack.child[at], stack.t0[at]) = (stack.child[at - 1], stack.t0[at - 1]);
            at -= 1;
        }
        (stack.child[at], stack.t0[at]) = (PLACEMENT | placement, t[lane]);
        height += 1;
    }
    slot.walk.height = height as u32;
}

/// Moves the ray into an object. Returns the nodes of the object's tree; `None` if the ray misses its bounds.
#[inline(always)]
fn enter<'a, B: LeafBlock, const ANY: bool>(
    slot: &mut InstanceSlot,
    tree: &'a BlockTree<B>,
    placement: &Placement,
) -> Option<&'a [Node8]>
where
    B::Ray: OwnRay,
{
    let map = placement.object_from_world();
    let (origin, dir) = (transform_point(&map, slot.origin), transform_vector(&map, slot.dir));
    let ray = Ray { origin, dir, t_max: slot.nearest.t };
    let shear = Shear::new(ray.dir);
    let tree_ray = TreeRay::new(ray.origin, ray.dir, &shear, tree.extent);
    let (t0, t1) = tree_ray.clip(&tree.nodes.bounds, slot.nearest.t);
    if !(t0 <= t1) || tree.nodes8.is_empty() {
        return None;
    }
    let TreeRay { origin, inv_lo, inv_hi, padding, .. } = tree_ray;
    let descent = DescentRay::new(origin, inv_lo, inv_hi, padding, slot.nearest.t);
    slot.walk.descent = if ANY { descent.far_first() } else { descent };
    B::Ray::new(&ray, &shear).put(slot);
    slot.upper_height = slot.walk.height;
    (slot.walk.child, slot.walk.t0, slot.walk.t1, slot.walk.height) = (0, t0, t1, 1);
    slot.object = placement.object;
    // At equal distance the lower object wins, whatever its primitive.
    slot.nearest.prim = if placement.object < slot.found[0] { u32::MAX } else { 0 };
    Some(&tree.nodes8)
}

/// A ray prepared for the leaves of an instance.
trait OwnRay: LeafRay {
    fn put(self, slot: &mut InstanceSlot);
}

impl OwnRay for ShearedRay {
    #[inline(always)]
    fn put(self, slot: &mut InstanceSlot) {
        slot.sheared = self;
    }
}

impl OwnRay for PreciseRay {
    #[inline(always)]
    fn put(self, slot: &mut InstanceSlot) {
        slot.precise = self;
    }
}
