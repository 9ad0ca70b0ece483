//! Where light is summed up: linear, unclamped, in tiles that workers own one at a time.

use super::estimate::{ErrorEstimate, TileConvergence};
use glam::{DVec3, UVec2, Vec3};

/// Sums and counts of one picture.
///
/// A tile is always advanced as a whole, so all pixels of a tile have the same number of samples; after a pass that
/// was stopped early, tiles may differ by the samples of that pass, and the next pass evens them out.
#[derive(Clone, Debug)]
pub struct Film {
    width: u32,
    height: u32,
    pub(super) tiles: Vec<FilmTile>,
    tiles_x: u32,
    tile_size: u32,
}

/// The pixels of one tile, row by row.
#[derive(Clone, Debug)]
pub(super) struct FilmTile {
    /// Upper left pixel.
    pub origin: UVec2,
    pub size: UVec2,
    /// Samples taken of each pixel of this tile so far, bad ones included.
    pub spp: u32,
    /// Sum of radiance a pixel, W·m⁻²·sr⁻¹.
    pub sums: Vec<DVec3>,
    /// Pixel (index in this tile) and number of each sample that was left out because it was not finite.
    pub bad: Vec<(u32, u32)>,
    /// What the error estimate needs.
    pub convergence: TileConvergence,
}

impl Film {
    /// Pixels along the side of a tile, unless asked otherwise.
    pub const TILE_SIZE: u32 = 32;

    /// Width and height in pixels, at least 1 each.
    pub fn new(width: u32, height: u32) -> Self {
        Self::with_tile_size(width, height, Self::TILE_SIZE)
    }

    /// The picture does not depend on `tile_size`, bit for bit.
    pub fn with_tile_size(width: u32, height: u32, tile_size: u32) -> Self {
        assert!(width > 0 && height > 0 && tile_size > 0, "a film of {width} × {height} has no pixels");
        let tiles_x = width.div_ceil(tile_size);
        let tiles = (0..tiles_x * height.div_ceil(tile_size))
            .map(|i| {
                let origin = UVec2::new(i % tiles_x, i / tiles_x) * tile_size;
                let size = (UVec2::new(width, height) - origin).min(UVec2::splat(tile_size));
                FilmTile::new(origin, size)
            })
            .collect();
        Self { width, height, tiles, tiles_x, tile_size }
    }

    pub fn width(&self) -> u32 {
        self.width
    }

    pub fn height(&self) -> u32 {
        self.height
    }

    /// Samples that every pixel has at least.
    pub fn spp(&self) -> u32 {
        self.tiles.iter().map(|tile| tile.spp).min().unwrap_or(0)
    }

    /// Mean radiance of a pixel, row 0 at the top; black where there is no sample yet.
    pub fn mean(&self, x: u32, y: u32) -> Vec3 {
        let (tile, local) = self.locate(x, y);
        tile.mean(local).as_vec3()
    }

    /// Mean radiance of the pixels of one row, from the left.
    pub fn row(&self, y: u32) -> impl Iterator<Item = Vec3> {
        let tiles = &self.tiles[(y / self.tile_size * self.tiles_x) as usize..][..self.tiles_x as usize];
        tiles.iter().flat_map(move |tile| {
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            (first..first + tile.size.x as usize).map(move |local| tile.mean(local).as_vec3())
        })
    }

    /// Mean radiance of all pixels, row by row from the top.
    pub fn means(&self) -> Vec<Vec3> {
        (0..self.height).flat_map(|y| self.row(y)).collect()
    }

    /// Samples taken of a pixel so far.
    pub fn samples(&self, x: u32, y: u32) -> u32 {
        self.locate(x, y).0.spp
    }

    /// How wrong the picture still is, as far as its own samples tell; `None` before the fourth sample of a pixel.
    pub fn error_estimate(&self) -> Option<ErrorEstimate> {
        ErrorEstimate::from_tiles(self.tiles.iter().map(|tile| &tile.convergence), self.spp())
    }

    /// How far a pixel moved when its samples last doubled: the squared relative difference, mean over channels; its
    /// mean over many pixels is the variance that is left. 0 before the second sample.
    pub fn doubling_step(&self, x: u32, y: u32) -> f32 {
        let (tile, local) = self.locate(x, y);
        tile.convergence.last_step(local)
    }

    fn locate(&self, x: u32, y: u32) -> (&FilmTile, usize) {
        let tile = &self.tiles[(y / self.tile_size * self.tiles_x + x / self.tile_size) as usize];
        let local = UVec2::new(x, y) - tile.origin;
        (tile, (local.y * tile.size.x + local.x) as usize)
    }
}

impl FilmTile {
    fn new(origin: UVec2, size: UVec2) -> Self {
        let n = (size.x * size.y) as usize;
        let sums = vec![DVec3::ZERO; n];
        Self { origin, size, spp: 0, sums, bad: Vec::new(), convergence: TileConvergence::default() }
    }

    pub fn n_pixels(&self) -> usize {
        self.sums.len()
    }

    pub fn mean(&self, local: usize) -> DVec3 {
        let n_bad = self.bad.iter().filter(|(pixel, _)| *pixel as usize == local).count() as u32;
        match self.spp - n_bad {
            0 => DVec3::ZERO,
            n => self.sums[local] / f64::from(n),
        }
    }

    /// Adds one sample of every pixel, in the order of `sums`; `sample` is its number.
    pub fn add_sample(&mut self, sample: u32, radiance: impl Iterator<Item = Vec3>) {
        debug_assert_eq!(sample, self.spp, "samples come in order, so that sums do not depend on threads");
        for (local, (sum, radiance)) in self.sums.iter_mut().zip(radiance).enumerate() {
            if radiance.is_finite() {
                *sum += radiance.as_dvec3();
            } else {
                self.bad.push((local as u32, sample));
            }
        }
        self.spp += 1;
        if self.spp.is_power_of_two() {
            let mut convergence = std::mem::take(&mut self.convergence);
            convergence.record(self.spp, self.size.x as usize, (0..self.n_pixels()).map(|local| self.mean(local)));
            self.convergence = convergence;
        }
    }
}
