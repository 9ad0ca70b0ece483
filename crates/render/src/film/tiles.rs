//! Where light is summed up: linear, unclamped, in tiles that workers own one at a time.
//!
//! Sums do not depend on the order of samples, so films of the same picture with different samples can be added up
//! ([`Film::merge`]) to the very film that has all of them.

use crate::film::error::MergeError;
use crate::film::estimate::{ErrorEstimate, TileConvergence};
use crate::film::exact_sum::ExactSum;
use crate::film::light_layer::LightLayer;
use crate::film::region::Region;
use crate::film::room::{self, NoRoom, Room};
use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;
use std::collections::TryReserveError;
use std::ops::Range;

/// Sums and counts of one picture.
///
/// A tile is always advanced as a whole, so all pixels of a tile have the same number of samples. After a pass that
/// was stopped early, or one over a [`Region`] alone, tiles may differ, and the next pass over all evens them out.
#[derive(Clone, Debug)]
pub struct Film {
    width: u32,
    height: u32,
    pub(crate) tiles: Vec<FilmTile>,
    tiles_x: u32,
    tile_size: u32,
    /// From paths that began at the lights; `None` until there is some.
    pub(crate) light: Option<LightLayer>,
    /// Memory of such a layer that is not in use.
    idle_light: Vec<ExactSum>,
}

/// The pixels of one tile, row by row.
#[derive(Clone, Debug)]
pub(crate) struct FilmTile {
    /// Upper left pixel.
    pub origin: UVec2,
    pub size: UVec2,
    /// Samples taken of each pixel of this tile so far, bad ones included.
    pub spp: u32,
    /// The numbers of those samples, ascending, with gaps between the ranges; new samples lengthen the last one.
    pub ranges: Vec<Range<u32>>,
    /// Sum of radiance a pixel, W·m⁻²·sr⁻¹.
    pub sums: Vec<ExactSum>,
    /// Pixel (index in this tile) and number of each sample that was left out because it was not finite.
    pub bad: Vec<(u32, u32)>,
    /// What the error estimate needs.
    pub convergence: TileConvergence,
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

impl Film {
    /// Pixels along the side of a tile, unless asked otherwise.
    pub const TILE_SIZE: u32 = 32;

    /// Samples of a pixel are numbered below this.
    pub const MAX_SAMPLES: u32 = 1 << 31;

    /// Memory that a pixel takes: its sums, and its mean at the last power of two.
    pub const BYTES_A_PIXEL: usize = room::BYTES_A_PIXEL;

    /// Memory that a pixel takes for traced light, where there is such light.
    pub const LIGHT_BYTES_A_PIXEL: usize = room::LIGHT_BYTES_A_PIXEL;

    /// Width and height in pixels, at least 1 each. Panics where there is no memory for it.
    pub fn new(width: u32, height: u32) -> Self {
        Self::with_tile_size(width, height, Self::TILE_SIZE)
    }

    /// The same, or how much memory it would have taken.
    ///
    /// # Errors
    /// When the memory cannot be had.
    pub fn try_new(width: u32, height: u32) -> Result<Self, NoRoom> {
        Self::try_with_tile_size(width, height, Self::TILE_SIZE)
    }

    /// The picture does not depend on `tile_size`, bit for bit.
    ///
    /// # Panics
    /// When a size is 0, or the memory cannot be had.
    pub fn with_tile_size(width: u32, height: u32, tile_size: u32) -> Self {
        Self::try_with_tile_size(width, height, tile_size).unwrap_or_else(|error| panic!("{error}"))
    }

    /// All that a render will need for it is there then, but for traced light ([`Self::reserve_light`]).
    ///
    /// # Errors
    /// When the memory cannot be had.
    ///
    /// # Panics
    /// When a size is 0.
    pub fn try_with_tile_size(width: u32, height: u32, tile_size: u32) -> Result<Self, NoRoom> {
        assert!(width > 0 && height > 0 && tile_size > 0, "a film of {width} × {height} has no pixels");
        // In one piece first: a system that promises small pieces beyond what it has refuses such a large one.
        drop(Room::for_film(width, height, false, &[])?);
        let bytes = u64::from(width) * u64::from(height) * (Self::BYTES_A_PIXEL + size_of::<f32>()) as u64;
        let no_room = |_| NoRoom { width, height, bytes };
        let (tiles_x, tiles_y) = (width.div_ceil(tile_size), height.div_ceil(tile_size));
        let mut tiles = Vec::new();
        tiles.try_reserve_exact(tiles_x as usize * tiles_y as usize).map_err(no_room)?;
        for (y, x) in (0..tiles_y).flat_map(|y| (0..tiles_x).map(move |x| (y, x))) {
            let origin = UVec2::new(x, y) * tile_size;
            let size = (UVec2::new(width, height) - origin).min(UVec2::splat(tile_size));
            tiles.push(FilmTile::try_new(origin, size).map_err(no_room)?);
        }
        Ok(Self { width, height, tiles, tiles_x, tile_size, light: None, idle_light: Vec::new() })
    }

    /// Has memory ready for traced light.
    ///
    /// # Errors
    /// When the memory cannot be had.
    pub fn reserve_light(&mut self) -> Result<(), NoRoom> {
        if self.light.is_some() {
            return Ok(());
        }
        let (width, height) = (self.width, self.height);
        let n_pixels = width as usize * height as usize;
        let bytes = (n_pixels * Self::LIGHT_BYTES_A_PIXEL) as u64;
        let missing = n_pixels.saturating_sub(self.idle_light.len());
        self.idle_light.try_reserve_exact(missing).map_err(|_| NoRoom { width, height, bytes })
    }

    /// The same without samples, to begin with sample number `first`.
    pub fn starting_at(mut self, first: u32) -> Self {
        self.clear();
        for tile in &mut self.tiles {
            tile.ranges = std::iter::once(first..first).collect();
        }
        self
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Pixels along the side of a tile.
    pub fn tile_size(&self) -> u32 {
        self.tile_size
    }

    /// Samples that every pixel has at least.
    pub fn spp(&self) -> u32 {
        self.spp_in(None)
    }

    /// Samples that every pixel of a region has at least, or of the whole film.
    pub fn spp_in(&self, region: Option<&Region>) -> u32 {
        let light_traced = self.light.as_ref().map(|light| light.spp);
        self.tiles_in(region).map(|tile| tile.spp).chain(light_traced).min().unwrap_or(0)
    }

    fn tiles_in<'a>(&'a self, region: Option<&'a Region>) -> impl Iterator<Item = &'a FilmTile> + Clone {
        self.tiles.iter().filter(move |tile| region.is_none_or(|region| tile.lies_in(region)))
    }

    /// Samples that have been begun: more than [`spp`](Self::spp) if a pass was stopped.
    pub fn max_spp(&self) -> u32 {
        let light_traced = self.light.as_ref().map(LightLayer::begun);
        self.tiles.iter().map(|tile| tile.spp).chain(light_traced).max().unwrap_or(0)
    }

    /// A film like a new one, in the memory of this one: for a large film, memory is what takes time.
    pub fn clear(&mut self) {
        self.clear_unless(&|| false);
    }

    /// The same until `stop` says so. Then it is false, and the film is good for nothing but being cleared again.
    pub fn clear_unless(&mut self, stop: &(dyn Fn() -> bool + Sync)) -> bool {
        if let Some(layer) = self.light.take() {
            self.idle_light = layer.sums;
        }
        self.tiles.par_iter_mut().all(|tile| {
            let goes_on = !stop();
            if goes_on {
                tile.clear();
            }
            goes_on
        })
    }

    /// Makes room for traced light, if there is none.
    pub(crate) fn want_light(&mut self) {
        if self.light.is_none() {
            let size = UVec2::new(self.width, self.height);
            let memory = std::mem::take(&mut self.idle_light);
            self.light = Some(LightLayer::in_memory(memory, size, self.first_sample()));
        }
    }

    /// The number of the first sample.
    pub fn first_sample(&self) -> u32 {
        self.tiles.iter().filter_map(|tile| tile.ranges.first()).map(|range| range.start).min().unwrap_or(0)
    }

    /// Samples that were left out because they were not finite.
    pub fn n_bad(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.bad.len() as u64).sum()
    }

    /// Adds the samples of another film of the same picture: the film is then the one that has the samples of both,
    /// bit for bit.
    ///
    /// # Errors
    /// When the films differ in size, or have a sample in common. Then nothing has been added.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if (self.width, self.height) != (other.width, other.height) {
            return Err(MergeError::Sizes((self.width, self.height), (other.width, other.height)));
        }
        if self.tile_size != other.tile_size {
            return Err(MergeError::TileSizes(self.tile_size, other.tile_size));
        }
        for (tile, other) in self.tiles.iter().zip(&other.tiles) {
            if let Some(shared) = tile.shares_with(other) {
                return Err(MergeError::SharedSamples { first: shared.start, last: shared.end - 1 });
            }
        }
        for (tile, other) in self.tiles.iter_mut().zip(&other.tiles) {
            tile.merge(other);
        }
        match (&mut self.light, &other.light) {
            (Some(light), Some(other)) => light.merge(other),
            (light, Some(other)) => *light = Some(other.clone()),
            (_, None) => {}
        }
        self.record_convergence(|_| true);
        Ok(())
    }

    /// Mean radiance of a pixel, row 0 at the top; black where there is no sample yet.
    pub fn mean(&self, x: u32, y: u32) -> Vec3 {
        let (tile, local) = self.locate(x, y);
        (tile.mean(local) + self.light_traced(x, y)).as_vec3()
    }

    /// The part of [`Self::mean`] that light paths have found.
    pub fn light_traced(&self, x: u32, y: u32) -> DVec3 {
        self.light.as_ref().map_or(DVec3::ZERO, |layer| layer.mean((y * self.width + x) as usize))
    }

    /// Mean radiance of the pixels of one row, from the left.
    pub fn row(&self, y: u32) -> impl Iterator<Item = Vec3> {
        let tiles = &self.tiles[(y / self.tile_size * self.tiles_x) as usize..][..self.tiles_x as usize];
        tiles.iter().flat_map(move |tile| {
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            (first..first + tile.size.x as usize)
                .zip(tile.origin.x..)
                .map(move |(local, x)| (tile.mean(local) + self.light_traced(x, y)).as_vec3())
        })
    }

    /// The same as [`Self::row`], given to `take` with the column: quicker, where every picture is read.
    pub(crate) fn for_each_in_row(&self, y: u32, mut take: impl FnMut(usize, Vec3)) {
        let tiles = &self.tiles[(y / self.tile_size * self.tiles_x) as usize..][..self.tiles_x as usize];
        for tile in tiles {
            let columns = tile.origin.x..tile.origin.x + tile.size.x;
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            if self.light.is_some() || !tile.bad.is_empty() || tile.spp == 0 {
                for (local, x) in (first..).zip(columns) {
                    take(x as usize, (tile.mean(local) + self.light_traced(x, y)).as_vec3());
                }
            } else {
                let n = f64::from(tile.spp);
                for (sum, x) in tile.sums[first..].iter().zip(columns) {
                    take(x as usize, (sum.sum / n).as_vec3());
                }
            }
        }
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
        self.error_estimate_in(None)
    }

    /// The same of a region alone. That of a whole film of which a region is ahead counts as if it were not.
    pub fn error_estimate_in(&self, region: Option<&Region>) -> Option<ErrorEstimate> {
        ErrorEstimate::from_tiles(self.tiles_in(region).map(|tile| &tile.convergence), self.spp_in(region))
    }

    /// How far a pixel moved when its samples last doubled: the squared relative difference, mean over channels; its
    /// mean over many pixels is the variance that is left. 0 before the second sample.
    pub fn doubling_step(&self, x: u32, y: u32) -> f32 {
        let (tile, local) = self.locate(x, y);
        tile.convergence.last_step(local)
    }

    /// Tells the part of the error estimate of each tile that `is_news` chooses how far the picture is.
    pub(crate) fn record_convergence(&mut self, is_news: impl Fn(&FilmTile) -> bool + Sync) {
        let (light, width) = (self.light.as_ref(), self.width);
        let tiles = self.tiles.par_iter_mut().filter(|tile| is_news(tile));
        tiles.for_each(|tile| tile.record_convergence(light.map(|light| (light, width))));
    }

    fn locate(&self, x: u32, y: u32) -> (&FilmTile, usize) {
        let tile = &self.tiles[(y / self.tile_size * self.tiles_x + x / self.tile_size) as usize];
        let local = UVec2::new(x, y) - tile.origin;
        (tile, (local.y * tile.size.x + local.x) as usize)
    }
}

impl FilmTile {
    pub fn lies_in(&self, region: &Region) -> bool {
        region.contains(self.origin.x, self.origin.y)
    }

    fn try_new(origin: UVec2, size: UVec2) -> Result<Self, TryReserveError> {
        let n = size.x as usize * size.y as usize;
        let (mut sums, mut convergence) = (Vec::new(), TileConvergence::default());
        sums.try_reserve_exact(n)?;
        sums.resize(n, ExactSum::default());
        convergence.try_reserve(n)?;
        let ranges = std::iter::once(0..0).collect();
        Ok(Self { origin, size, spp: 0, ranges, sums, bad: Vec::new(), convergence })
    }

    fn clear(&mut self) {
        let Self { origin: _, size: _, spp, ranges, sums, bad, convergence } = self;
        *spp = 0;
        ranges.clear();
        ranges.push(0..0);
        sums.fill(ExactSum::default());
        bad.clear();
        convergence.clear();
    }

    pub fn n_pixels(&self) -> usize {
        self.sums.len()
    }

    pub fn mean(&self, local: usize) -> DVec3 {
        let n_bad = self.bad.iter().filter(|(pixel, _)| *pixel as usize == local).count() as u32;
        match self.spp - n_bad {
            0 => DVec3::ZERO,
            n => self.sums[local].sum / f64::from(n),
        }
    }

    /// The number of the next sample.
    pub fn next_sample(&self) -> u32 {
        self.ranges.last().map_or(0, |range| range.end)
    }

    /// Adds one sample of every pixel, in the order of `sums`; `sample` is its number, the next one.
    pub fn add_sample(&mut self, sample: u32, radiance: impl Iterator<Item = Vec3>) {
        debug_assert_eq!(sample, self.next_sample(), "samples come in order");
        for (local, (sum, radiance)) in self.sums.iter_mut().zip(radiance).enumerate() {
            if radiance.is_finite() {
                sum.add(radiance);
            } else {
                self.bad.push((local as u32, sample));
            }
        }
        self.spp += 1;
        if let Some(last) = self.ranges.last_mut() {
            last.end += 1;
        }
    }

    /// At powers of two, tells the error estimate of the picture so far; `light`: from the lights, and the width of the film.
    pub fn record_convergence(&mut self, light: Option<(&LightLayer, u32)>) {
        if !self.spp.is_power_of_two() {
            return;
        }
        let mut convergence = std::mem::take(&mut self.convergence);
        let mean = |local: usize| {
            let light_traced = light.map_or(DVec3::ZERO, |(layer, width)| {
                let pixel = self.origin + UVec2::new(local as u32 % self.size.x, local as u32 / self.size.x);
                layer.mean((pixel.y * width + pixel.x) as usize)
            });
            self.mean(local) + light_traced
        };
        convergence.record(self.spp, self.size.x as usize, (0..self.n_pixels()).map(mean));
        self.convergence = convergence;
    }

    /// Samples that both have.
    fn shares_with(&self, other: &Self) -> Option<Range<u32>> {
        let pairs = self.ranges.iter().flat_map(|a| other.ranges.iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| a.start.max(b.start)..a.end.min(b.end)).find(|shared| !shared.is_empty())
    }

    /// Adds the samples of another tile, which has none of these.
    fn merge(&mut self, other: &Self) {
        for (sum, other) in self.sums.iter_mut().zip(&other.sums) {
            sum.merge(other);
        }
        // What rendering in one go would have measured is known where the second half doubles the first.
        let start = |tile: &Self| tile.ranges.first().map_or(0, |range| range.start);
        let other_knows_more =
            (other.spp, std::cmp::Reverse(start(other))) > (self.spp, std::cmp::Reverse(start(self)));
        if other_knows_more {
            self.convergence = other.convergence.clone();
        }
        self.spp += other.spp;
        self.bad.extend(&other.bad);
        self.bad.sort_unstable_by_key(|&(pixel, sample)| (sample, pixel));
        let mut ranges: Vec<Range<u32>> = self.ranges.iter().chain(&other.ranges).cloned().collect();
        ranges.retain(|range| !range.is_empty());
        if ranges.is_empty() {
            ranges.push(self.next_sample()..self.next_sample());
        }
        ranges.sort_by_key(|range| range.start);
        self.ranges = ranges.into_iter().fold(Vec::new(), |mut joined: Vec<Range<u32>>, range| {
            match joined.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => joined.push(range),
            }
            joined
        });
    }
}
