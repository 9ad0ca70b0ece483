//! Watertight ray-triangle test: a ray that crosses a closed mesh cannot slip through an edge or a vertex.
//!
//! The triangle is translated to the ray's origin and sheared so that the ray runs along +z; three edge functions in
//! the plane remain. Each vertex is rounded to a point that depends on the ray and the vertex alone, and the *signs* of
//! the edge functions over these points are exact. So both triangles at an edge agree about the side on which the ray
//! passes, however thin they are (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection").
//!
//! The *values* are accurate to a few roundings as well (Kahan's difference of products), so `t` is the depth of a true
//! point of the rounded triangle, not a quotient of two cancelled sums. The kd-tree relies on that: every tree over the
//! same triangles, and brute force over them, finds the same bits (see `kdtree::ray`).
//!
//! Start reading at [`intersect_triangle`].

use super::robust::difference_of_products;
use glam::Vec3;

/// The part of the test that depends on the ray's direction only.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Axis along which the direction is longest: 0, 1 or 2.
    pub kz: usize,
    /// The axis after `kz`, cyclically.
    pub kx: usize,
    /// The axis after `kx`, cyclically.
    pub ky: usize,
    /// `dir[kx] / dir[kz]`.
    pub sx: f32,
    /// `dir[ky] / dir[kz]`.
    pub sy: f32,
    /// `1 / dir[kz]`.
    pub sz: f32,
}

impl Shear {
    /// Prepares the test for a direction.
    ///
    /// - `dir`: any length but 0.
    #[inline]
    pub fn new(dir: Vec3) -> Self {
        let size = dir.abs();
        // Ties go to the first axis: every implementation must make the same choice.
        let kz = if size.x >= size.y && size.x >= size.z { 0 } else { 2 - usize::from(size.y >= size.z) };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        Self { kz, kx, ky, sx: dir[kx] / dir[kz], sy: dir[ky] / dir[kz], sz: 1.0 / dir[kz] }
    }
}

/// Intersection of a ray with a triangle: `t` in lengths of the direction, `u` and `v` the weights of vertices 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance from the origin in lengths of the direction, of either sign.
    pub t: f32,
    /// Barycentric weight of vertex 1.
    pub u: f32,
    /// Barycentric weight of vertex 2.
    pub v: f32,
}

/// Threshold below which an edge function has lost bits to underflow and the test is repeated in `f64`.
pub const TINY_EDGE: f32 = f32::MIN_POSITIVE * (1u64 << 60) as f32;

/// Intersects the line `origin + t · dir` with a triangle, from either side, with any sign of `t`.
///
/// A triangle without area is never hit, nor is one seen exactly edge-on.
#[inline]
pub fn intersect_triangle(origin: Vec3, shear: &Shear, vertices: &[Vec3; 3]) -> Option<TriangleHit> {
    let &Shear { kz, kx, ky, sx, sy, sz } = shear;
    let [a, b, c] = vertices.map(|vertex| vertex - origin);
    let (ax, ay) = (a[kx] - sx * a[kz], a[ky] - sy * a[kz]);
    let (bx, by) = (b[kx] - sx * b[kz], b[ky] - sy * b[kz]);
    let (cx, cy) = (c[kx] - sx * c[kz], c[ky] - sy * c[kz]);

    // Rounding is monotonic, so a plain difference never has the wrong sign; it can only be 0 by mistake.
    if mixed_signs(cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax) {
        return None;
    }
    let mut edges = [
        difference_of_products(cx, by, cy, bx),
        difference_of_products(ax, cy, ay, cx),
        difference_of_products(bx, ay, by, ax),
    ];
    if edges.iter().any(|edge| edge.abs() < TINY_EDGE) {
        edges = tiny_edges([[ax, ay], [bx, by], [cx, cy]])?;
    }
    let [e0, e1, e2] = edges;
    if mixed_signs(e0, e1, e2) {
        return None;
    }
    let inv = 1.0 / (e0 + e1 + e2);
    let (w, u, v) = (e0 * inv, e1 * inv, e2 * inv);
    let t = (w * a[kz] + u * b[kz] + v * c[kz]) * sz;
    // An area of zero makes `inv` infinite and `t` NaN or infinite.
    t.is_finite().then_some(TriangleHit { t, u, v })
}

#[inline]
fn mixed_signs(a: f32, b: f32, c: f32) -> bool {
    (a < 0.0 || b < 0.0 || c < 0.0) && (a > 0.0 || b > 0.0 || c > 0.0)
}

/// The three edge functions in `f64`, where products of two `f32` are exact, scaled so that the largest is ±1.
/// `None` if the ray misses.
#[cold]
pub fn tiny_edges([[ax, ay], [bx, by], [cx, cy]]: [[f32; 2]; 3]) -> Option<[f32; 3]> {
    let edge = |px: f32, qy: f32, py: f32, qx: f32| f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx);
    let edges = [edge(cx, by, cy, bx), edge(ax, cy, ay, cx), edge(bx, ay, by, ax)];
    let largest = edges.iter().fold(0.0, |largest: f64, edge| largest.max(edge.abs()));
    let mixed = edges.iter().any(|&edge| edge < 0.0) && edges.iter().any(|&edge| edge > 0.0);
    // Only the ratios are used from here on.
    (!mixed && largest > 0.0).then(|| edges.map(|edge| (edge / largest) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, vec3};
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        // Small integers hit edges, vertices and planes; the others cover the general case.
        let whole = (-3i8..=3, -3i8..=3, -3i8..=3).prop_map(|(x, y, z)| vec3(x.into(), y.into(), z.into()));
        let any = (-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0).prop_map(|(x, y, z)| vec3(x, y, z));
        prop_oneof![whole, any]
    }

    /// Distance from the line to the point of the triangle given by the hit's coordinates.
    fn distance_from_line(origin: Vec3, dir: Vec3, vertices: &[Vec3; 3], hit: TriangleHit) -> f64 {
        let [a, b, c] = vertices.map(Vec3::as_dvec3);
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let on_triangle = a + u * (b - a) + v * (c - a);
        let on_ray = origin.as_dvec3() + f64::from(hit.t) * dir.as_dvec3();
        (on_triangle - on_ray).length()
    }

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(20_000))]

        #[test]
        fn hit_lies_on_the_ray_and_on_the_triangle(a in point(), b in point(), c in point(), o in point(), d in point()) {
            prop_assume!(d != Vec3::ZERO);
            if let Some(hit) = intersect_triangle(o, &Shear::new(d), &[a, b, c]) {
                prop_assert!(hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v < 1.0 + 1e-6);
                prop_assert!(distance_from_line(o, d, &[a, b, c], hit) < 4e-6, "{hit:?}");
            }
        }

        #[test]
        fn agrees_with_a_volume_test_in_f64(a in point(), b in point(), c in point(), o in point(), d in point()) {
            let [a64, b64, c64, d64] = [a - o, b - o, c - o, d].map(Vec3::as_dvec3);
            let [u, v, w] = [(b64, c64), (c64, a64), (a64, b64)].map(|(p, q): (DVec3, DVec3)| p.cross(q).dot(d64));
            prop_assume!(d != Vec3::ZERO && u.abs().min(v.abs()).min(w.abs()) > 1e-4);
            let inside = (u > 0.0) == (v > 0.0) && (v > 0.0) == (w > 0.0);
            prop_assert_eq!(intersect_triangle(o, &Shear::new(d), &[a, b, c]).is_some(), inside);
        }

        #[test]
        fn no_ray_slips_through_a_shared_edge_or_vertex(
            hub in point(), o in point(), along in 0.0f32..1.0, spoke in 0usize..5, exponent in -90i32..60,
        ) {
            // A fan of five triangles closed around its hub; rays aim at the hub and at the edges that meet there.
            let scale = 2.0f32.powi(exponent);
            let rim: Vec<Vec3> = (0..5).map(|k| {
                let angle = k as f32 * std::f32::consts::TAU / 5.0;
                (hub + vec3(angle.cos(), angle.sin(), 0.1 * (k % 2) as f32)) * scale
            }).collect();
            let (hub, o) = (hub * scale, (o + vec3(0.0, 0.0, 9.0)) * scale);
            let dir = hub + (rim[spoke] - hub) * (along * 0.99) - o;
            let shear = Shear::new(dir);
            prop_assert!((0..5).any(|k| intersect_triangle(o, &shear, &[hub, rim[k], rim[(k + 1) % 5]]).is_some()));
        }
    }

    #[test]
    fn needles_keep_their_depth() {
        // 10^6 times longer than wide, tilted: a quotient of cancelled sums would be off by a tenth of its length.
        let vertices = [vec3(0.0, 0.0, 5.0), vec3(1.0, 1e-6, 6.0), vec3(1.0, 3e-6, 6.0)];
        for k in 1..100 {
            let x = k as f32 / 100.0;
            let ray_origin = vec3(x, 2e-6 * x, 0.0);
            if let Some(hit) = intersect_triangle(ray_origin, &Shear::new(Vec3::Z), &vertices) {
                assert!((hit.t - (5.0 + x)).abs() < 2e-6, "{hit:?} at {x}");
            }
        }
    }

    #[test]
    fn degenerate_triangles_and_edge_on_views_are_misses() {
        let flat = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X];
        let point = [Vec3::ONE; 3];
        let edge_on = [vec3(0.0, 0.0, 1.0), vec3(0.0, 1.0, 1.0), vec3(0.0, 0.0, 2.0)];
        for dir in [Vec3::Z, -Vec3::Z, vec3(-0.0, 0.0, 1.0), vec3(0.0, 0.1, 1.0)] {
            let shear = Shear::new(dir);
            for (triangle, origin) in
                [(flat, vec3(0.5, 0.0, -1.0)), (point, vec3(1.0, 1.0, 0.0)), (edge_on, Vec3::ZERO)]
            {
                assert_eq!(intersect_triangle(origin, &shear, &triangle), None);
            }
        }
    }
}
