//! Tables of integrals: computed by all threads before the first ray, or by the first ray that needs one.

use firstlight_simd::Real;
use rayon::prelude::*;
use std::sync::OnceLock;

/// A table that is computed once.
pub(crate) struct IntegralTable {
    entries: OnceLock<Vec<f32>>,
    n: usize,
    entry: fn(usize) -> f32,
}

impl IntegralTable {
    /// - `n`: number of entries.
    pub const fn new(n: usize, entry: fn(usize) -> f32) -> Self {
        Self { entries: OnceLock::new(), n, entry }
    }

    /// Returns the entries; computes them on this thread if there are none yet. Other threads must not take part here: a
    /// worker that waits for them could begin another task that needs the table.
    #[inline]
    pub fn get(&self) -> &[f32] {
        self.entries.get_or_init(|| (0..self.n).map(self.entry).collect())
    }

    /// Computes the entries on all threads.
    pub fn compute(&self) {
        if self.entries.get().is_none() {
            let entries = (0..self.n).into_par_iter().map(self.entry).collect();
            // Another thread may have set them first, to the same values.
            let _ = self.entries.set(entries);
        }
    }
}

/// Linear interpolation between two neighbours in a table, at one place or sixteen.
#[derive(Clone, Copy)]
pub(crate) struct Between<R = f32> {
    /// Index of the first, a whole number.
    pub first: R,
    /// Weight of the second.
    pub part: R,
}

impl<R: Real> Between<R> {
    /// - `x`: position, limited to 0..1; `n`: number of entries, at least 2.
    #[inline(always)]
    pub fn new(x: R, n: usize) -> Self {
        let x = x.at_least(0.0).at_most(1.0) * (n - 1) as f32;
        let first = x.whole().at_most((n - 2) as f32);
        Self { first, part: x - first }
    }

    /// Interpolates in a table that begins at an index.
    #[inline(always)]
    pub fn in_row(&self, table: &[f32], start: R) -> R {
        let first = start + self.first;
        let (a, b) = (first.entry_of(table), (first + 1.0).entry_of(table));
        a + self.part * (b - a)
    }

    /// Interpolates in a table with `n` entries per row.
    #[inline(always)]
    pub fn in_rows(&self, rows: &Self, table: &[f32], n: usize) -> R {
        let start = rows.first * n as f32;
        let (a, b) = (self.in_row(table, start), self.in_row(table, start + n as f32));
        a + rows.part * (b - a)
    }
}

impl Between {
    /// Interpolates linearly.
    #[inline]
    pub fn mean(&self, at: impl Fn(usize) -> f32) -> f32 {
        let first = self.first as usize;
        let (a, b) = (at(first), at(first + 1));
        a + self.part * (b - a)
    }
}

/// Eight-point Gauss–Legendre rule on 0..1: points and weights.
pub(crate) const GAUSS: [(f32, f32); 8] = [
    (0.019_855_072, 0.050_614_268),
    (0.101_666_76, 0.111_190_52),
    (0.237_233_8, 0.156_853_32),
    (0.408_282_68, 0.181_341_89),
    (0.591_717_3, 0.181_341_89),
    (0.762_766_2, 0.156_853_32),
    (0.898_333_25, 0.111_190_52),
    (0.980_144_9, 0.050_614_268),
];
