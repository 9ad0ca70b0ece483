//! Triangulated spheres, smooth and displaced.

use super::built;
use super::noise::{fractal_noise, ridged_noise};
use crate::Mesh;
use glam::{DVec3, dvec3};
use std::collections::HashMap;

/// A unit sphere: each face of an icosahedron subdivided into `frequency`² triangles, so `20 · frequency²` in all.
pub fn icosphere(frequency: u32) -> Mesh {
    let (positions, triangles) = sphere_grid(frequency);
    built(&positions, triangles)
}

/// A sphere with hills of several scales; see [`displaced_sphere`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacedSphere {
    /// `20 · frequency²` triangles.
    pub frequency: u32,
    /// Height of the largest hills relative to the radius, `[0, 0.5]`.
    pub amplitude: f64,
    /// Approximate number of hills across the radius.
    pub hills: f64,
    /// 0: rounded hills; 1: sharp ridges.
    pub ridged: f64,
    /// Seed of the noise that displaces the surface.
    pub seed: u32,
}

impl Default for DisplacedSphere {
    /// 200,000 triangles.
    fn default() -> Self {
        Self { frequency: 100, amplitude: 0.25, hills: 1.6, ridged: 0.5, seed: 1 }
    }
}

/// A sphere of mean radius about 1, displaced radially by noise; star-shaped, so it never intersects itself.
pub fn displaced_sphere(shape: &DisplacedSphere) -> Mesh {
    let (mut positions, triangles) = sphere_grid(shape.frequency);
    for p in &mut positions {
        let at = *p * shape.hills;
        let rounded = fractal_noise(at, 6, shape.seed);
        let sharp = 2.0 * ridged_noise(at, 6, shape.seed ^ 0x5bd1) - 1.0;
        *p *= 1.0 + shape.amplitude * (rounded + shape.ridged.clamp(0.0, 1.0) * (sharp - rounded));
    }
    built(&positions, triangles)
}

/// Returns points on the unit sphere, shared between faces, and their outward-facing triangles.
fn sphere_grid(frequency: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    assert!(frequency >= 1, "a sphere needs a frequency of at least 1");
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let corners: Vec<DVec3> = [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)]
        .into_iter()
        .flat_map(|(a, b)| [dvec3(0.0, a, b), dvec3(a, b, 0.0), dvec3(b, 0.0, a)])
        .collect();
    let mut positions: Vec<DVec3> = corners.iter().map(|c| c.normalize()).collect();
    let mut on_edge: HashMap<(u32, u32, u32), u32> = HashMap::new();
    let mut triangles = Vec::with_capacity(20 * (frequency * frequency) as usize);
    for [a, b, c] in icosahedron_faces(&corners) {
        let mut vertex = |i: u32, j: u32| -> u32 {
            // Weights of the three corners; a vertex on an edge is shared, so its key is that edge.
            let parts = [(a, frequency - i - j), (b, i), (c, j)];
            let mut used: Vec<(u32, u32)> = parts.into_iter().filter(|&(_, weight)| weight > 0).collect();
            used.sort_unstable();
            // The sum uses the sorted order too, so that both faces at an edge compute the same bits.
            let sum: DVec3 = used.iter().map(|&(k, weight)| f64::from(weight) * corners[k as usize]).sum();
            let mut push = || {
                positions.push(sum.normalize());
                positions.len() as u32 - 1
            };
            match used[..] {
                [(corner, _)] => corner,
                [(p, weight), (q, _)] => *on_edge.entry((p, q, weight)).or_insert_with(push),
                _ => push(),
            }
        };
        let rows: Vec<Vec<u32>> =
            (0..=frequency).map(|i| (0..=frequency - i).map(|j| vertex(i, j)).collect()).collect();
        for i in 0..frequency as usize {
            for j in 0..frequency as usize - i {
                triangles.push([rows[i][j], rows[i + 1][j], rows[i][j + 1]]);
                if i + j + 1 < frequency as usize {
                    triangles.push([rows[i + 1][j], rows[i + 1][j + 1], rows[i][j + 1]]);
                }
            }
        }
    }
    (positions, triangles)
}

/// Returns all triples of corners at edge length from each other, facing outwards.
fn icosahedron_faces(corners: &[DVec3]) -> Vec<[u32; 3]> {
    let near = |i: usize, j: usize| corners[i].distance(corners[j]) < 2.1;
    let mut faces = Vec::with_capacity(20);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let outwards = corners[i].dot(corners[j].cross(corners[k])) > 0.0;
                    faces.push(if outwards { [i, j, k] } else { [i, k, j] }.map(|v| v as u32));
                }
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Topology;
    use std::f64::consts::PI;

    #[test]
    fn icospheres_are_closed_at_every_frequency_and_near_the_sphere() {
        for frequency in [1, 2, 3, 7, 40] {
            let mesh = icosphere(frequency);
            let topology = Topology::of(&mesh);
            assert!(topology.is_closed() && topology.is_manifold() && topology.loose_vertices == 0);
            assert_eq!(topology.triangles as u32, 20 * frequency * frequency);
            assert_eq!((topology.genus(), topology.vertices), (0, mesh.positions.len()));
        }
        assert!((icosphere(40).signed_volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn a_displaced_sphere_is_closed_star_shaped_and_depends_on_its_seed() {
        let shape = DisplacedSphere { frequency: 30, amplitude: 0.5, ..DisplacedSphere::default() };
        let mesh = displaced_sphere(&shape);
        let topology = Topology::of(&mesh);
        assert!(topology.is_closed() && topology.is_manifold() && topology.degenerate_triangles == 0);
        for t in 0..mesh.triangles.len() {
            let from_origin = mesh.corners(t)[0].as_dvec3() + mesh.center;
            assert!(mesh.doubled_area_normal(t).dot(from_origin) > 0.0, "triangle {t} turns its back");
        }
        assert_eq!(mesh, displaced_sphere(&shape));
        assert_ne!(mesh, displaced_sphere(&DisplacedSphere { seed: 2, ..shape }));
    }
}
