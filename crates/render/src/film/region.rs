//! A part of the image that gets all samples for a while.
//!
//! Only whole tiles are advanced, each by its own sample numbers, so a region changes no sample: it selects which
//! samples are taken. The selection does not depend on their values, so every mean stays unbiased.

use glam::UVec2;

/// A rectangle of whole tiles of a film, in pixels; `end` is excluded. Not empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Column and row of the first pixel, from the upper left corner.
    pub start: UVec2,
    /// One past the column and row of the last pixel.
    pub end: UVec2,
}

impl Region {
    /// Number of pixels, at least 1.
    pub fn n_pixels(&self) -> u64 {
        let size = self.end - self.start;
        u64::from(size.x) * u64::from(size.y)
    }

    /// Whether the pixel in column `x` and row `y` lies in the region.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        let at = UVec2::new(x, y);
        at.cmpge(self.start).all() && at.cmplt(self.end).all()
    }
}
