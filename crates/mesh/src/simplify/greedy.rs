//! The quadric simplifier: always collapses the cheapest remaining edge.
//!
//! The cost of an edge is the sum of its ends' quadrics at their common minimum. Adding quadrics never makes an edge
//! cheaper, so a queued cost is a lower bound: it is checked when the edge is popped, and an edge whose ends have
//! changed is pushed back with its true cost, unless that is in the same level. This gives the order of an eager
//! priority queue, except within a level, for a fraction of the evaluations.

use super::quadric::Quadric;
use super::queue::LevelQueue;
use super::surface::{Kind, NONE, Surface};
use glam::Vec3;

#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [u32; 2],
    /// Sum of the ends' versions when the cost was computed.
    version: u32,
    /// A combination of the flags below.
    state: u32,
}
const _: () = assert!(size_of::<Edge>() == 16);

/// Not in the queue: the collapse was rejected, and the edge waits for a change of its ends.
const ASLEEP: u32 = 1;
/// The edge is in the waiting list of its first, second end.
const LISTED: [u32; 2] = [2, 4];

#[derive(Debug)]
pub(super) struct Greedy {
    pub surface: Surface,
    pub quadrics: Vec<Quadric>,
    queue: LevelQueue,
    edges: Vec<Edge>,
    /// The vertex that each vertex was merged into; itself while alive.
    merged_into: Vec<u32>,
    versions: Vec<u32>,
    /// Head of each vertex's list of sleeping edges; entry 2e + i is edge e at its end i.
    sleepers: Vec<u32>,
    next_sleeper: Vec<u32>,
    last_key: f32,
    /// The edge that was last pushed back, by a hash of its ends: see [`Self::is_twin`].
    seen: Vec<u32>,
}

/// Conditions for stopping.
#[derive(Clone, Copy, Debug)]
pub(super) struct CollapseLimits {
    /// Stops when at most this many triangles are left.
    pub faces: usize,
    /// Stops when the cheapest edge costs more.
    pub cost: f32,
    /// Rejects edges whose mean squared distance to the planes exceeds this.
    pub mean_square: f64,
}

impl Greedy {
    pub fn new(surface: Surface, quadrics: Vec<Quadric>) -> Self {
        let count = surface.positions.len();
        let edges = edges_of(&surface);
        let mut greedy = Self {
            surface,
            quadrics,
            queue: LevelQueue::new(edges.len()),
            merged_into: (0..count as u32).collect(),
            versions: vec![0; count],
            sleepers: vec![NONE; count],
            next_sleeper: vec![NONE; 2 * edges.len()],
            seen: vec![NONE; edges.len().next_power_of_two()],
            edges,
            last_key: 0.0,
        };
        for e in 0..greedy.edges.len() {
            let (_, _, _, cost) = greedy.plan(greedy.edges[e].ends);
            greedy.queue.push(cost, e as u32);
        }
        greedy
    }

    /// Collapses edges in order of cost until a limit is reached or no edge is left.
    pub fn run(&mut self, limits: CollapseLimits) {
        while self.surface.face_count > limits.faces {
            if self.queue.least_key().is_none_or(|key| key > limits.cost) {
                break;
            }
            let Some((key, e)) = self.queue.pop() else { break };
            self.last_key = key;
            let edge = self.edges[e as usize];
            let ends = edge.ends.map(|end| self.find(end));
            if ends[0] == ends[1] {
                continue;
            }
            let version = self.versions[ends[0] as usize].wrapping_add(self.versions[ends[1] as usize]);
            if version != edge.version && self.is_twin(e, ends, version) {
                continue;
            }
            let (from, to, position, cost) = self.plan(ends);
            if version != edge.version {
                let edge = &mut self.edges[e as usize];
                (edge.version, edge.ends) = (version, ends);
                if LevelQueue::floor(cost) > key {
                    self.queue.push(cost, e);
                    continue;
                }
            }
            if self.surface.kinds[from as usize] == Kind::Fixed {
                // Two corners of lines have met; neither may ever move.
                continue;
            }
            let near_enough = limits.mean_square == f64::INFINITY || {
                let mut sum = self.quadrics[from as usize];
                sum += self.quadrics[to as usize];
                sum.mean_at(position.as_dvec3()) <= limits.mean_square
            };
            if near_enough && self.surface.may_collapse(from, to, position) {
                self.collapse(from, to, position);
            } else {
                self.sleep(e, ends);
            }
        }
    }

    /// Returns a lower bound on the cost of the next collapse, if any edge is left.
    pub fn next_cost(&mut self) -> Option<f32> {
        self.queue.least_key()
    }

    /// Whether another edge between the same ends is already up to date. A collapse creates two such pairs; searching
    /// for them at that time would cost more than detecting them here. A missed twin costs only time.
    fn is_twin(&mut self, e: u32, [p, q]: [u32; 2], version: u32) -> bool {
        let (low, high) = (p.min(q), p.max(q));
        let hash = (low.wrapping_mul(0x9e37_79b1) ^ high).wrapping_mul(0x85eb_ca77);
        let cell = ((u64::from(hash) * self.seen.len() as u64) >> 32) as usize;
        let other = std::mem::replace(&mut self.seen[cell], e);
        let twin = other != NONE && other != e && {
            let other = &self.edges[other as usize];
            other.version == version && (other.ends == [p, q] || other.ends == [q, p])
        };
        if twin {
            self.seen[cell] = other;
        }
        twin
    }

    /// Returns the cost that half of the edges do not exceed before any collapse; 0 without edges.
    pub fn median_cost(&self) -> f32 {
        self.queue.median_key().unwrap_or(0.0)
    }

    /// Returns the end to remove, the end to keep, the new position of the latter, and the cost.
    #[inline]
    fn plan(&self, ends: [u32; 2]) -> (u32, u32, Vec3, f32) {
        let [p, q] = ends;
        let (from, to) = if self.surface.kinds[p as usize] <= self.surface.kinds[q as usize] { (p, q) } else { (q, p) };
        let (start, end) = (self.surface.positions[from as usize], self.surface.positions[to as usize]);
        let mut sum = self.quadrics[from as usize];
        sum += self.quadrics[to as usize];
        let moves = self.surface.kinds[from as usize] == self.surface.kinds[to as usize];
        let position = if moves && self.surface.kinds[to as usize] != Kind::Fixed {
            let middle = 0.5 * (start.as_dvec3() + end.as_dvec3());
            sum.minimum_near(middle).as_vec3()
        } else {
            end
        };
        (from, to, position, sum.at(position.as_dvec3()) as f32)
    }

    fn collapse(&mut self, from: u32, to: u32, position: Vec3) {
        let start = self.surface.positions[from as usize];
        let along = self.surface.positions[to as usize] - start;
        let length2 = along.length_squared();
        let t = if length2 > 0.0 { ((position - start).dot(along) / length2).clamp(0.0, 1.0) } else { 1.0 };
        self.surface.collapse(from, to, position, t);
        let gone = self.quadrics[from as usize];
        self.quadrics[to as usize] += gone;
        self.merged_into[from as usize] = to;
        // Both old versions are included, so that no sum of two versions can repeat.
        self.versions[to as usize] =
            self.versions[to as usize].wrapping_add(self.versions[from as usize]).wrapping_add(1);
        self.wake(from);
        self.wake(to);
    }

    fn sleep(&mut self, e: u32, ends: [u32; 2]) {
        let edge = &mut self.edges[e as usize];
        edge.state |= ASLEEP;
        for (i, end) in ends.into_iter().enumerate() {
            // It may still be listed at an end that has not changed since.
            if edge.state & LISTED[i] == 0 {
                edge.state |= LISTED[i];
                let entry = 2 * e + i as u32;
                self.next_sleeper[entry as usize] = self.sleepers[end as usize];
                self.sleepers[end as usize] = entry;
            }
        }
    }

    /// Pushes the edges that wait at `vertex` back to the queue.
    fn wake(&mut self, vertex: u32) {
        let mut entry = std::mem::replace(&mut self.sleepers[vertex as usize], NONE);
        while entry != NONE {
            let edge = &mut self.edges[entry as usize / 2];
            edge.state &= !LISTED[entry as usize % 2];
            if edge.state & ASLEEP != 0 {
                edge.state &= !ASLEEP;
                // Its cost has changed; the last key is a lower bound, and the check when it is popped does the rest.
                self.queue.push(self.last_key, entry / 2);
            }
            entry = self.next_sleeper[entry as usize];
        }
    }

    fn find(&mut self, mut vertex: u32) -> u32 {
        while self.merged_into[vertex as usize] != vertex {
            let above = self.merged_into[self.merged_into[vertex as usize] as usize];
            self.merged_into[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }
}

/// Returns every edge that can ever collapse; those on lines may occur twice.
fn edges_of(surface: &Surface) -> Vec<Edge> {
    let mut edges = Vec::with_capacity(surface.face_count * 3 / 2 + 16);
    for (_, [a, b, c], _) in surface.live_triangles() {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            let (kind, other) = (surface.kinds[p as usize], surface.kinds[q as usize]);
            // Inside the surface the neighbour has the edge in the opposite direction; on a line there may be no
            // neighbour.
            let once = p < q || kind.min(other) >= Kind::Curve;
            if once && kind.max(other) != Kind::Frozen && kind.min(other) != Kind::Fixed {
                edges.push(Edge { ends: [p, q], version: 0, state: 0 });
            }
        }
    }
    edges
}
