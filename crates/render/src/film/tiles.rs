//! Where light is summed up: linear, unclamped, in tiles that workers own one at a time.
//!
//! Sums do not depend on the order of samples, so films of the same picture with different samples can be added up
//! ([`Film::merge`]) to the very film that has all of them.

use crate::core::caustic_plan::CausticPlan;
use crate::core::settings::ErrorMetric;
use crate::film::allocation::{FIRST_ROUND, begin_round, end_round};
use crate::film::block::{BLOCK_SIZE, Block};
use crate::film::error::MergeError;
use crate::film::estimate::{ErrorEstimate, Evidence};
use crate::film::exact_sum::ExactSum;
use crate::film::light_layer::LightLayer;
use crate::film::region::Region;
use crate::film::room::{self, NoRoom, Room};
use crate::film::round::Round;
use crate::film::tile::FilmTile;
use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;

/// Sums and counts of one picture.
///
/// All pixels of a block of 8 × 8 have the same number of samples. In an even film all blocks have as many; after a pass
/// that was stopped early, or one over a [`Region`] alone, they may differ, and the next pass over all evens them out. In
/// an adaptive film samples go where the error is, and what counts is the mean over the picture, its budget.
#[derive(Clone, Debug)]
pub struct Film {
    width: u32,
    height: u32,
    pub(crate) tiles: Vec<FilmTile>,
    tiles_x: u32,
    tile_size: u32,
    /// How samples are allocated until the next budget; `None` as long as the film is even.
    pub(crate) round: Option<Round>,
    /// From paths that began at the lights; `None` until there is some.
    pub(crate) light: Option<LightLayer>,
    /// Memory of such a layer that is not in use.
    idle_light: Vec<ExactSum>,
    /// How caustics are looked for: of all its samples, so known from the first one on.
    pub(crate) caustic_plan: Option<CausticPlan>,
    /// See [`Self::set_preview`].
    pub(crate) is_preview: bool,
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

    /// Memory that a pixel takes: its sums, its mean at the last power of two, and how far that had moved.
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
        Ok(Self {
            width,
            height,
            tiles,
            tiles_x,
            tile_size,
            round: None,
            light: None,
            idle_light: Vec::new(),
            caustic_plan: None,
            is_preview: false,
        })
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
        let no_room = |_| NoRoom { width, height, bytes };
        self.tiles.iter_mut().try_for_each(FilmTile::try_reserve_light).map_err(no_room)?;
        self.idle_light.try_reserve_exact(missing).map_err(no_room)
    }

    /// The same without samples, to begin with sample number `first`.
    pub fn starting_at(mut self, first: u32) -> Self {
        self.clear();
        for block in self.tiles.iter_mut().flat_map(|tile| &mut tile.blocks) {
            block.clear(first);
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

    /// Samples per pixel: of an even film those that every pixel has at least, of an adaptive one the mean that has been
    /// spent.
    pub fn spp(&self) -> u32 {
        self.spp_in(None)
    }

    /// The same of a region, in which every pixel has so many at least, or of the whole film.
    pub fn spp_in(&self, region: Option<&Region>) -> u32 {
        let light_traced = self.light.as_ref().map(|light| light.spp);
        match (&self.round, region) {
            (Some(round), None) if !round.even => light_traced.unwrap_or(u32::MAX).min(round.budget),
            _ => self.tiles_in(region).map(FilmTile::spp).chain(light_traced).min().unwrap_or(0),
        }
    }

    fn tiles_in<'a>(&'a self, region: Option<&'a Region>) -> impl Iterator<Item = &'a FilmTile> + Clone {
        self.tiles.iter().filter(move |tile| region.is_none_or(|region| tile.lies_in(region)))
    }

    fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.tiles.iter().flat_map(|tile| &tile.blocks)
    }

    /// Samples per pixel that have been begun: more than [`spp`](Self::spp) if a pass was stopped.
    pub fn max_spp(&self) -> u32 {
        let light_traced = self.light.as_ref().map(LightLayer::begun);
        let begun = |block: &Block| match &self.round {
            Some(round) if !round.even => block.begun(round),
            _ => block.spp,
        };
        let budget = self.round.filter(|round| !round.even).map(|round| round.budget);
        self.blocks().map(begun).chain(light_traced).chain(budget).max().unwrap_or(0)
    }

    /// Whether another film of as many samples may not be the same: it was stopped in the middle of a pass, or has samples
    /// of a region or of a part that its allocation did not give it.
    pub fn is_uneven(&self) -> bool {
        self.max_spp() > self.spp() || self.round.is_some_and(|round| round.irregular)
    }

    /// The fewest and the most samples that a pixel has, and the mean over all pixels.
    pub fn sample_counts(&self) -> (u32, f64, u32) {
        let (mut least, mut most, mut sum) = (u32::MAX, 0, 0.0);
        for block in self.blocks() {
            (least, most) = (least.min(block.spp), most.max(block.spp));
            sum += f64::from(block.spp) * block.n_pixels() as f64;
        }
        (least, sum / (f64::from(self.width) * f64::from(self.height)), most)
    }

    /// A film like a new one, in the memory of this one: for a large film, memory is what takes time.
    pub fn clear(&mut self) {
        self.clear_unless(&|| false);
    }

    /// The same until `stop` says so. Then it is false, and the film is good for nothing but being cleared again.
    pub fn clear_unless(&mut self, stop: &(dyn Fn() -> bool + Sync)) -> bool {
        self.caustic_plan = None;
        if let Some(layer) = self.light.take() {
            self.idle_light = layer.sums;
        }
        self.round = None;
        self.tiles.par_iter_mut().all(|tile| {
            let goes_on = !stop();
            if goes_on {
                tile.clear(0);
            }
            goes_on
        })
    }

    /// Says that it is shown while things move: its samples need not be those of another film of the same size, so nothing
    /// is measured that the first of them would have to wait for. To be said before that.
    pub fn set_preview(&mut self, is_preview: bool) {
        self.is_preview = is_preview;
    }

    /// How caustics are looked for; `None` before the first sample.
    pub fn caustic_plan(&self) -> Option<CausticPlan> {
        self.caustic_plan
    }

    /// Makes room for traced light, if there is none.
    ///
    /// - `stride`: camera paths for each light path, at least 1.
    pub(crate) fn want_light(&mut self, stride: u32) {
        if self.light.is_none() {
            let size = UVec2::new(self.width, self.height);
            let memory = std::mem::take(&mut self.idle_light);
            self.light = Some(LightLayer::in_memory(memory, size, self.first_sample(), stride));
        }
    }

    /// The number of the first sample.
    pub fn first_sample(&self) -> u32 {
        self.blocks().filter_map(|block| block.ranges.first()).map(|range| range.start).min().unwrap_or(0)
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
        if let (Some(own), Some(others)) = (self.caustic_plan, other.caustic_plan)
            && own.light_path_stride != others.light_path_stride
        {
            return Err(MergeError::LightPaths(own.light_path_stride, others.light_path_stride));
        }
        for (block, other) in self.blocks().zip(other.blocks()) {
            if let Some(shared) = block.shares_with(other) {
                return Err(MergeError::SharedSamples { first: shared.start, last: shared.end - 1 });
            }
        }
        let light_knows_more = match (&self.light, &other.light) {
            (Some(light), Some(other)) => light.knows_less_than(other),
            (light, _) => light.is_none(),
        };
        for (tile, other) in self.tiles.iter_mut().zip(&other.tiles) {
            tile.merge(other, light_knows_more);
        }
        match (&mut self.light, &other.light) {
            (Some(light), Some(other)) => light.merge(other),
            (light, Some(other)) => *light = Some(other.clone()),
            (_, None) => {}
        }
        self.caustic_plan = self.caustic_plan.or(other.caustic_plan);
        if self.round.is_some() || other.round.is_some() {
            self.leave_round();
        }
        let even = self.is_even();
        self.tiles.par_iter_mut().for_each(|tile| tile.record(even));
        self.record_light();
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
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            for block in tile.blocks_in_row(y - tile.origin.y) {
                let columns = block.start.x..block.start.x + block.size.x;
                let locals = first + columns.start as usize..first + columns.end as usize;
                let columns = columns.map(|x| (tile.origin.x + x) as usize);
                if self.light.is_some() || !tile.bad.is_empty() || block.spp == 0 {
                    for (local, x) in locals.zip(columns) {
                        take(x, (tile.mean(local) + self.light_traced(x as u32, y)).as_vec3());
                    }
                } else {
                    let n = f64::from(block.spp);
                    for (sum, x) in tile.sums[locals].iter().zip(columns) {
                        take(x, (sum.sum / n).as_vec3());
                    }
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
        let (tile, local) = self.locate(x, y);
        tile.block_of(local).spp
    }

    /// Estimates the error of the image from its own samples; `None` before the second sample per pixel.
    pub fn error_estimate(&self) -> Option<ErrorEstimate> {
        self.error_estimate_in(None)
    }

    /// The same of a region alone.
    pub fn error_estimate_in(&self, region: Option<&Region>) -> Option<ErrorEstimate> {
        let mut evidence = Evidence::default();
        let is_even = region.is_some() || self.is_even();
        let spp = self.spp_in(region);
        for tile in self.tiles_in(region) {
            evidence.add_tile(tile.n_pixels());
            tile.blocks.iter().for_each(|block| evidence.add_part(block.steps, block.spp));
            if let Some(light) = &self.light {
                evidence.add_part(tile.light.steps, light.spp);
            }
        }
        ErrorEstimate::new(&evidence, spp, is_even)
    }

    /// Whether every pixel gets as many samples.
    fn is_even(&self) -> bool {
        self.round.is_none_or(|round| round.even)
    }

    /// How far a pixel moved when its samples last doubled: the squared relative difference, mean over channels; its
    /// mean over many pixels is the variance that is left. 0 before the second sample.
    pub fn doubling_step(&self, x: u32, y: u32) -> f32 {
        let (tile, local) = self.locate(x, y);
        tile.last_step(local)
    }

    /// Tells the error estimate how far traced light is, if that has come to a power of two.
    pub(crate) fn record_light(&mut self) {
        let Some(layer) = &self.light else { return };
        let width = self.width;
        self.tiles.par_iter_mut().for_each(|tile| tile.record_light(layer, width));
    }

    /// Decides the next round of an adaptive film, if the last one is over.
    pub(crate) fn begin_round_if_due(&mut self, metric: ErrorMetric) {
        let spp = self.spp();
        let (least, mean, most) = self.sample_counts();
        let (from, irregular) = match &self.round {
            // Blocks lie across tiles of other sizes, and have no neighbours then.
            _ if !self.tile_size.is_multiple_of(BLOCK_SIZE) => return,
            Some(round) if spp < round.to => return,
            Some(round) => (spp, round.irregular),
            None if spp < FIRST_ROUND => return,
            None => (spp.max(mean.round() as u32), least < most),
        };
        let size = UVec2::new(self.width, self.height).map(|side| side.div_ceil(BLOCK_SIZE));
        self.round = Some(begin_round(&mut self.tiles, size, from, irregular, metric));
    }

    /// All that was to be done up to a budget is done.
    pub(crate) fn has_spent(&mut self, budget: u32) {
        if let Some(round) = &mut self.round {
            round.budget = round.budget.max(budget);
        }
    }

    /// Takes the counts as they are, whatever the round was to make of them; the next one is decided from there.
    pub(crate) fn leave_round(&mut self) {
        let (least, mean, most) = self.sample_counts();
        self.round = if least == most { None } else { Some(end_round(&mut self.tiles, mean.round() as u32)) };
    }

    fn locate(&self, x: u32, y: u32) -> (&FilmTile, usize) {
        let tile = &self.tiles[(y / self.tile_size * self.tiles_x + x / self.tile_size) as usize];
        let local = UVec2::new(x, y) - tile.origin;
        (tile, (local.y * tile.size.x + local.x) as usize)
    }
}
