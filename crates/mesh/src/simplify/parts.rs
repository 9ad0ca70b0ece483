//! The quadric simplifier on many threads.
//!
//! The mesh is cut into parts along a space-filling curve. Each part is simplified separately with its rim frozen, and
//! all parts follow one cost threshold that rises until little is left to do. Then the remaining mesh is cut again in
//! other places, so that the first rims lie inside of parts, and these finish. Parts depend on the mesh alone, so any
//! number of threads gives the same result.

use super::greedy::{CollapseLimits, Greedy};
use super::prepare::PreparedMesh;
use super::quadric::Quadric;
use super::surface::{Kind, NONE, Surface};
use firstlight_kdtree::geometry::Aabb;
use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// Approximate number of triangles per part: small enough for a core's second-level cache, large enough that few lie at
/// the rim.
const PART_TRIANGLES: usize = 8_192;
/// The first cut leaves this fraction of the work, in addition to that at its rims, to the second, which evens out the
/// parts.
const LEFT_FOR_SECOND_CUT: usize = 64;

/// Simplifies in place: afterwards `prepared` holds the remaining mesh, and vertices keep their indices.
pub(super) fn simplify(prepared: &mut PreparedMesh, limits: CollapseLimits) {
    simplify_in(PART_TRIANGLES, prepared, limits);
}

/// Like [`simplify`], with a given part size. With parts as large as the mesh this is the plain method with one queue,
/// the reference of tests.
pub(super) fn simplify_in(part_triangles: usize, prepared: &mut PreparedMesh, limits: CollapseLimits) {
    let mut threshold = None;
    for cut in [Cut::First, Cut::Second] {
        let total = prepared.triangles.len();
        let count = total.div_ceil(part_triangles);
        if count <= 1 || total <= limits.faces {
            break;
        }
        let mut parts = split(prepared, count, cut);
        threshold = Some(run_all(&mut parts, limits, total, cut, threshold));
        join(prepared, parts);
    }
    // Handles small meshes, and work that rims have prevented.
    if prepared.triangles.len() > limits.faces {
        let whole: Vec<u32> = (0..prepared.triangles.len() as u32).collect();
        let mut part = MeshPart::new(prepared, whole, &prepared.valences(), &mut Numbering::of(prepared));
        part.greedy.run(limits);
        join(prepared, vec![part]);
    }
}

/// Position of the cuts, and how far parts are simplified.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cut {
    First,
    Second,
}

/// A subset of the triangles with local indices.
struct MeshPart {
    greedy: Greedy,
    /// Indices of triangles, vertices and wedges in the whole mesh.
    triangles: Vec<u32>,
    vertices: Vec<u32>,
    wedges: Vec<u32>,
}

/// Local indices of the whole mesh's vertices and wedges, `NONE` elsewhere: memory reused for one part after another.
struct Numbering {
    vertices: Vec<u32>,
    wedges: Vec<u32>,
}

impl Numbering {
    fn of(prepared: &PreparedMesh) -> Self {
        Self { vertices: vec![NONE; prepared.positions.len()], wedges: vec![NONE; prepared.wedges.len()] }
    }
}

impl MeshPart {
    /// Creates a part.
    ///
    /// - `valences`: triangles per vertex in the whole mesh.
    fn new(prepared: &PreparedMesh, triangles: Vec<u32>, valences: &[u32], numbering: &mut Numbering) -> Self {
        // Vertices in order of use by the triangles: neighbours are close in memory.
        let mut vertices = Vec::with_capacity(triangles.len() * 3 / 4);
        let numbers = &mut numbering.vertices;
        let corners: Vec<[u32; 3]> = triangles
            .iter()
            .map(|&t| prepared.triangles[t as usize].map(|vertex| number(vertex, numbers, &mut vertices)))
            .collect();
        vertices.iter().for_each(|&vertex| numbers[vertex as usize] = NONE);
        let (mut wedges, mut corner_wedges) = (Vec::new(), Vec::new());
        if !prepared.corner_wedges.is_empty() {
            let numbers = &mut numbering.wedges;
            let all = triangles.iter().flat_map(|&t| &prepared.corner_wedges[3 * t as usize..][..3]);
            corner_wedges = all.map(|&wedge| number(wedge, numbers, &mut wedges)).collect();
            wedges.iter().for_each(|&wedge| numbers[wedge as usize] = NONE);
        }
        let positions = vertices.iter().map(|&v| prepared.positions[v as usize]).collect();
        let kinds = vertices.iter().map(|&v| prepared.kinds[v as usize]).collect();
        let wedge_data = wedges.iter().map(|&w| prepared.wedges[w as usize]).collect();
        let quadrics: Vec<Quadric> = vertices.iter().map(|&v| prepared.quadrics[v as usize]).collect();
        let mut surface = Surface::new(&corners, positions, kinds, corner_wedges, wedge_data);
        // A vertex that has triangles in other parts is on the rim.
        for (i, &vertex) in vertices.iter().enumerate() {
            if surface.valence(i) != valences[vertex as usize] {
                surface.kinds[i] = Kind::Frozen;
            }
        }
        Self { greedy: Greedy::new(surface, quadrics), triangles, vertices, wedges }
    }
}

/// Returns the index of `item` in `items`, appending it if it is new.
#[inline]
fn number(item: u32, numbers: &mut [u32], items: &mut Vec<u32>) -> u32 {
    let number = &mut numbers[item as usize];
    if *number == NONE {
        *number = items.len() as u32;
        items.push(item);
    }
    *number
}

fn split(prepared: &PreparedMesh, count: usize, cut: Cut) -> Vec<MeshPart> {
    let bounds = Aabb::from_points(prepared.positions.iter().copied());
    let codes: Vec<(u32, u32)> = prepared
        .triangles
        .par_iter()
        .enumerate()
        .map(|(t, triangle)| {
            let center = triangle.map(|v| prepared.positions[v as usize]).into_iter().sum::<Vec3>() / 3.0;
            (morton_code(center, &bounds, cut), t as u32)
        })
        .collect();
    let (order, valences) = rayon::join(|| sorted_by_code(codes), || prepared.valences());
    order
        .par_chunks(order.len().div_ceil(count))
        .with_max_len(1)
        .map_init(
            || Numbering::of(prepared),
            |numbering, chunk| MeshPart::new(prepared, chunk.iter().map(|&(_, t)| t).collect(), &valences, numbering),
        )
        .collect()
}

/// Raises the threshold, to which all parts are simplified, until the whole is near the target count, or after the
/// second cut exactly there. Returns the threshold.
///
/// - `threshold`: initial value; by default the median cost of the edges.
fn run_all(parts: &mut [MeshPart], limits: CollapseLimits, triangles: usize, cut: Cut, threshold: Option<f32>) -> f32 {
    let excess = triangles - limits.faces;
    let done_at = match cut {
        Cut::First => {
            // Triangles at rims cannot collapse yet; the others must not make up for them.
            let at_rims: usize = parts.iter().map(|part| part.greedy.surface.faces_at(Kind::Frozen)).sum();
            let share = at_rims as u128 * excess as u128 / triangles as u128;
            limits.faces + excess / LEFT_FOR_SECOND_CUT + share as usize
        }
        Cut::Second => limits.faces,
    };
    let mut total = triangles;
    let mut threshold = threshold.unwrap_or_else(|| {
        let mut medians: Vec<f32> = parts.par_iter().with_max_len(1).map(|part| part.greedy.median_cost()).collect();
        medians.sort_unstable_by(f32::total_cmp);
        medians[medians.len() / 2].min(limits.cost)
    });
    while total > done_at && threshold < limits.cost {
        let excess = total - limits.faces;
        // Number of parts stopped by their share, not by the threshold.
        let stopped: usize = parts
            .par_iter_mut()
            .with_max_len(1)
            .map(|part| {
                let faces = part.greedy.surface.face_count;
                // The part's share of the excess: however cheap one part is, the whole cannot fall below the limit.
                let share = (excess as u128 * faces as u128 / total as u128) as usize;
                // A step removes two triangles: one less, so that it cannot exceed the share.
                let least = faces - share.saturating_sub(1);
                part.greedy.run(CollapseLimits { faces: least, cost: threshold, ..limits });
                usize::from(part.greedy.surface.face_count <= least)
            })
            .sum();
        let now: usize = parts.iter().map(|part| part.greedy.surface.face_count).sum();
        if now == total && stopped * 2 > parts.len() {
            // The shares are too small to be worth another round.
            break;
        }
        // Cheap parts come first: the threshold rises only when most parts have nothing left below it.
        if stopped * 2 <= parts.len() {
            let next = parts.iter_mut().filter_map(|part| part.greedy.next_cost()).min_by(f32::total_cmp);
            // Where few edges are near the threshold, larger strides pay: each round fetches every part's memory again.
            let stride = if (total - now) * 16 < excess { 8.0 } else { 2.0 };
            match next {
                Some(next) => threshold = (stride * threshold).max(next).min(limits.cost),
                None => break,
            }
        }
        total = now;
    }
    if cut == Cut::Second {
        finish_one_by_one(parts, limits);
    }
    threshold
}

/// Does the last few steps, fewer than there are parts, in order of cost.
fn finish_one_by_one(parts: &mut [MeshPart], limits: CollapseLimits) {
    loop {
        let total: usize = parts.iter().map(|part| part.greedy.surface.face_count).sum();
        let costs = parts.iter_mut().enumerate().filter_map(|(p, part)| Some((part.greedy.next_cost()?, p)));
        let cheapest = costs.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match cheapest {
            Some((cost, p)) if total > limits.faces && cost <= limits.cost => {
                let faces = parts[p].greedy.surface.face_count - 1;
                // Stops when the next step of this part would cost more, to let another part continue.
                parts[p].greedy.run(CollapseLimits { faces, cost, ..limits });
            }
            _ => break,
        }
    }
}

/// Writes the parts' results back into the whole mesh.
fn join(prepared: &mut PreparedMesh, parts: Vec<MeshPart>) {
    let left: Vec<(Vec<[u32; 3]>, Vec<u32>, Vec<u32>)> = parts
        .par_iter()
        .with_max_len(1)
        .map(|part| {
            let surface = &part.greedy.surface;
            let (mut triangles, mut sources) = (Vec::with_capacity(surface.face_count), Vec::new());
            let mut corner_wedges = Vec::new();
            for (t, vertices, wedges) in surface.live_triangles() {
                triangles.push(vertices.map(|v| part.vertices[v as usize]));
                sources.push(prepared.sources[part.triangles[t] as usize]);
                corner_wedges.extend(wedges.into_iter().flatten().map(|w| part.wedges[w as usize]));
            }
            (triangles, sources, corner_wedges)
        })
        .collect();
    prepared.triangles.clear();
    prepared.sources.clear();
    prepared.corner_wedges.clear();
    for (triangles, sources, corner_wedges) in left {
        prepared.triangles.extend(triangles);
        prepared.sources.extend(sources);
        prepared.corner_wedges.extend(corner_wedges);
    }
    for part in &parts {
        let surface = &part.greedy.surface;
        for (i, &vertex) in part.vertices.iter().enumerate() {
            // Removed vertices are never read again, and frozen ones have not changed.
            if surface.valence(i) > 0 && surface.kinds[i] != Kind::Frozen {
                prepared.positions[vertex as usize] = surface.positions[i];
                prepared.quadrics[vertex as usize] = part.greedy.quadrics[i];
                prepared.kinds[vertex as usize] = surface.kinds[i];
            }
        }
        for (&global, &wedge) in part.wedges.iter().zip(&surface.wedges) {
            prepared.wedges[global as usize] = wedge;
        }
    }
}

/// Returns the position of a point along a curve that fills the box, 21 bits: near points mostly have near codes.
fn morton_code(point: Vec3, bounds: &Aabb, cut: Cut) -> u32 {
    let size = bounds.size().max_element().max(f32::MIN_POSITIVE);
    let place = (point - bounds.min) / size;
    // The curve's longest jumps are at the halves and quarters of the box: those of the two cuts must not coincide.
    let place = if cut == Cut::First { place } else { 0.7 * place + 0.3 };
    let cell = (place * 127.0).clamp(Vec3::ZERO, Vec3::splat(127.0)).as_uvec3();
    let spread = |v: UVec3| {
        let v = (v | v << 8) & UVec3::splat(0x0000_f00f);
        let v = (v | v << 4) & UVec3::splat(0x000c_30c3);
        (v | v << 2) & UVec3::splat(0x0024_9249)
    };
    let UVec3 { x, y, z } = spread(cell);
    x | y << 1 | z << 2
}

/// Stable sort by the first number, which has at most 22 bits.
fn sorted_by_code(mut items: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    const BITS: u32 = 11;
    let mut sorted = vec![(0, 0); items.len()];
    for shift in [0, BITS] {
        let digit = |code: u32| (code >> shift) as usize & ((1 << BITS) - 1);
        let mut next = [0_u32; 1 << BITS];
        items.iter().for_each(|item| next[digit(item.0)] += 1);
        let mut sum = 0;
        for count in &mut next {
            sum += std::mem::replace(count, sum);
        }
        for &item in &items {
            let place = &mut next[digit(item.0)];
            sorted[*place as usize] = item;
            *place += 1;
        }
        std::mem::swap(&mut items, &mut sorted);
    }
    items
}
