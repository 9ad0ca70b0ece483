//! Procedural meshes: equal parameters give equal meshes, bit for bit on one build target.
//!
//! They have no normals: call [`Mesh::with_smooth_normals`] or leave them flat. [`serpent_knot`] and
//! [`displaced_sphere`] are meant as main subjects of images; the others are plain shapes and kernel benchmarks.

mod bench;
pub mod noise;
mod serpent;
mod shapes;
mod spheres;
mod terrain;

pub use bench::{blob_in_bowl, room, slivers};
pub use serpent::{SerpentKnot, serpent_knot};
pub use shapes::{bored_block, cube, cube_of, cuboid, torus};
pub use spheres::{DisplacedSphere, displaced_sphere, icosphere};
pub use terrain::{Terrain, terrain};

use super::Mesh;
use glam::DVec3;

/// Creates a mesh from data of this folder: a failure is a bug here.
fn built(positions: &[DVec3], triangles: Vec<[u32; 3]>) -> Mesh {
    match Mesh::from_f64(positions, triangles) {
        Ok(mesh) => mesh,
        Err(error) => panic!("a procedural mesh is not valid: {error}"),
    }
}

/// Triangles of a grid of `nu` × `nv` cells that closes on itself in both directions; vertex (i, j) is `i * nv + j`.
///
/// The front is where (∂/∂i) × (∂/∂j) points.
fn closed_grid(nu: u32, nv: u32) -> Vec<[u32; 3]> {
    let vertex = |i: u32, j: u32| (i % nu) * nv + j % nv;
    (0..nu).flat_map(|i| (0..nv).flat_map(move |j| cell(vertex, i, j))).collect()
}

/// Triangles of a grid of `nu` × `nv` cells with `(nu + 1) × (nv + 1)` vertices; vertex (i, j) is `i * (nv + 1) + j`.
///
/// The front is where (∂/∂i) × (∂/∂j) points.
fn open_grid(nu: u32, nv: u32) -> Vec<[u32; 3]> {
    let vertex = move |i: u32, j: u32| i * (nv + 1) + j;
    (0..nu).flat_map(|i| (0..nv).flat_map(move |j| cell(vertex, i, j))).collect()
}

/// Splits a grid cell into two triangles. The diagonals alternate, so that no direction is preferred.
fn cell(vertex: impl Fn(u32, u32) -> u32, i: u32, j: u32) -> [[u32; 3]; 2] {
    let (a, b, c, d) = (vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
    if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}
