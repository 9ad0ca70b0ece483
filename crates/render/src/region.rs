//! A part of the picture that gets all samples for a while.
//!
//! Only whole tiles are advanced, each by its own sample numbers, so a region changes no sample anywhere: it decides
//! which ones are taken, and since that does not depend on what they find, every mean stays unbiased.

use super::Film;
use super::film::FilmTile;
use glam::UVec2;

/// A rectangle of whole tiles of a film, pixels; `end` is excluded. Not empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    pub start: UVec2,
    pub end: UVec2,
}

impl Region {
    pub fn n_pixels(&self) -> u64 {
        let size = self.end - self.start;
        u64::from(size.x) * u64::from(size.y)
    }

    pub fn contains(&self, x: u32, y: u32) -> bool {
        let at = UVec2::new(x, y);
        at.cmpge(self.start).all() && at.cmplt(self.end).all()
    }

    pub(super) fn has(&self, tile: &FilmTile) -> bool {
        self.contains(tile.origin.x, tile.origin.y)
    }
}

impl Film {
    /// The tiles of which these pixels have a part, from `start` up to `end`, excluded; `None` where there is none.
    pub fn region(&self, start: UVec2, end: UVec2) -> Option<Region> {
        let (size, side) = (UVec2::new(self.width(), self.height()), self.tile_size());
        let end = end.min(size);
        if start.cmpge(end).any() {
            return None;
        }
        let last = (end - 1) / side + 1;
        Some(Region { start: start / side * side, end: (last * side).min(size) })
    }

    /// The same, of a rectangle in fractions of the picture from its upper left corner: left, top, right and bottom.
    pub fn region_of(&self, [left, top, right, bottom]: [f64; 4]) -> Option<Region> {
        let size = UVec2::new(self.width(), self.height()).as_dvec2();
        let pixel = |x: f64, y: f64| glam::DVec2::new(x, y).clamp(glam::DVec2::ZERO, glam::DVec2::ONE) * size;
        self.region(pixel(left, top).floor().as_uvec2(), pixel(right, bottom).ceil().as_uvec2())
    }
}
