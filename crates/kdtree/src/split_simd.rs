//! SIMD version of [`split::find_split`]: it bins two references, or compares one candidate with sixteen references, at
//! a time, and then evaluates sixteen candidates at a time.
//!
//! Every operation, its order, and the choice among ties are those of the scalar version, so the split has the same
//! bits.

use super::reference::{BuildConfig, Reference};
use super::simd::{InstructionSet, KernelSimd, LANES, Mask, dispatch};
use super::split::{self, EMPTY_CUT, MAX_BINS, MAX_FACES, Split};
use crate::geometry::Aabb;

/// Returns the split with the lowest expected cost, or `None` if a leaf costs no more.
pub(super) fn find_split(
    set: InstructionSet,
    references: &[Reference],
    cell: &Aabb,
    config: &BuildConfig,
) -> Option<Split> {
    if set == InstructionSet::Portable {
        return split::find_split(references, cell, config);
    }
    let mut found = None;
    let into = &mut found;
    dispatch!(set, search(references: &[Reference], cell: &Aabb, config: &BuildConfig, into: &mut Option<Split>));
    found
}

#[inline(always)]
fn search<S: KernelSimd>(s: S, references: &[Reference], cell: &Aabb, config: &BuildConfig, into: &mut Option<Split>) {
    let mut search = SimdSearch::new(s, references.len(), cell, config);
    let flat =
        if references.len() <= config.exact_below { search.try_faces(references) } else { search.try_bins(references) };
    for (axis, is_flat) in flat.into_iter().enumerate() {
        if is_flat {
            let mut candidates = Candidates::NONE;
            split::walls(references, cell, axis, |at, below, above| candidates.push(at, below, above));
            search.evaluate(axis, &candidates);
        }
    }
    *into = search.best;
}

/// The number of faces of the largest node whose faces are evaluated.
const MAX_CANDIDATES: usize = 2 * MAX_FACES;
// Planes between bins, and at either end of the references.
const _: () = assert!(MAX_BINS < MAX_CANDIDATES);

/// Planes across one axis, and the number of references on either side.
struct Candidates {
    at: [f32; MAX_CANDIDATES],
    below: [u32; MAX_CANDIDATES],
    above: [u32; MAX_CANDIDATES],
    len: usize,
}

impl Candidates {
    const NONE: Self =
        Self { at: [0.0; MAX_CANDIDATES], below: [0; MAX_CANDIDATES], above: [0; MAX_CANDIDATES], len: 0 };

    #[inline(always)]
    fn push(&mut self, at: f32, below: usize, above: usize) {
        let i = self.len % MAX_CANDIDATES;
        (self.at[i], self.below[i], self.above[i]) = (at, below as u32, above as u32);
        self.len += 1;
    }
}

struct SimdSearch<'a, S: KernelSimd> {
    s: S,
    config: &'a BuildConfig,
    cell: &'a Aabb,
    count: usize,
    inv_area: f32,
    /// Primitives in a block, as a power of two.
    log_block: u32,
    best_cost: f32,
    best: Option<Split>,
}

impl<'a, S: KernelSimd> SimdSearch<'a, S> {
    #[inline(always)]
    fn new(s: S, count: usize, cell: &'a Aabb, config: &'a BuildConfig) -> Self {
        assert!(config.block.is_power_of_two(), "blocks of {}", config.block);
        let log_block = config.block.trailing_zeros();
        let best_cost = config.block_cost * count.div_ceil(config.block) as f32;
        Self { s, config, cell, count, inv_area: 1.0 / (0.5 * cell.area()), log_block, best_cost, best: None }
    }

    #[inline(always)]
    fn side_cost(&self, counts: S::U) -> S::F {
        let (s, block_cost) = (self.s, self.s.splat(self.config.block_cost));
        if split::counts_partial_blocks(self.count, self.config) {
            return s.div(s.mul(block_cost, s.to_f(counts)), s.splat(self.config.block as f32));
        }
        let full = s.add_u(counts, s.splat_u(self.config.block as u32 - 1));
        s.mul(block_cost, s.to_f(s.shr_u(full, self.log_block)))
    }

    /// `split::Search::offer` for all candidates.
    #[inline(always)]
    fn evaluate(&mut self, axis: usize, candidates: &Candidates) {
        let s = self.s;
        let size = self.cell.size();
        let (a, b) = (size[(axis + 1) % 3], size[(axis + 2) % 3]);
        let (cap, rim, inv_area) = (s.splat(a * b), s.splat(a + b), s.splat(self.inv_area));
        let (lo, hi) = (s.splat(self.cell.min[axis]), s.splat(self.cell.max[axis]));
        let least_cut = s.splat(EMPTY_CUT * (self.cell.max[axis] - self.cell.min[axis]));
        let (none, one) = (s.splat_u(0), s.splat(1.0));
        let chunks = candidates.at.as_chunks::<LANES>().0.iter();
        let counts = candidates.below.as_chunks::<LANES>().0.iter().zip(candidates.above.as_chunks::<LANES>().0);
        for (i, (at_lanes, (below, above))) in chunks.zip(counts).enumerate() {
            let Some(left) = candidates.len.checked_sub(i * LANES + 1) else { return };
            let lanes = Mask::MAX >> (LANES - 1).saturating_sub(left);
            let (at, below, above) = (s.load(at_lanes), s.load_u(below), s.load_u(above));
            let room = lanes & s.lt(lo, at) & s.lt(at, hi);
            let (from_lo, to_hi) = (s.sub(at, lo), s.sub(hi, at));
            let below_share = s.mul(s.add(cap, s.mul(from_lo, rim)), inv_area);
            let above_share = s.mul(s.add(cap, s.mul(to_hi, rim)), inv_area);
            let cost = s.add(one, s.mul(below_share, self.side_cost(below)));
            let cost = s.add(cost, s.mul(above_share, self.side_cost(above)));
            let (none_below, none_above) = (s.eq_u(below, none), s.eq_u(above, none));
            let cut = s.select(none_below, from_lo, to_hi);
            let empty = (none_below | none_above) & s.lt(least_cut, cut);
            let cost = s.select(empty, s.mul(cost, s.splat(self.config.empty_factor)), cost);
            // NaN (a cell without area) is never lower.
            let better = room & s.lt(cost, s.splat(self.best_cost));
            if better != 0 {
                self.best_cost = s.least(better, cost);
                let first = (better & s.eq(cost, s.splat(self.best_cost))).trailing_zeros() as usize;
                self.best = Some(Split { axis, at: at_lanes[first % LANES] });
            }
        }
    }

    /// Returns the axes across which some reference is flat.
    #[inline(always)]
    fn try_faces(&mut self, references: &[Reference]) -> [bool; 3] {
        let (s, count) = (self.s, references.len());
        assert!(count <= MAX_FACES, "only small nodes try every face");
        let mut candidates = Candidates::NONE;
        candidates.len = 2 * count;
        let mut any_flat = [false; 3];
        for (axis, is_any_flat) in any_flat.iter_mut().enumerate() {
            // The padding is outside of every candidate, on neither side.
            let (mut min, mut max) = ([f32::INFINITY; MAX_FACES], [f32::NEG_INFINITY; MAX_FACES]);
            for (i, reference) in references.iter().enumerate() {
                (min[i], max[i]) = (reference.min[axis], reference.max[axis]);
            }
            candidates.at[..count].copy_from_slice(&min[..count]);
            candidates.at[count..2 * count].copy_from_slice(&max[..count]);
            let n_chunks = count.div_ceil(LANES);
            let chunks = || min.as_chunks::<LANES>().0.iter().zip(max.as_chunks::<LANES>().0).take(n_chunks);
            let mut flat: u32 = 0;
            for (i, (min, max)) in chunks().enumerate() {
                flat |= u32::from(s.eq(s.load(min), s.load(max))) << (i * LANES);
            }
            *is_any_flat = flat != 0;
            for i in 0..2 * count {
                let at = s.splat(candidates.at[i]);
                let (mut below, mut above) = (0, 0);
                for (j, (min, max)) in chunks().enumerate() {
                    let (min, max) = (s.load(min), s.load(max));
                    let starts_below = s.lt(min, at);
                    let lies_in = if flat != 0 { s.eq(min, at) & (flat >> (j * LANES)) as Mask } else { 0 };
                    below += (starts_below | lies_in).count_ones();
                    above += s.lt(at, max).count_ones();
                }
                (candidates.below[i], candidates.above[i]) = (below, above);
            }
            self.evaluate(axis, &candidates);
        }
        any_flat
    }

    /// Returns the axes across which some reference is flat.
    #[inline(always)]
    fn try_bins(&mut self, references: &[Reference]) -> [bool; 3] {
        let s = self.s;
        let bins = self.config.bins.min(MAX_BINS);
        let (pairs, single) = references.as_chunks::<2>();
        let single = single.first().map(|last| [*last; 2]);
        let (mut least, mut most) = (s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY));
        for pair in pairs.iter().chain(&single) {
            let lanes = s.load(&Reference::pair(pair));
            (least, most) = (s.min(lanes, least), s.max(lanes, most));
        }
        let (mut lanes_least, mut lanes_most) = ([0.0; LANES], [0.0; LANES]);
        s.store(least, &mut lanes_least);
        s.store(most, &mut lanes_most);
        let min: [f32; 3] = std::array::from_fn(|axis| lanes_least[axis].min(lanes_least[8 + axis]) + 0.0);
        let max: [f32; 3] = std::array::from_fn(|axis| lanes_most[4 + axis].max(lanes_most[12 + axis]) + 0.0);
        let size: [f32; 3] = std::array::from_fn(|axis| max[axis] - min[axis]);
        let scale = size.map(|size| if size > 0.0 { bins as f32 / size } else { 0.0 });
        // The memory layout of references, twice: minimum, index, maximum, unused. The indices, reinterpreted as `f32`,
        // are arbitrary and must not become subnormal, because subnormals multiply slowly.
        let by_axis = |of: [f32; 3], other: f32| -> [f32; LANES] {
            std::array::from_fn(|lane| if lane % 4 < 3 { of[lane % 4] } else { other })
        };
        let (origin, scale) = (s.load(&by_axis(min, 1.0)), s.load(&by_axis(scale, 0.0)));
        let other_end = s.load_u(&std::array::from_fn(|lane| lane as u32 ^ 4));
        let (first_bin, last_bin) = (s.splat(0.0), s.splat((bins - 1) as f32));
        // Separate counts for starts and ends of either reference of a pair, so that neighbours in the same bin are
        // independent.
        let mut counts = [[0u32; MAX_BINS]; LANES];
        let mut flat: Mask = 0;
        for (i, pair) in pairs.iter().chain(&single).enumerate() {
            let lanes = s.load(&Reference::pair(pair));
            flat |= s.eq(lanes, s.lookup(lanes, other_end));
            let place = s.mul(s.sub(lanes, origin), scale);
            // NaN becomes the first bin.
            let bin = s.truncate(s.min(s.max(place, first_bin), last_bin));
            let mut bin_of = [0; LANES];
            s.store_u(bin, &mut bin_of);
            for lane in [0, 1, 2, 4, 5, 6] {
                counts[lane][bin_of[lane] as usize % MAX_BINS] += 1;
            }
            if i < pairs.len() {
                for lane in [8, 9, 10, 12, 13, 14] {
                    counts[lane][bin_of[lane] as usize % MAX_BINS] += 1;
                }
            }
        }
        let mut candidates = Candidates::NONE;
        for axis in 0..3 {
            candidates.len = 0;
            candidates.push(min[axis], 0, self.count);
            candidates.push(max[axis], self.count, 0);
            let (mut below, mut above) = (0, self.count);
            for bin in 1..bins {
                below += (counts[axis][bin - 1] + counts[8 + axis][bin - 1]) as usize;
                above -= (counts[4 + axis][bin - 1] + counts[12 + axis][bin - 1]) as usize;
                candidates.push(min[axis] + size[axis] * (bin as f32 / bins as f32), below, above);
            }
            self.evaluate(axis, &candidates);
        }
        std::array::from_fn(|axis| flat >> axis & 1 != 0 || flat >> (8 + axis) & 1 != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BuildPreset;
    use glam::Vec3;

    #[test]
    fn all_instruction_sets_find_the_same_splits() {
        let mut state = 11u64;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let (mut found, mut walls) = (0, 0);
        let counts = [1, 2, 7, 15, 16, 17, 31, 32, 33, 40, 64, 65, 130, 517];
        for case in 0..4032 {
            let count = counts[case % counts.len()];
            // Each of these is combined with each of the others, and with each count.
            let (kind, block) = (case / counts.len() % 8, [1, 16][case / counts.len() / 8 % 2]);
            let scale = [1.0, 1.0, 1.0, 1.0, 1e-40, 1e38][case / counts.len() / 16 % 6];
            // Half of the cases have few distinct numbers, so that many planes cost the same; zeros of both signs.
            let coarse = kind % 2 == 0;
            let mut number = || {
                let x = random() * 2.0 - 1.0;
                scale * if coarse { (x * 3.0).round() / 3.0 } else { x }
            };
            let references: Vec<Reference> = (0..count)
                .map(|prim| {
                    let mut point = || Vec3::new(number(), number(), number());
                    let (mut a, b) = (point(), point());
                    let mut b = a + 0.3 * (b - a);
                    if prim % 5 == 0 {
                        // Flat, in some nodes lying in a face.
                        a.y = if kind % 4 == 1 { -scale } else { a.y };
                        b.y = a.y;
                    }
                    Reference::new(&Aabb::from_points([a, b]), prim as u32 * 1_000_003)
                })
                .collect();
            let mut cell = Aabb { min: Vec3::splat(-scale), max: Vec3::splat(scale) };
            // A cell without thickness, and one without area.
            if kind >= 6 {
                cell.max.x = cell.min.x;
            }
            if kind == 7 {
                cell.max.z = cell.min.z;
            }
            for preset in [BuildPreset::Best, BuildPreset::Quick] {
                let config = preset.config(block);
                let plain = split::find_split(&references, &cell, &config);
                found += usize::from(plain.is_some());
                walls += usize::from(plain.is_some_and(|split| split.at == (-scale).next_up()));
                for set in InstructionSet::available() {
                    let split = find_split(set, &references, &cell, &config);
                    let bits = |split: Option<Split>| split.map(|split| (split.axis, split.at.to_bits()));
                    assert_eq!(bits(split), bits(plain), "{set:?}, case {case}, {count} references, blocks of {block}");
                }
            }
        }
        assert!(found > 3000 && walls > 100, "{found} splits, {walls} at walls");
    }
}
