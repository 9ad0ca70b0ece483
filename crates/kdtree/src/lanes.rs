//! The tests of `geometry` in SIMD: one shape against sixteen rays, or one ray against sixteen triangles.
//!
//! Every operation and its order are those of the scalar test, so the bits are the same.

use super::simd::{KernelSimd, LANES, Mask};
use crate::geometry::{TINY_EDGE, tiny_edges};
use glam::Affine3A;

/// Vertices in the ray's sheared frame: two coordinates across the ray, one along it.
pub(super) type Sheared<S> = [<S as firstlight_simd::Simd>::F; 3];

/// Mask of lanes that hit, with their `t`, `u`, `v`; the values of other lanes are unspecified.
pub(super) struct LaneHits<S: KernelSimd> {
    pub mask: Mask,
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
}

impl<S: KernelSimd> LaneHits<S> {
    #[inline(always)]
    pub fn none(s: S) -> Self {
        let zero = s.splat(0.0);
        Self { mask: 0, t: zero, u: zero, v: zero }
    }
}

/// Returns the lanes whose direction is longest along x, and those along y; all others are longest along z. Ties go to
/// the first axis, as in `geometry::Shear`.
#[inline(always)]
pub(super) fn longest_axis<S: KernelSimd>(s: S, dir: &[S::F; 3]) -> (Mask, Mask) {
    let [x, y, z] = [s.abs(dir[0]), s.abs(dir[1]), s.abs(dir[2])];
    let along_x = s.le(y, x) & s.le(z, x);
    (along_x, !along_x & s.le(z, y))
}

/// Shears a vertex whose coordinates are in the order of the ray's axes.
///
/// Closures are not inlined reliably into functions with target features, so this file uses functions.
#[inline(always)]
pub(super) fn shear<S: KernelSimd>(s: S, vertex: [S::F; 3], origin: [S::F; 3], sx: S::F, sy: S::F) -> Sheared<S> {
    let (x, y) = (s.sub(vertex[0], origin[0]), s.sub(vertex[1], origin[1]));
    let z = s.sub(vertex[2], origin[2]);
    [s.sub(x, s.mul(sx, z)), s.sub(y, s.mul(sy, z)), z]
}

/// Returns the lanes whose three numbers do not have mixed signs; false for NaN.
#[inline(always)]
pub(super) fn same_sign<S: KernelSimd>(s: S, a: S::F, b: S::F, c: S::F) -> Mask {
    let zero = s.splat(0.0);
    s.le(zero, s.min(a, s.min(b, c))) | s.le(s.max(a, s.max(b, c)), zero)
}

/// The cross product in the plane without compensation: its sign is never wrong but may be lost.
#[inline(always)]
pub(super) fn plain<S: KernelSimd>(s: S, p: &Sheared<S>, q: &Sheared<S>) -> S::F {
    s.sub(s.mul(p[0], q[1]), s.mul(p[1], q[0]))
}

#[inline(always)]
fn exact<S: KernelSimd>(s: S, p: &Sheared<S>, q: &Sheared<S>) -> S::F {
    let cd = s.mul(p[1], q[0]);
    let rounding = s.neg_mul_add(p[1], q[0], cd);
    s.add(s.mul_sub(p[0], q[1], cd), rounding)
}

/// Returns the lanes that may hit according to the uncompensated edge functions.
#[inline(always)]
pub(super) fn may_hit<S: KernelSimd>(s: S, a: &Sheared<S>, b: &Sheared<S>, c: &Sheared<S>) -> Mask {
    same_sign(s, plain(s, c, b), plain(s, a, c), plain(s, b, a))
}

/// Completes the triangle test for lanes that may hit.
#[inline(always)]
pub(super) fn resolve<S: KernelSimd>(
    s: S,
    mut mask: Mask,
    a: &Sheared<S>,
    b: &Sheared<S>,
    c: &Sheared<S>,
    sz: S::F,
) -> LaneHits<S> {
    let mut edges = [exact(s, c, b), exact(s, a, c), exact(s, b, a)];
    let smallest = s.min(s.abs(edges[0]), s.min(s.abs(edges[1]), s.abs(edges[2])));
    let tiny = mask & s.lt(smallest, s.splat(TINY_EDGE));
    if tiny != 0 {
        // Copies, so that the originals need no memory.
        let mut again = TinyEdges::new(s, &edges, [a, b, c]);
        mask &= again.resolve(tiny);
        edges = again.edges(s);
    }
    let [e0, e1, e2] = edges;
    mask &= same_sign(s, e0, e1, e2);
    let inv = s.div(s.splat(1.0), s.add(s.add(e0, e1), e2));
    let (w, u, v) = (s.mul(e0, inv), s.mul(e1, inv), s.mul(e2, inv));
    let depth = s.add(s.add(s.mul(w, a[2]), s.mul(u, b[2])), s.mul(v, c[2]));
    LaneHits { mask, t: s.mul(depth, sz), u, v }
}

/// Intersects two triangles that share the diagonal `a c`, testing the first one first (`geometry::intersect_quad`).
///
/// - `corners`: `a`, `b`, `c`, `d` around the quad.
#[inline(always)]
pub(super) fn quad_hits<S: KernelSimd>(s: S, lanes: Mask, [a, b, c, d]: [&Sheared<S>; 4], sz: S::F) -> LaneHits<S> {
    let diagonal = plain(s, a, c);
    let back = s.sub(s.splat(0.0), diagonal);
    let first = lanes & same_sign(s, plain(s, c, b), diagonal, plain(s, b, a));
    let second = lanes & same_sign(s, plain(s, d, c), plain(s, a, d), back);
    if first | second == 0 {
        return LaneHits::none(s);
    }
    let one = s.splat(1.0);
    let (p, q) = (choose(s, first, b, c), choose(s, first, c, d));
    let mut hits = resolve(s, first | second, a, &p, &q, sz);
    let sum = s.min(s.add(hits.u, hits.v), one);
    let (u, v) = (hits.u, hits.v);
    hits.u = s.select(first, sum, u);
    hits.v = s.select(first, v, sum);
    // On the diagonal the uncompensated signs may select the first triangle where only the second is hit.
    let again = first & second & !hits.mask;
    if again != 0 {
        let other = resolve(s, again, a, c, d, sz);
        hits.mask |= other.mask;
        hits.t = s.select(again, other.t, hits.t);
        hits.u = s.select(again, other.u, hits.u);
        hits.v = s.select(again, s.min(s.add(other.u, other.v), one), hits.v);
    }
    hits
}

#[inline(always)]
fn choose<S: KernelSimd>(s: S, mask: Mask, p: &Sheared<S>, q: &Sheared<S>) -> Sheared<S> {
    [s.select(mask, p[0], q[0]), s.select(mask, p[1], q[1]), s.select(mask, p[2], q[2])]
}

/// Intersects rays with spheres in front of them (`geometry::intersect_sphere`): the near side, or the far side from
/// inside.
///
/// - `to_center`: from the origin of the ray.
/// - `inv_dir_squared`: `1 / (dir · dir)`.
#[inline(always)]
pub(super) fn sphere_hits<S: KernelSimd>(
    s: S,
    lanes: Mask,
    to_center: &[S::D; 3],
    radius_squared: S::D,
    dir: &[S::D; 3],
    inv_dir_squared: S::D,
) -> LaneHits<S> {
    let t_middle = s.mul_d(dot(s, to_center, dir), inv_dir_squared);
    let perpendicular = [
        s.sub_d(to_center[0], s.mul_d(dir[0], t_middle)),
        s.sub_d(to_center[1], s.mul_d(dir[1], t_middle)),
        s.sub_d(to_center[2], s.mul_d(dir[2], t_middle)),
    ];
    let discriminant = s.sub_d(radius_squared, dot(s, &perpendicular, &perpendicular));
    let mask = lanes & s.le_d(s.splat_d(0.0), discriminant);
    if mask == 0 {
        return LaneHits::none(s);
    }
    let half_chord = s.sqrt_d(s.mul_d(discriminant, inv_dir_squared));
    let near = s.narrow(s.sub_d(t_middle, half_chord));
    let far = s.narrow(s.add_d(t_middle, half_chord));
    let zero = s.splat(0.0);
    LaneHits { mask, t: s.select(s.lt(zero, near), near, far), u: zero, v: zero }
}

#[inline(always)]
pub(super) fn dot<S: KernelSimd>(s: S, a: &[S::D; 3], b: &[S::D; 3]) -> S::D {
    s.add_d(s.add_d(s.mul_d(a[0], b[0]), s.mul_d(a[1], b[1])), s.mul_d(a[2], b[2]))
}

/// The edge functions and corners of sixteen triangles in memory.
struct TinyEdges {
    edges: [[f32; LANES]; 3],
    corners: [[[f32; LANES]; 2]; 3],
}

impl TinyEdges {
    #[inline(always)]
    fn new<S: KernelSimd>(s: S, edges: &[S::F; 3], corners: [&Sheared<S>; 3]) -> Self {
        let mut stored = Self { edges: [[0.0; LANES]; 3], corners: [[[0.0; LANES]; 2]; 3] };
        for k in 0..3 {
            s.store(edges[k], &mut stored.edges[k]);
            s.store(corners[k][0], &mut stored.corners[k][0]);
            s.store(corners[k][1], &mut stored.corners[k][1]);
        }
        stored
    }

    /// Repeats the test for the lanes of `tiny` in `f64`; returns the lanes that still hit, including all lanes outside
    /// `tiny`.
    #[cold]
    #[inline(never)]
    fn resolve(&mut self, tiny: Mask) -> Mask {
        let mut hit = Mask::MAX;
        for lane in (0..LANES).filter(|lane| tiny >> lane & 1 != 0) {
            match tiny_edges(self.corners.map(|[x, y]| [x[lane], y[lane]])) {
                Some(again) => (0..3).for_each(|k| self.edges[k][lane] = again[k]),
                None => hit &= !(1 << lane),
            }
        }
        hit
    }

    #[inline(always)]
    fn edges<S: KernelSimd>(&self, s: S) -> [S::F; 3] {
        [s.load(&self.edges[0]), s.load(&self.edges[1]), s.load(&self.edges[2])]
    }
}

/// Transforms origins and directions into an object's space.
#[inline(always)]
pub(super) fn to_own_space<S: KernelSimd>(s: S, map: &Affine3A, origin: &[S::F; 3], dir: &[S::F; 3]) -> [[S::F; 3]; 2] {
    let turned = transform(s, map, origin);
    let origin = [
        s.add(turned[0], s.splat(map.translation[0])),
        s.add(turned[1], s.splat(map.translation[1])),
        s.add(turned[2], s.splat(map.translation[2])),
    ];
    [origin, transform(s, map, dir)]
}

/// Like `scene_tree::transform_vector`, with the same roundings.
#[inline(always)]
fn transform<S: KernelSimd>(s: S, map: &Affine3A, v: &[S::F; 3]) -> [S::F; 3] {
    [transform_row(s, map, 0, v), transform_row(s, map, 1, v), transform_row(s, map, 2, v)]
}

#[inline(always)]
fn transform_row<S: KernelSimd>(s: S, map: &Affine3A, row: usize, v: &[S::F; 3]) -> S::F {
    let x = s.mul(s.splat(map.matrix3.x_axis[row]), v[0]);
    let y = s.mul(s.splat(map.matrix3.y_axis[row]), v[1]);
    let z = s.mul(s.splat(map.matrix3.z_axis[row]), v[2]);
    s.add(s.add(x, y), z)
}
