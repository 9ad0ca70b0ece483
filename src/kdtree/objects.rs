//! The simple objects of a scene as flat records, and the packet of sixteen rays that is tested against them.
//!
//! Most scenes have a handful of walls and balls. Testing sixteen rays against each of them without any
//! branch costs less than finding out which ones to leave away, however little the rays have in common.

use super::batch::{HitBatch, RayBatch};
use super::lanes::{LaneHits, Sheared, may_hit, plain, resolve, same_sign};
use super::scene_tree::Shape;
use super::simd::{LANES, Mask, Simd};
use crate::geometry::quad_corners;
use glam::Vec3;

/// A point that [`Simd::pick`] can take axes from.
type Point = [f32; 4];

fn point(p: Vec3) -> Point {
    [p.x, p.y, p.z, 0.0]
}

#[derive(Debug)]
struct Quad {
    corners: [Point; 4],
    object: u32,
}

#[derive(Debug)]
struct Triangle {
    vertices: [Point; 3],
    object: u32,
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

/// All objects of a scene that are not instances, by kind.
#[derive(Debug, Default)]
pub(super) struct SimpleObjects {
    quads: Vec<Quad>,
    triangles: Vec<Triangle>,
    spheres: Vec<Sphere>,
    planes: Vec<Plane>,
}

impl SimpleObjects {
    /// - `objects`: which shapes to take.
    pub fn new(shapes: &[Shape], objects: impl Iterator<Item = u32>) -> Self {
        let mut simple = Self::default();
        for object in objects {
            match &shapes[object as usize] {
                Shape::Quad { corner, edge_u, edge_v } => {
                    let corners = quad_corners(*corner, *edge_u, *edge_v).map(point);
                    simple.quads.push(Quad { corners, object });
                }
                Shape::Triangle { vertices } => {
                    simple.triangles.push(Triangle { vertices: vertices.map(point), object });
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
        simple
    }
}

/// Sixteen rays and the nearest hit of each so far.
pub(super) struct Packet<S: Simd> {
    pub origin: [S::F; 3],
    pub dir: [S::F; 3],
    pub t_max: S::F,
    /// Lanes that hold a ray.
    pub lanes: Mask,
    /// `t_max` until something is hit.
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
    pub prim: S::U,
    pub object: S::U,
    pub found: Mask,
}

impl<S: Simd> Packet<S> {
    /// Rays `first..first + 16`, or as many as there are.
    #[inline(always)]
    pub fn load(s: S, rays: &RayBatch, first: usize) -> Self {
        let count = (rays.len() - first).min(LANES);
        let take = |from: &[f32], idle: f32| match from[first..].first_chunk::<LANES>() {
            Some(all) => s.load(all),
            None => {
                let mut some = [idle; LANES];
                some[..count].copy_from_slice(&from[first..]);
                s.load(&some)
            }
        };
        let t_max = take(&rays.t_max, 0.0);
        Self {
            origin: [take(&rays.origin_x, 0.0), take(&rays.origin_y, 0.0), take(&rays.origin_z, 0.0)],
            dir: [take(&rays.dir_x, 1.0), take(&rays.dir_y, 1.0), take(&rays.dir_z, 1.0)],
            t_max,
            lanes: if count == LANES { Mask::MAX } else { (1 << count) - 1 },
            t: t_max,
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
        for (to, from) in [(&mut hits.t, t), (&mut hits.u, self.u), (&mut hits.v, self.v)] {
            match to[first..].first_chunk_mut::<LANES>() {
                Some(all) => s.store(from, all),
                None => {
                    let mut all = [0.0; LANES];
                    s.store(from, &mut all);
                    let rest = &mut to[first..];
                    rest.copy_from_slice(&all[..rest.len()]);
                }
            }
        }
        for (to, from) in [(&mut hits.prim, prim), (&mut hits.object, object)] {
            match to[first..].first_chunk_mut::<LANES>() {
                Some(all) => s.store_u(from, all),
                None => {
                    let mut all = [0; LANES];
                    s.store_u(from, &mut all);
                    let rest = &mut to[first..];
                    rest.copy_from_slice(&all[..rest.len()]);
                }
            }
        }
    }

    /// Keeps the lanes that are nearer; at equal `t` the lower object.
    #[inline(always)]
    fn offer(&mut self, s: S, hits: LaneHits<S>, object: u32) {
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
    }

    /// Tests all simple objects; with `ANY` stops once every ray has hit something.
    #[inline(always)]
    pub fn test_objects<const ANY: bool>(&mut self, s: S, objects: &SimpleObjects) {
        let done = |packet: &Self| ANY && packet.found & packet.lanes == packet.lanes;
        if !objects.quads.is_empty() || !objects.triangles.is_empty() {
            let frame = ShearFrame::new(s, &self.origin, &self.dir);
            for quad in &objects.quads {
                self.test_quad(s, &frame, quad);
                if done(self) {
                    return;
                }
            }
            for triangle in &objects.triangles {
                let [a, b, c] = &triangle.vertices;
                let [a, b, c] = [frame.shear(s, a), frame.shear(s, b), frame.shear(s, c)];
                let mask = self.lanes & may_hit(s, &a, &b, &c);
                if mask != 0 {
                    let hits = resolve(s, mask, &a, &b, &c, frame.sz);
                    self.offer(s, hits, triangle.object);
                }
            }
        }
        if (!objects.spheres.is_empty() || !objects.planes.is_empty()) && !done(self) {
            let wide = WideFrame::new(s, &self.origin, &self.dir);
            for sphere in &objects.spheres {
                self.test_sphere(s, &wide, sphere);
                if done(self) {
                    return;
                }
            }
            for plane in &objects.planes {
                let normal = plane.normal.map(|n| s.splat_d(n));
                let to_point = wide.towards(s, &plane.point);
                let t = s.narrow(s.div_d(dot(s, &normal, &to_point), dot(s, &normal, &wide.dir)));
                let zero = s.splat(0.0);
                self.offer(s, LaneHits { mask: self.lanes, t, u: zero, v: zero }, plane.object);
            }
        }
    }

    /// Two triangles that share the diagonal `a c`, the first one first (`geometry::intersect_quad`).
    #[inline(always)]
    fn test_quad(&mut self, s: S, frame: &ShearFrame<S>, quad: &Quad) {
        let [a, b, c, d] = &quad.corners;
        let [a, b, c, d] = [frame.shear(s, a), frame.shear(s, b), frame.shear(s, c), frame.shear(s, d)];
        let diagonal = plain(s, &a, &c);
        let back = s.sub(s.splat(0.0), diagonal);
        let first = self.lanes & same_sign(s, plain(s, &c, &b), diagonal, plain(s, &b, &a));
        let second = self.lanes & same_sign(s, plain(s, &d, &c), plain(s, &a, &d), back);
        if first | second == 0 {
            return;
        }
        let choose = |p: &Sheared<S>, q: &Sheared<S>| {
            [s.select(first, p[0], q[0]), s.select(first, p[1], q[1]), s.select(first, p[2], q[2])]
        };
        let mut hits = resolve(s, first | second, &a, &choose(&b, &c), &choose(&c, &d), frame.sz);
        let sum = s.min(s.add(hits.u, hits.v), s.splat(1.0));
        let (u, v) = (hits.u, hits.v);
        hits.u = s.select(first, sum, u);
        hits.v = s.select(first, v, sum);
        // On the diagonal the plain signs may name the first triangle where only the second is hit.
        let again = first & second & !hits.mask;
        self.offer(s, hits, quad.object);
        if again != 0 {
            let mut hits = resolve(s, again, &a, &c, &d, frame.sz);
            hits.v = s.min(s.add(hits.u, hits.v), s.splat(1.0));
            self.offer(s, hits, quad.object);
        }
    }

    #[inline(always)]
    fn test_sphere(&mut self, s: S, wide: &WideFrame<S>, sphere: &Sphere) {
        let to_center = wide.towards(s, &sphere.center);
        let t_middle = s.mul_d(dot(s, &to_center, &wide.dir), wide.inv_dir_squared);
        let off = |axis: usize| s.sub_d(to_center[axis], s.mul_d(wide.dir[axis], t_middle));
        let perpendicular = [off(0), off(1), off(2)];
        let discriminant = s.sub_d(s.splat_d(sphere.radius_squared), dot(s, &perpendicular, &perpendicular));
        let mask = self.lanes & s.le_d(s.splat_d(0.0), discriminant);
        if mask == 0 {
            return;
        }
        let half_chord = s.sqrt_d(s.mul_d(discriminant, wide.inv_dir_squared));
        let near = s.narrow(s.sub_d(t_middle, half_chord));
        let far = s.narrow(s.add_d(t_middle, half_chord));
        let zero = s.splat(0.0);
        let t = s.select(s.lt(zero, near), near, far);
        self.offer(s, LaneHits { mask, t, u: zero, v: zero }, sphere.object);
    }
}

/// The rays' shears (`geometry::Shear`), each with axes of its own.
pub(super) struct ShearFrame<S: Simd> {
    /// For each lane the axes across, across and along.
    axes: [S::U; 3],
    /// The origin along these axes.
    origin: [S::F; 3],
    sx: S::F,
    sy: S::F,
    pub sz: S::F,
}

impl<S: Simd> ShearFrame<S> {
    #[inline(always)]
    fn new(s: S, origin: &[S::F; 3], dir: &[S::F; 3]) -> Self {
        let [x, y, z] = [s.abs(dir[0]), s.abs(dir[1]), s.abs(dir[2])];
        let along_x = s.le(y, x) & s.le(z, x);
        let along_y = !along_x & s.le(z, y);
        // Along z: (0, 1, 2); along y: (2, 0, 1); along x: (1, 2, 0).
        let turned = |v: &[S::F; 3]| {
            let pick =
                |on_z: usize, on_y: usize, on_x: usize| s.select(along_x, v[on_x], s.select(along_y, v[on_y], v[on_z]));
            [pick(0, 2, 1), pick(1, 0, 2), pick(2, 1, 0)]
        };
        let axis = |on_z: u32, on_y: u32, on_x: u32| {
            s.select_u(along_x, s.splat_u(on_x), s.select_u(along_y, s.splat_u(on_y), s.splat_u(on_z)))
        };
        let d = turned(dir);
        Self {
            axes: [axis(0, 2, 1), axis(1, 0, 2), axis(2, 1, 0)],
            origin: turned(origin),
            sx: s.div(d[0], d[2]),
            sy: s.div(d[1], d[2]),
            sz: s.div(s.splat(1.0), d[2]),
        }
    }

    #[inline(always)]
    fn shear(&self, s: S, vertex: &Point) -> Sheared<S> {
        let moved = |k: usize| s.sub(s.pick(vertex, self.axes[k]), self.origin[k]);
        let [x, y, z] = [moved(0), moved(1), moved(2)];
        [s.sub(x, s.mul(self.sx, z)), s.sub(y, s.mul(self.sy, z)), z]
    }
}

/// The rays in `f64`.
struct WideFrame<S: Simd> {
    origin: [S::D; 3],
    dir: [S::D; 3],
    inv_dir_squared: S::D,
}

impl<S: Simd> WideFrame<S> {
    #[inline(always)]
    fn new(s: S, origin: &[S::F; 3], dir: &[S::F; 3]) -> Self {
        let origin = [s.widen(origin[0]), s.widen(origin[1]), s.widen(origin[2])];
        let dir = [s.widen(dir[0]), s.widen(dir[1]), s.widen(dir[2])];
        let inv_dir_squared = s.div_d(s.splat_d(1.0), dot(s, &dir, &dir));
        Self { origin, dir, inv_dir_squared }
    }

    #[inline(always)]
    fn towards(&self, s: S, point: &[f64; 3]) -> [S::D; 3] {
        let towards = |axis: usize| s.sub_d(s.splat_d(point[axis]), self.origin[axis]);
        [towards(0), towards(1), towards(2)]
    }
}

#[inline(always)]
fn dot<S: Simd>(s: S, a: &[S::D; 3], b: &[S::D; 3]) -> S::D {
    s.add_d(s.add_d(s.mul_d(a[0], b[0]), s.mul_d(a[1], b[1])), s.mul_d(a[2], b[2]))
}
