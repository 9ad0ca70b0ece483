//! Conversion of a mesh to the simplifiers' form: welded vertices, their kinds, quadrics and wedges.

use super::quadric::Quadric;
use super::surface::{Kind, Wedge};
use crate::{Mesh, Welding};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// A mesh in the simplifiers' form. Vertices are welded positions; seams are represented by wedges.
#[derive(Clone, Debug)]
pub(super) struct PreparedMesh {
    /// Relative to the mesh's centre, times `scale`.
    pub positions: Vec<Vec3>,
    pub kinds: Vec<Kind>,
    pub quadrics: Vec<Quadric>,
    /// Three different vertices each; triangles that used one twice, or all of an earlier triangle, are removed.
    pub triangles: Vec<[u32; 3]>,
    /// Index of each triangle in the original mesh.
    pub sources: Vec<u32>,
    /// One per corner, or empty if the mesh has neither shading data nor slots.
    pub corner_wedges: Vec<u32>,
    pub wedges: Vec<Wedge>,
    /// A power of two, so that scaling is exact; it makes the largest side of the bounds lie between 1 and 2.
    pub scale: f32,
}

/// Triangles at a vertex up to which linear search is used.
const MAX_LINEAR: usize = 32;

impl PreparedMesh {
    /// Prepares a mesh.
    ///
    /// - `with_quadrics`: false leaves the quadrics empty.
    pub fn of(mesh: &Mesh, with_quadrics: bool) -> Self {
        let size = mesh.bounds().size().max_element();
        let scale = if size.is_normal() { size.log2().floor().exp2().recip() } else { 1.0 };
        let welding = Welding::of(&mesh.positions);
        let positions: Vec<Vec3> =
            welding.first.par_iter().map(|&vertex| mesh.positions[vertex as usize] * scale).collect();
        let mut triangles: Vec<[u32; 3]> = mesh.triangles.par_iter().map(|&t| welding.places(t)).collect();
        let mut sources: Vec<u32> = (0..triangles.len() as u32).collect();
        let is_triangle = |[a, b, c]: [u32; 3]| a != b && b != c && c != a;
        if !triangles.par_iter().all(|&t| is_triangle(t)) {
            sources.retain(|&t| is_triangle(triangles[t as usize]));
            triangles.retain(|&t| is_triangle(t));
        }
        let mut prepared = Self {
            positions,
            kinds: Vec::new(),
            quadrics: Vec::new(),
            triangles,
            sources,
            corner_wedges: Vec::new(),
            wedges: Vec::new(),
            scale,
        };
        prepared.add_wedges(mesh);
        let mut around = Neighborhood::of(&prepared.triangles, prepared.positions.len());
        let (mut kinds, has_duplicates) = prepared.find_kinds(&around);
        if has_duplicates && prepared.drop_duplicates() {
            around = Neighborhood::of(&prepared.triangles, prepared.positions.len());
            kinds = prepared.find_kinds(&around).0;
        }
        prepared.kinds = kinds;
        if with_quadrics {
            prepared.quadrics = prepared.find_quadrics(&around);
        }
        prepared
    }

    /// Number of triangles at each vertex.
    pub fn valences(&self) -> Vec<u32> {
        let mut valences = vec![0; self.positions.len()];
        self.triangles.as_flattened().iter().for_each(|&vertex| valences[vertex as usize] += 1);
        valences
    }

    /// Adds wedges. A wedge is a vertex of the mesh; with slots, a vertex in combination with one slot.
    fn add_wedges(&mut self, mesh: &Mesh) {
        if mesh.normals.is_empty() && mesh.uvs.is_empty() && mesh.slots.is_empty() {
            return;
        }
        let wedge_of = |vertex: u32| Wedge {
            normal: mesh.normals.get(vertex as usize).copied().unwrap_or(Vec3::ZERO),
            uv: mesh.uvs.get(vertex as usize).copied().unwrap_or_default(),
        };
        if mesh.slots.is_empty() {
            self.wedges = (0..mesh.positions.len() as u32).into_par_iter().map(wedge_of).collect();
            self.corner_wedges = self.sources.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
            return;
        }
        let mut known: HashMap<(u32, u16), u32> = HashMap::new();
        for &t in &self.sources {
            let slot = mesh.slots[t as usize];
            for vertex in mesh.triangles[t as usize] {
                let wedge = *known.entry((vertex, slot)).or_insert_with(|| {
                    self.wedges.push(wedge_of(vertex));
                    self.wedges.len() as u32 - 1
                });
                self.corner_wedges.push(wedge);
            }
        }
    }

    /// Returns the kind of each vertex, and whether any triangle is duplicated.
    fn find_kinds(&self, around: &Neighborhood) -> (Vec<Kind>, bool) {
        let found: Vec<(Kind, bool)> = (0..self.positions.len())
            .into_par_iter()
            .map_init(Default::default, |memory, vertex| self.kind_of(around.corners(vertex), memory))
            .collect();
        let has_duplicates = found.par_iter().any(|f| f.1);
        (found.into_iter().map(|f| f.0).collect(), has_duplicates)
    }

    /// Returns the kind of one vertex, and whether two of its triangles coincide.
    ///
    /// - `memory`: working memory.
    fn kind_of(&self, corners: &[u32], (spokes, pairs): &mut (Vec<Spoke>, Vec<[u32; 2]>)) -> (Kind, bool) {
        if self.is_inside(corners) {
            return (Kind::Free, false);
        }
        spokes.clear();
        pairs.clear();
        for &corner in corners {
            let [next, after] = ring(corner);
            let [p, q] = [next, after].map(|c| self.triangles[c as usize / 3][c as usize % 3]);
            pairs.push([p.min(q), p.max(q)]);
            for (other, leaves) in [(next, true), (after, false)] {
                let vertex = self.triangles[other as usize / 3][other as usize % 3];
                let wedges = if self.corner_wedges.is_empty() {
                    [0; 2]
                } else {
                    [corner, other].map(|c| self.corner_wedges[c as usize])
                };
                spokes.push(Spoke { vertex, leaves, wedges });
            }
        }
        spokes.sort_unstable();
        pairs.sort_unstable();
        let has_duplicates = pairs.windows(2).any(|pair| pair[0] == pair[1]);
        let (mut lines, mut faulty) = (0, false);
        for edge in spokes.chunk_by(|p, q| p.vertex == q.vertex) {
            match edge {
                [p, q] if p.leaves != q.leaves => lines += usize::from(p.wedges != q.wedges),
                [_] => lines += 1,
                _ => faulty = true,
            }
        }
        let kind = match lines {
            _ if faulty => Kind::Fixed,
            0 => Kind::Free,
            2 => Kind::Curve,
            _ => Kind::Fixed,
        };
        (kind, has_duplicates)
    }

    /// Whether the corners form one or more closed fans without a seam, none of them a triangle and its back: a fast
    /// path for by far the most common case.
    fn is_inside(&self, corners: &[u32]) -> bool {
        const MAX: usize = 16;
        let count = corners.len();
        if count > MAX {
            return false;
        }
        let (mut next, mut after) = ([0; MAX], [0; MAX]);
        for (i, &corner) in corners.iter().enumerate() {
            let triangle = &self.triangles[corner as usize / 3];
            let k = corner as usize % 3;
            (next[i], after[i]) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
        }
        let times = |list: &[u32; MAX], vertex: u32| list[..count].iter().filter(|&&v| v == vertex).count();
        let has_back = |i: usize| (0..count).any(|k| after[k] == next[i] && next[k] == after[i]);
        (0..count).all(|i| times(&next, next[i]) == 1 && times(&after, next[i]) == 1 && !has_back(i))
            && (self.corner_wedges.is_empty() || self.has_one_wedge_an_edge(corners, &next, &after))
    }

    /// For corners of a closed fan: whether both triangles at each edge have the same wedges.
    fn has_one_wedge_an_edge(&self, corners: &[u32], next: &[u32], after: &[u32]) -> bool {
        // A vertex that only removed triangles used has no corners.
        let Some(&first) = corners.first() else { return true };
        let here = self.corner_wedges[first as usize];
        corners.iter().enumerate().all(|(i, &corner)| {
            let partner = after.iter().position(|&v| v == next[i]).unwrap_or(i);
            let ends = [ring(corner)[0], ring(corners[partner])[1]].map(|c| self.corner_wedges[c as usize]);
            self.corner_wedges[corner as usize] == here && ends[0] == ends[1]
        })
    }

    /// Removes triangles on the same three vertices as an earlier one; returns whether any were found.
    fn drop_duplicates(&mut self) -> bool {
        let mut keys: Vec<([u32; 3], u32)> = self
            .triangles
            .iter()
            .zip(0..)
            .map(|(&triangle, t)| {
                let mut key = triangle;
                key.sort_unstable();
                (key, t)
            })
            .collect();
        keys.par_sort_unstable();
        let mut keep = vec![true; self.triangles.len()];
        for pair in keys.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            keep[pair[1].1 as usize] = false;
        }
        let count = self.triangles.len();
        let retain = |t: &mut usize| {
            *t += 1;
            keep[*t - 1]
        };
        let (mut t, mut s, mut c) = (0, 0, 0);
        self.triangles.retain(|_| retain(&mut t));
        self.sources.retain(|_| retain(&mut s));
        self.corner_wedges.retain(|_| {
            c += 1;
            keep[(c - 1) / 3]
        });
        self.triangles.len() < count
    }

    /// Sums the planes of the triangles around each vertex, and at borders and seams planes perpendicular to the
    /// surface through the edge.
    fn find_quadrics(&self, around: &Neighborhood) -> Vec<Quadric> {
        let normals: Vec<(DVec3, f64)> = self
            .triangles
            .par_iter()
            .map(|triangle| {
                let normal = self.doubled_area_normal(triangle);
                let length = normal.length();
                (normal / length.max(f64::MIN_POSITIVE), length)
            })
            .collect();
        (0..self.positions.len())
            .into_par_iter()
            .map(|vertex| {
                let here = self.positions[vertex].as_dvec3();
                let mut sum = Quadric::default();
                for &corner in around.corners(vertex) {
                    let (normal, doubled_area) = normals[corner as usize / 3];
                    sum += Quadric::of_plane(here, normal, doubled_area / 6.0);
                }
                if self.kinds[vertex] != Kind::Free {
                    self.add_edge_planes(around, vertex, &normals, &mut sum);
                }
                sum
            })
            .collect()
    }

    /// Adds line constraints: for each triangle side at `vertex` that ends at another vertex on a line, and is itself a
    /// border or seam, the triangle's plane and the plane perpendicular to it through the side.
    fn add_edge_planes(&self, around: &Neighborhood, vertex: usize, normals: &[(DVec3, f64)], sum: &mut Quadric) {
        let here = self.positions[vertex].as_dvec3();
        // Searching for each side among all others would take quadratic time at a hub.
        let sides = (around.corners(vertex).len() > MAX_LINEAR).then(|| self.sorted_sides(around.corners(vertex)));
        let is_line = |corner: u32, other: u32| match &sides {
            Some(sides) => self.is_line_among(sides, corner, other),
            None => self.is_line(around, corner, other),
        };
        for &corner in around.corners(vertex) {
            for other in ring(corner) {
                let end = self.triangles[other as usize / 3][other as usize % 3];
                if self.kinds[end as usize] == Kind::Free || !is_line(corner, other) {
                    continue;
                }
                let along = self.positions[end as usize].as_dvec3() - here;
                let face_normal = normals[corner as usize / 3].0;
                if let Some(normal) = along.cross(face_normal).try_normalize() {
                    // Both planes through the edge get equal weights, so that the distance to its line counts and
                    // neither side is preferred. The weight is large, because a moving border is visible against the
                    // background.
                    let weight = 10.0 * along.length_squared();
                    *sum += Quadric::of_plane(here, normal, weight);
                    *sum += Quadric::of_plane(here, face_normal, weight);
                }
            }
        }
    }

    /// Whether the side from `corner` to `other` (corners of one triangle) is a border, a seam or non-manifold.
    fn is_line(&self, around: &Neighborhood, corner: u32, other: u32) -> bool {
        let vertex_of = |c: u32| self.triangles[c as usize / 3][c as usize % 3];
        let end = vertex_of(other);
        let mut matching = 0;
        for &c in around.corners(vertex_of(corner) as usize) {
            for o in ring(c).into_iter().filter(|&o| vertex_of(o) == end) {
                let same = self.corner_wedges.is_empty()
                    || [(c, corner), (o, other)]
                        .iter()
                        .all(|&(p, q)| self.corner_wedges[p as usize] == self.corner_wedges[q as usize]);
                matching += if same { 1 } else { 3 };
            }
        }
        matching != 2
    }

    /// Returns the sides of triangles at the vertex of these corners: the other end, and the wedges at both.
    fn sorted_sides(&self, corners: &[u32]) -> Vec<(u32, [u32; 2])> {
        let pairs = corners.iter().flat_map(|&corner| ring(corner).map(|other| (corner, other)));
        let mut sides: Vec<_> = pairs.map(|(corner, other)| self.side(corner, other)).collect();
        sides.sort_unstable();
        sides
    }

    fn side(&self, corner: u32, other: u32) -> (u32, [u32; 2]) {
        let end = self.triangles[other as usize / 3][other as usize % 3];
        (end, [corner, other].map(|c| self.corner_wedges.get(c as usize).copied().unwrap_or(0)))
    }

    /// Like [`Self::is_line`], by a search in the result of [`Self::sorted_sides`].
    fn is_line_among(&self, sides: &[(u32, [u32; 2])], corner: u32, other: u32) -> bool {
        let side = self.side(corner, other);
        let first = sides.partition_point(|s| s.0 < side.0);
        // Exactly two equal sides, and none that differs.
        let [a, b] = [first, first + 1].map(|i| sides.get(i) == Some(&side));
        let more = sides.get(first + 2).is_some_and(|s| s.0 == side.0);
        !(a && b && !more)
    }

    fn doubled_area_normal(&self, triangle: &[u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize].as_dvec3());
        (b - a).cross(c - a)
    }
}

/// One end of a triangle side, as seen from its vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Spoke {
    vertex: u32,
    /// Whether the triangle runs along the side away from the vertex.
    leaves: bool,
    wedges: [u32; 2],
}

/// Returns the other two corners of a corner's triangle, in order.
fn ring(corner: u32) -> [u32; 2] {
    let (base, k) = (corner - corner % 3, corner % 3);
    [base + (k + 1) % 3, base + (k + 2) % 3]
}

/// The corners at each vertex, in order.
struct Neighborhood {
    start: Vec<u32>,
    corners: Vec<u32>,
}

impl Neighborhood {
    fn of(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let flat = triangles.as_flattened();
        let mut start = vec![0_u32; vertices + 1];
        flat.iter().for_each(|&vertex| start[vertex as usize + 1] += 1);
        for i in 0..vertices {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut corners = vec![0; flat.len()];
        for (corner, &vertex) in flat.iter().enumerate() {
            corners[next[vertex as usize] as usize] = corner as u32;
            next[vertex as usize] += 1;
        }
        Self { start, corners }
    }

    fn corners(&self, vertex: usize) -> &[u32] {
        &self.corners[self.start[vertex] as usize..self.start[vertex + 1] as usize]
    }
}
