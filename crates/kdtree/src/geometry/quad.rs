//! Watertight ray-parallelogram test: two triangles that share a diagonal.
//!
//! A direct solution for `u` and `v` would be cheaper, but close to edge-on its depth is not that of a point near the
//! ray, on which the kd-tree relies (see [`super::Shear`]).

use super::triangle::{Shear, TriangleHit, intersect_triangle};
use glam::Vec3;

/// Returns the four corners in order around the parallelogram: `u v` = 00, 10, 11, 01.
///
/// Quads that meet at an edge are watertight when these rounded corners are equal.
#[inline]
pub fn quad_corners(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> [Vec3; 4] {
    [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v]
}

/// Intersects the line `origin + t · dir` with a quad, from either side, with any sign of `t`; `u` and `v` are in 0..1
/// along the edges.
#[inline]
pub fn intersect_quad(origin: Vec3, shear: &Shear, &[a, b, c, d]: &[Vec3; 4]) -> Option<TriangleHit> {
    // The weights of the corners 10 and 11, or of 11 and 01, are combined into coordinates.
    let first =
        || intersect_triangle(origin, shear, &[a, b, c]).map(|hit| TriangleHit { u: (hit.u + hit.v).min(1.0), ..hit });
    let second =
        || intersect_triangle(origin, shear, &[a, c, d]).map(|hit| TriangleHit { v: (hit.u + hit.v).min(1.0), ..hit });
    first().or_else(second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        (-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0).prop_map(|(x, y, z)| vec3(x, y, z))
    }

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(20_000))]

        #[test]
        fn hit_is_the_point_that_its_coordinates_name(
            corner in vector(), eu in vector(), ev in vector(), u in 0.0f32..1.0, v in 0.0f32..1.0, o in vector(),
        ) {
            prop_assume!(eu.cross(ev).length() > 0.1 && (eu.cross(ev).dot(corner - o)).abs() > 0.1);
            let dir = corner + u * eu + v * ev - o;
            let hit = intersect_quad(o, &Shear::new(dir), &quad_corners(corner, eu, ev));
            // At the boundary, rounding may decide either way.
            prop_assume!(u.min(v).min(1.0 - u).min(1.0 - v) > 1e-4);
            let hit = hit.expect("aimed at the inside");
            let [u64, v64, t64] = [hit.u, hit.v, hit.t].map(f64::from);
            let on_quad = corner.as_dvec3() + u64 * eu.as_dvec3() + v64 * ev.as_dvec3();
            let on_ray = o.as_dvec3() + t64 * dir.as_dvec3();
            prop_assert!((on_quad - on_ray).length() < 2e-5, "{hit:?} for {u} {v}");
        }
    }

    #[test]
    fn no_ray_slips_through_the_seams_of_a_box() {
        let (o, s) = (vec3(-1.0, -1.0, -1.0), 2.0);
        let (x, y, z) = (Vec3::X * s, Vec3::Y * s, Vec3::Z * s);
        let walls = [(o, x, y), (o + z, x, y), (o, y, z), (o + x, y, z), (o, z, x), (o + y, z, x)];
        let walls = walls.map(|(corner, u, v)| quad_corners(corner, u, v));
        for i in 0..4000 {
            let (a, b) = ((i % 67) as f32 / 66.0, (i / 67) as f32 / 66.0);
            let origin = vec3(0.3 * a, -0.2 * b, 0.1);
            // Along the twelve edges and into the eight corners.
            for target in
                [vec3(1.0, 1.0, 2.0 * a - 1.0), vec3(-1.0, 2.0 * b - 1.0, 1.0), vec3(2.0 * a - 1.0, -1.0, -1.0)]
            {
                let shear = Shear::new(target - origin);
                let mut hits = walls.iter().filter_map(|wall| intersect_quad(origin, &shear, wall));
                assert!(hits.any(|hit| hit.t > 0.0), "leak from {origin} to {target}");
            }
        }
    }
}
