//! Batch queries over a scene: selects the traversal for each kind of object.
//!
//! A handful of simple objects, or of spheres in a cloud, is tested by packets of sixteen rays; larger numbers have
//! trees that are traversed by streams. Rays that enter the bounds of an instance traverse its own tree, as a packet if
//! the batch is coherent, otherwise in a stream. Many instances have a tree over them, and one stream through both
//! levels. None of this changes the results.

use super::batch::{HitBatch, RayBatch};
use super::block_tree::BlockTree;
use super::blocks::{QuadBlock, SphereBlock, TriangleBlock};
use super::instance_stream::{self, InstanceSource, InstanceState};
use super::instance_tree::InstanceTree;
use super::lanes::to_own_space;
use super::mesh_packet::{MeshPacket, NearestLanes, PacketBlock, PacketStack};
use super::objects::{Packet, SimpleObjects, load_some, load_some_u};
use super::primitive_trees::PrimitiveTrees;
use super::ray::Nearest;
use super::ray_setup::{FetchedRays, Source};
use super::shape::{RayClass, Shape};
use super::simd::{InstructionSet, KernelSimd, LANES, Mask, dispatch};
use super::stream::{self, StreamState};
use super::surface::{Instance, PlacedShapes};
use crate::geometry::Aabb;
use glam::Affine3A;
use std::cell::RefCell;

/// Rays that pass through all objects before the next ones start.
const CHUNK: usize = 2048;

/// The objects of a scene, grouped by traversal.
#[derive(Debug, Default)]
pub(super) struct TopLevel {
    /// Tested by every ray; includes planes.
    pub simple: SimpleObjects,
    /// Object indices of `simple`.
    pub simple_objects: Vec<u32>,
    pub loose: PrimitiveTrees,
    pub instances: Instances,
}

/// Objects with their own space.
#[derive(Debug)]
pub(super) enum Instances {
    /// Few enough that every ray tests the bounds of each.
    Few(Vec<u32>),
    Many(InstanceTree),
}

impl Default for Instances {
    fn default() -> Self {
        Self::Few(Vec::new())
    }
}

/// Clouds of up to this many spheres are tested by packets, sphere by sphere.
const MAX_PACKET_SPHERES: usize = 16;

/// With more instances than this, a tree over them pays.
const MAX_INSTANCES: usize = 12;

impl TopLevel {
    /// Groups the objects.
    ///
    /// - `boxes`: bounds of all shapes.
    pub fn new(scene: &PlacedShapes, boxes: &[Aabb]) -> Self {
        let shapes = &scene.shapes[..];
        let (loose, simple_objects) = PrimitiveTrees::build(shapes, boxes);
        let is_instance = |object: &u32| matches!(shapes[*object as usize], Shape::Mesh { .. } | Shape::Spheres { .. });
        let instances: Vec<u32> = (0..shapes.len() as u32).filter(is_instance).collect();
        let instances = if instances.len() > MAX_INSTANCES {
            Instances::Many(InstanceTree::build(scene, &instances))
        } else {
            Instances::Few(instances)
        };
        let simple = SimpleObjects::new(shapes, simple_objects.iter().copied());
        Self { simple, simple_objects, loose, instances }
    }

    pub fn closest_hits(
        &self,
        set: InstructionSet,
        scene: &PlacedShapes,
        rays: &RayBatch,
        class: RayClass,
        hits: &mut HitBatch,
    ) {
        trace(set, self, scene, rays, class, hits);
    }

    pub fn any_hits(
        &self,
        set: InstructionSet,
        scene: &PlacedShapes,
        rays: &RayBatch,
        class: RayClass,
        occluded: &mut [bool],
    ) {
        trace(set, self, scene, rays, class, occluded);
    }
}

/// Any tree that streams traverse.
#[derive(Clone, Copy)]
enum StreamTree<'a> {
    Triangles(&'a BlockTree<TriangleBlock>),
    Quads(&'a BlockTree<QuadBlock>),
    Spheres(&'a BlockTree<SphereBlock>),
    Instances(&'a InstanceTree),
}

/// Storage for the results of a batch.
trait Answers {
    /// Returns what is known of the rays from `first` on: those that are not done, the distance of their hits so far, by
    /// default `t_max`, and the objects of these hits, by default [`HitBatch::MISS`].
    fn so_far<S: KernelSimd>(&self, s: S, first: usize, t_max: S::F) -> (Mask, S::F, S::U);

    fn set(&mut self, ray: usize, object: u32, prim: u32, nearest: &Nearest);

    /// Stores the hits of a packet for the rays from `first` on.
    fn store<S: KernelSimd>(&mut self, s: S, packet: &Packet<S>, first: usize);

    /// Traces packets with the instruction set `set`.
    fn packets(&mut self, set: InstructionSet, packets: &Packets);

    /// Traces a [`stream`] with the instruction set `set`.
    fn stream(&mut self, set: InstructionSet, tree: StreamTree, rays: QueuedRays, state: &mut StreamStates);
}

impl Answers for HitBatch {
    #[inline(always)]
    fn so_far<S: KernelSimd>(&self, s: S, first: usize, t_max: S::F) -> (Mask, S::F, S::U) {
        let object = load_some_u(s, &self.object[first..], Self::MISS);
        let t = load_some(s, &self.t[first..], 0.0);
        let missed = s.eq_u(object, s.splat_u(Self::MISS));
        (Mask::MAX, s.select(missed, t_max, t), object)
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, object: u32, prim: u32, nearest: &Nearest) {
        (self.t[ray], self.u[ray], self.v[ray]) = (nearest.t, nearest.u, nearest.v);
        (self.prim[ray], self.object[ray]) = (prim, object);
    }

    #[inline(always)]
    fn store<S: KernelSimd>(&mut self, s: S, packet: &Packet<S>, first: usize) {
        packet.store(s, self, first);
    }

    fn packets(&mut self, set: InstructionSet, packets: &Packets) {
        let answers = self;
        dispatch!(set, closest_packets(packets: &Packets, answers: &mut HitBatch));
    }

    fn stream(&mut self, set: InstructionSet, tree: StreamTree, rays: QueuedRays, state: &mut StreamStates) {
        let answers = self;
        dispatch!(set, closest_stream(tree: StreamTree, rays: QueuedRays, answers: &mut HitBatch, state: &mut StreamStates));
    }
}

/// Results of any-hit queries: whether each ray is occluded.
impl Answers for [bool] {
    #[inline(always)]
    fn so_far<S: KernelSimd>(&self, s: S, first: usize, t_max: S::F) -> (Mask, S::F, S::U) {
        let occluded = self[first..].iter().take(LANES).enumerate();
        let done = occluded.fold(0, |done: Mask, (lane, occluded)| done | Mask::from(*occluded) << lane);
        (!done, t_max, s.splat_u(HitBatch::MISS))
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, _: u32, _: u32, _: &Nearest) {
        self[ray] = true;
    }

    #[inline(always)]
    fn store<S: KernelSimd>(&mut self, _: S, packet: &Packet<S>, first: usize) {
        for (lane, occluded) in self[first..].iter_mut().take(LANES).enumerate() {
            *occluded = packet.found >> lane & 1 != 0;
        }
    }

    fn packets(&mut self, set: InstructionSet, packets: &Packets) {
        let answers = self;
        dispatch!(set, any_packets(packets: &Packets, answers: &mut [bool]));
    }

    fn stream(&mut self, set: InstructionSet, tree: StreamTree, rays: QueuedRays, state: &mut StreamStates) {
        let answers = self;
        dispatch!(set, any_stream(tree: StreamTree, rays: QueuedRays, answers: &mut [bool], state: &mut StreamStates));
    }
}

fn trace<A: Answers + ?Sized>(
    set: InstructionSet,
    top: &TopLevel,
    scene: &PlacedShapes,
    rays: &RayBatch,
    class: RayClass,
    answers: &mut A,
) {
    STATES.with_borrow_mut(|state| trace_in(state, set, (top, scene), (rays, class), answers));
}

/// State of streams over one level and over two.
struct StreamStates {
    one: StreamState,
    two: Option<InstanceState>,
}

thread_local! {
    static STATES: RefCell<StreamStates> = RefCell::new(StreamStates { one: StreamState::new(), two: None });
}

fn trace_in<A: Answers + ?Sized>(
    state: &mut StreamStates,
    set: InstructionSet,
    (top, scene): (&TopLevel, &PlacedShapes),
    (rays, class): (&RayBatch, RayClass),
    answers: &mut A,
) {
    let few = match &top.instances {
        Instances::Few(few) => &few[..],
        Instances::Many(_) => &[],
    };
    let goes_in_packets = |object: &u32| match &scene.shapes[*object as usize] {
        Shape::Mesh { .. } => class == RayClass::Coherent,
        Shape::Spheres { tree, .. } => class == RayClass::Coherent || tree.len() <= MAX_PACKET_SPHERES,
        _ => false,
    };
    let (in_packets, streamed): (Vec<u32>, Vec<u32>) = few.iter().partition(|object| goes_in_packets(object));
    for first in (0..rays.len()).step_by(CHUNK) {
        let end = (first + CHUNK).min(rays.len());
        answers.packets(set, &Packets { simple: &top.simple, instances: &in_packets, scene, rays, first, end });
        let own = |instance: Option<u32>| QueuedRays {
            rays,
            first,
            end,
            instance: instance.map(|i| (i, &scene.instances[i as usize])),
        };
        if let Some(tree) = &top.loose.spheres {
            answers.stream(set, StreamTree::Spheres(tree), own(None), state);
        }
        if let Some(tree) = &top.loose.quads {
            answers.stream(set, StreamTree::Quads(tree), own(None), state);
        }
        if let Some(tree) = &top.loose.triangles {
            answers.stream(set, StreamTree::Triangles(tree), own(None), state);
        }
        for &object in &streamed {
            if let Some(tree) = tree_of(scene, object) {
                answers.stream(set, tree, own(Some(object)), state);
            }
        }
        if let Instances::Many(tree) = &top.instances {
            answers.stream(set, StreamTree::Instances(tree), own(None), state);
        }
    }
}

/// Returns the tree of an object; `None` for an object without one.
fn tree_of(scene: &PlacedShapes, object: u32) -> Option<StreamTree<'_>> {
    match &scene.shapes[object as usize] {
        Shape::Mesh { tree, .. } => Some(StreamTree::Triangles(&tree.tree)),
        Shape::Spheres { tree, .. } => Some(StreamTree::Spheres(&tree.tree)),
        _ => None,
    }
}

/// Input of packet traversal.
struct Packets<'a> {
    simple: &'a SimpleObjects,
    /// Meshes and small clouds of spheres.
    instances: &'a [u32],
    scene: &'a PlacedShapes,
    rays: &'a RayBatch,
    /// The first ray, and the one after the last.
    first: usize,
    end: usize,
}

#[inline(always)]
fn closest_packets<S: KernelSimd>(s: S, packets: &Packets, answers: &mut HitBatch) {
    trace_packets::<S, HitBatch, false>(s, packets, answers);
}

#[inline(always)]
fn any_packets<S: KernelSimd>(s: S, packets: &Packets, answers: &mut [bool]) {
    trace_packets::<S, [bool], true>(s, packets, answers);
}

#[inline(always)]
fn trace_packets<S: KernelSimd, A: Answers + ?Sized, const ANY: bool>(s: S, packets: &Packets, answers: &mut A) {
    let mut stack = PacketStack::new(s);
    for first in (packets.first..packets.end).step_by(LANES) {
        let mut packet = Packet::load(s, packets.rays, first);
        packet.test_objects::<ANY>(s, packets.simple);
        for &object in packets.instances {
            let instance = &packets.scene.instances[object as usize];
            match &packets.scene.shapes[object as usize] {
                Shape::Mesh { tree, .. } => {
                    trace_packet::<S, _, ANY>(s, &tree.tree, instance, object, &mut packet, &mut stack);
                }
                Shape::Spheres { tree, .. } if tree.len() > MAX_PACKET_SPHERES => {
                    trace_packet::<S, _, ANY>(s, &tree.tree, instance, object, &mut packet, &mut stack);
                }
                Shape::Spheres { tree, .. } => {
                    let [origin, dir] = to_own_space(s, &instance.object_from_world, &packet.origin, &packet.dir);
                    packet.test_cloud::<ANY>(s, tree, object, &origin, &dir);
                }
                _ => {}
            }
        }
        answers.store(s, &packet, first);
    }
}

/// Traces a packet through one mesh or cloud of spheres.
#[inline(always)]
fn trace_packet<S: KernelSimd, B: PacketBlock, const ANY: bool>(
    s: S,
    tree: &BlockTree<B>,
    instance: &Instance,
    object: u32,
    packet: &mut Packet<S>,
    stack: &mut PacketStack<S>,
) {
    let lanes = if ANY { packet.lanes & !packet.found } else { packet.lanes };
    if lanes == 0 {
        return;
    }
    let [origin, dir] = to_own_space(s, &instance.object_from_world, &packet.origin, &packet.dir);
    let mut nearest = NearestLanes { t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES], prim: [0; LANES], found: 0 };
    s.store(packet.t, &mut nearest.t);
    // At equal distance the lower object wins, whatever its primitive.
    let wins_ties: Mask = packet.found & s.lt_u(s.splat_u(object), packet.object);
    s.store_u(s.select_u(wins_ties, s.splat_u(u32::MAX), s.splat_u(0)), &mut nearest.prim);
    let mut mesh_packet = MeshPacket { origin, dir, lanes, nearest };
    mesh_packet.trace::<B, ANY>(s, tree, stack);
    let nearest = mesh_packet.nearest;
    let take = nearest.found;
    packet.t = s.select(take, s.load(&nearest.t), packet.t);
    packet.u = s.select(take, s.load(&nearest.u), packet.u);
    packet.v = s.select(take, s.load(&nearest.v), packet.v);
    packet.prim = s.select_u(take, s.load_u(&nearest.prim), packet.prim);
    packet.object = s.select_u(take, s.splat_u(object), packet.object);
    packet.found |= take;
}

#[inline(always)]
fn closest_stream<S: KernelSimd>(
    s: S,
    tree: StreamTree,
    rays: QueuedRays,
    answers: &mut HitBatch,
    state: &mut StreamStates,
) {
    run_stream::<S, HitBatch, false>(s, tree, rays, answers, state);
}

#[inline(always)]
fn any_stream<S: KernelSimd>(s: S, tree: StreamTree, rays: QueuedRays, answers: &mut [bool], state: &mut StreamStates) {
    run_stream::<S, [bool], true>(s, tree, rays, answers, state);
}

#[inline(always)]
fn run_stream<S: KernelSimd, A: Answers + ?Sized, const ANY: bool>(
    s: S,
    tree: StreamTree,
    rays: QueuedRays,
    answers: &mut A,
    state: &mut StreamStates,
) {
    let mut source = Queue { rays, answers };
    match tree {
        StreamTree::Triangles(tree) => stream::run::<S, _, ANY>(s, tree, &mut source, &mut state.one),
        StreamTree::Quads(tree) => stream::run::<S, _, ANY>(s, tree, &mut source, &mut state.one),
        StreamTree::Spheres(tree) => stream::run::<S, _, ANY>(s, tree, &mut source, &mut state.one),
        StreamTree::Instances(tree) => {
            let state = state.two.get_or_insert_with(InstanceState::new);
            instance_stream::run::<S, ANY>(s, tree, &mut source, state);
        }
    }
}

/// Rays of a batch queued for one tree.
#[derive(Clone, Copy)]
struct QueuedRays<'a> {
    rays: &'a RayBatch,
    /// The next ray, and the one after the last.
    first: usize,
    end: usize,
    /// The instance of the tree; `None` if the tree's primitives are themselves the objects.
    instance: Option<(u32, &'a Instance)>,
}

struct Queue<'a, A: ?Sized> {
    rays: QueuedRays<'a>,
    answers: &'a mut A,
}

impl<A: Answers + ?Sized> Source for Queue<'_, A> {
    #[inline(always)]
    fn left(&self) -> usize {
        self.rays.end - self.rays.first
    }

    #[inline(always)]
    fn fetch<S: KernelSimd>(&mut self, s: S, to: &mut FetchedRays) -> Option<Mask> {
        let QueuedRays { rays, first, end, instance } = self.rays;
        if first == end {
            return None;
        }
        let n = (end - first).min(LANES);
        self.rays.first += n;
        for (to, from) in to.origin.iter_mut().zip([&rays.origin_x, &rays.origin_y, &rays.origin_z]) {
            s.store(load_some(s, &from[first..], 0.0), to);
        }
        for (to, from) in to.dir.iter_mut().zip([&rays.dir_x, &rays.dir_y, &rays.dir_z]) {
            s.store(load_some(s, &from[first..], 1.0), to);
        }
        let t_max = load_some(s, &rays.t_max[first..], 0.0);
        let (lanes, t, object) = self.answers.so_far(s, first, t_max);
        s.store(t, &mut to.t);
        let known = s.lt_u(object, s.splat_u(HitBatch::MISS));
        let zero = s.splat_u(0);
        // At equal distance the lower object wins, whatever its primitive.
        let prim = match instance {
            None => s.select_u(known, object, zero),
            Some((own, _)) => s.select_u(known & s.lt_u(s.splat_u(own), object), s.splat_u(u32::MAX), zero),
        };
        s.store_u(prim, &mut to.prim);
        to.id = std::array::from_fn(|lane| (first + lane) as u32);
        Some(lanes & Mask::MAX >> (LANES - n))
    }

    #[inline(always)]
    fn own_from_world(&self) -> Option<&Affine3A> {
        self.rays.instance.map(|(_, instance)| &instance.object_from_world)
    }

    #[inline(always)]
    fn finish(&mut self, ray: u32, nearest: &Nearest) {
        if nearest.found {
            let (object, prim) = self.rays.instance.map_or((nearest.prim, 0), |(object, _)| (object, nearest.prim));
            self.answers.set(ray as usize, object, prim, nearest);
        }
    }
}

impl<A: Answers + ?Sized> InstanceSource for Queue<'_, A> {
    #[inline(always)]
    fn finish_in(&mut self, ray: u32, object: u32, nearest: &Nearest) {
        self.answers.set(ray as usize, object, nearest.prim, nearest);
    }
}
