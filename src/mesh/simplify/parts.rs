//! The quadric simplifier on many threads.
//!
//! The mesh is cut into parts along a space-filling curve. Each part is simplified alone, its rim frozen, and all
//! parts follow one cost threshold that rises until little is left to do; then one queue over the whole mesh
//! finishes, rims included. Parts depend on the mesh alone, so any number of threads gives the same result.

use super::greedy::{Collapse, Greedy, Limits, Log};
use super::prepare::Prepared;
use super::quadric::Quadric;
use super::surface::{Kind, NONE, Surface, WedgeJoin};
use crate::geometry::Aabb;
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// About this many triangles a part: small enough that a core works on it within its second-level cache.
const PART_TRIANGLES: usize = 4_096;
/// The last sixteenth is left to the queue over the whole mesh, which puts the parts on a level.
const LEFT_TO_WHOLE: usize = 16;

/// Simplifies in place: afterwards `prepared` holds what is left, and vertices keep their numbers.
pub(super) fn simplify(prepared: &mut Prepared, limits: Limits, keep_log: bool) -> Log {
    let count = prepared.triangles.len().div_ceil(PART_TRIANGLES);
    simplify_in(count, prepared, limits, keep_log)
}

/// With one part this is the plain method with one queue, against which the other is tested.
pub(super) fn simplify_in(count: usize, prepared: &mut Prepared, limits: Limits, keep_log: bool) -> Log {
    let mut log = Log::default();
    if count > 1 && prepared.triangles.len() > limits.faces {
        let mut parts = split(prepared, count);
        run_together(&mut parts, limits, prepared.triangles.len());
        log = join(prepared, parts, keep_log);
    }
    let whole: Vec<u32> = (0..prepared.triangles.len() as u32).collect();
    let mut owners = vec![0; prepared.positions.len()];
    prepared.triangles.iter().flatten().for_each(|&v| owners[v as usize] = 1);
    let vertices: Vec<u32> = (0..prepared.positions.len() as u32).filter(|&v| owners[v as usize] == 1).collect();
    let mut local = vec![NONE; prepared.positions.len()];
    vertices.iter().zip(0..).for_each(|(&v, i)| local[v as usize] = i);
    let mut part = Part::new(prepared, whole, vertices, &local, &[]);
    part.greedy.run(limits);
    let finish = join(prepared, vec![part], keep_log);
    log.collapses.extend(finish.collapses);
    log.joins.extend(finish.joins);
    log
}

/// Some triangles with a numbering of their own.
struct Part {
    greedy: Greedy,
    /// The whole mesh's numbers of triangles, vertices, wedges.
    triangles: Vec<u32>,
    vertices: Vec<u32>,
    wedges: Vec<u32>,
}

impl Part {
    /// - `vertices`: those of the part alone; - `local`: their numbers in it; - `rim`: vertices shared with others.
    fn new(prepared: &Prepared, triangles: Vec<u32>, vertices: Vec<u32>, local: &[u32], rim: &[bool]) -> Self {
        let inside = vertices.len();
        let mut vertices = vertices;
        let mut rim_numbers: HashMap<u32, u32> = HashMap::new();
        let corners: Vec<[u32; 3]> = triangles
            .iter()
            .map(|&t| {
                prepared.triangles[t as usize].map(|vertex| {
                    if !rim.get(vertex as usize).copied().unwrap_or(false) {
                        return local[vertex as usize];
                    }
                    *rim_numbers.entry(vertex).or_insert_with(|| {
                        vertices.push(vertex);
                        vertices.len() as u32 - 1
                    })
                })
            })
            .collect();
        let positions = vertices.iter().map(|&v| prepared.positions[v as usize]).collect();
        let kinds = vertices
            .iter()
            .enumerate()
            .map(|(i, &v)| if i < inside { prepared.kinds[v as usize] } else { Kind::Frozen })
            .collect();
        let (mut wedges, mut corner_wedges) = (Vec::new(), Vec::new());
        if !prepared.corner_wedges.is_empty() {
            let mut numbers: HashMap<u32, u32> = HashMap::new();
            for &t in &triangles {
                for wedge in &prepared.corner_wedges[3 * t as usize..][..3] {
                    corner_wedges.push(*numbers.entry(*wedge).or_insert_with(|| {
                        wedges.push(*wedge);
                        wedges.len() as u32 - 1
                    }));
                }
            }
        }
        let wedge_data = wedges.iter().map(|&w| prepared.wedges[w as usize]).collect();
        let quadrics: Vec<Quadric> = vertices.iter().map(|&v| prepared.quadrics[v as usize]).collect();
        let surface = Surface::new(&corners, positions, kinds, corner_wedges, wedge_data);
        Self { greedy: Greedy::new(surface, quadrics), triangles, vertices, wedges }
    }
}

fn split(prepared: &Prepared, count: usize) -> Vec<Part> {
    const SHARED: u32 = u32::MAX - 1;
    let bounds = Aabb::from_points(prepared.positions.iter().copied());
    let mut order: Vec<(u32, u32)> = prepared
        .triangles
        .par_iter()
        .enumerate()
        .map(|(t, triangle)| {
            let center = triangle.map(|v| prepared.positions[v as usize]).into_iter().sum::<Vec3>() / 3.0;
            (morton_code(center, &bounds), t as u32)
        })
        .collect();
    order.par_sort_unstable();
    let part_size = order.len().div_ceil(count);
    let mut owner = vec![NONE; prepared.positions.len()];
    for (p, chunk) in order.chunks(part_size).enumerate() {
        for &(_, t) in chunk {
            for vertex in prepared.triangles[t as usize] {
                let owner = &mut owner[vertex as usize];
                *owner = if *owner == NONE || *owner == p as u32 { p as u32 } else { SHARED };
            }
        }
    }
    let rim: Vec<bool> = owner.par_iter().map(|&o| o == SHARED).collect();
    // Vertices in the order in which the part's triangles use them: neighbours lie together in memory.
    let mut local = vec![NONE; owner.len()];
    let numbered: Vec<(Vec<u32>, Vec<u32>)> = order
        .chunks(part_size)
        .map(|chunk| {
            let mut vertices = Vec::new();
            for vertex in chunk.iter().flat_map(|&(_, t)| prepared.triangles[t as usize]) {
                if !rim[vertex as usize] && local[vertex as usize] == NONE {
                    local[vertex as usize] = vertices.len() as u32;
                    vertices.push(vertex);
                }
            }
            (chunk.iter().map(|&(_, t)| t).collect(), vertices)
        })
        .collect();
    numbered
        .into_par_iter()
        .with_max_len(1)
        .map(|(triangles, vertices)| Part::new(prepared, triangles, vertices, &local, &rim))
        .collect()
}

/// Raises the threshold, and lets every part follow it, until the whole is near the wanted count.
fn run_together(parts: &mut [Part], limits: Limits, triangles: usize) {
    // Triangles at rims stay whole for now; the others must not pay for them.
    let at_rims: usize = parts.iter().map(|part| part.greedy.surface.faces_at(Kind::Frozen)).sum();
    let excess = triangles - limits.faces;
    let done_at =
        limits.faces + excess / LEFT_TO_WHOLE + (at_rims as u128 * excess as u128 / triangles as u128) as usize;
    let mut total = triangles;
    let mut medians: Vec<f32> = parts.par_iter().with_max_len(1).map(|part| part.greedy.median_cost()).collect();
    medians.sort_unstable_by(f32::total_cmp);
    let mut threshold = medians[medians.len() / 2].min(limits.cost);
    while total > done_at && threshold < limits.cost {
        let excess = total - limits.faces;
        // How many parts were stopped by their share, not by the threshold.
        let stopped: usize = parts
            .par_iter_mut()
            .with_max_len(1)
            .map(|part| {
                let faces = part.greedy.surface.face_count;
                // Its share of what is too much: however cheap one part is, the whole cannot fall below the limit.
                let share = (excess as u128 * faces as u128 / total as u128) as usize;
                part.greedy.run(Limits { faces: faces - share, cost: threshold, ..limits });
                usize::from(part.greedy.surface.face_count <= faces - share)
            })
            .sum();
        let now: usize = parts.iter().map(|part| part.greedy.surface.face_count).sum();
        if now == total && stopped * 2 > parts.len() {
            // Shares too small to be worth a round.
            break;
        }
        // Parts that cost little come first: only when most have nothing left below it does the threshold rise.
        if stopped * 2 <= parts.len() {
            let next = parts.iter().filter_map(|part| part.greedy.next_cost()).min_by(f32::total_cmp);
            // In a desert of costs larger strides: each round fetches every part's memory anew.
            let stride = if (total - now) * 16 < excess { 8.0 } else { 2.0 };
            match next {
                Some(next) => threshold = (stride * threshold).max(next).min(limits.cost),
                None => break,
            }
        }
        total = now;
    }
}

/// Brings the parts' results back into the whole, and their steps into one order.
fn join(prepared: &mut Prepared, parts: Vec<Part>, keep_log: bool) -> Log {
    let mut triangles = Vec::new();
    let mut sources = Vec::new();
    let mut corner_wedges = Vec::new();
    for part in &parts {
        let surface = &part.greedy.surface;
        for (i, &vertex) in part.vertices.iter().enumerate().filter(|&(i, _)| surface.kinds[i] != Kind::Frozen) {
            prepared.positions[vertex as usize] = surface.positions[i];
            prepared.quadrics[vertex as usize] = part.greedy.quadrics[i];
            prepared.kinds[vertex as usize] = surface.kinds[i];
        }
        for (&global, &wedge) in part.wedges.iter().zip(&surface.wedges) {
            prepared.wedges[global as usize] = wedge;
        }
        for (t, vertices, wedges) in surface.live_triangles() {
            triangles.push(vertices.map(|v| part.vertices[v as usize]));
            sources.push(prepared.sources[part.triangles[t] as usize]);
            corner_wedges.extend(wedges.into_iter().flatten().map(|w| part.wedges[w as usize]));
        }
    }
    (prepared.triangles, prepared.sources, prepared.corner_wedges) = (triangles, sources, corner_wedges);
    if keep_log { merge_logs(parts) } else { Log::default() }
}

/// Steps by cost; each part's own are in order of cost already, and parts do not touch each other.
fn merge_logs(parts: Vec<Part>) -> Log {
    let mut steps: Vec<(u32, usize, usize, usize)> = Vec::new();
    for (p, part) in parts.iter().enumerate() {
        let mut first_join = 0;
        for (i, collapse) in part.greedy.log.collapses.iter().enumerate() {
            steps.push((collapse.cost.to_bits(), p, i, first_join));
            first_join += collapse.joins as usize;
        }
    }
    steps.par_sort_unstable();
    let mut log = Log::default();
    for (_, p, i, first_join) in steps {
        let part = &parts[p];
        let collapse = part.greedy.log.collapses[i];
        let name = |v: u32| part.vertices[v as usize];
        log.collapses.push(Collapse { from: name(collapse.from), to: name(collapse.to), ..collapse });
        log.joins.extend(part.greedy.log.joins[first_join..first_join + collapse.joins as usize].iter().map(|join| {
            WedgeJoin { from: part.wedges[join.from as usize], to: part.wedges[join.to as usize], ..*join }
        }));
    }
    log
}

/// Where a point lies along a curve that fills the box: near points have near numbers, mostly.
fn morton_code(point: Vec3, bounds: &Aabb) -> u32 {
    let size = bounds.size().max_element().max(f32::MIN_POSITIVE);
    let cell = ((point - bounds.min) / size * 1023.0).clamp(Vec3::ZERO, Vec3::splat(1023.0)).as_uvec3();
    let spread = |v: UVec3| {
        let v = (v | v << 16) & UVec3::splat(0x0300_00ff);
        let v = (v | v << 8) & UVec3::splat(0x0300_f00f);
        let v = (v | v << 4) & UVec3::splat(0x030c_30c3);
        (v | v << 2) & UVec3::splat(0x0924_9249)
    };
    let UVec3 { x, y, z } = spread(cell);
    x | y << 1 | z << 2
}
