//! Tables of integrals: computed by all threads before the first ray, or by the first ray that needs one.

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

/// Linear interpolation between two neighbours in a table.
#[derive(Clone, Copy)]
pub(crate) struct Between {
    first: usize,
    part: f32,
}

impl Between {
    /// - `x`: position, limited to 0..1; `n`: number of entries, at least 2.
    #[inline]
    pub fn new(x: f32, n: usize) -> Self {
        let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
        let first = (x as usize).min(n - 2);
        Self { first, part: x - first as f32 }
    }

    /// Interpolates linearly.
    #[inline]
    pub fn mean(&self, at: impl Fn(usize) -> f32) -> f32 {
        let (a, b) = (at(self.first), at(self.first + 1));
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
