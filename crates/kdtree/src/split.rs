//! Choice of the split of a cell: the surface area heuristic over bins or over all faces, and the median for
//! comparison.
//!
//! Scalar version, for processors without SIMD support, and the reference for `split_simd`, which must find the same
//! splits.

use super::reference::{BuildConfig, Reference};
use crate::geometry::Aabb;
use glam::Vec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub axis: usize,
    pub at: f32,
}

/// Cuts of less than this share of a cell get no bonus for the empty space they remove.
pub(super) const EMPTY_CUT: f32 = 0.05;

/// Limits on the number of bins, and on the references of a node whose faces are evaluated.
pub(super) const MAX_BINS: usize = 16;
pub(super) const MAX_FACES: usize = 32;

/// Returns the split with the lowest expected cost, or `None` if a leaf costs no more.
pub(super) fn find_split(references: &[Reference], cell: &Aabb, config: &BuildConfig) -> Option<Split> {
    let mut search = Search::new(references.len(), cell, config);
    if references.len() <= config.exact_below {
        search.try_faces(references);
    } else {
        search.try_bins(references);
    }
    search.try_walls(references);
    search.best
}

/// Whether partial blocks count proportionally in the cost: in large nodes they do, because further splits even out the
/// steps of a block.
pub(super) fn counts_partial_blocks(count: usize, config: &BuildConfig) -> bool {
    count > 4 * config.block
}

/// Offers splits that separate references lying flat in a face of the cell, which a ray through the cell would test
/// although they are a wall behind it.
///
/// The plane next to the face puts them in a cell without thickness, which only rays that cross the wall visit.
///
/// - `offer`: receives the plane and the number of references on either side.
pub(super) fn walls(references: &[Reference], cell: &Aabb, axis: usize, mut offer: impl FnMut(f32, usize, usize)) {
    let (lo, hi) = (cell.min[axis], cell.max[axis]);
    let is_flat = |face: f32| references.iter().any(|r| r.min[axis] == face && r.max[axis] == face);
    for (face, at) in [(lo, lo.next_up()), (hi, hi.next_down())] {
        if is_flat(face) {
            let below = references.iter().filter(|r| r.is_below(axis, at)).count();
            let above = references.iter().filter(|r| r.is_above(axis, at)).count();
            offer(at, below, above);
        }
    }
}

struct Search<'a> {
    config: &'a BuildConfig,
    cell: &'a Aabb,
    count: usize,
    /// 1 over half the surface area of the cell.
    inv_area: f32,
    best_cost: f32,
    best: Option<Split>,
}

impl<'a> Search<'a> {
    fn new(count: usize, cell: &'a Aabb, config: &'a BuildConfig) -> Self {
        let area = 0.5 * cell.area();
        let mut search = Self { config, cell, count, inv_area: 1.0 / area, best_cost: 0.0, best: None };
        search.best_cost = search.leaf_cost(count);
        search
    }

    fn leaf_cost(&self, count: usize) -> f32 {
        self.config.block_cost * count.div_ceil(self.config.block) as f32
    }

    fn side_cost(&self, count: usize) -> f32 {
        if counts_partial_blocks(self.count, self.config) {
            self.config.block_cost * count as f32 / self.config.block as f32
        } else {
            self.leaf_cost(count)
        }
    }

    #[inline]
    fn offer(&mut self, axis: usize, at: f32, below: usize, above: usize) {
        let (lo, hi) = (self.cell.min[axis], self.cell.max[axis]);
        // Also false if rounding or a flat cell leaves no room for a split.
        if !(at > lo && at < hi) {
            return;
        }
        let size = self.cell.size();
        let (a, b) = (size[(axis + 1) % 3], size[(axis + 2) % 3]);
        let (cap, rim) = (a * b, a + b);
        let below_share = (cap + (at - lo) * rim) * self.inv_area;
        let above_share = (cap + (hi - at) * rim) * self.inv_area;
        let mut cost = 1.0 + below_share * self.side_cost(below) + above_share * self.side_cost(above);
        let cut = if below == 0 { at - lo } else { hi - at };
        if (below == 0 || above == 0) && cut > EMPTY_CUT * (hi - lo) {
            cost *= self.config.empty_factor;
        }
        // NaN (a cell without area) is never lower.
        if cost < self.best_cost {
            self.best_cost = cost;
            self.best = Some(Split { axis, at });
        }
    }

    fn try_walls(&mut self, references: &[Reference]) {
        for axis in 0..3 {
            walls(references, self.cell, axis, |at, below, above| self.offer(axis, at, below, above));
        }
    }

    fn try_bins(&mut self, references: &[Reference]) {
        let bins = self.config.bins.min(MAX_BINS);
        let tight = tight_bounds(references);
        let (min, size) = (tight.min.to_array(), tight.size().to_array());
        let scale = size.map(|size| if size > 0.0 { bins as f32 / size } else { 0.0 });
        let mut starts = [[0u32; MAX_BINS]; 3];
        let mut ends = [[0u32; MAX_BINS]; 3];
        for reference in references {
            for axis in 0..3 {
                // `as` saturates, so an infinite scale is harmless.
                let first = ((reference.min[axis] - min[axis]) * scale[axis]) as usize;
                let last = ((reference.max[axis] - min[axis]) * scale[axis]) as usize;
                starts[axis][first.min(bins - 1)] += 1;
                ends[axis][last.min(bins - 1)] += 1;
            }
        }
        for axis in 0..3 {
            self.offer(axis, tight.min[axis], 0, self.count);
            self.offer(axis, tight.max[axis], self.count, 0);
            let (mut below, mut above) = (0, self.count);
            for bin in 1..bins {
                below += starts[axis][bin - 1] as usize;
                above -= ends[axis][bin - 1] as usize;
                self.offer(axis, min[axis] + size[axis] * (bin as f32 / bins as f32), below, above);
            }
        }
    }

    fn try_faces(&mut self, references: &[Reference]) {
        let count = references.len();
        assert!(count <= MAX_FACES, "only small nodes try every face");
        for axis in 0..3 {
            // The padding is outside of every candidate, on neither side.
            let (mut min, mut max) = ([f32::INFINITY; MAX_FACES], [f32::NEG_INFINITY; MAX_FACES]);
            for (i, reference) in references.iter().enumerate() {
                (min[i], max[i]) = (reference.min[axis], reference.max[axis]);
            }
            let lanes = count.next_multiple_of(16);
            let (min_lanes, max_lanes) = (&min[..lanes], &max[..lanes]);
            for i in 0..2 * count {
                let at = if i < count { min[i] } else { max[i - count] };
                let (mut below, mut above, mut flat) = (0u32, 0u32, 0u32);
                for (min, max) in min_lanes.iter().zip(max_lanes) {
                    below += u32::from(*min < at);
                    above += u32::from(*max > at);
                    flat += u32::from((*min == at) & (*max == at));
                }
                self.offer(axis, at, (below + flat) as usize, above as usize);
            }
        }
    }
}

fn tight_bounds(references: &[Reference]) -> Aabb {
    let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for reference in references {
        for axis in 0..3 {
            min[axis] = min[axis].min(reference.min[axis]);
            max[axis] = max[axis].max(reference.max[axis]);
        }
    }
    // Adding 0 makes zeros positive, independent of the order.
    Aabb { min: (Vec3::from(min) + 0.0), max: (Vec3::from(max) + 0.0) }
}

/// Splits at the median reference along the longest side of the cell.
pub(super) fn median_split(references: &[Reference], cell: &Aabb) -> Option<Split> {
    let size = cell.size();
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]))?;
    let mut centers: Vec<f32> = references.iter().map(|r| 0.5 * r.min[axis] + 0.5 * r.max[axis]).collect();
    let middle = centers.len() / 2;
    let (_, &mut at, _) = centers.select_nth_unstable_by(middle, f32::total_cmp);
    (at > cell.min[axis] && at < cell.max[axis]).then_some(Split { axis, at })
}
