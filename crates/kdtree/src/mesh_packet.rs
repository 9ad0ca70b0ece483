//! Packet traversal: sixteen coherent rays through one mesh or one cloud of spheres.
//!
//! All rays of a packet visit a node together while at least one of them intersects it. Rays of different octants would
//! need different child orders, and rays with different longest axes are sheared differently, so a mixed packet is
//! traced in groups.

use super::block_tree::{BlockTree, Leaf};
use super::blocks::{PreciseRay, SphereBlock, TriangleBlock, spheres_near};
use super::lanes::{LaneHits, dot, longest_axis, may_hit, resolve, shear, sphere_hits};
use super::leaf::{BLOCK, LeafBlock, ShearedRay};
use super::nodes::{MAX_DEPTH, Node};
use super::objects::FrameF64;
use super::present::PresentPrimitives;
use super::ray::{Nearest, RELATIVE_PADDING};
use super::shared_block::SharedBlock;
use super::simd::{KernelSimd, LANES, Mask};
use firstlight_simd::three;

/// Sixteen rays in the mesh's own space, and their nearest hits so far.
pub(super) struct MeshPacket<'a, S: KernelSimd> {
    pub origin: [S::F; 3],
    pub dir: [S::F; 3],
    /// Lanes that hold a ray.
    pub lanes: Mask,
    pub nearest: NearestLanes,
    /// The primitives that take part; `None` for all.
    pub present: Option<&'a PresentPrimitives>,
}

/// [`Nearest`] of sixteen rays; in memory, because single lanes are read and written too.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct NearestLanes {
    pub t: [f32; LANES],
    pub u: [f32; LANES],
    pub v: [f32; LANES],
    /// At equal `t` the lower index wins.
    pub prim: [u32; LANES],
    pub found: Mask,
}

/// Leaf blocks that packets can test.
pub(super) trait PacketBlock: LeafBlock {
    /// Ray data prepared for the test, of use for spheres only.
    type Frame<S: KernelSimd>: Copy;

    /// Whether the test uses the [`Footprint`].
    const HAS_FOOTPRINT: bool;

    fn frame<S: KernelSimd>(s: S, packet: &MeshPacket<'_, S>) -> Self::Frame<S>;

    /// Tests the rays of `mask` against the whole leaf.
    fn test_rays<S: KernelSimd>(
        s: S,
        packet: &mut MeshPacket<'_, S>,
        common: (&PacketGroup<S>, &Self::Frame<S>),
        leaf: &Leaf<Self>,
        mask: Mask,
    );
}

/// Sixteen triangles in either vertex layout.
trait PacketTriangles: LeafBlock<Ray = ShearedRay> {
    fn corner(&self, lane: usize, corner: usize) -> [f32; 3];

    /// Returns the triangles whose sheared vertices all lie on one side of the rays of the footprint, or behind them.
    fn missed<S: KernelSimd>(&self, s: S, footprint: &Footprint, axes: [usize; 3]) -> Mask;
}

impl PacketTriangles for TriangleBlock {
    #[inline(always)]
    fn corner(&self, lane: usize, corner: usize) -> [f32; 3] {
        let [x, y, z] = &self.vertices[corner];
        [x[lane], y[lane], z[lane]]
    }

    #[inline(always)]
    fn missed<S: KernelSimd>(&self, s: S, footprint: &Footprint, axes: [usize; 3]) -> Mask {
        let [a, b, c] = three!(|k| footprint.reach(s, &self.vertices[k], axes));
        let mut missed = 0;
        for axis in 0..3 {
            let low = s.min(a[axis][0], s.min(b[axis][0], c[axis][0]));
            let high = s.max(a[axis][1], s.max(b[axis][1], c[axis][1]));
            missed |= s.lt(s.splat(0.0), low) | s.lt(high, s.splat(0.0));
        }
        missed
    }
}

impl PacketTriangles for SharedBlock {
    #[inline(always)]
    fn corner(&self, lane: usize, corner: usize) -> [f32; 3] {
        self.corner(lane, corner)
    }

    #[inline(always)]
    fn missed<S: KernelSimd>(&self, s: S, footprint: &Footprint, axes: [usize; 3]) -> Mask {
        let vertices = footprint.reach(s, self.vertices(), axes);
        let [x, y, z] = three!(|axis| self.beside(s, vertices[axis][0], vertices[axis][1]));
        x | y | z
    }
}

impl PacketBlock for TriangleBlock {
    type Frame<S: KernelSimd> = ();

    const HAS_FOOTPRINT: bool = true;

    #[inline(always)]
    fn frame<S: KernelSimd>(_: S, _: &MeshPacket<'_, S>) {}

    #[inline(always)]
    fn test_rays<S: KernelSimd>(
        s: S,
        packet: &mut MeshPacket<'_, S>,
        (group, ()): (&PacketGroup<S>, &()),
        leaf: &Leaf<Self>,
        mask: Mask,
    ) {
        for block in leaf.compact {
            packet.test_triangles(s, group, block, mask);
        }
        for block in leaf.blocks {
            packet.test_triangles(s, group, block, mask);
        }
    }
}

impl PacketBlock for SphereBlock {
    type Frame<S: KernelSimd> = SphereFrame<S>;

    const HAS_FOOTPRINT: bool = false;

    #[inline(always)]
    fn frame<S: KernelSimd>(s: S, packet: &MeshPacket<'_, S>) -> SphereFrame<S> {
        let precise = FrameF64::new(s, &packet.origin, &packet.dir);
        let length = s.sqrt_d(dot(s, &precise.dir, &precise.dir));
        let inv_length = s.mul_d(length, precise.inv_dir_squared);
        let unit = three!(|axis| s.narrow(s.mul_d(precise.dir[axis], inv_length)));
        SphereFrame { precise, unit, length: s.narrow(length) }
    }

    #[inline(always)]
    fn test_rays<S: KernelSimd>(
        s: S,
        packet: &mut MeshPacket<'_, S>,
        (_, frame): (&PacketGroup<S>, &SphereFrame<S>),
        leaf: &Leaf<Self>,
        mask: Mask,
    ) {
        for block in leaf.blocks {
            packet.test_spheres(s, frame, block, mask);
        }
    }
}

/// Sixteen rays prepared for spheres.
#[derive(Clone, Copy)]
pub(super) struct SphereFrame<S: KernelSimd> {
    precise: FrameF64<S>,
    /// Direction of length 1, and the length of the ray's own direction.
    unit: [S::F; 3],
    length: S::F,
}

/// Up to so many rays are tested one after the other, without culling triangles by the footprint.
const FEW_RAYS: u32 = 2;

/// Stack of pending nodes with their lanes and intervals. Reused for many packets, because clearing it takes longer
/// than tracing some of them.
pub(super) struct PacketStack<S: KernelSimd>([(u32, Mask, S::F, S::F); MAX_DEPTH]);

impl<S: KernelSimd> PacketStack<S> {
    #[inline(always)]
    pub fn new(s: S) -> Self {
        Self([(0, 0, s.splat(0.0), s.splat(0.0)); MAX_DEPTH])
    }
}

/// Data that all rays of a group share, and the reciprocals of their directions.
pub(super) struct PacketGroup<S: KernelSimd> {
    inv_lo: [S::F; 3],
    inv_hi: [S::F; 3],
    padding: S::F,
    /// The two axes across the rays and the axis along them.
    axes: [usize; 3],
    sx: S::F,
    sy: S::F,
    sz: S::F,
    footprint: Footprint,
}

/// Bounds of the rays of a group, as intervals.
#[derive(Clone, Copy)]
struct Footprint {
    /// Of the origins, along the axes of the group.
    origin: [[f32; 2]; 3],
    sx: [f32; 2],
    sy: [f32; 2],
    down: bool,
}

impl Footprint {
    const NONE: Self = Self { origin: [[0.0; 2]; 3], sx: [0.0; 2], sy: [0.0; 2], down: false };

    /// Bounds of sixteen sheared vertices over the rays of the footprint: two coordinates across the rays, one along
    /// them, which is bounded on the side behind the rays only.
    ///
    /// Rounding is monotonic: the steps of the test in interval arithmetic, in the order of the test, bound its values
    /// for every ray. A triangle whose sheared vertices all lie on one side of the rays, or behind them, is missed by
    /// all of them.
    #[inline(always)]
    fn reach<S: KernelSimd>(&self, s: S, points: &[[f32; BLOCK]; 3], [x, y, z]: [usize; 3]) -> [[S::F; 2]; 3] {
        let depth = less(s, s.load(&points[z]), self.origin[2]);
        [
            self.across(s, s.load(&points[x]), self.origin[0], self.sx, depth),
            self.across(s, s.load(&points[y]), self.origin[1], self.sy, depth),
            if self.down { [depth[0], s.splat(0.0)] } else { [s.splat(0.0), depth[1]] },
        ]
    }

    #[inline(always)]
    fn across<S: KernelSimd>(&self, s: S, at: S::F, origin: [f32; 2], slope: [f32; 2], depth: [S::F; 2]) -> [S::F; 2] {
        let [flat, steep] = [s.splat(slope[0]), s.splat(slope[1])];
        let [a, b] = [s.mul(flat, depth[0]), s.mul(flat, depth[1])];
        let [c, d] = [s.mul(steep, depth[0]), s.mul(steep, depth[1])];
        let moved = less(s, at, origin);
        let low = s.sub(moved[0], s.max(s.max(a, b), s.max(c, d)));
        [low, s.sub(moved[1], s.min(s.min(a, b), s.min(c, d)))]
    }
}

#[inline(always)]
fn less<S: KernelSimd>(s: S, at: S::F, from: [f32; 2]) -> [S::F; 2] {
    [s.sub(at, s.splat(from[1])), s.sub(at, s.splat(from[0]))]
}

/// Minimum and maximum of the lanes in the mask.
#[inline(always)]
fn interval<S: KernelSimd>(s: S, mask: Mask, a: S::F) -> [f32; 2] {
    [s.least(mask, a), -s.least(mask, s.sub(s.splat(0.0), a))]
}

impl<S: KernelSimd> MeshPacket<'_, S> {
    /// Finds the nearest hits; with `ANY` a ray ends at its first hit and traversal starts from its far end, as in
    /// streams.
    #[inline(always)]
    pub fn trace<B: PacketBlock, const ANY: bool>(&mut self, s: S, tree: &BlockTree<B>, stack: &mut PacketStack<S>) {
        let frame = B::frame(s, self);
        let (along_x, along_y) = longest_axis(s, &self.dir);
        let down = [s.negative(self.dir[0]), s.negative(self.dir[1]), s.negative(self.dir[2])];
        let mut left = self.lanes;
        while left != 0 {
            let first = left.trailing_zeros();
            let mut group = left;
            for mask in [along_x, along_y, down[0], down[1], down[2]] {
                group &= if mask >> first & 1 != 0 { mask } else { !mask };
            }
            left &= !group;
            let octant = (0..3).fold(0, |octant, axis| octant | usize::from(down[axis] >> first & 1) << axis);
            let kz = if along_x >> first & 1 != 0 { 0 } else { 2 - usize::from(along_y >> first & 1) };
            self.trace_group::<B, ANY>(s, tree, &frame, stack, (group, octant, kz));
        }
    }

    #[inline(always)]
    fn trace_group<B: PacketBlock, const ANY: bool>(
        &mut self,
        s: S,
        tree: &BlockTree<B>,
        frame: &B::Frame<S>,
        stack: &mut PacketStack<S>,
        (lanes, octant, kz): (Mask, usize, usize),
    ) {
        let one = s.splat(1.0);
        let inv = [s.div(one, self.dir[0]), s.div(one, self.dir[1]), s.div(one, self.dir[2])];
        let (shorter, longer) = (s.splat(1.0 - RELATIVE_PADDING), s.splat(1.0 + RELATIVE_PADDING));
        let axes = [(kz + 1) % 3, (kz + 2) % 3, kz];
        let sz = inv[kz];
        let (sx, sy) = (s.div(self.dir[axes[0]], self.dir[kz]), s.div(self.dir[axes[1]], self.dir[kz]));
        let footprint = if B::HAS_FOOTPRINT {
            Footprint {
                origin: [
                    interval(s, lanes, self.origin[axes[0]]),
                    interval(s, lanes, self.origin[axes[1]]),
                    interval(s, lanes, self.origin[kz]),
                ],
                sx: interval(s, lanes, sx),
                sy: interval(s, lanes, sy),
                down: octant >> kz & 1 != 0,
            }
        } else {
            Footprint::NONE
        };
        let group = PacketGroup::<S> {
            inv_lo: [s.mul(inv[0], shorter), s.mul(inv[1], shorter), s.mul(inv[2], shorter)],
            inv_hi: [s.mul(inv[0], longer), s.mul(inv[1], longer), s.mul(inv[2], longer)],
            padding: s.mul(s.splat(RELATIVE_PADDING * tree.extent), s.abs(sz)),
            axes,
            sx,
            sy,
            sz,
            footprint,
        };
        let bounds = self.present.map_or(&tree.nodes.bounds, |present| &present.bounds);
        let bounds = [bounds.min, bounds.max];
        let (mut t0, mut t1) = (s.splat(0.0), s.load(&self.nearest.t));
        for axis in 0..3 {
            let down = octant >> axis & 1;
            let (entry, exit) = (bounds[down], bounds[1 - down]);
            // NaN as the first argument yields the second.
            t0 = s.max(self.crossing(s, &group, axis, entry[axis]).0, t0);
            t1 = s.min(self.crossing(s, &group, axis, exit[axis]).1, t1);
        }
        let mut mask = lanes & s.le(t0, t1);
        let mut height = 0;
        let mut index = 0u32;
        while mask != 0 {
            match tree.nodes.nodes[index as usize].unpack() {
                Node::Inner { axis, split, first_child } => {
                    let (lo, hi) = self.crossing(s, &group, axis, split);
                    let down = (octant >> axis & 1) as u32;
                    let (near, far) = (first_child + down, first_child + 1 - down);
                    let (near_mask, far_mask) = (mask & !s.lt(hi, t0), mask & !s.lt(t1, lo));
                    let near = (near, near_mask, t0, s.min(hi, t1));
                    let far = (far, far_mask, s.max(lo, t0), t1);
                    let (first, second) = if ANY { (far, near) } else { (near, far) };
                    if first.1 == 0 {
                        (index, mask, t0, t1) = second;
                    } else {
                        if second.1 != 0 {
                            stack.0[height % MAX_DEPTH] = second;
                            height += 1;
                        }
                        (index, mask, t0, t1) = first;
                    }
                    if mask != 0 {
                        continue;
                    }
                }
                Node::Leaf { first, count } => {
                    B::test_rays(s, self, (&group, frame), &tree.leaf(first, count), mask);
                }
            }
            mask = 0;
            while height > 0 && mask == 0 {
                height -= 1;
                (index, mask, t0, t1) = stack.0[height % MAX_DEPTH];
                let limit = s.load(&self.nearest.t);
                mask &= s.le(t0, limit);
                if ANY {
                    mask &= !self.nearest.found;
                }
                t1 = s.min(t1, limit);
            }
        }
    }

    #[inline(always)]
    fn crossing(&self, s: S, group: &PacketGroup<S>, axis: usize, split: f32) -> (S::F, S::F) {
        let distance = s.sub(s.splat(split), self.origin[axis]);
        let lo = s.sub(s.mul(distance, group.inv_lo[axis]), group.padding);
        (lo, s.add(s.mul(distance, group.inv_hi[axis]), group.padding))
    }

    #[inline(always)]
    fn test_triangles(&mut self, s: S, group: &PacketGroup<S>, block: &impl PacketTriangles, mask: Mask) {
        let n_rays = mask.count_ones();
        if n_rays <= FEW_RAYS {
            return self.test_by_ray(s, group, block, mask);
        }
        let mut triangles = block.prims().lanes(s) & !block.missed(s, &group.footprint, group.axes);
        if n_rays < triangles.count_ones() {
            return self.test_by_ray(s, group, block, mask);
        }
        while triangles != 0 {
            self.test_triangle(s, group, block, triangles.trailing_zeros() as usize, mask);
            triangles &= triangles - 1;
        }
    }

    /// Tests one ray after the other against all triangles.
    #[inline(always)]
    fn test_by_ray(&mut self, s: S, group: &PacketGroup<S>, block: &impl PacketTriangles, mut mask: Mask) {
        let [kx, ky, kz] = group.axes;
        let origin = [stored(s, self.origin[kx]), stored(s, self.origin[ky]), stored(s, self.origin[kz])];
        let (sx, sy, sz) = (stored(s, group.sx), stored(s, group.sy), stored(s, group.sz));
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % LANES;
            mask &= mask - 1;
            let ray = ShearedRay {
                axes: group.axes.map(|k| k as u32),
                origin: [origin[0][lane], origin[1][lane], origin[2][lane]],
                sx: sx[lane],
                sy: sy[lane],
                sz: sz[lane],
            };
            self.nearest.offer_one(s, block, &ray, lane, self.present);
        }
    }

    /// Tests one sphere or one ray after the other, whichever are fewer.
    #[inline(always)]
    fn test_spheres(&mut self, s: S, frame: &SphereFrame<S>, block: &SphereBlock, mut mask: Mask) {
        let n_spheres = block.prims().len();
        if n_spheres <= mask.count_ones() as usize {
            for lane in 0..n_spheres {
                self.test_sphere(s, frame, block, lane, mask);
            }
            return;
        }
        let origin = [stored(s, self.origin[0]), stored(s, self.origin[1]), stored(s, self.origin[2])];
        let dir = [stored(s, self.dir[0]), stored(s, self.dir[1]), stored(s, self.dir[2])];
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % LANES;
            mask &= mask - 1;
            let at = |v: &[[f32; LANES]; 3]| [f64::from(v[0][lane]), f64::from(v[1][lane]), f64::from(v[2][lane])];
            self.nearest.offer_one(s, block, &PreciseRay::of(at(&origin), at(&dir)), lane, self.present);
        }
    }

    /// Tests one sphere against all rays.
    #[inline(always)]
    fn test_sphere(
        &mut self,
        s: S,
        SphereFrame { precise: frame, unit, length }: &SphereFrame<S>,
        block: &SphereBlock,
        lane: usize,
        mut mask: Mask,
    ) {
        let (center, radius) = block.sphere(lane % BLOCK);
        let to_center = three!(|axis| s.sub(s.splat(center[axis]), self.origin[axis]));
        let end = s.mul(s.load(&self.nearest.t), *length);
        mask &= spheres_near(s, &to_center, unit, s.splat(radius), end);
        if mask == 0 {
            return;
        }
        let to_center = frame.towards(s, &center.as_dvec3().to_array());
        let radius_squared = s.splat_d(f64::from(radius).powi(2));
        let hits = sphere_hits(s, mask, &to_center, radius_squared, &frame.dir, frame.inv_dir_squared);
        if hits.mask != 0 {
            self.offer(s, hits, block.prims().get(lane % BLOCK));
        }
    }

    /// Tests one triangle against all rays.
    #[inline(always)]
    fn test_triangle(&mut self, s: S, group: &PacketGroup<S>, block: &impl PacketTriangles, lane: usize, mask: Mask) {
        let lane = lane % BLOCK;
        if self.present.is_some_and(|present| !present.has(block.prims().get(lane))) {
            return;
        }
        let [kx, ky, kz] = group.axes;
        let origin = [self.origin[kx], self.origin[ky], self.origin[kz]];
        let (a, b, c) = (block.corner(lane, 0), block.corner(lane, 1), block.corner(lane, 2));
        let a = [s.splat(a[kx]), s.splat(a[ky]), s.splat(a[kz])];
        let b = [s.splat(b[kx]), s.splat(b[ky]), s.splat(b[kz])];
        let c = [s.splat(c[kx]), s.splat(c[ky]), s.splat(c[kz])];
        let a = shear(s, a, origin, group.sx, group.sy);
        let b = shear(s, b, origin, group.sx, group.sy);
        let c = shear(s, c, origin, group.sx, group.sy);
        let mask = mask & may_hit(s, &a, &b, &c);
        if mask == 0 {
            return;
        }
        let hits = resolve(s, mask, &a, &b, &c, group.sz);
        self.offer(s, hits, block.prims().get(lane));
    }

    /// Keeps the hits of lanes that are nearer; at equal `t` the lower primitive wins.
    #[inline(always)]
    fn offer(&mut self, s: S, hits: LaneHits<S>, prim: u32) {
        let best = s.load(&self.nearest.t);
        let ahead = hits.mask & s.lt(s.splat(0.0), hits.t) & s.le(hits.t, best);
        if ahead == 0 {
            return;
        }
        let prim = s.splat_u(prim);
        let old = s.load_u(&self.nearest.prim);
        let take = ahead & (s.lt(hits.t, best) | s.lt_u(prim, old));
        let nearest = &mut self.nearest;
        s.store(s.select(take, hits.t, best), &mut nearest.t);
        s.store(s.select(take, hits.u, s.load(&nearest.u)), &mut nearest.u);
        s.store(s.select(take, hits.v, s.load(&nearest.v)), &mut nearest.v);
        s.store_u(s.select_u(take, prim, old), &mut nearest.prim);
        nearest.found |= take;
    }
}

impl NearestLanes {
    /// Tests one ray against a whole block.
    #[inline(always)]
    fn offer_one<S: KernelSimd, B: LeafBlock>(
        &mut self,
        s: S,
        block: &B,
        ray: &B::Ray,
        lane: usize,
        present: Option<&PresentPrimitives>,
    ) {
        let (t, prim) = (self.t[lane], self.prim[lane]);
        let mut nearest = Nearest { t, u: 0.0, v: 0.0, prim, found: false };
        B::test_once(s, block, ray, &mut nearest, present);
        if nearest.found {
            (self.t[lane], self.u[lane], self.v[lane]) = (nearest.t, nearest.u, nearest.v);
            self.prim[lane] = nearest.prim;
            self.found |= 1 << lane;
        }
    }
}

#[inline(always)]
fn stored<S: KernelSimd>(s: S, from: S::F) -> [f32; LANES] {
    let mut to = [0.0; LANES];
    s.store(from, &mut to);
    to
}
