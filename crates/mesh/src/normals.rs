//! Shading normals computed from the geometry alone.
//!
//! A shading normal is a weighted sum of the normals of the triangles around a vertex. Vertices at equal positions
//! count as one ([`Welding`]), so a seam of duplicated vertices is invisible; a crease angle keeps hard edges hard.

use super::topology::DisjointSets;
use super::{Mesh, Welding};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The weight of each triangle in the normal of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalWeight {
    /// The triangle's area: cheap, and the most common choice.
    Area,
    /// The triangle's angle at the vertex: independent of the triangulation of the same faces (Thürmer and Wüthrich
    /// 1998).
    #[default]
    Angle,
}

/// Edges of more triangles than this are never smooth; this bounds the work on hostile meshes.
const MAX_TRIANGLES_AT_EDGE: usize = 16;

impl Mesh {
    /// Removes the shading normals, so that each triangle has its own normal.
    pub fn flat(mut self) -> Self {
        self.normals.clear();
        self
    }

    /// Computes area-weighted normals per stored vertex, without welding: the sum of the triangles' unnormalised
    /// normals, as the 2013 program and the neutral reference format define `smooth`.
    pub fn with_vertex_normals(self) -> Self {
        self.with_normals_of_vertices(|vertex| vertex)
    }

    /// Like [`with_vertex_normals`](Self::with_vertex_normals), for stored vertices that are copies of fewer original
    /// ones: `origin` maps a stored vertex to its original, whose index is no larger than that of the last stored
    /// vertex.
    pub fn with_normals_of_vertices(mut self, origin: impl Fn(u32) -> u32) -> Self {
        let n = self.positions.len();
        let n_origins = (0..n as u32).map(&origin).max().map_or(0, |last| last as usize + 1);
        let mut sums = vec![DVec3::ZERO; n_origins];
        for (t, corners) in self.triangles.iter().enumerate() {
            let normal = self.doubled_area_normal(t);
            corners.iter().for_each(|&vertex| sums[origin(vertex) as usize] += normal);
        }
        self.normals = (0..n as u32).map(|vertex| unit_or(sums[origin(vertex) as usize], DVec3::Z)).collect();
        self
    }

    /// Computes normals that are smooth across every edge whose triangles meet at an angle of at most `crease_angle`.
    ///
    /// - `crease_angle`: radians between the normals of two neighbours, `[0, π]`; `None` smooths everything.
    ///
    /// A crease duplicates its vertices, one copy per side, after all others; existing vertices keep their indices.
    /// Triangles without area neither contribute to a normal nor connect their neighbours. A vertex with no other
    /// triangles gets an arbitrary unit vector, so that no normal is ever NaN.
    pub fn with_smooth_normals(mut self, weight: NormalWeight, crease_angle: Option<f32>) -> Self {
        let welding = Welding::of(&self.positions);
        let face_normals: Vec<DVec3> =
            (0..self.triangles.len()).into_par_iter().map(|t| self.doubled_area_normal(t)).collect();
        let corner_weights = |t: usize| corner_weights(&self, t, weight);
        match crease_angle {
            None => {
                let mut sums = vec![DVec3::ZERO; welding.len()];
                for (t, &corners) in self.triangles.iter().enumerate() {
                    let unit = face_normals[t].normalize_or_zero();
                    for (place, weight) in welding.places(corners).into_iter().zip(corner_weights(t)) {
                        sums[place as usize] += weight * unit;
                    }
                }
                let normals: Vec<Vec3> = sums.par_iter().map(|&sum| unit_or(sum, DVec3::Z)).collect();
                self.normals = welding.place.iter().map(|&place| normals[place as usize]).collect();
            }
            Some(angle) => {
                let groups = smooth_groups(&self.triangles, &welding, &face_normals, f64::from(angle));
                let mut sums = vec![DVec3::ZERO; groups.len()];
                for t in 0..self.triangles.len() {
                    let unit = face_normals[t].normalize_or_zero();
                    for (k, weight) in corner_weights(t).into_iter().enumerate() {
                        sums[groups[3 * t + k] as usize] += weight * unit;
                    }
                }
                self.normals.clear();
                let normal = |group: &Option<u32>| {
                    group.map_or(Vec3::Z, |group| {
                        // A group has the number of its first corner.
                        let fallback = unit_or(face_normals[group as usize / 3], DVec3::Z).as_dvec3();
                        unit_or(sums[group as usize], fallback)
                    })
                };
                self.normals = self.split_by(&groups).iter().map(normal).collect();
            }
        }
        self
    }
}

/// Returns the group of each corner of each triangle: corners at one position whose triangles are connected across
/// edges that end there and bend by at most `crease_angle`. A group is identified by its first corner.
fn smooth_groups(triangles: &[[u32; 3]], welding: &Welding, normals: &[DVec3], crease_angle: f64) -> Vec<u32> {
    // Per triangle side: the two positions, and the corner at each of them.
    let mut sides: Vec<(u32, u32, u32, u32)> = Vec::with_capacity(triangles.len() * 3);
    for (t, &corners) in triangles.iter().enumerate() {
        let places = welding.places(corners);
        for k in 0..3 {
            let (from, to) = (places[k], places[(k + 1) % 3]);
            let (at_from, at_to) = ((3 * t + k) as u32, (3 * t + (k + 1) % 3) as u32);
            if from < to {
                sides.push((from, to, at_from, at_to));
            } else {
                sides.push((to, from, at_to, at_from));
            }
        }
    }
    sides.par_sort_unstable();
    // Rounding of two unit normals may raise the angle of a flat edge slightly above zero.
    let min_cos = crease_angle.cos() - 4.0 * f64::EPSILON;
    let mut sets = DisjointSets::new(triangles.len() * 3);
    let unit: Vec<DVec3> = normals.par_iter().map(|n| n.normalize_or_zero()).collect();
    for edge in sides.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
        if edge.len() > MAX_TRIANGLES_AT_EDGE || edge[0].0 == edge[0].1 {
            continue;
        }
        for (i, p) in edge.iter().enumerate() {
            for q in &edge[i + 1..] {
                let (n, m) = (unit[p.2 as usize / 3], unit[q.2 as usize / 3]);
                if n != DVec3::ZERO && m != DVec3::ZERO && n.dot(m) >= min_cos {
                    sets.join(p.2, q.2);
                    sets.join(p.3, q.3);
                }
            }
        }
    }
    (0..triangles.len() as u32 * 3).map(|corner| sets.find(corner)).collect()
}

fn corner_weights(mesh: &Mesh, triangle: usize, weight: NormalWeight) -> [f64; 3] {
    match weight {
        NormalWeight::Area => [mesh.doubled_area_normal(triangle).length(); 3],
        NormalWeight::Angle => {
            let p = mesh.corners(triangle).map(|p| p.as_dvec3());
            [0, 1, 2].map(|k| angle_between(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]))
        }
    }
}

/// Angle in radians; accurate for needles too, where the arc cosine loses half the digits.
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

fn unit_or(sum: DVec3, fallback: DVec3) -> Vec3 {
    sum.try_normalize().unwrap_or(fallback).as_vec3().normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural;
    use glam::dvec3;

    /// Two unit squares that share an edge (the y axis) and meet at `bend` radians; the edge's vertices are duplicated.
    fn book(bend: f64) -> Mesh {
        let (s, c) = bend.sin_cos();
        let points = [
            dvec3(-1.0, 0.0, 0.0),
            dvec3(0.0, 0.0, 0.0),
            dvec3(0.0, 1.0, 0.0),
            dvec3(-1.0, 1.0, 0.0),
            dvec3(0.0, 0.0, 0.0),
            dvec3(c, 0.0, -s),
            dvec3(c, 1.0, -s),
            dvec3(0.0, 1.0, 0.0),
        ];
        Mesh::from_f64(&points, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap()
    }

    #[test]
    fn doubled_vertices_are_smoothed_as_one() {
        for weight in [NormalWeight::Area, NormalWeight::Angle] {
            let mesh = book(0.5).with_smooth_normals(weight, None);
            assert_eq!(mesh.normals[1], mesh.normals[4]);
            assert!((mesh.normals[0] - Vec3::Z).length() < 1e-6);
            mesh.validate().unwrap();
        }
        let apart = book(0.5).with_vertex_normals();
        assert!((apart.normals[1] - Vec3::Z).length() < 1e-6, "kept apart by definition");
    }

    #[test]
    fn a_crease_is_hard_above_its_angle_and_smooth_below() {
        for (bend, crease, smooth) in [(0.5, 0.6, true), (0.5, 0.4, false), (0.0, 0.0, true)] {
            let mesh = book(bend).with_smooth_normals(NormalWeight::Angle, Some(crease));
            assert_eq!(mesh.normals[1] == mesh.normals[4], smooth, "bend {bend}, crease {crease}");
            mesh.validate().unwrap();
        }
    }

    #[test]
    fn a_cube_with_a_crease_has_flat_faces_and_without_one_points_to_its_corners() {
        let cube = procedural::cuboid(DVec3::ONE);
        let shape = |mesh: &Mesh| -> Vec<[Vec3; 3]> { (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect() };
        let hard = cube.clone().with_smooth_normals(NormalWeight::Angle, Some(1.0));
        assert_eq!(hard.positions.len(), 24);
        assert_eq!(shape(&hard), shape(&cube));
        for (t, corners) in hard.triangles.iter().enumerate() {
            let own = hard.doubled_area_normal(t).normalize().as_vec3();
            assert!(corners.iter().all(|&v| (hard.normals[v as usize] - own).length() < 1e-6));
        }
        let soft = cube.with_smooth_normals(NormalWeight::Angle, None);
        for (p, n) in soft.positions.iter().zip(&soft.normals) {
            assert!((p.normalize() - n).length() < 1e-6, "angle weights do not see the diagonals: {p} {n}");
        }
    }

    #[test]
    fn flat_triangles_and_loose_vertices_get_finite_normals() {
        let points = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let mesh = Mesh::from_f64(&points, vec![[0, 1, 2], [0, 1, 3], [1, 0, 3], [4, 4, 4]]).unwrap();
        for crease in [None, Some(0.5)] {
            for weight in [NormalWeight::Area, NormalWeight::Angle] {
                mesh.clone().with_smooth_normals(weight, crease).validate().unwrap();
            }
        }
        mesh.with_vertex_normals().validate().unwrap();
    }

    #[test]
    fn normals_of_a_fine_sphere_are_its_radii_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let mut mesh = procedural::icosphere(24);
            mesh.positions.iter_mut().for_each(|p| *p *= scale as f32);
            let smooth = mesh.with_smooth_normals(NormalWeight::Angle, Some(1.0));
            for (p, n) in smooth.positions.iter().zip(&smooth.normals) {
                assert!((p.normalize() - n).length() < 2e-3, "scale {scale}: {p} {n}");
            }
        }
    }
}
