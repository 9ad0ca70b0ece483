//! The film: linear, unclamped sums of samples, in tiles that workers own one at a time.
//!
//! Sums do not depend on the order of samples, so films of the same image with different samples can be merged
//! ([`Film::merge`]) to exactly the film that has all of them.

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

/// Sums and sample counts of one image.
///
/// All pixels of a block of 8 × 8 have the same number of samples. In an even film all blocks have the same number;
/// after a pass that was stopped, or a pass over a [`Region`], they may differ, and the next pass over all tiles evens
/// them out. In an adaptive film samples go where the error is, and the sample count of the film is the mean over the
/// image, its budget.
#[derive(Clone, Debug)]
pub struct Film {
    width: u32,
    height: u32,
    pub(crate) tiles: Vec<FilmTile>,
    tiles_x: u32,
    tile_size: u32,
    /// The sample allocation up to the next budget; `None` as long as the film has no rounds.
    pub(crate) round: Option<Round>,
    /// Sums of light tracing; `None` until there are any.
    pub(crate) light: Option<LightLayer>,
    /// Memory of a light layer that is not in use.
    idle_light: Vec<ExactSum>,
    /// How caustics are rendered: the same for all samples, so fixed from the first one on.
    pub(crate) caustic_plan: Option<CausticPlan>,
    /// See [`Self::set_preview`].
    pub(crate) is_preview: bool,
    /// Cost of a sample per block, for the sample allocation; `None` until it is measured, which gives the same again.
    pub(crate) block_costs: Option<Vec<f64>>,
}

impl Film {
    /// The smallest region of whole tiles that contains the pixels from `start` up to `end`, excluded; `None` if there
    /// are none.
    pub fn region(&self, start: UVec2, end: UVec2) -> Option<Region> {
        let (size, side) = (UVec2::new(self.width(), self.height()), self.tile_size());
        let end = end.min(size);
        if start.cmpge(end).any() {
            return None;
        }
        let last = (end - 1) / side + 1;
        Some(Region { start: start / side * side, end: (last * side).min(size) })
    }

    /// Like [`Self::region`], for a rectangle in fractions of the image from its upper left corner: left, top, right
    /// and bottom, clamped to 0..1.
    pub fn region_of(&self, [left, top, right, bottom]: [f64; 4]) -> Option<Region> {
        let size = UVec2::new(self.width(), self.height()).as_dvec2();
        let pixel = |x: f64, y: f64| glam::DVec2::new(x, y).clamp(glam::DVec2::ZERO, glam::DVec2::ONE) * size;
        self.region(pixel(left, top).floor().as_uvec2(), pixel(right, bottom).ceil().as_uvec2())
    }
}

impl Film {
    /// Default side of a tile in pixels.
    pub const TILE_SIZE: u32 = 32;

    /// Sample numbers of a pixel are below this.
    pub const MAX_SAMPLES: u32 = 1 << 31;

    /// Bytes per pixel: its sum, its mean at the last power of two, and the last change of the mean.
    pub const BYTES_A_PIXEL: usize = room::BYTES_A_PIXEL;

    /// Bytes per pixel of light tracing, if there is any.
    pub const LIGHT_BYTES_A_PIXEL: usize = room::LIGHT_BYTES_A_PIXEL;

    /// Creates an empty film.
    ///
    /// - `width`, `height`: pixels, at least 1 each.
    ///
    /// # Panics
    /// If a size is 0, or there is not enough memory.
    pub fn new(width: u32, height: u32) -> Self {
        Self::with_tile_size(width, height, Self::TILE_SIZE)
    }

    /// Like [`Self::new`], with an error that says the required memory.
    ///
    /// # Errors
    /// If there is not enough memory.
    ///
    /// # Panics
    /// If a size is 0.
    pub fn try_new(width: u32, height: u32) -> Result<Self, NoRoom> {
        Self::try_with_tile_size(width, height, Self::TILE_SIZE)
    }

    /// Like [`Self::new`], with a side of the tiles in pixels. The image does not depend on it, bit for bit.
    ///
    /// # Panics
    /// If a size is 0, or there is not enough memory.
    pub fn with_tile_size(width: u32, height: u32, tile_size: u32) -> Self {
        Self::try_with_tile_size(width, height, tile_size).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Like [`Self::with_tile_size`], with an error. Allocates everything that a render needs, except for light tracing
    /// ([`Self::reserve_light`]).
    ///
    /// # Errors
    /// If there is not enough memory.
    ///
    /// # Panics
    /// If a size is 0.
    pub fn try_with_tile_size(width: u32, height: u32, tile_size: u32) -> Result<Self, NoRoom> {
        assert!(width > 0 && height > 0 && tile_size > 0, "a film of {width} × {height} has no pixels");
        // In one piece first: a system that overcommits small allocations refuses one that is too large.
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
            block_costs: None,
        })
    }

    /// Reserves memory for light tracing.
    ///
    /// # Errors
    /// If there is not enough memory.
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

    /// Removes all samples; the next one has number `first`.
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

    /// Samples per pixel: for an even film the minimum over all pixels, for an adaptive film the mean that has been
    /// spent.
    pub fn spp(&self) -> u32 {
        self.spp_in(None)
    }

    /// Like [`Self::spp`] for the whole film; for a region, the minimum over its pixels.
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

    /// Samples per pixel that any pixel has begun: more than [`spp`](Self::spp) if a pass was stopped.
    pub fn max_spp(&self) -> u32 {
        let light_traced = self.light.as_ref().map(LightLayer::begun);
        let begun = |block: &Block| match &self.round {
            Some(round) if !round.even => block.begun(round),
            _ => block.spp,
        };
        let budget = self.round.filter(|round| !round.even).map(|round| round.budget);
        self.blocks().map(begun).chain(light_traced).chain(budget).max().unwrap_or(0)
    }

    /// Whether another film with the same sample count may differ: this one was stopped in the middle of a pass, or has
    /// samples of a region or of a part that its allocation did not assign.
    pub fn is_uneven(&self) -> bool {
        self.max_spp() > self.spp() || self.round.is_some_and(|round| round.irregular)
    }

    /// Returns the minimum of samples per pixel, their mean over all pixels, and the maximum.
    pub fn sample_counts(&self) -> (u32, f64, u32) {
        let (mut least, mut most, mut sum) = (u32::MAX, 0, 0.0);
        for block in self.blocks() {
            (least, most) = (least.min(block.spp), most.max(block.spp));
            sum += f64::from(block.spp) * block.n_pixels() as f64;
        }
        (least, sum / (f64::from(self.width) * f64::from(self.height)), most)
    }

    /// Removes all samples and keeps the memory, because allocating a large film is slow.
    pub fn clear(&mut self) {
        self.clear_unless(&|| false);
    }

    /// Like [`Self::clear`], until `stop` returns true. Then it returns false, and the film must be cleared before any
    /// other use.
    pub fn clear_unless(&mut self, stop: &(dyn Fn() -> bool + Sync)) -> bool {
        self.caustic_plan = None;
        self.block_costs = None;
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

    /// Marks the film as a preview, shown during motion: its samples may differ from those of another film of the same
    /// size, so no pilot paths delay the first of them. Must be called before the first sample.
    pub fn set_preview(&mut self, is_preview: bool) {
        self.is_preview = is_preview;
    }

    /// How caustics are rendered; `None` before the first sample.
    pub fn caustic_plan(&self) -> Option<CausticPlan> {
        self.caustic_plan
    }

    /// Creates the sums of light tracing if there are none.
    ///
    /// - `stride`: camera paths per light path, at least 1.
    pub(crate) fn want_light(&mut self, stride: u32) {
        if self.light.is_none() {
            let size = UVec2::new(self.width, self.height);
            let memory = std::mem::take(&mut self.idle_light);
            self.light = Some(LightLayer::in_memory(memory, size, self.first_sample(), stride));
        }
    }

    /// Number of the first sample.
    pub fn first_sample(&self) -> u32 {
        self.blocks().filter_map(|block| block.ranges.first()).map(|range| range.start).min().unwrap_or(0)
    }

    /// Number of samples that were rejected because they were not finite.
    pub fn n_bad(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.bad.len() as u64).sum()
    }

    /// Adds the samples of another film of the same image: the result equals the film that was rendered with the
    /// samples of both, bit for bit.
    ///
    /// # Errors
    /// If the films differ in size, tile size or number of light paths, or have a sample in common. Then this film is
    /// unchanged.
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

    /// Mean radiance of a pixel, W·m⁻²·sr⁻¹, row 0 at the top; black if it has no samples.
    pub fn mean(&self, x: u32, y: u32) -> Vec3 {
        let (tile, local) = self.locate(x, y);
        (tile.mean(local) + self.light_traced(x, y)).as_vec3()
    }

    /// The part of [`Self::mean`] from light paths.
    pub fn light_traced(&self, x: u32, y: u32) -> DVec3 {
        self.light.as_ref().map_or(DVec3::ZERO, |layer| layer.mean((y * self.width + x) as usize))
    }

    /// The tiles that have pixels of a row, from the left.
    pub(crate) fn tiles_of_row(&self, y: u32) -> &[FilmTile] {
        &self.tiles[(y / self.tile_size * self.tiles_x) as usize..][..self.tiles_x as usize]
    }

    /// Mean radiance of the pixels of one row, from the left.
    pub fn row(&self, y: u32) -> impl Iterator<Item = Vec3> {
        self.tiles_of_row(y).iter().flat_map(move |tile| {
            let first = ((y - tile.origin.y) * tile.size.x) as usize;
            (first..first + tile.size.x as usize)
                .zip(tile.origin.x..)
                .map(move |(local, x)| (tile.mean(local) + self.light_traced(x, y)).as_vec3())
        })
    }

    /// Like [`Self::row`], passing column and radiance to `take`: faster where whole images are read.
    pub(crate) fn for_each_in_row(&self, y: u32, mut take: impl FnMut(usize, Vec3)) {
        for tile in self.tiles_of_row(y) {
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
        let mut means = vec![Vec3::ZERO; self.width as usize * self.height as usize];
        means.par_chunks_exact_mut(self.width as usize).zip(0..self.height).for_each(|(row, y)| {
            self.for_each_in_row(y, |x, radiance| row[x] = radiance);
        });
        means
    }

    /// Samples per pixel of the camera paths at a pixel, non-finite ones included.
    pub fn samples(&self, x: u32, y: u32) -> u32 {
        let (tile, local) = self.locate(x, y);
        tile.block_of(local).spp
    }

    /// Estimates the error of the image from its own samples; `None` before the second sample per pixel.
    pub fn error_estimate(&self) -> Option<ErrorEstimate> {
        self.error_estimate_in(None)
    }

    /// Like [`Self::error_estimate`], for a region.
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

    /// Whether every pixel gets the same number of samples.
    fn is_even(&self) -> bool {
        self.round.is_none_or(|round| round.even)
    }

    /// Returns the change of a pixel by the last doubling of its samples: the squared relative difference, mean over
    /// channels. Its mean over many pixels is the remaining relative variance. 0 before the second sample.
    pub fn doubling_step(&self, x: u32, y: u32) -> f32 {
        let (tile, local) = self.locate(x, y);
        tile.last_step(local)
    }

    /// Records light tracing for the error estimate, if its sample count is a power of two.
    pub(crate) fn record_light(&mut self) {
        let Some(layer) = &self.light else { return };
        let width = self.width;
        self.tiles.par_iter_mut().for_each(|tile| tile.record_light(layer, width));
    }

    /// Sets the radiance that counts as 1 in relative errors, W·m⁻²·sr⁻¹: a property of the scene.
    pub(crate) fn set_radiance_unit(&mut self, unit: f32) {
        self.tiles.iter_mut().for_each(|tile| tile.unit = unit);
    }

    /// Whether the next round of an adaptive film must be decided, because the previous one is over.
    pub(crate) fn round_is_due(&self) -> bool {
        // Tiles of other sizes cut blocks, which then have no neighbours.
        self.tile_size.is_multiple_of(BLOCK_SIZE)
            && self.spp() >= self.round.as_ref().map_or(FIRST_ROUND, |round| round.to)
    }

    /// Decides the next round of an adaptive film, if it is due. Unknown [`Self::block_costs`] are taken as equal.
    pub(crate) fn begin_round_if_due(&mut self, metric: ErrorMetric) {
        if !self.round_is_due() {
            return;
        }
        let (least, mean, most) = self.sample_counts();
        let (from, irregular) = match &self.round {
            Some(round) => (self.spp(), round.irregular),
            None => (self.spp().max(mean.round() as u32), least < most),
        };
        let size = UVec2::new(self.width, self.height).map(|side| side.div_ceil(BLOCK_SIZE));
        let costs = self.block_costs.as_deref();
        self.round = Some(begin_round(&mut self.tiles, size, (from, irregular), metric, costs));
    }

    /// Records that all samples due up to a budget have been taken.
    pub(crate) fn has_spent(&mut self, budget: u32) {
        if let Some(round) = &mut self.round {
            round.budget = round.budget.max(budget);
        }
    }

    /// Ends the round at the present sample counts; the next one is decided from them.
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
