//! Batches of rays through a scene: which objects are tested by which traversal.
//!
//! Simple objects are tested by all rays of a packet at once. Rays that meet the box of an instance go on through its own tree, as a
//! packet when the caller says that they belong together, otherwise in a stream. None of this changes what is found.

use super::batch::{HitBatch, RayBatch};
use super::mesh_packet::{MeshPacket, NearestLanes, PacketStack};
use super::objects::{Packet, SimpleObjects};
use super::ray::Nearest;
use super::scene_tree::{RayClass, SceneTree, Shape};
use super::simd::{InstructionSet, LANES, Mask, Simd, dispatch};
use super::stream::{self, Source};
use super::surface::Instance;
use super::{MeshTree, SphereTree};
use crate::geometry::{Ray, Shear};
use glam::Affine3A;

/// Rays that one stream takes on at a time.
const CHUNK: usize = 2048;

/// A scene of few objects: no tree above them.
#[derive(Debug, Default)]
pub(super) struct FlatScene {
    pub simple: SimpleObjects,
    /// Objects with a space of their own.
    pub instances: Vec<u32>,
}

/// More objects of a kind than this, and a tree above them pays.
pub(super) const MAX_SIMPLE: usize = 48;
pub(super) const MAX_INSTANCES: usize = 12;

impl FlatScene {
    /// `None` if a tree over the objects will do better.
    pub fn new(shapes: &[Shape]) -> Option<Self> {
        let is_instance = |object: &u32| matches!(shapes[*object as usize], Shape::Mesh { .. } | Shape::Spheres { .. });
        let (instances, simple): (Vec<u32>, Vec<u32>) = (0..shapes.len() as u32).partition(is_instance);
        (simple.len() <= MAX_SIMPLE && instances.len() <= MAX_INSTANCES)
            .then(|| Self { simple: SimpleObjects::new(shapes, simple.into_iter()), instances })
    }

    pub fn closest_hits(
        &self,
        set: InstructionSet,
        scene: &SceneTree,
        rays: &RayBatch,
        class: RayClass,
        hits: &mut HitBatch,
    ) {
        let flat = self;
        dispatch!(set, closest(flat: &FlatScene, scene: &SceneTree, rays: &RayBatch, class: RayClass, hits: &mut HitBatch));
    }

    pub fn any_hits(
        &self,
        set: InstructionSet,
        scene: &SceneTree,
        rays: &RayBatch,
        class: RayClass,
        occluded: &mut [bool],
    ) {
        let flat = self;
        dispatch!(set, any(flat: &FlatScene, scene: &SceneTree, rays: &RayBatch, class: RayClass, occluded: &mut [bool]));
    }
}

#[inline(always)]
fn closest<S: Simd>(s: S, flat: &FlatScene, scene: &SceneTree, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
    let mut stack = PacketStack::new(s);
    for chunk in (0..rays.len()).step_by(CHUNK) {
        let chunk = chunk..(chunk + CHUNK).min(rays.len());
        for first in chunk.clone().step_by(LANES) {
            let mut packet = Packet::load(s, rays, first);
            packet.test_objects::<false>(s, &flat.simple);
            if class == RayClass::Coherent {
                for &object in &flat.instances {
                    if let Shape::Mesh { tree, .. } = &scene.shapes()[object as usize] {
                        trace_packet::<S, false>(
                            s,
                            tree,
                            &scene.instances[object as usize],
                            object,
                            &mut packet,
                            &mut stack,
                        );
                    }
                }
            }
            packet.store(s, hits, first);
        }
        for &object in &flat.instances {
            let instance = &scene.instances[object as usize];
            let mut source = Closest { rays, hits, instance, object, queue: Queue::new() };
            match &scene.shapes()[object as usize] {
                Shape::Mesh { tree, .. } if class == RayClass::Incoherent => {
                    source.queue.fill(chunk.clone());
                    stream::run::<S, false>(s, tree, &mut source);
                }
                Shape::Spheres { tree, .. } => {
                    source.queue.fill(chunk.clone());
                    each_ray(tree, &mut source, false);
                }
                _ => {}
            }
        }
    }
}

#[inline(always)]
fn any<S: Simd>(s: S, flat: &FlatScene, scene: &SceneTree, rays: &RayBatch, class: RayClass, occluded: &mut [bool]) {
    let mut stack = PacketStack::new(s);
    for chunk in (0..rays.len()).step_by(CHUNK) {
        let chunk = chunk..(chunk + CHUNK).min(rays.len());
        for first in chunk.clone().step_by(LANES) {
            let mut packet = Packet::load(s, rays, first);
            packet.test_objects::<true>(s, &flat.simple);
            if class == RayClass::Coherent {
                for &object in &flat.instances {
                    if let Shape::Mesh { tree, .. } = &scene.shapes()[object as usize] {
                        trace_packet::<S, true>(
                            s,
                            tree,
                            &scene.instances[object as usize],
                            object,
                            &mut packet,
                            &mut stack,
                        );
                    }
                }
            }
            for (lane, occluded) in occluded[first..].iter_mut().take(LANES).enumerate() {
                *occluded = packet.found >> lane & 1 != 0;
            }
        }
        for &object in &flat.instances {
            let instance = &scene.instances[object as usize];
            let mut source = Any { rays, occluded, instance, queue: Queue::new() };
            match &scene.shapes()[object as usize] {
                Shape::Mesh { tree, .. } if class == RayClass::Incoherent => {
                    source.queue.fill(chunk.clone());
                    stream::run::<S, true>(s, tree, &mut source);
                }
                Shape::Spheres { tree, .. } => {
                    source.queue.fill(chunk.clone());
                    each_ray(tree, &mut source, true);
                }
                _ => {}
            }
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
    mesh_packet.trace::<ANY>(s, tree, stack);
    let nearest = mesh_packet.nearest;
    let take = nearest.found;
    packet.t = s.select(take, s.load(&nearest.t), packet.t);
    packet.u = s.select(take, s.load(&nearest.u), packet.u);
    packet.v = s.select(take, s.load(&nearest.v), packet.v);
    packet.prim = s.select_u(take, s.load_u(&nearest.prim), packet.prim);
    packet.object = s.select_u(take, s.splat_u(object), packet.object);
    packet.found |= take;
}

/// Rays of the batch that are still to be traced.
struct Queue {
    next: usize,
    end: usize,
}

impl Queue {
    fn new() -> Self {
        Self { next: 0, end: 0 }
    }

    fn fill(&mut self, rays: std::ops::Range<usize>) {
        (self.next, self.end) = (rays.start, rays.end);
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<usize> {
        (self.next < self.end).then(|| {
            self.next += 1;
            self.next - 1
        })
    }
}

struct Closest<'a> {
    rays: &'a RayBatch,
    hits: &'a mut HitBatch,
    instance: &'a Instance,
    object: u32,
    queue: Queue,
}

impl Source for Closest<'_> {
    #[inline(always)]
    fn next(&mut self) -> Option<(Ray, Nearest, u32)> {
        let i = self.queue.pop()?;
        let ray = self.rays.get(i);
        let mut nearest = Nearest::before(ray.t_max);
        if self.hits.object[i] != HitBatch::MISS {
            nearest.t = self.hits.t[i];
            // At equal distance the lower object wins, whatever its primitive.
            nearest.prim = if self.object < self.hits.object[i] { u32::MAX } else { 0 };
        }
        Some((self.instance.ray(&ray), nearest, i as u32))
    }

    #[inline(always)]
    fn finish(&mut self, ray: u32, nearest: &Nearest) {
        if nearest.found {
            let (i, hits) = (ray as usize, &mut *self.hits);
            (hits.t[i], hits.u[i], hits.v[i]) = (nearest.t, nearest.u, nearest.v);
            (hits.prim[i], hits.object[i]) = (nearest.prim, self.object);
        }
    }
}

struct Any<'a> {
    rays: &'a RayBatch,
    occluded: &'a mut [bool],
    instance: &'a Instance,
    queue: Queue,
}

impl Source for Any<'_> {
    #[inline(always)]
    fn next(&mut self) -> Option<(Ray, Nearest, u32)> {
        loop {
            let i = self.queue.pop()?;
            if !self.occluded[i] {
                let ray = self.rays.get(i);
                return Some((self.instance.ray(&ray), Nearest::before(ray.t_max), i as u32));
            }
        }
    }

    #[inline(always)]
    fn finish(&mut self, ray: u32, nearest: &Nearest) {
        self.occluded[ray as usize] |= nearest.found;
    }
}

/// Balls have no stream.
fn each_ray(tree: &SphereTree, source: &mut impl Source, any: bool) {
    while let Some((ray, mut nearest, id)) = source.next() {
        tree.offer_hits(&ray, &Shear::new(ray.dir), &mut nearest, any);
        source.finish(id, &nearest);
    }
}
