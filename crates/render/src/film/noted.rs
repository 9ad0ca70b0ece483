//! A film that notes what its first samples see of surfaces.

use crate::film::surfaces::{PixelSurface, SurfaceSums};
use crate::film::tile::FilmTile;
use crate::film::tiles::Film;
use rayon::prelude::*;

impl Film {
    /// Notes what the first samples of each pixel see, from the first sample on, until the film is cleared. The classic
    /// integrator notes nothing, nor do scenes that move while the shutter is open.
    pub fn note_surfaces(&mut self) {
        let all = |tile: &mut FilmTile| tile.surfaces.resize(tile.sums.len(), SurfaceSums::default());
        self.tiles.par_iter_mut().for_each(all);
    }

    /// Drops what was noted, 40 bytes per pixel; images of the film cannot be smoothed any more.
    pub fn forget_surfaces(&mut self) {
        self.tiles.iter_mut().for_each(|tile| tile.surfaces = Vec::new());
    }

    /// Whether what the first samples see is noted.
    pub(crate) fn notes_surfaces(&self) -> bool {
        self.tiles.iter().all(|tile| !tile.surfaces.is_empty())
    }

    /// Whether the first pixel, and so all of a film that can be displayed, has a noted sample.
    pub(crate) fn has_surfaces(&self) -> bool {
        self.tiles.first().and_then(|tile| tile.surfaces.first()).is_some_and(SurfaceSums::is_noted)
    }

    /// What was noted of the pixels of a row, given to `take` with the column.
    pub(crate) fn for_each_surface_in_row(&self, y: u32, mut take: impl FnMut(usize, PixelSurface)) {
        for tile in self.tiles_of_row(y) {
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            let row = &tile.surfaces[first..first + tile.size.x as usize];
            for (sums, x) in row.iter().zip(tile.origin.x as usize..) {
                take(x, sums.mean());
            }
        }
    }
}
