//! Sampling of the unit square in proportion to an image.

use firstlight_simd::{Bits, Float, Real, Simd, Word, select};
use glam::Vec2;

/// A piecewise constant pdf over the unit square, sampled by inversion, which preserves stratification.
#[derive(Clone, Debug)]
pub struct PictureDistribution {
    width: usize,
    height: usize,
    /// Cumulative sums of the rows, normalised: row y has `width + 1` numbers from 0 to 1.
    rows: Vec<f32>,
    /// Where to search in each row, see [`push_guide`].
    row_guides: Vec<u32>,
    /// Cumulative sum over the rows, normalised: `height + 1` numbers.
    columns: Vec<f32>,
    column_guide: Vec<u32>,
}

impl PictureDistribution {
    /// Creates a distribution from `weights` row by row, finite and not negative. `None` if all are zero.
    pub fn new(width: usize, height: usize, weights: &[f32]) -> Option<Self> {
        assert_eq!(weights.len(), width * height);
        let mut rows = Vec::with_capacity((width + 1) * height);
        let mut row_sums = Vec::with_capacity(height);
        for row in weights.chunks_exact(width) {
            let sum = push_cumulative(&mut rows, row.iter().map(|&w| f64::from(w)));
            row_sums.push(sum);
        }
        let mut columns = Vec::with_capacity(height + 1);
        let total = push_cumulative(&mut columns, row_sums.iter().copied());
        let mut row_guides = Vec::with_capacity(guide_len(width) * height);
        rows.chunks_exact(width + 1).for_each(|row| push_guide(&mut row_guides, row));
        let mut column_guide = Vec::new();
        push_guide(&mut column_guide, &columns);
        (total > 0.0).then_some(Self { width, height, rows, row_guides, columns, column_guide })
    }

    /// Samples a point; returns it with its pdf with respect to area on the unit square.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (y, dy, py) = invert(&self.columns, &self.column_guide, u.y);
        let row = &self.rows[y * (self.width + 1)..][..self.width + 1];
        let len = guide_len(self.width);
        let (x, dx, px) = invert(row, &self.row_guides[y * len..][..len], u.x);
        let point = Vec2::new((x as f32 + dx) / self.width as f32, (y as f32 + dy) / self.height as f32);
        (point, px * py * (self.width * self.height) as f32)
    }

    /// Pdf with respect to area on the unit square.
    #[inline]
    pub fn pdf(&self, point: Vec2) -> f32 {
        let x = ((point.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((point.y * self.height as f32) as usize).min(self.height - 1);
        let row = &self.rows[y * (self.width + 1)..];
        let (px, py) = (row[x + 1] - row[x], self.columns[y + 1] - self.columns[y]);
        px * py * (self.width * self.height) as f32
    }
}

impl PictureDistribution {
    /// Like [`Self::sample`], for sixteen points.
    #[inline(always)]
    pub(crate) fn sample_lanes<S: Simd>(&self, [u, v]: [Float<S>; 2]) -> ([Float<S>; 2], Float<S>) {
        let (width, height, len) = (self.width as u32, self.height as u32, guide_len(self.width) as u32);
        let first = Bits::splat(u.s, 0);
        let (y, dy, py) = invert_lanes(
            (&self.columns, first, height + 1),
            (&self.column_guide, first, guide_len(self.height) as u32),
            v,
        );
        let (x, dx, px) = invert_lanes((&self.rows, y * (width + 1), width + 1), (&self.row_guides, y * len, len), u);
        let point = [(x.to_float() + dx) / width as f32, (y.to_float() + dy) / height as f32];
        (point, px * py * (self.width * self.height) as f32)
    }

    /// Like [`Self::pdf`], for sixteen points.
    #[inline(always)]
    pub(crate) fn pdf_lanes<S: Simd>(&self, [u, v]: [Float<S>; 2]) -> Float<S> {
        let (width, height) = (self.width as f32, self.height as f32);
        let x = (u * width).at_least(0.0).at_most(width - 1.0).truncate();
        let y = (v * height).at_least(0.0).at_most(height - 1.0).truncate();
        let at = y * (self.width as u32 + 1) + x;
        let px = Float::gather(&self.rows, at + 1) - Float::gather(&self.rows, at);
        let py = Float::gather(&self.columns, y + 1) - Float::gather(&self.columns, y);
        px * py * (self.width * self.height) as f32
    }
}

/// Like [`invert`], in sixteen lists of one table.
///
/// - `cumulative`, `guide`: table, start of the list of each lane, length of a list.
#[inline(always)]
fn invert_lanes<S: Simd>(
    (cumulative, start, n): (&[f32], Bits<S>, u32),
    (guide, guide_start, n_guide): (&[u32], Bits<S>, u32),
    u: Float<S>,
) -> (Bits<S>, Float<S>, Float<S>) {
    let (s, n_steps) = (u.s, n_guide - 1);
    let least = |a: Bits<S>, most: u32| Bits { s, v: s.select_u(s.lt_u(a.v, s.splat_u(most)), a.v, s.splat_u(most)) };
    let step = (u * n_steps as f32).truncate();
    // Rounding may lead to a neighbour.
    let before = Bits { s, v: s.select_u(step.equals(0), step.v, (step + u32::MAX).v) };
    let mut low = Bits::gather(guide, guide_start + before);
    let mut high = Bits::gather(guide, guide_start + least(step + 2, n_steps));
    loop {
        let open = s.lt_u(low.v, high.v);
        if open == 0 {
            break;
        }
        let middle = (low + high).shift_right(1);
        let is_below = Float::gather(cumulative, start + middle).le(u);
        low = Bits { s, v: s.select_u(open & is_below, (middle + 1).v, low.v) };
        high = Bits { s, v: s.select_u(open & !is_below, middle.v, high.v) };
    }
    let after = least(low, n - 1);
    let after = Bits { s, v: s.select_u(after.equals(0), s.splat_u(1), after.v) };
    let before = after + u32::MAX;
    let (low, high) = (Float::gather(cumulative, start + before), Float::gather(cumulative, start + after));
    let width = high - low;
    let part = ((u - low) / width).at_least(0.0).at_most(1.0f32.next_down());
    (before, select(width.is_positive(), part, u.all(0.5)), width)
}

/// Appends 0 and the cumulative sums scaled to end at 1 (uniform steps if all weights are zero); returns the sum.
fn push_cumulative(target: &mut Vec<f32>, weights: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let sum: f64 = weights.clone().sum();
    let n = weights.len() as f64;
    let mut running = 0.0;
    target.push(0.0);
    for (i, weight) in weights.enumerate() {
        running += weight;
        target.push(if sum > 0.0 { (running / sum) as f32 } else { ((i + 1) as f64 / n) as f32 });
    }
    // Rounding must not leave a gap at the end, and last weights of zero must keep zero width.
    let last = *target.last().expect("just pushed");
    let start = target.len() - (n as usize + 1);
    target[start..].iter_mut().rev().take_while(|x| **x == last).for_each(|x| *x = 1.0);
    sum
}

/// Intervals per entry of a guide.
const PER_ENTRY: usize = 4;

/// Entries of the guide of `n` intervals.
fn guide_len(n: usize) -> usize {
    n.div_ceil(PER_ENTRY) + 1
}

/// Appends, for `u` in equal steps from 0 to 1, how many of the cumulative sums are at most `u`: between two of them lie
/// few, on average, whatever the distribution (Chen and Asau 1974).
fn push_guide(target: &mut Vec<u32>, cumulative: &[f32]) {
    let n_steps = guide_len(cumulative.len() - 1) - 1;
    let mut at_most = 0;
    for step in 0..=n_steps {
        let u = step as f32 / n_steps as f32;
        at_most += cumulative[at_most..].iter().take_while(|&&c| c <= u).count();
        target.push(at_most as u32);
    }
}

/// Returns the index of the interval that contains `u`, the position in it, and its width.
///
/// - `guide`: from [`push_guide`].
#[inline]
fn invert(cumulative: &[f32], guide: &[u32], u: f32) -> (usize, f32, f32) {
    let n_steps = guide.len() - 1;
    // Rounding may lead to a neighbour.
    let step = (u * n_steps as f32) as usize;
    let (first, last) = (guide[step.saturating_sub(1)] as usize, guide[(step + 2).min(n_steps)] as usize);
    let after = (first + cumulative[first..last].partition_point(|&c| c <= u)).clamp(1, cumulative.len() - 1);
    let (low, high) = (cumulative[after - 1], cumulative[after]);
    let width = high - low;
    let inside = if width > 0.0 { ((u - low) / width).clamp(0.0, 1.0f32.next_down()) } else { 0.5 };
    (after - 1, inside, width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_the_density_that_pdf_says() {
        let weights = [0.0, 1.0, 5.0, 0.0, 2.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
        let distribution = PictureDistribution::new(4, 3, &weights).unwrap();
        let n = 512;
        let mut counts = [0u32; 12];
        for i in 0..n * n {
            let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            let (point, pdf) = distribution.sample(u);
            assert!((distribution.pdf(point) - pdf).abs() < 1e-5 * pdf);
            counts[(point.y * 3.0) as usize * 4 + (point.x * 4.0) as usize] += 1;
        }
        for (count, weight) in counts.iter().zip(weights) {
            let expected = weight / 8.5 * (n * n) as f32;
            assert!((*count as f32 - expected).abs() <= 2.0 * n as f32, "{count} for {expected}");
            assert!(weight > 0.0 || *count == 0, "a point where the density is zero");
        }
    }

    #[test]
    fn the_guide_finds_what_a_search_of_all_finds() {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(747796405).wrapping_add(2891336453);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for n in [1, 2, 3, 5, 16, 1000] {
            for power in [0.0, 1.0, 40.0] {
                let weights: Vec<f64> =
                    (0..n).map(|_| f64::from(next()).powf(power) * f64::from(next() > 0.3)).collect();
                let (mut cumulative, mut guide) = (Vec::new(), Vec::new());
                push_cumulative(&mut cumulative, weights.iter().copied());
                push_guide(&mut guide, &cumulative);
                assert_eq!(guide.len(), guide_len(n));
                let between = (0..2000).map(|_| next().min(1.0f32.next_down()));
                let at = cumulative.iter().flat_map(|&c| [c.next_down().max(0.0), c.min(1.0f32.next_down())]);
                for u in between.chain(at) {
                    let plain = cumulative.partition_point(|&c| c <= u).clamp(1, n) - 1;
                    assert_eq!(invert(&cumulative, &guide, u).0, plain, "{n} {power} {u}");
                }
            }
        }
    }

    #[test]
    fn black_pictures_have_no_distribution() {
        assert!(PictureDistribution::new(2, 2, &[0.0; 4]).is_none());
    }
}
