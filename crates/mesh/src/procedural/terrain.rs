//! Height-field terrain over a square.

use super::noise::{fractal_noise, ridged_noise};
use super::{built, open_grid};
use crate::Mesh;
use glam::{DVec3, Vec2, dvec3};

/// A landscape over a square about the origin, y up; see [`terrain`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terrain {
    /// Cells along a side: `2 · cells²` triangles.
    pub cells: u32,
    /// Side of the square, metres.
    pub size: f64,
    /// Approximate height between the valleys and the highest crests, metres.
    pub height: f64,
    /// Approximate number of mountains along a side.
    pub mountains: f64,
    /// Seed of the noise that shapes mountains and ground.
    pub seed: u32,
}

impl Default for Terrain {
    /// 204,800 triangles.
    fn default() -> Self {
        Self { cells: 320, size: 10.0, height: 1.6, mountains: 4.0, seed: 1 }
    }
}

/// Builds ridged mountains over rolling ground, with texture coordinates 0..1 along x and −z.
///
/// # Panics
/// If there are no cells.
pub fn terrain(shape: &Terrain) -> Mesh {
    assert!(shape.cells >= 1, "a terrain needs at least one cell");
    let n = f64::from(shape.cells);
    let mut positions = Vec::new();
    let mut uvs = Vec::new();
    for i in 0..=shape.cells {
        for j in 0..=shape.cells {
            let (u, v) = (f64::from(i) / n, f64::from(j) / n);
            // The offset keeps the lattice planes of the noise, where it is zero, off the ground plane.
            let at = DVec3::new(u, 0.0, v) * shape.mountains + dvec3(0.0, 0.37, 0.0);
            // A slight domain warp breaks up the straight valleys of gradient noise.
            let bend = dvec3(fractal_noise(at, 3, shape.seed ^ 0x68bc), 0.0, fractal_noise(at, 3, shape.seed ^ 0x02e5));
            let ridges = ridged_noise(at + 0.35 * bend, 8, shape.seed);
            let plain = 0.5 + 0.5 * fractal_noise(at * 0.5, 4, shape.seed ^ 0xb529);
            let height = shape.height * (ridges * ridges * (0.35 + 0.65 * plain) + 0.15 * plain);
            positions.push(dvec3((u - 0.5) * shape.size, height, (v - 0.5) * shape.size));
            uvs.push(Vec2::new(u as f32, 1.0 - v as f32));
        }
    }
    // The grid's own front faces down: x × z is −y.
    let triangles = open_grid(shape.cells, shape.cells).into_iter().map(|[a, b, c]| [a, c, b]).collect();
    Mesh { uvs, ..built(&positions, triangles) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Topology;

    #[test]
    fn every_triangle_faces_up_and_the_border_is_a_square() {
        let mesh = terrain(&Terrain { cells: 40, ..Terrain::default() });
        assert!((0..mesh.triangles.len()).all(|t| mesh.doubled_area_normal(t).y > 0.0));
        let topology = Topology::of(&mesh);
        assert_eq!((topology.boundary_edges, topology.pieces, topology.triangles), (160, 1, 3200));
        mesh.validate().unwrap();
    }
}
