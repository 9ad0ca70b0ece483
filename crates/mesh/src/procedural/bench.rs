//! Meshes that are difficult for a kd-tree, for benchmarks and stress tests.

use super::noise::lattice_unit;
use super::{DisplacedSphere, Terrain, built, cuboid, displaced_sphere, terrain};
use crate::Mesh;
use glam::{DVec3, dvec3};

/// A dense blob of 101,920 triangles in a bowl 200 times its size of 11,250 triangles: detail where few rays go.
pub fn blob_in_bowl() -> Mesh {
    let blob = displaced_sphere(&DisplacedSphere { frequency: 71, ..DisplacedSphere::default() });
    let cells: u32 = 75;
    let bowl = terrain(&Terrain { cells, size: 400.0, height: 4.0, mountains: 3.0, seed: 7 });
    let mut parts = BenchParts::default();
    parts.add(&blob, |p| p + dvec3(0.0, 4.0, 0.0));
    parts.add(&bowl, |p| p + dvec3(0.0, 60.0 * (p.x * p.x + p.z * p.z) / 8e4, 0.0));
    parts.finish()
}

/// A closed room of 20 × 6 × 12 metres that faces inwards, with two rows of six columns and nine blobs: 230 k
/// triangles, and every ray from inside hits something.
pub fn room() -> Mesh {
    let mut parts = BenchParts::default();
    let mut walls = cuboid(dvec3(20.0, 6.0, 12.0));
    walls.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    parts.add(&walls, |p| p);
    for i in 0..12_u32 {
        let (x, z) = (f64::from(i % 6) * 3.2 - 8.0, if i < 6 { -3.5 } else { 3.5 });
        // Slightly shorter than the room, so that no two parts touch.
        parts.add(&column(48, 8), |p| p * dvec3(1.0, 2.99, 1.0) + dvec3(x, 0.0, z));
    }
    for i in 0..9_u32 {
        let shape = DisplacedSphere { frequency: 35, seed: 10 + i, ..DisplacedSphere::default() };
        let place = dvec3(f64::from(i) * 2.0 - 8.0, -1.9, if i % 2 == 0 { -0.9 } else { 0.9 });
        parts.add(&displaced_sphere(&shape), |p| 0.7 * p + place);
    }
    parts.finish()
}

/// `count` triangles in a cube of side 2, each about 1000 times as long as wide, in all directions.
pub fn slivers(count: u32, seed: u32) -> Mesh {
    let unit = |i: u32, k: u32| 2.0 * lattice_unit([i, k, 0], seed) - 1.0;
    let point = |i: u32, k: u32| DVec3::new(unit(i, k), unit(i, k + 1), unit(i, k + 2));
    let mut positions = Vec::with_capacity(count as usize * 3);
    for i in 0..count {
        let start = 0.8 * point(i, 0);
        let along = 0.4 * point(i, 3);
        let across = along.cross(point(i, 6)).normalize_or(DVec3::X) * along.length() * 1e-3;
        positions.extend([start, start + along, start + along * 0.5 + across]);
    }
    built(&positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A closed fluted column of half height 1 about the y axis, `sides × (2 · rings + 2)` triangles.
fn column(sides: u32, rings: u32) -> Mesh {
    let mut positions = vec![-DVec3::Y, DVec3::Y];
    for ring in 0..=rings {
        for side in 0..sides {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(side) / f64::from(sides)).sin_cos();
            let radius = 0.45 - 0.04 * f64::from(side % 4 / 2) - 0.02 * f64::from(ring) / f64::from(rings);
            positions.push(dvec3(radius * sin, 2.0 * f64::from(ring) / f64::from(rings) - 1.0, radius * cos));
        }
    }
    let vertex = |ring: u32, side: u32| 2 + ring * sides + side % sides;
    let mut triangles = Vec::new();
    for side in 0..sides {
        triangles.push([0, vertex(0, side + 1), vertex(0, side)]);
        triangles.push([1, vertex(rings, side), vertex(rings, side + 1)]);
        for ring in 0..rings {
            let (a, b) = (vertex(ring, side), vertex(ring, side + 1));
            let (c, d) = (vertex(ring + 1, side + 1), vertex(ring + 1, side));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    built(&positions, triangles)
}

#[derive(Default)]
struct BenchParts {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl BenchParts {
    fn add(&mut self, mesh: &Mesh, place: impl Fn(DVec3) -> DVec3) {
        let base = self.positions.len() as u32;
        self.positions.extend(mesh.positions.iter().map(|p| place(p.as_dvec3() + mesh.center)));
        self.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + base)));
    }

    fn finish(self) -> Mesh {
        built(&self.positions, self.triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Topology;

    #[test]
    fn the_room_is_closed_and_faces_inwards() {
        let mesh = room();
        let topology = Topology::of(&mesh);
        assert!(topology.is_closed() && topology.is_manifold(), "{topology:?}");
        assert_eq!(topology.pieces, 22);
        assert!((225_000..240_000).contains(&topology.triangles), "{}", topology.triangles);
        assert!(mesh.signed_volume() < -1000.0, "the walls must face inwards: {}", mesh.signed_volume());
        let blobs: f64 = mesh.signed_volume() + 20.0 * 6.0 * 12.0;
        assert!(blobs > 0.0, "columns and blobs must face outwards");
    }

    #[test]
    fn slivers_are_thin_but_not_flat() {
        let mesh = slivers(2000, 1);
        for t in 0..mesh.triangles.len() {
            let [a, b, _] = mesh.corners(t);
            let ratio = mesh.doubled_area_normal(t).length() / f64::from(a.distance_squared(b));
            assert!((0.9e-3..1.1e-3).contains(&ratio), "triangle {t}: height over length {ratio}");
        }
    }

    #[test]
    fn the_bowl_dwarfs_the_blob() {
        let mesh = blob_in_bowl();
        assert!((110_000..115_000).contains(&mesh.triangles.len()));
        assert!(mesh.bounds().size().x > 190.0 * 2.0);
    }
}
