//! The pixels of one tile: the unit that a worker owns while it adds samples.

use crate::core::material::MaterialId;
use crate::film::block::{BLOCK_PIXELS, BLOCK_SIZE, Block, Steps};
use crate::film::estimate::local_level;
use crate::film::exact_sum::ExactSum;
use crate::film::light_layer::LightLayer;
use crate::film::region::Region;
use crate::film::surfaces::SurfaceSums;
use crate::integrators::common::seen::Seen;
use glam::{DVec3, UVec2, Vec3};
use std::collections::TryReserveError;

/// The pixels of one tile, row by row, in blocks of equal sample counts.
#[derive(Clone, Debug)]
pub(crate) struct FilmTile {
    /// Upper left pixel in the film.
    pub origin: UVec2,
    pub size: UVec2,
    /// Blocks, row by row.
    pub blocks: Vec<Block>,
    /// Sum of radiance per pixel, W·m⁻²·sr⁻¹.
    pub sums: Vec<ExactSum>,
    /// Pixel (index in this tile) and sample number of each sample that was rejected because it was not finite.
    pub bad: Vec<(u32, u32)>,
    /// Mean radiance at the last power of two of each block's samples; empty before the first.
    pub before: Vec<DVec3>,
    /// Squared relative change of each pixel in its block's last doubling, mean over channels; empty if unknown.
    pub last: Vec<f32>,
    /// Change of each pixel's mean in that doubling, W·m⁻²·sr⁻¹; NaN where unknown, empty if unknown for all pixels.
    pub half_steps: Vec<Vec3>,
    /// The same for light tracing.
    pub light: TileLight,
    /// What the first samples of each pixel see; empty where nobody asks.
    pub surfaces: Vec<SurfaceSums>,
    /// The radiance that counts as 1 in relative errors, W·m⁻²·sr⁻¹.
    pub unit: f32,
}

/// Error statistics of light tracing in a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileLight {
    /// Samples per pixel in `before`; 0 before the first.
    pub mean_of: u32,
    /// Mean radiance per pixel at the last power of two.
    pub before: Vec<DVec3>,
    /// Squared relative change of each pixel in the last doubling, mean over channels; empty if unknown.
    pub last: Vec<f32>,
    /// Change of each pixel's mean in that doubling; empty if unknown.
    pub half_steps: Vec<Vec3>,
    /// Squared changes by the latest doublings.
    pub steps: Steps,
}

impl TileLight {
    /// The mean at the last power of two; zero before the first.
    fn before(&self, local: usize) -> DVec3 {
        if self.mean_of > 0 { self.before[local] } else { DVec3::ZERO }
    }

    /// Like [`Block::knows_half_step`].
    pub fn knows_half_step(&self) -> bool {
        self.steps.at > 0 && self.steps.at == self.mean_of
    }

    /// Like [`Block::change`].
    pub fn change(&self, local: usize) -> Option<[f32; 4]> {
        let change = if self.knows_half_step() { *self.half_steps.get(local)? } else { Vec3::ZERO };
        let relative = if self.steps.at > 0 { *self.last.get(local)? } else { 0.0 };
        Some([change.x, change.y, change.z, relative])
    }

    fn clear(&mut self) {
        let Self { mean_of, before, last, half_steps, steps } = self;
        before.clear();
        last.clear();
        half_steps.clear();
        (*mean_of, *steps) = (0, Steps::default());
    }
}

impl FilmTile {
    pub fn lies_in(&self, region: &Region) -> bool {
        region.contains(self.origin.x, self.origin.y)
    }

    pub fn try_new(origin: UVec2, size: UVec2) -> Result<Self, TryReserveError> {
        let n = size.x as usize * size.y as usize;
        let (mut sums, mut before, mut last, mut half_steps) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        sums.try_reserve_exact(n)?;
        sums.resize(n, ExactSum::default());
        before.try_reserve_exact(n)?;
        last.try_reserve_exact(n)?;
        half_steps.try_reserve_exact(n)?;
        let starts = |length: u32| (0..length).step_by(BLOCK_SIZE as usize);
        let blocks = starts(size.y).flat_map(|y| starts(size.x).map(move |x| UVec2::new(x, y)));
        let blocks = blocks.map(|start| Block::new(start, (size - start).min(UVec2::splat(BLOCK_SIZE)))).collect();
        let (bad, surfaces, light) = (Vec::new(), Vec::new(), TileLight::default());
        Ok(Self { origin, size, blocks, sums, bad, before, last, half_steps, light, surfaces, unit: 1.0 })
    }

    /// Reserves the memory for light tracing.
    pub fn try_reserve_light(&mut self) -> Result<(), TryReserveError> {
        let n = self.n_pixels();
        self.light.before.try_reserve_exact(n)?;
        self.light.half_steps.try_reserve_exact(n)?;
        self.light.last.try_reserve_exact(n)
    }

    /// Removes all samples; the next one has number `first`.
    pub fn clear(&mut self, first: u32) {
        let Self { origin: _, size: _, blocks, sums, bad, before, last, half_steps, light, surfaces, unit: _ } = self;
        blocks.iter_mut().for_each(|block| block.clear(first));
        sums.fill(ExactSum::default());
        bad.clear();
        before.clear();
        last.clear();
        half_steps.clear();
        surfaces.clear();
        light.clear();
    }

    pub fn n_pixels(&self) -> usize {
        self.sums.len()
    }

    /// Smallest sample count of any pixel.
    pub fn spp(&self) -> u32 {
        self.blocks.iter().map(|block| block.spp).min().unwrap_or(0)
    }

    /// The block of a pixel.
    pub fn block_of(&self, local: usize) -> &Block {
        let (x, y) = (local as u32 % self.size.x, local as u32 / self.size.x);
        &self.blocks[(y / BLOCK_SIZE * self.size.x.div_ceil(BLOCK_SIZE) + x / BLOCK_SIZE) as usize]
    }

    /// Returns the blocks that contain row `y` of the tile, from left to right.
    pub fn blocks_in_row(&self, y: u32) -> &[Block] {
        let n = self.size.x.div_ceil(BLOCK_SIZE) as usize;
        &self.blocks[(y / BLOCK_SIZE) as usize * n..][..n]
    }

    pub fn mean(&self, local: usize) -> DVec3 {
        self.mean_of(local, self.block_of(local).spp)
    }

    /// - `spp`: sample count of its block.
    pub fn mean_of(&self, local: usize, spp: u32) -> DVec3 {
        let n_bad = self.bad.iter().filter(|(pixel, _)| *pixel as usize == local).count() as u32;
        match spp - n_bad {
            0 => DVec3::ZERO,
            n => self.sums[local].sum / f64::from(n),
        }
    }

    /// Mean radiance of a pixel, with light tracing, at the last powers of two of its samples.
    pub fn shown_before(&self, local: usize) -> DVec3 {
        self.before[local] + self.light.before(local)
    }

    /// Returns the change of a pixel by its last doubling: the squared relative difference, mean over channels.
    pub fn last_step(&self, local: usize) -> f32 {
        self.last_steps(local, self.block_of(local).steps).into_iter().sum()
    }

    /// The same of camera paths and of light paths.
    ///
    /// - `steps`: of its block.
    pub fn last_steps(&self, local: usize, steps: Steps) -> [f32; 2] {
        let of = |steps: Steps, last: &[f32]| {
            if steps.at > 0 { last.get(local).copied().unwrap_or(0.0) } else { 0.0 }
        };
        [of(steps, &self.last), of(self.light.steps, &self.light.last)]
    }

    /// Adds one sample of every pixel of a block, row by row; `sample` is its number, which must be the next one.
    pub fn add_sample(&mut self, block: usize, sample: u32, radiance: &[Vec3]) {
        let of = &mut self.blocks[block];
        debug_assert_eq!(sample, of.next_sample(), "samples come in order");
        for (local, &radiance) in of.locals(self.size.x).zip(radiance) {
            if radiance.is_finite() {
                self.sums[local].add(radiance);
            } else {
                self.bad.push((local as u32, sample));
            }
        }
        of.spp += 1;
        if let Some(last) = of.ranges.last_mut() {
            last.end += 1;
        }
    }

    /// Adds the first surfaces of one sample of every pixel of a block, row by row.
    ///
    /// - `emits`: whether a material is that of an emitter.
    pub fn add_surfaces(&mut self, block: usize, seen: &[Seen], emits: &impl Fn(MaterialId) -> bool) {
        for (local, seen) in self.blocks[block].locals(self.size.x).zip(seen) {
            self.surfaces[local].add(seen, seen.material != Seen::NONE && emits(seen.material));
        }
    }

    /// Records the means of blocks whose sample count is a power of two, and their last doubling, for the error
    /// estimate. Must be called at each power of two.
    ///
    /// - `even`: all blocks get the same number of samples, so the level of a pixel may use its neighbours in other
    ///   blocks. Otherwise it would depend on the order in which blocks are rendered, and so on the portions of a pass.
    pub fn record(&mut self, even: bool) {
        let is_news = |block: &Block| block.spp.is_power_of_two() && block.mean_of != block.spp;
        if !self.blocks.iter().any(is_news) {
            return;
        }
        let first = self.blocks[0].spp;
        let mut of_tile = Vec::new();
        if even && self.blocks.iter().all(|block| block.spp == first) {
            of_tile.extend((0..self.n_pixels()).map(|local| self.mean_of(local, first) + self.light.before(local)));
        }
        for block in 0..self.blocks.len() {
            if is_news(&self.blocks[block]) {
                self.record_block(block, &of_tile);
            }
        }
    }

    /// - `of_tile`: mean radiance of all pixels of the tile, or empty if the level must come from the block alone.
    fn record_block(&mut self, block: usize, of_tile: &[DVec3]) {
        let Block { spp, mean_of, size, .. } = self.blocks[block];
        let (mut seen, mut shown) = ([DVec3::ZERO; BLOCK_PIXELS], [DVec3::ZERO; BLOCK_PIXELS]);
        let n = self.blocks[block].n_pixels();
        for (i, local) in self.blocks[block].locals(self.size.x).enumerate() {
            seen[i] = self.mean_of(local, spp);
            shown[i] = seen[i] + self.light.before(local);
        }
        if self.before.is_empty() {
            self.before.resize(self.sums.len(), DVec3::ZERO);
        }
        // More than one doubling at once gives no estimate.
        if mean_of > 0 && mean_of == spp / 2 {
            if self.last.is_empty() {
                self.last.resize(self.sums.len(), 0.0);
            }
            if self.half_steps.is_empty() {
                self.half_steps.resize(self.sums.len(), Vec3::NAN);
            }
            let mut sum = 0.0;
            for (i, local) in self.blocks[block].locals(self.size.x).enumerate() {
                let before = self.before[local];
                let shown_before = self.shown_before(local);
                let level = if of_tile.is_empty() {
                    local_level(&shown[..n], shown_before, size.x as usize, i)
                } else {
                    local_level(of_tile, shown_before, self.size.x as usize, local)
                };
                let step = relative_square(seen[i] - before, level, self.unit);
                self.last[local] = (step / 3.0) as f32;
                self.half_steps[local] = (seen[i] - before).as_vec3();
                sum += step;
            }
            self.blocks[block].steps.push(spp, sum);
        } else if !self.half_steps.is_empty() {
            for local in self.blocks[block].locals(self.size.x) {
                self.half_steps[local] = Vec3::NAN;
            }
        }
        for (i, local) in self.blocks[block].locals(self.size.x).enumerate() {
            self.before[local] = seen[i];
        }
        self.blocks[block].mean_of = spp;
    }

    /// Records the light-traced means if the samples of light tracing are a power of two, and their last doubling, for
    /// the error estimate.
    ///
    /// - `width`: width of the film in pixels.
    pub fn record_light(&mut self, layer: &LightLayer, width: u32) {
        let (spp, mean_of) = (layer.spp, self.light.mean_of);
        if !spp.is_power_of_two() || mean_of == spp {
            return;
        }
        let place = |local: usize| self.origin + UVec2::new(local as u32 % self.size.x, local as u32 / self.size.x);
        let traced = |local: usize| layer.mean((place(local).y * width + place(local).x) as usize);
        let now: Vec<DVec3> = (0..self.n_pixels()).map(traced).collect();
        self.light.half_steps.clear();
        if mean_of > 0 && mean_of == spp / 2 {
            let seen: Vec<DVec3> = (0..self.n_pixels()).map(|local| self.mean(local)).collect();
            let shown: Vec<DVec3> = seen.iter().zip(&now).map(|(seen, traced)| *seen + *traced).collect();
            let Self { light, size, unit, .. } = self;
            light.last.clear();
            let mut sum = 0.0;
            for (local, (traced, before)) in now.iter().zip(&light.before).enumerate() {
                let level = local_level(&shown, seen[local] + *before, size.x as usize, local);
                let step = relative_square(*traced - *before, level, *unit);
                light.last.push((step / 3.0) as f32);
                light.half_steps.push((*traced - *before).as_vec3());
                sum += step;
            }
            light.steps.push(spp, sum);
        }
        // Copies into the existing list, because its memory is reserved for as long as the film exists.
        self.light.before.clear();
        self.light.before.extend_from_slice(&now);
        self.light.mean_of = spp;
    }

    /// Adds the samples of another tile; the tiles must have no sample in common.
    ///
    /// - `light_knows_more`: whether the other tile's error statistics of light tracing rest on more samples.
    pub fn merge(&mut self, other: &Self, light_knows_more: bool) {
        for (sum, other) in self.sums.iter_mut().zip(&other.sums) {
            sum.merge(other);
        }
        if light_knows_more {
            self.light = other.light.clone();
        }
        for (i, of_other) in other.blocks.iter().enumerate() {
            let block = &mut self.blocks[i];
            if block.knows_less_than(of_other) {
                (block.mean_of, block.steps) = (of_other.mean_of, of_other.steps);
                for local in block.locals(self.size.x) {
                    copy_one(&other.before, &mut self.before, local, self.sums.len());
                    copy_one(&other.last, &mut self.last, local, self.sums.len());
                    let half_step = other.half_steps.get(local).copied().unwrap_or(Vec3::NAN);
                    if !half_step.is_nan() || !self.half_steps.is_empty() {
                        self.half_steps.resize(self.sums.len(), Vec3::NAN);
                        self.half_steps[local] = half_step;
                    }
                }
            }
            block.merge_samples(of_other);
        }
        self.bad.extend(&other.bad);
    }
}

/// Copies one entry between lists that are either empty or complete.
fn copy_one<T: Copy + Default>(from: &[T], to: &mut Vec<T>, at: usize, n: usize) {
    if let Some(value) = from.get(at) {
        to.resize(n, T::default());
        to[at] = *value;
    }
}

/// Returns the squared difference over the squared level plus 0.01 squared units, summed over channels.
fn relative_square(difference: DVec3, level: DVec3, unit: f32) -> f64 {
    let floor = 0.01 * f64::from(unit).powi(2);
    (difference * difference / (level * level + floor)).element_sum()
}
