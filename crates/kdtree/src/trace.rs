//! Batch queries over a scene: selects the traversal for each kind of object.
//!
//! A handful of simple objects, or of spheres in a cloud, is tested by packets of sixteen rays; larger numbers have
//! trees that are traversed by streams. Meshes that stand still share static trees, or are tested by packets too if all
//! their triangles are few; rays that enter the bounds of an instance traverse its own tree: as a packet if the batch is
//! coherent, otherwise in a stream. Many instances have a tree over them, and one stream through both levels. None of
//! this changes the results.

use super::batch::{HitBatch, RayBatch};
use super::block_tree::BlockTree;
use super::blocks::{QuadBlock, SphereBlock, TriangleBlock};
use super::instance_stream::{self, InstanceSource, InstanceState};
use super::instance_tree::InstanceTree;
use super::lanes::to_own_space;
use super::mesh_packet::{MeshPacket, NearestLanes, PacketBlock, PacketStack};
use super::objects::{Packet, SimpleObjects, load_some, load_some_u};
use super::present::PresentPrimitives;
use super::primitive_trees::PrimitiveTrees;
use super::ray::Nearest;
use super::ray_setup::{FetchedRays, Source};
use super::shape::{HitSpace, RayClass, Shape};
use super::simd::{InstructionSet, KernelSimd, LANES, Mask, dispatch};
use super::static_tree::{self, PlacedStatic, StaticTree};
use super::stream::{self, StreamState};
use super::surface::{Instance, PlacedShapes};
use crate::geometry::Aabb;
use glam::Affine3A;
use std::cell::Cell;
use std::sync::Arc;

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
    /// Meshes whose hits are decided in the space of the snapshot.
    pub statics: Vec<PlacedStatic>,
    /// Whether their triangles are so few that each is tested as a simple object.
    statics_are_simple: bool,
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

/// Up to this many triangles of static trees are tested by every ray, sixteen rays at a time. Rooms render in 0.75 to 0.8
/// of the time that streams take, whose cost hardly depends on a dozen or hundreds of triangles; scenes in the open in as
/// much.
const MAX_TESTED: usize = 256;

/// Clouds of up to this many spheres are tested by packets, sphere by sphere.
const MAX_PACKET_SPHERES: usize = 16;

/// With more instances than this, a tree over them pays.
const MAX_INSTANCES: usize = 12;

impl TopLevel {
    /// Groups the objects.
    ///
    /// - `boxes`: bounds of all shapes.
    /// - `statics`: trees of an earlier state of the scene.
    pub fn new(scene: &PlacedShapes, boxes: &[Aabb], statics: &[Arc<StaticTree>]) -> Self {
        let shapes = &scene.shapes[..];
        let (loose, simple_objects) = PrimitiveTrees::build(shapes, boxes);
        let is_instance = |object: &u32| {
            matches!(shapes[*object as usize], Shape::Mesh { space: HitSpace::Object, .. } | Shape::Spheres { .. })
        };
        let instances: Vec<u32> = (0..shapes.len() as u32).filter(is_instance).collect();
        let instances = if instances.len() > MAX_INSTANCES {
            Instances::Many(InstanceTree::build(scene, &instances))
        } else {
            Instances::Few(instances)
        };
        let statics = static_tree::place(shapes, statics);
        let statics_are_simple = statics.iter().map(PlacedStatic::n_triangles).sum::<usize>() <= MAX_TESTED;
        let of_meshes = statics.iter().filter(|_| statics_are_simple).flat_map(PlacedStatic::triangles);
        let simple = SimpleObjects::new(shapes, simple_objects.iter().copied(), of_meshes);
        Self { simple, simple_objects, loose, statics, statics_are_simple, instances }
    }

    /// The static trees that rays traverse.
    fn statics(&self) -> &[PlacedStatic] {
        if self.statics_are_simple { &[] } else { &self.statics }
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
    /// And the primitives that take part.
    Triangles(&'a BlockTree<TriangleBlock>, Option<&'a PresentPrimitives>),
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
    // Taken out meanwhile: a tree that is built while rays are traced waits for helpers, and this thread may take over work
    // that traces rays too.
    let kept = STATES.take();
    let mut state = kept.unwrap_or_else(|| Box::new(StreamStates { one: StreamState::new(), two: None }));
    trace_in(&mut state, set, (top, scene), (rays, class), answers);
    STATES.set(Some(state));
}

/// State of streams over one level and over two.
struct StreamStates {
    one: StreamState,
    two: Option<InstanceState>,
}

thread_local! {
    static STATES: Cell<Option<Box<StreamStates>>> = const { Cell::new(None) };
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
        let statics = if class == RayClass::Coherent { top.statics() } else { &[] };
        let (simple, instances) = (&top.simple, &in_packets[..]);
        answers.packets(set, &Packets { simple, statics, instances, scene, rays, first, end });
        let own = |owner| QueuedRays { rays, first, end, owner };
        if let Some(tree) = &top.loose.spheres {
            answers.stream(set, StreamTree::Spheres(tree), own(Owner::Primitives), state);
        }
        if let Some(tree) = &top.loose.quads {
            answers.stream(set, StreamTree::Quads(tree), own(Owner::Primitives), state);
        }
        if let Some(tree) = &top.loose.triangles {
            answers.stream(set, StreamTree::Triangles(tree, None), own(Owner::Primitives), state);
        }
        if class == RayClass::Incoherent {
            for placed in top.statics() {
                let tree = StreamTree::Triangles(&placed.tree.blocks, placed.present());
                answers.stream(set, tree, own(Owner::Members(placed)), state);
            }
        }
        for &object in &streamed {
            if let Some(tree) = tree_of(scene, object) {
                let instance = &scene.instances[object as usize];
                answers.stream(set, tree, own(Owner::Instance(object, instance)), state);
            }
        }
        if let Instances::Many(tree) = &top.instances {
            answers.stream(set, StreamTree::Instances(tree), own(Owner::Primitives), state);
        }
    }
}

/// Returns the tree of an object; `None` for an object without one.
fn tree_of(scene: &PlacedShapes, object: u32) -> Option<StreamTree<'_>> {
    match &scene.shapes[object as usize] {
        Shape::Mesh { tree, .. } => Some(StreamTree::Triangles(tree.blocks(), None)),
        Shape::Spheres { tree, .. } => Some(StreamTree::Spheres(&tree.tree)),
        _ => None,
    }
}

/// Input of packet traversal.
struct Packets<'a> {
    simple: &'a SimpleObjects,
    statics: &'a [PlacedStatic],
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
        for placed in packets.statics {
            trace_static::<S, ANY>(s, placed, &mut packet, &mut stack);
        }
        for &object in packets.instances {
            let instance = &packets.scene.instances[object as usize];
            match &packets.scene.shapes[object as usize] {
                Shape::Mesh { tree, .. } => {
                    trace_packet::<S, _, ANY>(s, tree.blocks(), instance, object, &mut packet, &mut stack);
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
    let mut mesh_packet = MeshPacket { origin, dir, lanes, nearest, present: None };
    mesh_packet.trace::<B, ANY>(s, tree, stack);
    take_hits(s, packet, &mesh_packet.nearest, &[object; LANES]);
}

/// Traces a packet through a static tree.
#[inline(always)]
fn trace_static<S: KernelSimd, const ANY: bool>(
    s: S,
    placed: &PlacedStatic,
    packet: &mut Packet<S>,
    stack: &mut PacketStack<S>,
) {
    let lanes = if ANY { packet.lanes & !packet.found } else { packet.lanes };
    if lanes == 0 {
        return;
    }
    let mut nearest = NearestLanes { t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES], prim: [0; LANES], found: 0 };
    s.store(packet.t, &mut nearest.t);
    let mut objects = [0; LANES];
    s.store_u(packet.object, &mut objects);
    for lane in (0..LANES).filter(|lane| packet.found >> lane & 1 != 0) {
        nearest.prim[lane] = placed.wins_ties_below(objects[lane]);
    }
    let [origin, dir] = [packet.origin, packet.dir];
    let mut mesh_packet = MeshPacket { origin, dir, lanes, nearest, present: placed.present() };
    mesh_packet.trace::<TriangleBlock, ANY>(s, &placed.tree.blocks, stack);
    let mut nearest = mesh_packet.nearest;
    for lane in (0..LANES).filter(|lane| nearest.found >> lane & 1 != 0) {
        (objects[lane], nearest.prim[lane]) = placed.object_of(nearest.prim[lane]);
    }
    take_hits(s, packet, &nearest, &objects);
}

/// Moves the hits that were found in a tree to the packet.
#[inline(always)]
fn take_hits<S: KernelSimd>(s: S, packet: &mut Packet<S>, nearest: &NearestLanes, objects: &[u32; LANES]) {
    let take = nearest.found;
    packet.t = s.select(take, s.load(&nearest.t), packet.t);
    packet.u = s.select(take, s.load(&nearest.u), packet.u);
    packet.v = s.select(take, s.load(&nearest.v), packet.v);
    packet.prim = s.select_u(take, s.load_u(&nearest.prim), packet.prim);
    packet.object = s.select_u(take, s.load_u(objects), packet.object);
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
        StreamTree::Triangles(tree, present) => {
            stream::run::<S, _, ANY>(s, tree, present, &mut source, &mut state.one);
        }
        StreamTree::Quads(tree) => stream::run::<S, _, ANY>(s, tree, None, &mut source, &mut state.one),
        StreamTree::Spheres(tree) => stream::run::<S, _, ANY>(s, tree, None, &mut source, &mut state.one),
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
    owner: Owner<'a>,
}

/// The objects that the primitives of a tree belong to.
#[derive(Clone, Copy)]
enum Owner<'a> {
    /// They are the objects.
    Primitives,
    /// All belong to this object.
    Instance(u32, &'a Instance),
    /// To the members of a static tree.
    Members(&'a PlacedStatic),
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
        let QueuedRays { rays, first, end, owner } = self.rays;
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
        let prim = match owner {
            Owner::Primitives => s.select_u(known, object, zero),
            Owner::Instance(own, _) => s.select_u(known & s.lt_u(s.splat_u(own), object), s.splat_u(u32::MAX), zero),
            Owner::Members(_) => zero,
        };
        s.store_u(prim, &mut to.prim);
        if let Owner::Members(placed) = owner
            && known != 0
        {
            let mut objects = [0; LANES];
            s.store_u(object, &mut objects);
            for lane in (0..LANES).filter(|lane| known >> lane & 1 != 0) {
                to.prim[lane] = placed.wins_ties_below(objects[lane]);
            }
        }
        to.id = std::array::from_fn(|lane| (first + lane) as u32);
        Some(lanes & Mask::MAX >> (LANES - n))
    }

    #[inline(always)]
    fn own_from_world(&self) -> Option<&Affine3A> {
        match self.rays.owner {
            Owner::Instance(_, instance) => Some(&instance.object_from_world),
            Owner::Primitives | Owner::Members(_) => None,
        }
    }

    #[inline(always)]
    fn finish(&mut self, ray: u32, nearest: &Nearest) {
        if nearest.found {
            let (object, prim) = match self.rays.owner {
                Owner::Primitives => (nearest.prim, 0),
                Owner::Instance(object, _) => (object, nearest.prim),
                Owner::Members(placed) => placed.object_of(nearest.prim),
            };
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
