//! Rows of several planes of numbers, with margins.

use firstlight_simd::LANES;
use rayon::prelude::*;

/// Margin on both sides of a row, pixels: as far as a tap reaches.
pub const MARGIN: usize = 16;

/// A normal that is unlike all others, of what takes no part.
pub const APART: f32 = 1e4;

/// Numbers of a plane of a row of so many pixels.
pub fn stride_of(width: usize) -> usize {
    width.next_multiple_of(LANES) + 2 * MARGIN
}

/// Rows of several planes: those of a row lie together.
#[derive(Default)]
pub struct Planes {
    /// At least those of the present image: to clear memory again whenever the size changes would take longer than the
    /// filter.
    numbers: Vec<f32>,
    stride: usize,
    height: usize,
    n: usize,
}

impl Planes {
    /// Takes the size of an image of so many pixels, with `n` planes. The numbers are whatever they were.
    pub fn fit(&mut self, width: usize, height: usize, n: usize) {
        (self.stride, self.height, self.n) = (stride_of(width), height, n);
        let needed = height * self.stride * n;
        if self.numbers.len() < needed {
            // Memory that is zero already is touched by the workers first.
            self.numbers = vec![0.0; needed];
        }
    }

    /// Takes size and numbers of other planes.
    pub fn copy(&mut self, other: &Self) {
        (self.stride, self.height, self.n) = (other.stride, other.height, other.n);
        self.numbers.clear();
        self.numbers.extend_from_slice(&other.numbers[..other.height * other.stride * other.n]);
    }

    /// Numbers of a plane of a row.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All planes of a row.
    pub fn row(&self, y: usize) -> &[f32] {
        let length = self.stride * self.n;
        &self.numbers[y * length..][..length]
    }

    /// All planes of each row.
    pub fn rows_mut(&mut self) -> rayon::slice::ChunksExactMut<'_, f32> {
        let length = self.stride * self.n;
        self.numbers[..self.height * length].par_chunks_exact_mut(length)
    }
}
