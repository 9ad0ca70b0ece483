//! Melax's simplifier: half-edge collapses in order of edge length times bend.
//!
//! Source: Melax 1998, "A Simple, Fast, and Effective Polygon Reduction Algorithm"; the 2013 program used it. Here the
//! queue is exact, costs are updated wherever they can have changed, lines bend too, and the checks of [`Surface`]
//! apply.

use super::heap::IndexedHeap;
use super::prepare::PreparedMesh;
use super::surface::{Kind, Surface};
use glam::DVec3;

/// Simplifies in place until `faces` are left or no collapse is allowed; vertices keep their indices and positions.
pub(super) fn simplify(prepared: &mut PreparedMesh, faces: usize, max_cost: f32) {
    let mut melax = Melax::new(prepared);
    while melax.surface.face_count > faces {
        let Some((cost, from)) = melax.heap.peek() else { break };
        if cost > max_cost {
            break;
        }
        match melax.allowed_target(from) {
            // The cheaper neighbour is not allowed: the next one may cost more than other vertices do.
            Some((to, true_cost)) if true_cost <= cost => melax.collapse(from, to),
            Some((_, true_cost)) => melax.heap.set(from, true_cost),
            None => melax.heap.remove(from),
        }
    }
    let surface = melax.surface;
    let live: Vec<_> = surface.live_triangles().collect();
    let sources = live.iter().map(|&(t, ..)| prepared.sources[t]).collect();
    let triangles = live.iter().map(|&(_, vertices, _)| vertices).collect();
    let corner_wedges = live.iter().filter_map(|&(.., wedges)| wedges).flatten().collect();
    drop(live);
    (prepared.triangles, prepared.sources, prepared.corner_wedges) = (triangles, sources, corner_wedges);
    prepared.wedges = surface.wedges;
}

struct Melax {
    surface: Surface,
    heap: IndexedHeap,
    /// Working memory.
    neighbors: Vec<u32>,
    normals: Vec<(DVec3, u32, u32)>,
}

impl Melax {
    fn new(prepared: &PreparedMesh) -> Self {
        let surface = Surface::new(
            &prepared.triangles,
            prepared.positions.clone(),
            prepared.kinds.clone(),
            prepared.corner_wedges.clone(),
            prepared.wedges.clone(),
        );
        let count = surface.positions.len();
        let mut melax = Self { surface, heap: IndexedHeap::new(count), neighbors: Vec::new(), normals: Vec::new() };
        for vertex in 0..count as u32 {
            melax.update(vertex);
        }
        melax
    }

    /// Updates the queue with the cost of the vertex's cheapest edge.
    fn update(&mut self, vertex: u32) {
        let cheapest = self.candidates(vertex).first().copied();
        match cheapest {
            Some((cost, _)) => self.heap.set(vertex, cost),
            None => self.heap.remove(vertex),
        }
    }

    /// Returns the cheapest neighbour that `from` may be merged into.
    fn allowed_target(&mut self, from: u32) -> Option<(u32, f32)> {
        let candidates = self.candidates(from);
        candidates.into_iter().find_map(|(cost, to)| {
            let position = self.surface.positions[to as usize];
            self.surface.may_collapse(from, to, position).then_some((to, cost))
        })
    }

    /// Returns the neighbours that a vertex's kind allows as targets, cheapest first.
    fn candidates(&mut self, from: u32) -> Vec<(f32, u32)> {
        let kind = self.surface.kinds[from as usize];
        // A hub may not collapse anyway, and comparing all of its edges takes quadratic time.
        if kind >= Kind::Fixed || self.surface.is_hub(from) {
            return Vec::new();
        }
        let mut neighbors = std::mem::take(&mut self.neighbors);
        neighbors.clear();
        self.surface.for_each_neighbor(from, |other| neighbors.push(other));
        let mut normals = std::mem::take(&mut self.normals);
        normals.clear();
        let place = |v: u32| self.surface.positions[v as usize].as_dvec3();
        let here = place(from);
        normals.extend(
            self.surface
                .fan(from)
                .map(|(_, b, c)| ((place(b) - here).cross(place(c) - here).normalize_or_zero(), b, c)),
        );
        // On a border or seam the bend of the line counts as well: in a flat sheet nothing else would preserve a
        // corner.
        let on_line = |to: u32| {
            let shared = normals.iter().filter(|(_, b, c)| *b == to || *c == to).count() as u32;
            self.surface.is_constraint(from, to, shared)
        };
        let line: Vec<u32> =
            if kind == Kind::Curve { neighbors.iter().copied().filter(|&n| on_line(n)).collect() } else { Vec::new() };
        let turn = |to: u32| {
            let behind = line.iter().find(|&&n| n != to && line.contains(&to));
            behind.map_or(0.0, |&n| {
                let (before, after) = ((here - place(n)).normalize_or_zero(), (place(to) - here).normalize_or_zero());
                0.5 * (1.0 - before.dot(after))
            })
        };
        let mut found: Vec<(f32, u32)> = neighbors
            .iter()
            .filter(|&&to| self.surface.kinds[to as usize] >= kind)
            .map(|&to| ((place(to).distance(here) * bend(&normals, to).max(turn(to))) as f32, to))
            .collect();
        found.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        (self.neighbors, self.normals) = (neighbors, normals);
        found
    }

    fn collapse(&mut self, from: u32, to: u32) {
        let position = self.surface.positions[to as usize];
        self.surface.collapse(from, to, position, 1.0);
        self.heap.remove(from);
        // The triangles that have changed are those around `to`: the bend at their vertices changes.
        let mut changed = vec![to];
        self.surface.for_each_neighbor(to, |other| changed.push(other));
        for vertex in changed {
            self.update(vertex);
        }
    }
}

/// Returns the maximum over the triangles around a vertex of the minimum turn against a triangle at the edge to `to`, 0
/// to 1.
fn bend(normals: &[(DVec3, u32, u32)], to: u32) -> f64 {
    let sides: Vec<DVec3> = normals.iter().filter(|(_, b, c)| *b == to || *c == to).map(|side| side.0).collect();
    normals
        .iter()
        .map(|(normal, ..)| sides.iter().map(|side| 0.5 * (1.0 - normal.dot(*side))).fold(1.0, f64::min))
        .fold(0.0, f64::max)
}
