//! Rows of several planes of numbers, with margins.

use firstlight_simd::LANES;
use rayon::prelude::*;

/// Margin on both sides of a row, pixels: as far as a tap reaches.
pub const MARGIN: usize = 16;

/// Numbers of a plane of a row of so many pixels.
pub fn stride_of(width: usize) -> usize {
    width.next_multiple_of(LANES) + 2 * MARGIN
}

/// Rows of several planes: those of a row lie together.
#[derive(Default)]
pub struct Planes {
    numbers: Vec<f32>,
    stride: usize,
    n: usize,
}

impl Planes {
    /// Takes the size of an image of so many pixels, with `n` planes. The numbers are whatever they were.
    pub fn fit(&mut self, width: usize, height: usize, n: usize) {
        (self.stride, self.n) = (stride_of(width), n);
        self.numbers.resize(height * self.stride * n, 0.0);
    }

    /// Numbers of a plane of a row.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Pixels.
    pub fn height(&self) -> usize {
        self.numbers.len() / (self.stride * self.n)
    }

    /// All planes of a row.
    pub fn row(&self, y: usize) -> &[f32] {
        let length = self.stride * self.n;
        &self.numbers[y * length..][..length]
    }

    /// All planes of each row.
    pub fn rows_mut(&mut self) -> rayon::slice::ChunksExactMut<'_, f32> {
        self.numbers.par_chunks_exact_mut(self.stride * self.n)
    }
}
