//! Batches of rays through a scene: which objects are tested by which traversal.
//!
//! A handful of simple objects is tested by sixteen rays at once; many of them have trees, which rays stream through. Rays that meet the
//! box of an instance go on through its own tree, as a packet when the caller says that they belong together, otherwise
//! in a stream. Of many instances each ray asks for the nearest first, and rays that ask for the same one go together, round
//! after round. None of this changes what is found.

use super::MeshTree;
use super::batch::{HitBatch, RayBatch};
use super::block_tree::BlockTree;
use super::blocks::LeafBlock;
use super::instance_tree::{Entry, InstanceTree, Recent};
use super::loose::LooseTrees;
use super::mesh_packet::{MeshPacket, NearestLanes, PacketStack};
use super::objects::{Packet, SimpleObjects};
use super::ray::Nearest;
use super::scene_tree::{RayClass, SceneTree, Shape};
use super::simd::{InstructionSet, LANES, Mask, Simd, dispatch};
use super::stream::{self, Source, Stacks};
use super::surface::Instance;
use crate::geometry::Ray;
use glam::Affine3A;

/// Rays that are taken through all objects before the next ones start.
const CHUNK: usize = 2048;

/// The same where there are many instances, of which each may be met by few rays.
const LARGE_CHUNK: usize = 8192;

/// The objects of a scene, by how rays get to them.
#[derive(Debug, Default)]
pub(super) struct TopLevel {
    /// Tested by every ray; planes are among them.
    pub simple: SimpleObjects,
    /// The numbers of `simple`.
    pub simple_objects: Vec<u32>,
    pub loose: LooseTrees,
    pub instances: Instances,
}

/// Objects with a space of their own.
#[derive(Debug)]
pub(super) enum Instances {
    /// Few enough for every ray to look at each.
    Few(Vec<u32>),
    Many(InstanceTree),
}

impl Default for Instances {
    fn default() -> Self {
        Self::Few(Vec::new())
    }
}

/// With more instances than this a tree above them pays.
const MAX_INSTANCES: usize = 12;

impl TopLevel {
    pub fn new(shapes: &[Shape]) -> Self {
        let (loose, simple_objects) = LooseTrees::build(shapes);
        let is_instance = |object: &u32| matches!(shapes[*object as usize], Shape::Mesh { .. } | Shape::Spheres { .. });
        let instances: Vec<u32> = (0..shapes.len() as u32).filter(is_instance).collect();
        let instances = if instances.len() > MAX_INSTANCES {
            Instances::Many(InstanceTree::build(shapes, instances))
        } else {
            Instances::Few(instances)
        };
        let simple = SimpleObjects::new(shapes, simple_objects.iter().copied());
        Self { simple, simple_objects, loose, instances }
    }

    pub fn closest_hits(
        &self,
        set: InstructionSet,
        scene: &SceneTree,
        rays: &RayBatch,
        class: RayClass,
        hits: &mut HitBatch,
    ) {
        let top = self;
        dispatch!(set, closest(top: &TopLevel, scene: &SceneTree, rays: &RayBatch, class: RayClass, hits: &mut HitBatch));
    }

    pub fn any_hits(
        &self,
        set: InstructionSet,
        scene: &SceneTree,
        rays: &RayBatch,
        class: RayClass,
        occluded: &mut [bool],
    ) {
        let top = self;
        dispatch!(set, any(top: &TopLevel, scene: &SceneTree, rays: &RayBatch, class: RayClass, occluded: &mut [bool]));
    }
}

#[inline(always)]
fn closest<S: Simd>(s: S, top: &TopLevel, scene: &SceneTree, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
    trace::<S, HitBatch, false>(s, top, scene, rays, class, hits);
}

#[inline(always)]
fn any<S: Simd>(s: S, top: &TopLevel, scene: &SceneTree, rays: &RayBatch, class: RayClass, occluded: &mut [bool]) {
    trace::<S, [bool], true>(s, top, scene, rays, class, occluded);
}

/// Where the answers to a batch are kept.
trait Answers {
    /// Distance and object of the hit so far; `None` if the ray needs no other.
    fn so_far(&self, ray: usize, t_max: f32) -> Option<(f32, Option<u32>)>;

    fn set(&mut self, ray: usize, object: u32, prim: u32, nearest: &Nearest);

    /// What a packet found for the rays from `first` on.
    fn store<S: Simd>(&mut self, s: S, packet: &Packet<S>, first: usize);
}

impl Answers for HitBatch {
    #[inline(always)]
    fn so_far(&self, ray: usize, t_max: f32) -> Option<(f32, Option<u32>)> {
        let object = self.object[ray];
        Some(if object == Self::MISS { (t_max, None) } else { (self.t[ray], Some(object)) })
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, object: u32, prim: u32, nearest: &Nearest) {
        (self.t[ray], self.u[ray], self.v[ray]) = (nearest.t, nearest.u, nearest.v);
        (self.prim[ray], self.object[ray]) = (prim, object);
    }

    #[inline(always)]
    fn store<S: Simd>(&mut self, s: S, packet: &Packet<S>, first: usize) {
        packet.store(s, self, first);
    }
}

/// Whether a ray is occluded.
impl Answers for [bool] {
    #[inline(always)]
    fn so_far(&self, ray: usize, t_max: f32) -> Option<(f32, Option<u32>)> {
        (!self[ray]).then_some((t_max, None))
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, _: u32, _: u32, _: &Nearest) {
        self[ray] = true;
    }

    #[inline(always)]
    fn store<S: Simd>(&mut self, _: S, packet: &Packet<S>, first: usize) {
        for (lane, occluded) in self[first..].iter_mut().take(LANES).enumerate() {
            *occluded = packet.found >> lane & 1 != 0;
        }
    }
}

#[inline(always)]
fn trace<S: Simd, A: Answers + ?Sized, const ANY: bool>(
    s: S,
    top: &TopLevel,
    scene: &SceneTree,
    rays: &RayBatch,
    class: RayClass,
    answers: &mut A,
) {
    let mut packet_stack = PacketStack::new(s);
    let mut stacks = Stacks::new();
    let mut rounds = Rounds::default();
    let (few, chunk) = match &top.instances {
        Instances::Few(few) => (&few[..], CHUNK),
        Instances::Many(_) => (&[][..], LARGE_CHUNK),
    };
    let all: Vec<u32> = (0..rays.len() as u32).collect();
    for queue in all.chunks(chunk) {
        for sixteen in queue.chunks(LANES) {
            let first = sixteen[0] as usize;
            let mut packet = Packet::load(s, rays, first);
            packet.test_objects::<ANY>(s, &top.simple);
            if class == RayClass::Coherent {
                for &object in few {
                    if let Shape::Mesh { tree, .. } = &scene.shapes()[object as usize] {
                        let instance = &scene.instances[object as usize];
                        trace_packet::<S, ANY>(s, tree, instance, object, &mut packet, &mut packet_stack);
                    }
                }
            }
            answers.store(s, &packet, first);
        }
        stream_loose::<S, _, A, ANY>(s, top.loose.spheres.as_ref(), rays, answers, queue, &mut stacks);
        stream_loose::<S, _, A, ANY>(s, top.loose.quads.as_ref(), rays, answers, queue, &mut stacks);
        stream_loose::<S, _, A, ANY>(s, top.loose.triangles.as_ref(), rays, answers, queue, &mut stacks);
        for &object in few {
            let is_done = class == RayClass::Coherent && matches!(scene.shapes()[object as usize], Shape::Mesh { .. });
            if !is_done {
                stream_instance::<S, A, ANY>(s, scene, object, rays, answers, queue, &mut stacks);
            }
        }
        if let Instances::Many(tree) = &top.instances {
            rounds.trace::<S, A, ANY>(s, tree, scene, rays, answers, queue, &mut stacks);
        }
    }
}

/// As `scene_tree::transform_vector`, rounding for rounding.
#[inline(always)]
fn transform<S: Simd>(s: S, map: &Affine3A, v: &[S::F; 3]) -> [S::F; 3] {
    [transform_row(s, map, 0, v), transform_row(s, map, 1, v), transform_row(s, map, 2, v)]
}

#[inline(always)]
fn transform_row<S: Simd>(s: S, map: &Affine3A, row: usize, v: &[S::F; 3]) -> S::F {
    let x = s.mul(s.splat(map.matrix3.x_axis[row]), v[0]);
    let y = s.mul(s.splat(map.matrix3.y_axis[row]), v[1]);
    let z = s.mul(s.splat(map.matrix3.z_axis[row]), v[2]);
    s.add(s.add(x, y), z)
}

/// Takes a packet through one mesh.
#[inline(always)]
fn trace_packet<S: Simd, const ANY: bool>(
    s: S,
    tree: &MeshTree,
    instance: &Instance,
    object: u32,
    packet: &mut Packet<S>,
    stack: &mut PacketStack<S>,
) {
    let lanes = if ANY { packet.lanes & !packet.found } else { packet.lanes };
    if lanes == 0 {
        return;
    }
    let map = &instance.object_from_world;
    let turned = transform(s, map, &packet.origin);
    let origin = [
        s.add(turned[0], s.splat(map.translation[0])),
        s.add(turned[1], s.splat(map.translation[1])),
        s.add(turned[2], s.splat(map.translation[2])),
    ];
    let dir = transform(s, map, &packet.dir);
    let mut nearest = NearestLanes { t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES], prim: [0; LANES], found: 0 };
    s.store(packet.t, &mut nearest.t);
    // At equal distance the lower object wins, whatever its primitive.
    let wins_ties: Mask = packet.found & s.lt_u(s.splat_u(object), packet.object);
    s.store_u(s.select_u(wins_ties, s.splat_u(u32::MAX), s.splat_u(0)), &mut nearest.prim);
    let mut mesh_packet = MeshPacket { origin, dir, lanes, nearest };
    mesh_packet.trace::<ANY>(s, &tree.tree, stack);
    let nearest = mesh_packet.nearest;
    let take = nearest.found;
    packet.t = s.select(take, s.load(&nearest.t), packet.t);
    packet.u = s.select(take, s.load(&nearest.u), packet.u);
    packet.v = s.select(take, s.load(&nearest.v), packet.v);
    packet.prim = s.select_u(take, s.load_u(&nearest.prim), packet.prim);
    packet.object = s.select_u(take, s.splat_u(object), packet.object);
    packet.found |= take;
}

/// Streams rays through the tree of one instance.
#[inline(always)]
fn stream_instance<S: Simd, A: Answers + ?Sized, const ANY: bool>(
    s: S,
    scene: &SceneTree,
    object: u32,
    rays: &RayBatch,
    answers: &mut A,
    queue: &[u32],
    stacks: &mut Stacks,
) {
    let mut source = InstanceRays { rays, answers, instance: &scene.instances[object as usize], object, queue };
    match &scene.shapes()[object as usize] {
        Shape::Mesh { tree, .. } => stream::run::<S, _, ANY>(s, &tree.tree, &mut source, stacks),
        Shape::Spheres { tree, .. } => stream::run::<S, _, ANY>(s, &tree.tree, &mut source, stacks),
        _ => {}
    }
}

/// Streams rays through a tree over simple objects, if there is one.
#[inline(always)]
fn stream_loose<S: Simd, B: LeafBlock, A: Answers + ?Sized, const ANY: bool>(
    s: S,
    tree: Option<&BlockTree<B>>,
    rays: &RayBatch,
    answers: &mut A,
    queue: &[u32],
    stacks: &mut Stacks,
) {
    if let Some(tree) = tree {
        stream::run::<S, B, ANY>(s, tree, &mut LooseRays { rays, answers, queue }, stacks);
    }
}

/// The rays of a batch on their way into one instance.
struct InstanceRays<'a, A: ?Sized> {
    rays: &'a RayBatch,
    answers: &'a mut A,
    instance: &'a Instance,
    object: u32,
    queue: &'a [u32],
}

impl<A: Answers + ?Sized> Source for InstanceRays<'_, A> {
    #[inline(always)]
    fn next(&mut self) -> Option<(Ray, Nearest, u32)> {
        loop {
            let (&i, queue) = self.queue.split_first()?;
            self.queue = queue;
            let ray = self.rays.get(i as usize);
            if let Some((t, object)) = self.answers.so_far(i as usize, ray.t_max) {
                let mut nearest = Nearest::before(t);
                // At equal distance the lower object wins, whatever its primitive.
                nearest.prim = if object.is_some_and(|object| self.object < object) { u32::MAX } else { 0 };
                return Some((self.instance.ray(&ray), nearest, i));
            }
        }
    }

    #[inline(always)]
    fn finish(&mut self, ray: u32, nearest: &Nearest) {
        if nearest.found {
            self.answers.set(ray as usize, self.object, nearest.prim, nearest);
        }
    }
}

/// The rays of a batch on their way through a tree over objects.
struct LooseRays<'a, A: ?Sized> {
    rays: &'a RayBatch,
    answers: &'a mut A,
    queue: &'a [u32],
}

impl<A: Answers + ?Sized> Source for LooseRays<'_, A> {
    #[inline(always)]
    fn next(&mut self) -> Option<(Ray, Nearest, u32)> {
        loop {
            let (&i, queue) = self.queue.split_first()?;
            self.queue = queue;
            let ray = self.rays.get(i as usize);
            if let Some((t, object)) = self.answers.so_far(i as usize, ray.t_max) {
                let mut nearest = Nearest::before(t);
                nearest.prim = object.unwrap_or(0);
                return Some((ray, nearest, i));
            }
        }
    }

    #[inline(always)]
    fn finish(&mut self, ray: u32, nearest: &Nearest) {
        if nearest.found {
            self.answers.set(ray as usize, nearest.prim, 0, nearest);
        }
    }
}

/// Each ray looks at the instances along its way, front to back. In every round it enters the next one, together with all
/// other rays that want the same.
#[derive(Default)]
struct Rounds {
    /// Of all rays.
    entries: Vec<Entry>,
    pending: Vec<Pending>,
    /// Instance and ray of this round.
    wishes: Vec<(u32, u32)>,
    together: Vec<u32>,
}

/// A ray on its way from instance to instance.
struct Pending {
    ray: u32,
    /// Entries that are left of those found.
    left: std::ops::Range<usize>,
    /// From where others may follow.
    from: f32,
    recent: Recent,
}

impl Pending {
    /// The next instance to enter; `None` if none can matter.
    #[inline(always)]
    fn next(&mut self, tree: &InstanceTree, ray: &Ray, t: f32, entries: &mut Vec<Entry>) -> Option<u32> {
        loop {
            // Beyond one that is too far lie only others that are.
            if let Some(entry) = self.left.next().map(|entry| entries[entry])
                && entry.t <= t
            {
                return Some(entry.object);
            }
            if self.from > t || self.from == f32::INFINITY {
                return None;
            }
            self.left.start = entries.len();
            self.from = tree.entries(ray, self.from, t, &mut self.recent, entries);
            self.left.end = entries.len();
        }
    }
}

impl Rounds {
    #[expect(clippy::too_many_arguments, reason = "a loop body, cut out")]
    #[inline(always)]
    fn trace<S: Simd, A: Answers + ?Sized, const ANY: bool>(
        &mut self,
        s: S,
        tree: &InstanceTree,
        scene: &SceneTree,
        rays: &RayBatch,
        answers: &mut A,
        queue: &[u32],
        stacks: &mut Stacks,
    ) {
        self.entries.clear();
        self.pending.clear();
        let start = |&ray: &u32| Pending { ray, left: 0..0, from: 0.0, recent: Recent::default() };
        self.pending.extend(queue.iter().map(start));
        loop {
            self.wishes.clear();
            let (entries, wishes) = (&mut self.entries, &mut self.wishes);
            self.pending.retain_mut(|pending| {
                let ray = rays.get(pending.ray as usize);
                let so_far = answers.so_far(pending.ray as usize, ray.t_max);
                let next = so_far.and_then(|(t, _)| pending.next(tree, &ray, t, entries));
                wishes.extend(next.map(|object| (object, pending.ray)));
                next.is_some()
            });
            if self.wishes.is_empty() {
                break;
            }
            self.wishes.sort_unstable();
            for wish in self.wishes.chunk_by(|a, b| a.0 == b.0) {
                self.together.clear();
                self.together.extend(wish.iter().map(|&(_, ray)| ray));
                stream_instance::<S, A, ANY>(s, scene, wish[0].0, rays, answers, &self.together, stacks);
            }
        }
    }
}
