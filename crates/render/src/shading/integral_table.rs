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
