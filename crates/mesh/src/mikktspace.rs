//! MikkTSpace tangents of triangles, computed in parallel.
//!
//! Vertices with the same position, normal and texture coordinate are one. The corners around such a vertex form a fan;
//! neighbours across its edges whose texture has the same orientation form a group, and a group has one tangent: the
//! sum of the directions of its triangles, weighted by their angles. So almost everything depends on one fan only, and
//! fans are independent. Only triangles without a direction of their own, whose texture coordinates have no area, get
//! their orientation from the first group that reaches them; groups at their vertices are found one after the other.
//!
//! Source: Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", and its program `mikktspace.c` as of 2020. The
//! arithmetic is that of the program, so that normal maps made with it fit; the tests compare with the crate
//! `bevy_mikktspace`, a translation of it. No search is quadratic and nothing recurses, whatever the mesh.

use super::Mesh;
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::hash::{Hash, Hasher};

/// No corner, or no group.
const NONE: u32 = u32::MAX;

/// Number of fans that are one task.
const FANS_PER_TASK: usize = 1 << 12;

/// Groups with more triangles are never split by opposite directions.
const MOST_COMPARED: usize = 64;

/// What the texture coordinates of a triangle say about it.
#[derive(Clone, Copy, Default)]
struct CornerTriangle {
    /// Unit direction in which u grows.
    s: Vec3,
    /// Unit direction in which v grows.
    t: Vec3,
    /// Whether the texture is not mirrored.
    preserves: bool,
    /// Two corners at the same position.
    is_degenerate: bool,
    /// Without a direction of its own: part of any group.
    fits_any: bool,
}

/// Returns the tangent of each corner, three per triangle: direction, and the sign of the bitangent. The sign is 0
/// where there is none, because no triangle nearby has a direction.
///
/// - `mesh`: valid, with normals and texture coordinates.
pub(super) fn corner_tangents(mesh: &Mesh) -> Vec<Vec4> {
    let vertex_of = welded(mesh);
    let mut fans = Fans::new(mesh, &vertex_of);
    let shared = fans.groups_around_undirected();
    let mut of_slots = vec![Vec4::ZERO; fans.corners.len()];
    let mut tasks = Vec::new();
    let mut rest = &mut of_slots[..];
    for first in (0..fans.n_vertices()).step_by(FANS_PER_TASK) {
        let last = (first + FANS_PER_TASK).min(fans.n_vertices());
        let (of_task, others) = rest.split_at_mut((fans.starts[last] - fans.starts[first]) as usize);
        tasks.push((first..last, of_task));
        rest = others;
    }
    tasks.into_par_iter().for_each(|(vertices, mut out)| {
        let mut scratch = Scratch::default();
        for vertex in vertices {
            let (of_fan, others) = out.split_at_mut(fans.fan(vertex).len());
            fans.tangents_around(vertex, shared.as_deref(), &mut scratch, of_fan);
            out = others;
        }
    });
    let mut tangents = vec![Vec4::ZERO; 3 * mesh.triangles.len()];
    for (&corner, &tangent) in fans.corners.iter().zip(&of_slots) {
        tangents[corner as usize] = tangent;
    }
    for (_, face) in fans.triangles.iter().zip(0..).filter(|(triangle, _)| triangle.is_degenerate) {
        for corner in 3 * face..3 * face + 3 {
            // That of the first corner at the same vertex.
            let vertex = fans.vertex(corner) as usize;
            let (start, end) = (fans.starts[vertex], fans.starts[vertex + 1]);
            if start < end {
                tangents[corner as usize] = of_slots[start as usize];
            }
        }
    }
    tangents
}

/// Returns for each vertex the first one with the same position, normal and texture coordinate.
fn welded(mesh: &Mesh) -> Vec<u32> {
    let bits = |vertex: u32| {
        let v = vertex as usize;
        let (position, normal, uv) = (mesh.positions[v], mesh.normals[v], mesh.uvs[v]);
        // Adding zero makes -0 the same as 0.
        let floats = [position.x, position.y, position.z, normal.x, normal.y, normal.z, uv.x, uv.y];
        floats.map(|float| (float + 0.0).to_bits())
    };
    let hash = |vertex: u32| {
        let mut hasher = rustc_hash::FxHasher::default();
        bits(vertex).hash(&mut hasher);
        (hasher.finish(), vertex)
    };
    let mut order: Vec<(u64, u32)> = (0..mesh.positions.len() as u32).into_par_iter().map(hash).collect();
    let same = |a: &(u64, u32), b: &(u64, u32)| a.0 == b.0 && bits(a.1) == bits(b.1);
    // By content among equal hashes, so that collisions cost no more than other vertices.
    order
        .par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| bits(a.1).cmp(&bits(b.1))).then_with(|| a.1.cmp(&b.1)));
    let mut first = vec![0; order.len()];
    for run in order.chunk_by(same) {
        run.iter().for_each(|&(_, vertex)| first[vertex as usize] = run[0].1);
    }
    first
}

/// Scratch memory of one task.
#[derive(Default)]
struct Scratch {
    /// Per corner of a fan: its neighbours across the edges before and after its vertex, as positions in the fan.
    neighbors: Vec<[u32; 2]>,
    /// Group of each corner of a fan.
    groups: Vec<u32>,
    /// Positions in the fan by group.
    order: Vec<u32>,
    open: Vec<u32>,
    edges: Vec<(u32, u32, bool)>,
    directions: Vec<(Vec3, Vec3)>,
    members: Vec<u32>,
}

/// Corners by vertex, except those of degenerate triangles; a corner is three times its triangle plus 0, 1 or 2.
struct Fans<'a> {
    mesh: &'a Mesh,
    vertex_of: &'a [u32],
    triangles: Vec<CornerTriangle>,
    /// First entry in `corners` of each vertex, and the end.
    starts: Vec<u32>,
    /// Ascending for each vertex.
    corners: Vec<u32>,
}

impl<'a> Fans<'a> {
    fn new(mesh: &'a Mesh, vertex_of: &'a [u32]) -> Self {
        let triangles: Vec<CornerTriangle> =
            mesh.triangles.par_iter().map(|corners| CornerTriangle::of(mesh, corners)).collect();
        let mut starts = vec![0; vertex_of.len() + 2];
        let whole = || mesh.triangles.iter().zip(&triangles).zip(0..).filter(|((_, known), _)| !known.is_degenerate);
        for ((corners, _), _) in whole() {
            corners.iter().for_each(|&corner| starts[vertex_of[corner as usize] as usize + 2] += 1);
        }
        for i in 2..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut corners = vec![0; starts[starts.len() - 1] as usize];
        for ((vertices, _), face) in whole() {
            for (&vertex, corner) in vertices.iter().zip(3 * face..) {
                let next = &mut starts[vertex_of[vertex as usize] as usize + 1];
                corners[*next as usize] = corner;
                *next += 1;
            }
        }
        starts.pop();
        Self { mesh, vertex_of, triangles, starts, corners }
    }

    fn n_vertices(&self) -> usize {
        self.vertex_of.len()
    }

    fn fan(&self, vertex: usize) -> &[u32] {
        &self.corners[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    fn triangle(&self, corner: u32) -> &CornerTriangle {
        &self.triangles[corner as usize / 3]
    }

    /// Index of the mesh's vertex at a corner.
    fn index(&self, corner: u32) -> usize {
        self.mesh.triangles[corner as usize / 3][corner as usize % 3] as usize
    }

    fn vertex(&self, corner: u32) -> u32 {
        self.vertex_of[self.index(corner)]
    }

    fn position(&self, corner: u32) -> Vec3 {
        self.mesh.positions[self.index(corner)]
    }

    /// Finds for each corner of a fan the neighbours that have the same edge in the other direction. If several have,
    /// each is the neighbour of one, in their order.
    fn find_neighbors(&self, fan: &[u32], scratch: &mut Scratch) {
        let Scratch { neighbors, edges, .. } = scratch;
        neighbors.clear();
        neighbors.resize(fan.len(), [NONE; 2]);
        edges.clear();
        for (&corner, i) in fan.iter().zip(0..) {
            edges.push((self.vertex(before(corner)), i, false));
            edges.push((self.vertex(after(corner)), i, true));
        }
        edges.sort_unstable();
        let mut waiting: VecDeque<(u32, u32, bool)> = VecDeque::new();
        for &(vertex, i, leaves) in edges.iter() {
            if waiting.front().is_some_and(|&(other, ..)| other != vertex) {
                waiting.clear();
            }
            match waiting.front() {
                Some(&(_, other, other_leaves)) if other_leaves != leaves => {
                    waiting.pop_front();
                    neighbors[i as usize][usize::from(leaves)] = other;
                    neighbors[other as usize][usize::from(other_leaves)] = i;
                }
                _ => waiting.push_back((vertex, i, leaves)),
            }
        }
    }

    /// Returns the groups of the corners at vertices of triangles without a direction, as numbers that are different
    /// at each vertex, and sets the orientation of these triangles; `None` if there are no such triangles.
    fn groups_around_undirected(&mut self) -> Option<Vec<u32>> {
        let is_undirected = |triangle: &CornerTriangle| triangle.fits_any && !triangle.is_degenerate;
        if !self.triangles.iter().any(is_undirected) {
            return None;
        }
        let mut seeds = Vec::new();
        let mut neighbors = vec![[NONE; 2]; self.corners.len()];
        let mut scratch = Scratch::default();
        for vertex in 0..self.n_vertices() {
            let fan = self.fan(vertex);
            if !fan.iter().any(|&corner| is_undirected(self.triangle(corner))) {
                continue;
            }
            self.find_neighbors(fan, &mut scratch);
            let start = self.starts[vertex];
            let place = |i: u32| if i == NONE { NONE } else { start + i };
            for (&corner, (at, found)) in fan.iter().zip((start..).zip(&scratch.neighbors)) {
                neighbors[at as usize] = found.map(place);
                if !self.triangle(corner).fits_any {
                    seeds.push((corner, at));
                }
            }
        }
        seeds.sort_unstable();
        let mut groups = vec![NONE; self.corners.len()];
        let mut has_orientation = vec![false; self.triangles.len()];
        let mut open = Vec::new();
        for (corner, at) in seeds {
            if groups[at as usize] != NONE {
                continue;
            }
            let preserves = self.triangle(corner).preserves;
            open.push(at);
            while let Some(place) = open.pop() {
                let face = self.corners[place as usize] as usize / 3;
                let triangle = &mut self.triangles[face];
                if triangle.fits_any && !has_orientation[face] {
                    triangle.preserves = preserves;
                    has_orientation[face] = true;
                }
                if groups[place as usize] == NONE && triangle.preserves == preserves {
                    groups[place as usize] = at;
                    open.extend(neighbors[place as usize].iter().filter(|&&next| next != NONE));
                }
            }
        }
        Some(groups)
    }

    /// Finds the groups of a fan whose triangles all have a direction.
    fn find_groups(&self, fan: &[u32], scratch: &mut Scratch) {
        self.find_neighbors(fan, scratch);
        let Scratch { neighbors, groups, open, .. } = scratch;
        groups.clear();
        groups.resize(fan.len(), NONE);
        for seed in 0..fan.len() {
            let preserves = self.triangle(fan[seed]).preserves;
            open.push(seed as u32);
            while let Some(i) = open.pop() {
                if groups[i as usize] == NONE && self.triangle(fan[i as usize]).preserves == preserves {
                    groups[i as usize] = seed as u32;
                    open.extend(neighbors[i as usize].iter().filter(|&&next| next != NONE));
                }
            }
        }
    }

    /// Computes the tangents of the corners of a fan.
    fn tangents_around(&self, vertex: usize, shared: Option<&[u32]>, scratch: &mut Scratch, out: &mut [Vec4]) {
        let fan = self.fan(vertex);
        if fan.is_empty() {
            return;
        }
        match shared {
            Some(shared) if fan.iter().any(|&corner| self.triangle(corner).fits_any) => {
                scratch.groups.clear();
                let range = self.starts[vertex] as usize..self.starts[vertex + 1] as usize;
                scratch.groups.extend_from_slice(&shared[range]);
            }
            _ => self.find_groups(fan, scratch),
        }
        let normal = self.mesh.normals[vertex];
        let Scratch { groups, order, .. } = scratch;
        order.clear();
        order.extend(0..fan.len() as u32);
        order.sort_unstable_by_key(|&i| (groups[i as usize], i));
        let mut order = std::mem::take(&mut scratch.order);
        let groups = std::mem::take(&mut scratch.groups);
        for group in order.chunk_by(|&a, &b| groups[a as usize] == groups[b as usize]) {
            if groups[group[0] as usize] == NONE {
                continue;
            }
            let sign = if self.triangle(fan[group[0] as usize]).preserves { 1.0 } else { -1.0 };
            if self.is_together(fan, group, normal, scratch) {
                let tangent = self.tangent(fan, group, normal).extend(sign);
                group.iter().for_each(|&i| out[i as usize] = tangent);
                continue;
            }
            // Each has a tangent of those that do not point in the opposite direction.
            for (k, &i) in group.iter().enumerate() {
                let (s, t) = scratch.directions[k];
                let any = self.triangle(fan[i as usize]).fits_any;
                scratch.members.clear();
                for (&j, &(other_s, other_t)) in group.iter().zip(&scratch.directions) {
                    let fits = any || self.triangle(fan[j as usize]).fits_any;
                    if fits || i == j || dot(s, other_s) > -1.0 && dot(t, other_t) > -1.0 {
                        scratch.members.push(j);
                    }
                }
                out[i as usize] = self.tangent(fan, &scratch.members, normal).extend(sign);
            }
        }
        order.clear();
        (scratch.order, scratch.groups) = (order, groups);
    }

    /// Whether no two directions of a group are opposite; otherwise its directions in the tangent plane are in
    /// `scratch`.
    fn is_together(&self, fan: &[u32], group: &[u32], normal: Vec3, scratch: &mut Scratch) -> bool {
        if group.len() == 1 || group.len() > MOST_COMPARED {
            return true;
        }
        let directions = &mut scratch.directions;
        directions.clear();
        directions.extend(group.iter().map(|&i| {
            let triangle = self.triangle(fan[i as usize]);
            (projected(triangle.s, normal), projected(triangle.t, normal))
        }));
        let sum = directions.iter().fold((Vec3::ZERO, Vec3::ZERO), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        // Within 84° of their mean: no two are opposite.
        let (least_s, least_t) = (0.1 * sum.0.length(), 0.1 * sum.1.length());
        let has_none = |(s, t): &(Vec3, Vec3)| *s == Vec3::ZERO && *t == Vec3::ZERO;
        directions.iter().all(|one| has_none(one) || one.0.dot(sum.0) > least_s && one.1.dot(sum.1) > least_t)
    }

    /// Returns the tangent of some corners of a fan: the mean direction, weighted by angle.
    fn tangent(&self, fan: &[u32], members: &[u32], normal: Vec3) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for &i in members {
            let corner = fan[i as usize];
            let triangle = self.triangle(corner);
            if triangle.fits_any {
                continue;
            }
            let here = self.position(corner);
            let [a, b] = [before(corner), after(corner)].map(|other| projected(self.position(other) - here, normal));
            let angle = f64::from(dot(b, a).clamp(-1.0, 1.0)).acos() as f32;
            sum += projected(triangle.s, normal) * angle;
        }
        normalized_or_zero(sum)
    }
}

impl CornerTriangle {
    /// - `corners`: vertices of the mesh.
    fn of(mesh: &Mesh, corners: &[u32; 3]) -> Self {
        let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
        if a == b || b == c || c == a {
            return Self { is_degenerate: true, ..Self::default() };
        }
        let [uv_a, uv_b, uv_c]: [Vec2; 3] = corners.map(|vertex| mesh.uvs[vertex as usize]);
        let (uv1, uv2, edge1, edge2) = (uv_b - uv_a, uv_c - uv_a, b - a, c - a);
        let area = uv1.x * uv2.y - uv1.y * uv2.x;
        let (s, t) = (edge1 * uv2.y - edge2 * uv1.y, edge1 * -uv2.x + edge2 * uv1.x);
        let preserves = area > 0.0;
        let mut known = Self { preserves, fits_any: true, ..Self::default() };
        if is_not_zero(area) {
            let sign = if preserves { 1.0 } else { -1.0 };
            known.s = normalized_or_zero(s) * sign;
            known.t = normalized_or_zero(t) * sign;
            known.fits_any = !(is_not_zero(length(s) / area.abs()) && is_not_zero(length(t) / area.abs()));
        }
        known
    }
}

/// The corner before, in the same triangle.
fn before(corner: u32) -> u32 {
    if corner.is_multiple_of(3) { corner + 2 } else { corner - 1 }
}

/// The corner after, in the same triangle.
fn after(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// Unit direction in the plane of a normal, or zero.
fn projected(direction: Vec3, normal: Vec3) -> Vec3 {
    normalized_or_zero(direction - normal * dot(normal, direction))
}

fn is_not_zero(x: f32) -> bool {
    x.abs() > f32::MIN_POSITIVE
}

fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

fn length(v: Vec3) -> f32 {
    dot(v, v).sqrt()
}

fn normalized_or_zero(v: Vec3) -> Vec3 {
    if is_not_zero(v.x) || is_not_zero(v.y) || is_not_zero(v.z) { v * length(v).recip() } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
    use glam::DVec3;

    /// The reference of the tests.
    struct OfCrate<'a> {
        mesh: &'a Mesh,
        tangents: Vec<Vec4>,
    }

    impl OfCrate<'_> {
        fn vertex(&self, face: usize, corner: usize) -> usize {
            self.mesh.triangles[face][corner] as usize
        }
    }

    impl Geometry for OfCrate<'_> {
        fn num_faces(&self) -> usize {
            self.mesh.triangles.len()
        }

        fn num_vertices_of_face(&self, _face: usize) -> usize {
            3
        }

        fn position(&self, face: usize, corner: usize) -> [f32; 3] {
            self.mesh.positions[self.vertex(face, corner)].to_array()
        }

        fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
            self.mesh.normals[self.vertex(face, corner)].to_array()
        }

        fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
            self.mesh.uvs[self.vertex(face, corner)].to_array()
        }

        fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
            let encoded = tangent.map_or(Vec4::ZERO, |tangent| Vec4::from(tangent.tangent_encoded()));
            self.tangents[3 * face + corner] = encoded;
        }
    }

    fn of_crate(mesh: &Mesh) -> Vec<Vec4> {
        let mut reference = OfCrate { mesh, tangents: vec![Vec4::ZERO; 3 * mesh.triangles.len()] };
        generate_tangents(&mut reference).unwrap();
        reference.tangents
    }

    /// Uniform numbers below `n`.
    struct Numbers(u64);

    impl Numbers {
        fn below(&mut self, n: u32) -> u32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 33) % u64::from(n)) as u32
        }

        fn unit(&mut self) -> f32 {
            self.below(1 << 20) as f32 / (1 << 20) as f32
        }
    }

    /// A bumpy square of `n`² squares, with texture coordinates that are warped and in part mirrored.
    fn bumps(n: u32, numbers: &mut Numbers) -> Mesh {
        let (mut positions, mut uvs, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for y in 0..=n {
            for x in 0..=n {
                let (u, v) = (x as f32 / n as f32, y as f32 / n as f32);
                positions.push(DVec3::new(u.into(), v.into(), (0.2 * numbers.unit()).into()));
                uvs.push(Vec2::new(4.0 * (u - 0.5).abs() + 0.1 * numbers.unit(), 3.0 * v + 0.1 * numbers.unit()));
                normals.push(Vec3::new(numbers.unit() - 0.5, numbers.unit() - 0.5, 2.0).normalize());
            }
        }
        for y in 0..n {
            for x in 0..n {
                let i = y * (n + 1) + x;
                triangles.extend([[i, i + 1, i + n + 2], [i, i + n + 2, i + n + 1]]);
            }
        }
        let mut mesh = Mesh::from_f64(&positions, triangles).unwrap();
        (mesh.uvs, mesh.normals) = (uvs, normals);
        mesh
    }

    /// The same triangles in which no two share a vertex, in another order.
    fn torn(mesh: &Mesh, numbers: &mut Numbers) -> Mesh {
        let mut triangles = mesh.triangles.clone();
        for i in (1..triangles.len()).rev() {
            triangles.swap(i, numbers.below(i as u32 + 1) as usize);
        }
        let each = || triangles.iter().flatten().map(|&vertex| vertex as usize);
        Mesh {
            positions: each().map(|v| mesh.positions[v]).collect(),
            normals: each().map(|v| mesh.normals[v]).collect(),
            uvs: each().map(|v| mesh.uvs[v]).collect(),
            triangles: (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..mesh.clone()
        }
    }

    fn assert_same(mesh: &Mesh, name: &str) {
        let (found, expected) = (corner_tangents(mesh), of_crate(mesh));
        for (corner, (found, expected)) in found.iter().zip(&expected).enumerate() {
            // The crate tells no missing tangent from one whose direction is zero.
            let same = found.truncate() == expected.truncate() && (found.w == expected.w || found.w == 0.0);
            assert!(same, "{name}, corner {corner}: {found} for {expected}");
        }
    }

    #[test]
    fn tangents_are_those_of_the_reference_to_the_last_bit() {
        let mut numbers = Numbers(1);
        for size in [1, 2, 7, 30, 100] {
            let mesh = bumps(size, &mut numbers);
            assert_same(&mesh, &format!("{size} squares a side"));
            assert_same(&torn(&mesh, &mut numbers), &format!("{size} squares a side, torn"));
        }
    }

    #[test]
    fn soups_with_every_fault_have_the_tangents_of_the_reference() {
        let mut numbers = Numbers(2);
        for case in 0..400 {
            let n = 4 + case % 13;
            // Few distinct values: many coincident vertices, degenerate triangles and texture coordinates without area.
            let mut value = || numbers.below(3) as f32;
            let positions: Vec<Vec3> = (0..n).map(|_| Vec3::new(value(), value(), 0.5 * value())).collect();
            let uvs = (0..n).map(|_| Vec2::new(value(), value())).collect();
            let normals = (0..n).map(|_| Vec3::new(value() - 1.0, value() - 1.0, 2.0).normalize()).collect();
            let mut triangles = Vec::new();
            while triangles.len() < 3 * n {
                let [a, b, c] = [0; 3].map(|_| numbers.below(n as u32));
                if a != b && b != c && c != a {
                    triangles.push([a, b, c]);
                }
            }
            let mesh = Mesh { positions, uvs, normals, triangles, ..Mesh::default() };
            assert_same(&mesh, &format!("soup {case}"));
        }
    }

    #[test]
    fn patches_without_texture_area_have_the_tangents_of_the_reference() {
        let mut numbers = Numbers(3);
        for case in 0..40 {
            let mut mesh = bumps(12, &mut numbers);
            for _ in 0..case {
                let triangle = mesh.triangles[numbers.below(mesh.triangles.len() as u32) as usize];
                let uv = mesh.uvs[triangle[0] as usize];
                triangle.iter().for_each(|&vertex| mesh.uvs[vertex as usize] = uv);
            }
            assert_same(&mesh, &format!("{case} patches"));
        }
    }

    #[test]
    fn a_fan_of_a_million_triangles_takes_no_stack_and_no_quadratic_time() {
        let n = 1_000_000_u32;
        let mut positions = vec![Vec3::Z];
        let mut uvs = vec![Vec2::ZERO];
        for i in 0..n {
            let direction = Vec2::from_angle(i as f32 / n as f32 * std::f32::consts::TAU);
            positions.push(direction.extend(0.0));
            uvs.push(direction);
        }
        let triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
        let normals = vec![Vec3::Z; positions.len()];
        let mesh = Mesh { positions, uvs, normals, triangles, ..Mesh::default() };
        let tangents = corner_tangents(&mesh);
        assert!(tangents.iter().all(|tangent| tangent.truncate().abs_diff_eq(Vec3::X, 1e-3)));
    }
}
