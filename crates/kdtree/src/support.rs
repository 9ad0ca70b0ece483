//! Tight bounds of placed objects: an object that is rotated fills a small part of the box around its rotated box.
//!
//! The extent of an object along a direction is its support function, which is sublinear: along a sum of directions it
//! is at most the sum of the extents along each. So a table over a grid of directions bounds the extent along any
//! direction between them: too much by at most 2 % of the radius of a sphere, and 18 % of that of a needle or a plate,
//! whose extent has a kink. Each axis of the world is one direction in the object's own space.

use crate::geometry::Aabb;
use crate::geometry::robust::{UNIT_ROUNDOFF, gamma};
use glam::{Affine3A, Vec3};

/// Cells along a side of the grid: directions are points on the three faces of the cube `[-1, 1]³` with a coordinate 1.
const CELLS: usize = 8;

/// Grid points of a face.
const POINTS: usize = (CELLS + 1) * (CELLS + 1);

/// The extents of an object along a grid of directions.
#[derive(Debug)]
pub(super) struct Support {
    /// The smallest and the largest `d · p` over the object's points `p`, for each direction `d` of the grid.
    ranges: Vec<[f64; 2]>,
}

/// A sphere; a point has the radius 0.
type Ball = (Vec3, f32);

impl Support {
    /// - `balls`: they or their convex hull contain the object.
    pub fn of(balls: impl Iterator<Item = Ball>) -> Self {
        let directions: Vec<[Vec3; LANES]> = directions().chunks(LANES).map(padded).collect();
        let mut ranges = vec![[[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]]; directions.len()];
        let lengths: Vec<[f32; LANES]> = directions.iter().map(|lanes| lanes.map(Vec3::length)).collect();
        let coordinates: Vec<[[f32; LANES]; 3]> =
            directions.iter().map(|lanes| [0, 1, 2].map(|axis| lanes.map(|d| d[axis]))).collect();
        let mut largest = 0.0f32;
        for (center, radius) in balls {
            largest = largest.max(center.abs().max_element() + radius);
            for (([x, y, z], length), [least, most]) in coordinates.iter().zip(&lengths).zip(&mut ranges) {
                for lane in 0..LANES {
                    let along = x[lane] * center.x + y[lane] * center.y + z[lane] * center.z;
                    let reach = radius * length[lane];
                    least[lane] = least[lane].min(along - reach);
                    most[lane] = most[lane].max(along + reach);
                }
            }
        }
        // Each of four terms is at most `largest` times the square root of 3.
        let rounding = f64::from(7.0 * gamma(5) * largest);
        let range = |[least, most]: [[f32; LANES]; 2]| {
            (0..LANES).map(move |k| [f64::from(least[k]) - rounding, f64::from(most[k]) + rounding])
        };
        Self { ranges: ranges.into_iter().flat_map(range).collect() }
    }

    /// Returns the bounds of the object after a transform, as exact values rounded outwards.
    pub fn bounds(&self, map: &Affine3A) -> Aabb {
        let rows = [map.matrix3.row(0), map.matrix3.row(1), map.matrix3.row(2)];
        let mut bounds = Aabb::EMPTY;
        for (axis, row) in rows.into_iter().enumerate() {
            let [least, most] = self.range(row.into()).map(|along| along + f64::from(map.translation[axis]));
            let rounding = f64::from(UNIT_ROUNDOFF) * least.abs().max(most.abs());
            (bounds.min[axis], bounds.max[axis]) = ((least - rounding) as f32, (most + rounding) as f32);
        }
        bounds
    }

    /// Bounds `d · p` over all points `p` of the object.
    fn range(&self, d: Vec3) -> [f64; 2] {
        let d = d.as_dvec3();
        let face =
            if d.x.abs() >= d.y.abs() && d.x.abs() >= d.z.abs() { 0 } else { 2 - usize::from(d.y.abs() >= d.z.abs()) };
        let scale = d[face];
        if scale == 0.0 {
            return [0.0; 2];
        }
        let cell = |x: f64| {
            let x = (x / scale + 1.0) * (CELLS / 2) as f64;
            let whole = x.floor().clamp(0.0, (CELLS - 1) as f64);
            (whole as usize, (x - whole).clamp(0.0, 1.0))
        };
        let ((i, u), (j, v)) = (cell(d[(face + 1) % 3]), cell(d[(face + 2) % 3]));
        // The triangle of the cell that the direction lies in.
        let (corner, weight) = if u + v <= 1.0 { ([i, j], 1.0 - u - v) } else { ([i + 1, j + 1], u + v - 1.0) };
        let (along_u, along_v) = if u + v <= 1.0 { (u, v) } else { (1.0 - v, 1.0 - u) };
        let parts = [(corner, weight), ([i + 1, j], along_u), ([i, j + 1], along_v)];
        let range = parts.into_iter().fold([0.0; 2], |[least, most], ([i, j], weight)| {
            let [a, b] = self.ranges[face * POINTS + i * (CELLS + 1) + j];
            [least + weight * a, most + weight * b]
        });
        let [least, most] = range.map(|along| along * scale);
        if scale > 0.0 { [least, most] } else { [most, least] }
    }
}

/// Directions that are computed together.
const LANES: usize = 16;

/// The directions of the grid, by face and row.
fn directions() -> Vec<Vec3> {
    let at = |k: usize| k as f32 / (CELLS / 2) as f32 - 1.0;
    let all = (0..3 * POINTS).map(|index| {
        let (face, i, j) = (index / POINTS, index % POINTS / (CELLS + 1), index % (CELLS + 1));
        let mut d = Vec3::ONE;
        (d[(face + 1) % 3], d[(face + 2) % 3]) = (at(i), at(j));
        d
    });
    all.collect()
}

fn padded(directions: &[Vec3]) -> [Vec3; LANES] {
    let mut all = [Vec3::ZERO; LANES];
    all[..directions.len()].copy_from_slice(directions);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::transform_point;
    use glam::{Mat3A, Quat, vec3};

    /// Maps with rotations, mirroring, shear, and rows along the axes and the edges of the cube.
    fn maps() -> Vec<Affine3A> {
        let turned = (0..300).map(|i| {
            let turn = Quat::from_rotation_x(0.37 * i as f32) * Quat::from_rotation_z(1.1 * i as f32);
            let scale = vec3(0.1 + 0.1 * i as f32, [1.0, -2.0][i % 2], 0.7);
            Affine3A::from_scale_rotation_translation(scale, turn, vec3(3.0, i as f32, -0.1))
        });
        let rows = [vec3(1.0, 1.0, 1.0), vec3(-1.0, 1.0, 0.0), vec3(0.0, -0.25, 1.0)];
        let shears = (0..3).map(|k| {
            let [a, b, c] = [rows[k], rows[(k + 1) % 3], rows[(k + 2) % 3]];
            Affine3A::from_mat3(Mat3A::from_cols(a.into(), b.into(), c.into()).transpose().into())
        });
        turned.chain(shears).chain([Affine3A::IDENTITY]).collect()
    }

    /// - `tolerance`: excess that is allowed, in radii of the object.
    fn check(balls: &[Ball], tolerance: f32) {
        let own = balls
            .iter()
            .fold(Aabb::EMPTY, |all, (center, radius)| all.grown_by(*center - *radius).grown_by(*center + *radius));
        let (radius, largest) = (0.5 * own.size().length(), own.min.abs().max(own.max.abs()).max_element());
        let support = Support::of(balls.iter().copied());
        for map in maps() {
            let bounds = support.bounds(&map);
            let rows = [map.matrix3.row(0), map.matrix3.row(1), map.matrix3.row(2)].map(Vec3::from);
            let reach = Vec3::from(rows.map(|row| row.length()));
            let exact = balls.iter().fold(Aabb::EMPTY, |all, (center, radius)| {
                let center = transform_point(&map, *center);
                all.grown_by(center - reach * *radius).grown_by(center + reach * *radius)
            });
            let tiny = 1e-6 * Vec3::from(map.translation.abs()) + 1e-6 * largest * reach;
            assert!((bounds.min - tiny).cmple(exact.min).all() && exact.max.cmple(bounds.max + tiny).all());
            let excess = (exact.min - bounds.min).max(bounds.max - exact.max);
            assert!(excess.cmple(reach * (tolerance * radius) + tiny * 9.0).all(), "{excess} {exact:?}");
        }
    }

    #[test]
    fn bounds_hold_all_points_and_are_tight() {
        let wire: Vec<Ball> = (0..500)
            .map(|i| (vec3((0.13 * i as f32).sin(), 0.01 * i as f32 - 2.0, (0.3 * i as f32).cos() * 0.1), 0.0))
            .collect();
        check(&wire, 0.18);
        check(&wire[..1], 0.0);
        check(&[(vec3(-1.0, 0.5, 2.0), 0.0), (vec3(1.0, 0.2, -1.0), 0.0)], 0.18);
        check(&[(Vec3::ZERO, 1.0)], 0.02);
        check(&[(vec3(0.3, -2.0, 0.1), 0.5), (vec3(7.0, 0.0, 0.0), 0.25)], 0.18);
    }
}
