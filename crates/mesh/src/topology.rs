//! Topology of a mesh: counts of edges, borders, pieces and defects.

use super::faults::{Faults, distinct};
use super::{Mesh, Welding};

/// Counts over the mesh with vertices at equal positions welded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Distinct positions that triangles use.
    pub vertices: usize,
    /// Vertices that no triangle uses.
    pub loose_vertices: usize,
    /// Triangles, including degenerate ones and duplicates.
    pub triangles: usize,
    /// Distinct pairs of positions that are sides of triangles with three different corners.
    pub edges: usize,
    /// Edges of exactly one triangle.
    pub boundary_edges: usize,
    /// Edges of three or more triangles.
    pub non_manifold_edges: usize,
    /// Edges of two triangles that run along it in the same direction, so that one of them faces the wrong way.
    pub misoriented_edges: usize,
    /// Vertices where two fans of triangles touch.
    pub non_manifold_vertices: usize,
    /// Triangles without area, except duplicates: corners at one position or collinear.
    pub degenerate_triangles: usize,
    /// Triangles on the same three distinct positions as an earlier one, of either orientation.
    pub duplicate_triangles: usize,
    /// Pieces connected over edges or vertices.
    pub pieces: usize,
}

impl Topology {
    /// Analyses a mesh that passes [`Mesh::validate`].
    pub fn of(mesh: &Mesh) -> Self {
        let welding = Welding::of(&mesh.positions);
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|&t| welding.places(t)).collect();
        let faults = Faults::in_places(mesh, &triangles);
        let mut counts = Self {
            triangles: triangles.len(),
            loose_vertices: loose_vertices(mesh),
            degenerate_triangles: faults.collapsed + faults.flat,
            duplicate_triangles: faults.duplicates,
            ..Self::default()
        };
        counts.count_edges(&triangles);
        counts.count_vertices(&triangles, welding.len());
        counts
    }

    /// Whether each edge has exactly two triangles with consistent orientation.
    pub fn is_closed(&self) -> bool {
        self.triangles > 0 && self.boundary_edges + self.non_manifold_edges + self.misoriented_edges == 0
    }

    /// Whether each edge has one or two triangles and each vertex one fan.
    pub fn is_manifold(&self) -> bool {
        self.non_manifold_edges + self.non_manifold_vertices == 0
    }

    /// Handles and tunnels of a closed manifold, summed over its pieces (Euler's formula).
    pub fn genus(&self) -> i64 {
        self.pieces as i64 - (self.vertices as i64 - self.edges as i64 + self.triangles as i64) / 2
    }

    fn count_edges(&mut self, triangles: &[[u32; 3]]) {
        // One entry per edge and triangle: the edge, and whether the triangle runs from its lower end to its higher.
        let mut sides: Vec<(u32, u32, bool)> = triangles
            .iter()
            .filter(|t| distinct(t))
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(from, to)| (from.min(to), from.max(to), from < to))
            .collect();
        sides.sort_unstable();
        for side in sides.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            self.edges += 1;
            match side {
                [_] => self.boundary_edges += 1,
                [p, q] => self.misoriented_edges += usize::from(p.2 == q.2),
                _ => self.non_manifold_edges += 1,
            }
        }
    }

    fn count_vertices(&mut self, triangles: &[[u32; 3]], places: usize) {
        // Fans at a vertex: its corners, connected if they share an edge that ends there.
        let mut spokes: Vec<(u32, u32, u32)> = Vec::with_capacity(triangles.len() * 6);
        for (t, &[a, b, c]) in triangles.iter().enumerate().filter(|(_, t)| distinct(t)) {
            for (corner, (at, others)) in [(a, [b, c]), (b, [c, a]), (c, [a, b])].into_iter().enumerate() {
                spokes.extend(others.map(|other| (at, other, (3 * t + corner) as u32)));
            }
        }
        spokes.sort_unstable();
        let mut corner_sets = DisjointSets::new(triangles.len() * 3);
        for spoke in spokes.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            spoke.windows(2).for_each(|pair| corner_sets.join(pair[0].2, pair[1].2));
        }
        let mut place_sets = DisjointSets::new(places);
        for &[a, b, c] in triangles {
            place_sets.join(a, b);
            place_sets.join(b, c);
        }
        let mut used = vec![false; places];
        triangles.iter().flatten().for_each(|&place| used[place as usize] = true);
        self.vertices = used.iter().filter(|&&u| u).count();
        self.pieces = (0..places as u32).filter(|&p| used[p as usize] && place_sets.find(p) == p).count();
        for around in spokes.chunk_by(|p, q| p.0 == q.0) {
            let fan = corner_sets.find(around[0].2);
            self.non_manifold_vertices += usize::from(around.iter().any(|s| corner_sets.find(s.2) != fan));
        }
    }
}

fn loose_vertices(mesh: &Mesh) -> usize {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
    used.iter().filter(|&&u| !u).count()
}

/// Union–find with path halving; the smaller index is the root, so that results do not depend on the order of joins.
pub(super) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    pub(super) fn new(len: usize) -> Self {
        Self { parent: (0..len as u32).collect() }
    }

    pub(super) fn find(&mut self, mut item: u32) -> u32 {
        while self.parent[item as usize] != item {
            let above = self.parent[self.parent[item as usize] as usize];
            self.parent[item as usize] = above;
            item = above;
        }
        item
    }

    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};

    fn mesh(points: &[DVec3], triangles: &[[u32; 3]]) -> Mesh {
        Mesh::from_f64(points, triangles.to_vec()).unwrap()
    }

    #[test]
    fn a_tetrahedron_is_closed_and_one_with_a_turned_face_is_not() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let good = Topology::of(&mesh(&points, &faces));
        assert!(good.is_closed() && good.is_manifold());
        assert_eq!((good.vertices, good.edges, good.pieces, good.genus()), (4, 6, 1, 0));
        let turned = Topology::of(&mesh(&points, &[faces[0], faces[1], faces[2], [0, 2, 3]]));
        assert_eq!(turned.misoriented_edges, 3);
        let open = Topology::of(&mesh(&points, &faces[..3]));
        assert_eq!((open.boundary_edges, open.is_closed()), (3, false));
    }

    #[test]
    fn faults_are_counted() {
        let points =
            [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, dvec3(2.0, 0.0, 0.0), DVec3::ONE];
        // Three triangles at one edge, one of them duplicated, one without area, one touching at a vertex.
        let found = Topology::of(&mesh(&points, &[[0, 1, 2], [1, 0, 3], [0, 1, 5], [0, 5, 1], [0, 1, 6], [4, 5, 0]]));
        assert_eq!(found.duplicate_triangles, 1);
        assert_eq!(found.degenerate_triangles, 1);
        assert_eq!(found.loose_vertices, 1);
        assert!(found.non_manifold_edges >= 1, "{found:?}");
        let touching = Topology::of(&mesh(&points, &[[0, 1, 2], [0, 4, 5]]));
        assert_eq!((touching.non_manifold_vertices, touching.pieces), (1, 1));
    }
}
