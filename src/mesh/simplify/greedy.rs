//! The quadric simplifier: always the cheapest edge that is left.
//!
//! An edge costs the sum of its ends' quadrics at their common minimum. Adding quadrics never makes an edge cheaper,
//! so a queued cost is a lower bound: it is checked when the edge comes up, and an edge whose ends have changed goes
//! back with its true cost. This gives the order of an eager priority queue for a fraction of the evaluations.

use super::quadric::Quadric;
use super::queue::MonotoneQueue;
use super::surface::{Kind, NONE, Surface, WedgeJoin};
use glam::Vec3;

/// One step: vertex `from` goes into `to`, and both are then at `position`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Collapse {
    pub cost: f32,
    pub from: u32,
    pub to: u32,
    pub position: Vec3,
    /// Triangles that died.
    pub died: u32,
    /// How many entries of the log's wedge joins belong to this step.
    pub joins: u32,
}

/// What was done, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Log {
    pub collapses: Vec<Collapse>,
    pub joins: Vec<WedgeJoin>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [u32; 2],
    /// Sum of the ends' versions when the cost was computed.
    version: u32,
    key: f32,
    /// See the flags below.
    state: u8,
}

/// Not in the queue: it was refused, and waits for its ends to change.
const ASLEEP: u8 = 1;
/// The edge is in the waiting list of its first, second end.
const LISTED: [u8; 2] = [2, 4];

#[derive(Debug)]
pub(super) struct Greedy {
    pub surface: Surface,
    pub quadrics: Vec<Quadric>,
    queue: MonotoneQueue,
    edges: Vec<Edge>,
    /// Where a vertex went; itself while alive.
    went_to: Vec<u32>,
    versions: Vec<u32>,
    /// Head of each vertex's list of sleeping edges; entry 2e + i is edge e at its end i.
    sleepers: Vec<u32>,
    next_sleeper: Vec<u32>,
    last_key: f32,
    pub log: Log,
}

/// When to stop, besides the face count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Stop when no more than this many triangles are left.
    pub faces: usize,
    /// Stop when the cheapest edge costs more.
    pub cost: f32,
    /// Refuse edges whose mean squared distance to the planes exceeds this.
    pub mean_square: f64,
}

impl Greedy {
    pub fn new(mut surface: Surface, quadrics: Vec<Quadric>) -> Self {
        let count = surface.positions.len();
        let mut edges = Vec::with_capacity(surface.face_count * 3 / 2 + 16);
        for vertex in 0..count as u32 {
            if surface.kinds[vertex as usize] == Kind::Frozen {
                continue;
            }
            surface.for_each_neighbor(vertex, |other| {
                if vertex < other {
                    edges.push(Edge { ends: [vertex, other], version: 0, key: 0.0, state: 0 });
                }
            });
        }
        let kinds = &surface.kinds;
        edges.retain(|edge: &Edge| {
            let [p, q] = edge.ends.map(|end| kinds[end as usize]);
            p.max(q) != Kind::Frozen && p.min(q) != Kind::Fixed
        });
        let mut greedy = Self {
            surface,
            quadrics,
            queue: MonotoneQueue::new(),
            went_to: (0..count as u32).collect(),
            versions: vec![0; count],
            sleepers: vec![NONE; count],
            next_sleeper: vec![NONE; 2 * edges.len()],
            edges,
            last_key: 0.0,
            log: Log::default(),
        };
        for e in 0..greedy.edges.len() {
            let (_, _, _, cost) = greedy.plan(greedy.edges[e].ends);
            greedy.edges[e].key = cost;
            greedy.queue.push(cost, e as u32);
        }
        greedy
    }

    /// Collapses edges in order of cost until a limit is reached or no edge is left.
    pub fn run(&mut self, limits: Limits) {
        while self.surface.face_count > limits.faces {
            let Some((key, e)) = self.queue.pop() else { break };
            self.last_key = key;
            if key > limits.cost {
                self.queue.push(key, e);
                break;
            }
            let edge = self.edges[e as usize];
            let ends = edge.ends.map(|end| self.find(end));
            if ends[0] == ends[1] {
                continue;
            }
            let version = self.versions[ends[0] as usize].wrapping_add(self.versions[ends[1] as usize]);
            let (from, to, position, cost) = self.plan(ends);
            if version != edge.version {
                let edge = &mut self.edges[e as usize];
                (edge.version, edge.key) = (version, cost);
                if cost > key {
                    self.queue.push(cost, e);
                    continue;
                }
            }
            if self.surface.kinds[from as usize] == Kind::Fixed {
                // Two corners of lines have come together; neither may move, ever.
                continue;
            }
            let near_enough = limits.mean_square == f64::INFINITY || {
                let mut sum = self.quadrics[from as usize];
                sum += self.quadrics[to as usize];
                sum.mean_at(position.as_dvec3()) <= limits.mean_square
            };
            if near_enough && self.surface.may_collapse(from, to, position) {
                self.collapse(from, to, position, key);
            } else {
                self.sleep(e, ends);
            }
        }
    }

    /// A lower bound on the cost of the next collapse, if any edge is left.
    pub fn next_cost(&self) -> Option<f32> {
        self.queue.least_key()
    }

    /// Which end goes, which stays, where the survivor will be, and the cost.
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

    fn collapse(&mut self, from: u32, to: u32, position: Vec3, cost: f32) {
        let start = self.surface.positions[from as usize];
        let along = self.surface.positions[to as usize] - start;
        let length2 = along.length_squared();
        let t = if length2 > 0.0 { ((position - start).dot(along) / length2).clamp(0.0, 1.0) } else { 1.0 };
        let joins_before = self.log.joins.len();
        let died = self.surface.collapse(from, to, position, t, &mut self.log.joins);
        let gone = self.quadrics[from as usize];
        self.quadrics[to as usize] += gone;
        self.went_to[from as usize] = to;
        // Both old versions go in, so that no sum of two versions can repeat.
        self.versions[to as usize] =
            self.versions[to as usize].wrapping_add(self.versions[from as usize]).wrapping_add(1);
        let joins = (self.log.joins.len() - joins_before) as u32;
        self.log.collapses.push(Collapse { cost, from, to, position, died: died as u32, joins });
        self.wake(from);
        self.wake(to);
    }

    fn sleep(&mut self, e: u32, ends: [u32; 2]) {
        let edge = &mut self.edges[e as usize];
        edge.state |= ASLEEP;
        for (i, end) in ends.into_iter().enumerate() {
            // Still listed at an end that has not changed since.
            if edge.state & LISTED[i] == 0 {
                edge.state |= LISTED[i];
                let entry = 2 * e + i as u32;
                self.next_sleeper[entry as usize] = self.sleepers[end as usize];
                self.sleepers[end as usize] = entry;
            }
        }
    }

    /// Sends the edges that wait at `vertex` back to the queue.
    fn wake(&mut self, vertex: u32) {
        let mut entry = std::mem::replace(&mut self.sleepers[vertex as usize], NONE);
        while entry != NONE {
            let edge = &mut self.edges[entry as usize / 2];
            edge.state &= !LISTED[entry as usize % 2];
            if edge.state & ASLEEP != 0 {
                edge.state &= !ASLEEP;
                self.queue.push(edge.key.max(self.last_key), entry / 2);
            }
            entry = self.next_sleeper[entry as usize];
        }
    }

    fn find(&mut self, mut vertex: u32) -> u32 {
        while self.went_to[vertex as usize] != vertex {
            let above = self.went_to[self.went_to[vertex as usize] as usize];
            self.went_to[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }
}
