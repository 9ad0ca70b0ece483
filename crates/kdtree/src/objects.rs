//! The simple objects of a scene as flat records, and the packet of sixteen rays that is tested against them.
//!
//! Most scenes have a handful of walls and spheres. Testing sixteen rays against each of them without branches costs
//! less than culling, even for incoherent rays.

use super::batch::{HitBatch, RayBatch};
use super::lanes::{LaneHits, Sheared, dot, longest_axis, may_hit, quad_hits, resolve, shear, sphere_hits};
use super::primitive_trees::MAX_SIMPLE;
use super::quad_filter::{FilteredQuad, QuadFilterRays};
use super::shape::Shape;
use super::simd::{KernelSimd, LANES, Mask};
use super::sphere_tree::SphereTree;
use crate::geometry::quad_corners;
use glam::Vec3;

/// A point padded to four floats, from which `KernelSimd` can pick axes by index.
type Point = [f32; 4];

fn point(p: Vec3) -> Point {
    [p.x, p.y, p.z, 0.0]
}

#[derive(Debug)]
struct Quad {
    corners: [Point; 4],
    object: u32,
}

/// Quads with a conservative filter, used when each ray is expected to hit only a few of them.
#[derive(Debug, Default)]
struct QuadFilter {
    quads: Vec<FilteredQuad>,
    /// Tables of the filtered quads that lanes look up: the four corners and the object index.
    corners: [[Vec<f32>; 3]; 4],
    objects: Vec<u32>,
    /// Indices among the scene's quads of those in the filter, and of those that are always tested.
    filtered: Vec<u32>,
    others: Vec<u32>,
}

/// Number of quads from which the filter pays.
const MIN_FILTERED: usize = 5;

impl QuadFilter {
    fn add(&mut self, place: u32, object: u32, [corner, edge_u, edge_v]: [Vec3; 3]) {
        let Some(quad) = FilteredQuad::new(corner, edge_u, edge_v) else { return self.others.push(place) };
        self.quads.push(quad);
        self.filtered.push(place);
        self.objects.push(object);
        for (table, corner) in self.corners.iter_mut().zip(quad_corners(corner, edge_u, edge_v)) {
            table.iter_mut().zip(corner.to_array()).for_each(|(table, x)| table.push(x));
        }
    }

    /// Pads the tables: lookups are fastest with sixteen or thirty-two entries.
    fn padded(mut self) -> Option<Self> {
        let n = self.quads.len();
        let length = [LANES, 2 * LANES, n].into_iter().find(|&length| length >= n)?;
        self.corners.iter_mut().flatten().for_each(|table| table.resize(length, 0.0));
        self.objects.resize(length, 0);
        (n >= MIN_FILTERED).then_some(self)
    }
}

#[derive(Debug)]
struct Triangle {
    vertices: [Point; 3],
    object: u32,
    /// Its index in a mesh, or 0.
    prim: u32,
}

#[derive(Debug)]
struct Sphere {
    center: [f64; 3],
    radius_squared: f64,
    object: u32,
}

#[derive(Debug)]
struct Plane {
    point: [f64; 3],
    normal: [f64; 3],
    object: u32,
}

/// All objects of a scene that are neither instances nor in trees, by kind; and the triangles of meshes if they are few.
#[derive(Debug, Default)]
pub(super) struct SimpleObjects {
    quads: Vec<Quad>,
    filter: Option<QuadFilter>,
    triangles: Vec<Triangle>,
    spheres: Vec<Sphere>,
    planes: Vec<Plane>,
}

impl SimpleObjects {
    /// Collects shapes by kind.
    ///
    /// - `objects`: indices of the shapes to include.
    /// - `of_meshes`: triangles of meshes: object, index there, vertices. Those of an object are ascending.
    pub fn new(
        shapes: &[Shape],
        objects: impl Iterator<Item = u32>,
        of_meshes: impl Iterator<Item = (u32, u32, [Vec3; 3])>,
    ) -> Self {
        let (mut simple, mut filter) = (Self::default(), QuadFilter::default());
        for object in objects {
            match &shapes[object as usize] {
                Shape::Quad { corner, edge_u, edge_v } => {
                    filter.add(simple.quads.len() as u32, object, [*corner, *edge_u, *edge_v]);
                    let corners = quad_corners(*corner, *edge_u, *edge_v).map(point);
                    simple.quads.push(Quad { corners, object });
                }
                Shape::Triangle { vertices } => {
                    simple.triangles.push(Triangle { vertices: vertices.map(point), object, prim: 0 });
                }
                Shape::Sphere { center, radius } => {
                    let center = center.as_dvec3().to_array();
                    simple.spheres.push(Sphere { center, radius_squared: f64::from(*radius).powi(2), object });
                }
                Shape::Plane { point, normal } => {
                    let (point, normal) = (point.as_dvec3().to_array(), normal.as_dvec3().to_array());
                    simple.planes.push(Plane { point, normal, object });
                }
                Shape::Mesh { .. } | Shape::Spheres { .. } => {}
            }
        }
        let triangle =
            |(object, prim, vertices): (u32, u32, [Vec3; 3])| Triangle { vertices: vertices.map(point), object, prim };
        simple.triangles.extend(of_meshes.map(triangle));
        simple.filter = filter.padded();
        simple
    }
}

/// Sixteen rays and the nearest hit of each so far.
pub(super) struct Packet<S: KernelSimd> {
    pub origin: [S::F; 3],
    pub dir: [S::F; 3],
    /// Lanes that hold a ray.
    pub lanes: Mask,
    /// `t_max` of the ray until something is hit.
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
    pub prim: S::U,
    pub object: S::U,
    pub found: Mask,
}

impl<S: KernelSimd> Packet<S> {
    /// Loads rays `first..first + 16`, or as many as there are.
    #[inline(always)]
    pub fn load(s: S, rays: &RayBatch, first: usize) -> Self {
        let count = (rays.len() - first).min(LANES);
        let (x, y, z) = (&rays.origin_x[first..], &rays.origin_y[first..], &rays.origin_z[first..]);
        let origin = [load_some(s, x, 0.0), load_some(s, y, 0.0), load_some(s, z, 0.0)];
        let (x, y, z) = (&rays.dir_x[first..], &rays.dir_y[first..], &rays.dir_z[first..]);
        let dir = [load_some(s, x, 1.0), load_some(s, y, 1.0), load_some(s, z, 1.0)];
        Self {
            origin,
            dir,
            lanes: if count == LANES { Mask::MAX } else { (1 << count) - 1 },
            t: load_some(s, &rays.t_max[first..], 0.0),
            u: s.splat(0.0),
            v: s.splat(0.0),
            prim: s.splat_u(0),
            object: s.splat_u(0),
            found: 0,
        }
    }

    /// Writes the nearest hits into the batch.
    #[inline(always)]
    pub fn store(&self, s: S, hits: &mut HitBatch, first: usize) {
        let t = s.select(self.found, self.t, s.splat(f32::INFINITY));
        let miss = s.splat_u(HitBatch::MISS);
        let (prim, object) = (s.select_u(self.found, self.prim, miss), s.select_u(self.found, self.object, miss));
        store_some(s, t, &mut hits.t[first..]);
        store_some(s, self.u, &mut hits.u[first..]);
        store_some(s, self.v, &mut hits.v[first..]);
        store_some_u(s, prim, &mut hits.prim[first..]);
        store_some_u(s, object, &mut hits.object[first..]);
    }

    /// Keeps the hits of lanes that are nearer; at equal `t` the lower object wins. Returns these lanes.
    #[inline(always)]
    fn offer(&mut self, s: S, hits: LaneHits<S>, object: u32) -> Mask {
        let ahead = hits.mask & s.lt(s.splat(0.0), hits.t);
        let tie = s.eq(hits.t, self.t);
        let mut nearer = s.lt(hits.t, self.t);
        if ahead & tie != 0 {
            nearer |= tie & s.lt_u(s.splat_u(object), self.object);
        }
        let take = ahead & nearer;
        self.t = s.select(take, hits.t, self.t);
        self.u = s.select(take, hits.u, self.u);
        self.v = s.select(take, hits.v, self.v);
        self.prim = s.select_u(take, s.splat_u(0), self.prim);
        self.object = s.select_u(take, s.splat_u(object), self.object);
        self.found |= take;
        take
    }

    /// Tests all simple objects; with `ANY` stops once every ray has a hit.
    #[inline(always)]
    pub fn test_objects<const ANY: bool>(&mut self, s: S, objects: &SimpleObjects) {
        if !objects.quads.is_empty() || !objects.triangles.is_empty() {
            let frame = ShearFrame::new(s, &self.origin, &self.dir);
            match &objects.filter {
                Some(filter) if ANY => self.filter_any(s, &frame, &objects.quads, filter),
                Some(filter) => self.filter_nearest(s, &frame, &objects.quads, filter),
                None => self.test_quads::<ANY>(s, &frame, &objects.quads),
            }
            if self.is_done::<ANY>() {
                return;
            }
            for triangle in &objects.triangles {
                let [a, b, c] = &triangle.vertices;
                let [a, b, c] = [frame.shear(s, a), frame.shear(s, b), frame.shear(s, c)];
                let mask = self.lanes & may_hit(s, &a, &b, &c);
                if mask != 0 {
                    let hits = resolve(s, mask, &a, &b, &c, frame.sz);
                    // Of triangles at equal distance, the first of a mesh is kept already.
                    let take = self.offer(s, hits, triangle.object);
                    self.prim = s.select_u(take, s.splat_u(triangle.prim), self.prim);
                    if self.is_done::<ANY>() {
                        return;
                    }
                }
            }
        }
        if (!objects.spheres.is_empty() || !objects.planes.is_empty()) && !self.is_done::<ANY>() {
            let wide = FrameF64::new(s, &self.origin, &self.dir);
            for sphere in &objects.spheres {
                self.test_sphere(s, &wide, sphere);
                if self.is_done::<ANY>() {
                    return;
                }
            }
            for plane in &objects.planes {
                let normal = [s.splat_d(plane.normal[0]), s.splat_d(plane.normal[1]), s.splat_d(plane.normal[2])];
                let to_point = wide.towards(s, &plane.point);
                let t = s.narrow(s.div_d(dot(s, &normal, &to_point), dot(s, &normal, &wide.dir)));
                let zero = s.splat(0.0);
                self.offer(s, LaneHits { mask: self.lanes, t, u: zero, v: zero }, plane.object);
            }
        }
    }

    /// Tests every sphere of a cloud.
    ///
    /// - `origin`, `dir`: in the space of the cloud.
    #[inline(always)]
    pub fn test_cloud<const ANY: bool>(
        &mut self,
        s: S,
        tree: &SphereTree,
        object: u32,
        origin: &[S::F; 3],
        dir: &[S::F; 3],
    ) {
        let wide = FrameF64::new(s, origin, dir);
        for (prim, (center, radius)) in (0..).zip(tree.centers.iter().zip(&tree.radii)) {
            if self.is_done::<ANY>() {
                return;
            }
            let to_center = wide.towards(s, &center.as_dvec3().to_array());
            let radius_squared = s.splat_d(f64::from(*radius).powi(2));
            let hits = sphere_hits(s, self.lanes, &to_center, radius_squared, &wide.dir, wide.inv_dir_squared);
            if hits.mask != 0 {
                // Of spheres at equal distance, the first is kept already.
                let take = self.offer(s, hits, object);
                self.prim = s.select_u(take, s.splat_u(prim), self.prim);
            }
        }
    }

    #[inline(always)]
    fn is_done<const ANY: bool>(&self) -> bool {
        ANY && self.found & self.lanes == self.lanes
    }

    #[inline(always)]
    fn test_quads<const ANY: bool>(&mut self, s: S, frame: &ShearFrame<S>, quads: &[Quad]) {
        for quad in quads {
            self.test_quad(s, frame, quad);
            if self.is_done::<ANY>() {
                return;
            }
        }
    }

    /// Finds the nearest of many quads for rays that have no hit yet. Each lane tests the quad that the filter puts
    /// first; all quads are tested only where the filter leaves the order open.
    #[inline(always)]
    fn filter_nearest(&mut self, s: S, frame: &ShearFrame<S>, quads: &[Quad], filter: &QuadFilter) {
        let rays = QuadFilterRays::new(s, &self.origin, &self.dir);
        // The earliest possible `t` of the two nearest quads.
        let (mut first, mut second) = (self.t, self.t);
        let mut which = s.splat_u(0);
        for (k, quad) in (0..).zip(&filter.quads) {
            let earliest = rays.filter::<false>(s, quad).earliest;
            second = s.min(s.max(earliest, first), second);
            which = s.select_u(s.lt(earliest, first), s.splat_u(k), which);
            first = s.min(earliest, first);
        }
        let some = self.lanes & s.lt(first, self.t);
        if some != 0 {
            let [a, b, c, d] = &filter.corners;
            let (a, b) = (frame.shear_each(s, a, which), frame.shear_each(s, b, which));
            let (c, d) = (frame.shear_each(s, c, which), frame.shear_each(s, d, which));
            let hits = quad_hits(s, some, [&a, &b, &c, &d], frame.sz);
            let take = hits.mask & s.lt(s.splat(0.0), hits.t) & s.lt(hits.t, second);
            self.t = s.select(take, hits.t, self.t);
            self.u = s.select(take, hits.u, self.u);
            self.v = s.select(take, hits.v, self.v);
            self.object = s.select_u(take, s.gather_u(&filter.objects, which), self.object);
            self.found |= take;
            let all = std::mem::replace(&mut self.lanes, some & !take);
            if self.lanes != 0 {
                self.test_quads::<false>(s, frame, quads);
            }
            self.lanes = all;
        }
        for &place in &filter.others {
            self.test_quad(s, frame, &quads[place as usize]);
        }
    }

    /// The any-hit variant of the filtered test: a quad is tested exactly only where the filter is undecided.
    #[inline(always)]
    fn filter_any(&mut self, s: S, frame: &ShearFrame<S>, quads: &[Quad], filter: &QuadFilter) {
        let rays = QuadFilterRays::new(s, &self.origin, &self.dir);
        let mut doubts = [0; MAX_SIMPLE];
        // Checking for completion after each quad would cost more than filtering a few in vain.
        for (quads, doubts) in filter.quads.chunks(4).zip(doubts.chunks_mut(4)) {
            for (quad, doubt) in quads.iter().zip(doubts) {
                let seen = rays.filter::<true>(s, quad);
                let sure = seen.hits & s.lt(seen.latest, self.t);
                self.found |= self.lanes & sure;
                *doubt = !s.le(self.t, seen.earliest) & !sure;
            }
            if self.is_done::<true>() {
                return;
            }
        }
        let all = self.lanes;
        for (&place, &doubt) in filter.filtered.iter().zip(&doubts) {
            self.lanes = all & doubt & !self.found;
            if self.lanes != 0 {
                self.test_quad(s, frame, &quads[place as usize]);
            }
        }
        self.lanes = all;
        for &place in &filter.others {
            self.test_quad(s, frame, &quads[place as usize]);
        }
    }

    #[inline(always)]
    fn test_quad(&mut self, s: S, frame: &ShearFrame<S>, quad: &Quad) {
        let [a, b, c, d] = &quad.corners;
        let corners = [frame.shear(s, a), frame.shear(s, b), frame.shear(s, c), frame.shear(s, d)];
        let hits = quad_hits(s, self.lanes, corners.each_ref(), frame.sz);
        if hits.mask != 0 {
            self.offer(s, hits, quad.object);
        }
    }

    #[inline(always)]
    fn test_sphere(&mut self, s: S, wide: &FrameF64<S>, sphere: &Sphere) {
        let to_center = wide.towards(s, &sphere.center);
        let radius_squared = s.splat_d(sphere.radius_squared);
        let hits = sphere_hits(s, self.lanes, &to_center, radius_squared, &wide.dir, wide.inv_dir_squared);
        if hits.mask != 0 {
            self.offer(s, hits, sphere.object);
        }
    }
}

/// Shears of the rays (`geometry::Shear`), with separate axes for each lane.
pub(super) struct ShearFrame<S: KernelSimd> {
    /// For each lane the two axes across and the axis along the ray.
    axes: [S::U; 3],
    along_x: Mask,
    along_y: Mask,
    /// The origin along these axes.
    origin: [S::F; 3],
    sx: S::F,
    sy: S::F,
    pub sz: S::F,
}

impl<S: KernelSimd> ShearFrame<S> {
    #[inline(always)]
    fn new(s: S, origin: &[S::F; 3], dir: &[S::F; 3]) -> Self {
        let (along_x, along_y) = longest_axis(s, dir);
        // The axes (across, across, along) are (x, y, z), (z, x, y) or (y, z, x).
        let [x, y, z] = *dir;
        let d = [
            by_axis(s, along_x, along_y, y, z, x),
            by_axis(s, along_x, along_y, z, x, y),
            by_axis(s, along_x, along_y, x, y, z),
        ];
        let [x, y, z] = *origin;
        let o = [
            by_axis(s, along_x, along_y, y, z, x),
            by_axis(s, along_x, along_y, z, x, y),
            by_axis(s, along_x, along_y, x, y, z),
        ];
        let (zero, one, two) = (s.splat_u(0), s.splat_u(1), s.splat_u(2));
        let axes = [
            s.select_u(along_x, one, s.select_u(along_y, two, zero)),
            s.select_u(along_x, two, s.select_u(along_y, zero, one)),
            s.select_u(along_x, zero, s.select_u(along_y, one, two)),
        ];
        let (sx, sy, sz) = (s.div(d[0], d[2]), s.div(d[1], d[2]), s.div(s.splat(1.0), d[2]));
        Self { axes, along_x, along_y, origin: o, sx, sy, sz }
    }

    #[inline(always)]
    fn shear(&self, s: S, vertex: &Point) -> Sheared<S> {
        let [kx, ky, kz] = self.axes;
        let vertex = [s.pick(vertex, kx), s.pick(vertex, ky), s.pick(vertex, kz)];
        shear(s, vertex, self.origin, self.sx, self.sy)
    }

    /// Shears one point per lane, looked up in a table.
    #[inline(always)]
    fn shear_each(&self, s: S, [x, y, z]: &[Vec<f32>; 3], which: S::U) -> Sheared<S> {
        let (x, y, z) = (s.gather(x, which), s.gather(y, which), s.gather(z, which));
        let vertex = [
            by_axis(s, self.along_x, self.along_y, y, z, x),
            by_axis(s, self.along_x, self.along_y, z, x, y),
            by_axis(s, self.along_x, self.along_y, x, y, z),
        ];
        shear(s, vertex, self.origin, self.sx, self.sy)
    }
}

/// Selects the value that belongs to the longest axis of each lane.
#[inline(always)]
fn by_axis<S: KernelSimd>(s: S, along_x: Mask, along_y: Mask, on_x: S::F, on_y: S::F, on_z: S::F) -> S::F {
    s.select(along_x, on_x, s.select(along_y, on_y, on_z))
}

/// Loads the first sixteen numbers, or all of them with `idle` in the remaining lanes.
#[inline(always)]
pub(super) fn load_some<S: KernelSimd>(s: S, from: &[f32], idle: f32) -> S::F {
    if let Some(all) = from.first_chunk() {
        return s.load(all);
    }
    let mut some = [idle; LANES];
    some[..from.len()].copy_from_slice(from);
    s.load(&some)
}

/// Like [`load_some`], for integers.
#[inline(always)]
pub(super) fn load_some_u<S: KernelSimd>(s: S, from: &[u32], idle: u32) -> S::U {
    if let Some(all) = from.first_chunk() {
        return s.load_u(all);
    }
    let mut some = [idle; LANES];
    some[..from.len()].copy_from_slice(from);
    s.load_u(&some)
}

#[inline(always)]
fn store_some<S: KernelSimd>(s: S, from: S::F, to: &mut [f32]) {
    if let Some(all) = to.first_chunk_mut() {
        return s.store(from, all);
    }
    let mut all = [0.0; LANES];
    s.store(from, &mut all);
    to.copy_from_slice(&all[..to.len()]);
}

#[inline(always)]
fn store_some_u<S: KernelSimd>(s: S, from: S::U, to: &mut [u32]) {
    if let Some(all) = to.first_chunk_mut() {
        return s.store_u(from, all);
    }
    let mut all = [0; LANES];
    s.store_u(from, &mut all);
    to.copy_from_slice(&all[..to.len()]);
}

/// Sixteen rays in `f64`.
#[derive(Clone, Copy)]
pub(super) struct FrameF64<S: KernelSimd> {
    origin: [S::D; 3],
    pub dir: [S::D; 3],
    pub inv_dir_squared: S::D,
}

impl<S: KernelSimd> FrameF64<S> {
    #[inline(always)]
    pub fn new(s: S, origin: &[S::F; 3], dir: &[S::F; 3]) -> Self {
        let origin = [s.widen(origin[0]), s.widen(origin[1]), s.widen(origin[2])];
        let dir = [s.widen(dir[0]), s.widen(dir[1]), s.widen(dir[2])];
        let inv_dir_squared = s.div_d(s.splat_d(1.0), dot(s, &dir, &dir));
        Self { origin, dir, inv_dir_squared }
    }

    #[inline(always)]
    pub fn towards(&self, s: S, point: &[f64; 3]) -> [S::D; 3] {
        [
            s.sub_d(s.splat_d(point[0]), self.origin[0]),
            s.sub_d(s.splat_d(point[1]), self.origin[1]),
            s.sub_d(s.splat_d(point[2]), self.origin[2]),
        ]
    }
}
