//! Where light is summed up: linear, unclamped, in tiles that workers own one at a time.

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
                FilmTile { origin, size, spp: 0, sums: vec![DVec3::ZERO; (size.x * size.y) as usize] }
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
        let tile = &self.tiles[(y / self.tile_size * self.tiles_x + x / self.tile_size) as usize];
        let local = UVec2::new(x, y) - tile.origin;
        let sum = tile.sums[(local.y * tile.size.x + local.x) as usize];
        if tile.spp == 0 { Vec3::ZERO } else { (sum / f64::from(tile.spp)).as_vec3() }
    }

    /// Mean radiance of all pixels, row by row from the top.
    pub fn means(&self) -> Vec<Vec3> {
        (0..self.height).flat_map(|y| (0..self.width).map(move |x| self.mean(x, y))).collect()
    }
}
