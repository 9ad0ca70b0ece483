//! Conversion of a film to and from plain numbers, for storage.

use crate::core::caustic_plan::CausticPlan;
use crate::film::block::{Block, MAX_DOUBLINGS, NEVER, Steps};
use crate::film::error::RecordError;
use crate::film::exact_sum::ExactSum;
use crate::film::light_layer::LightLayer;
use crate::film::round::Round;
use crate::film::tile::FilmTile;
use crate::film::tiles::Film;
use glam::{DVec3, UVec2, Vec3};
use serde::{Deserialize, Serialize};

/// Planes of a record, one number per pixel each: three channels each of the sum, of its rest and of the mean at the
/// last power of two; then the same nine for light tracing.
pub const N_PLANES: usize = 18;

/// Planes of the last doubling, one number per pixel each: three channels of the change of the mean and the squared
/// relative change; then the same four for light tracing.
pub const N_CHANGE_PLANES: usize = 8;

/// All data of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmRecord {
    /// Size, tiles and sample ranges.
    pub layout: FilmLayout,
    /// [`N_PLANES`] planes, each row by row from the top.
    pub planes: Vec<Vec<f64>>,
    /// [`N_CHANGE_PLANES`] planes of the last doubling, in the same order, 0 where there was none; `None` if they are not
    /// known, as after a doubling at once from fewer samples. Only the denoiser and the error of single pixels need them.
    pub changes: Option<Vec<Vec<f32>>>,
}

/// The data of a film that is not stored per pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmLayout {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Side of a tile in pixels.
    pub tile_size: u32,
    /// Row by row from the top.
    pub tiles: Vec<TileRecord>,
    /// The sample allocation, unless the film is even.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub round: Option<RoundRecord>,
    /// State of light tracing, if there is any.
    pub light_traced: Option<LightTracingRecord>,
    /// How caustics are rendered; `None` without samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub caustics: Option<CausticPlan>,
}

/// A round of the sample allocation and its progress; all numbers are mean samples per pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoundRecord {
    /// Budget at which it began.
    pub from: u32,
    /// Budget at which it ends.
    pub to: u32,
    /// Budget spent so far.
    pub budget: u32,
    /// Whether all pixels get the same number of samples.
    pub even: bool,
    /// Whether the film has samples that no round allocated.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub irregular: bool,
}

/// Light paths of a film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightTracingRecord {
    /// First batch and the one after the last, per range.
    pub batches: Vec<(u64, u64)>,
    /// Samples per pixel of the whole image that are complete.
    pub spp: u32,
}

/// Sample ranges and error statistics of a tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileRecord {
    /// Blocks, row by row from the top.
    pub blocks: Vec<BlockRecord>,
    /// Rejected samples: pixel index in the tile and sample number.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bad: Vec<(u32, u32)>,
    /// Samples per pixel in the means of light tracing at the last power of two.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub light_mean_of: u32,
    /// Squared changes by the latest doublings of light tracing.
    #[serde(default, skip_serializing_if = "StepsRecord::is_none")]
    pub light_steps: StepsRecord,
}

/// Sample ranges and error statistics of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockRecord {
    /// First sample and the one after the last, per range.
    pub samples: Vec<(u32, u32)>,
    /// Samples per pixel in the means at the last power of two.
    pub mean_of: u32,
    /// Squared changes by the latest doublings.
    #[serde(default, skip_serializing_if = "StepsRecord::is_none")]
    pub steps: StepsRecord,
    /// Samples per pixel when the round began, and the budgets from which on they are doubled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub due: Option<(u32, Vec<u32>)>,
    /// Bits of the `f32` share of a pixel's level below which shadow rays are subject to roulette; 0 for none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub shadow_share: u32,
}

/// Samples per pixel after the newest doubling (0 before the first), and the bits of the `f32` values of `Steps`,
/// newest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepsRecord(pub u32, pub Vec<u32>);

impl StepsRecord {
    fn is_none(&self) -> bool {
        self.0 == 0
    }

    fn of(steps: &Steps) -> Self {
        if steps.at == 0 { Self::default() } else { Self(steps.at, steps.values.map(f32::to_bits).to_vec()) }
    }

    /// - `mean_of`: samples per pixel in the means from which the next doubling is measured.
    fn steps(&self, mean_of: u32) -> Result<Steps, RecordError> {
        let Self(at, bits) = self;
        if *at == 0 && bits.is_empty() {
            return Ok(Steps::default());
        }
        let bits: [u32; Steps::KEPT] = bits.as_slice().try_into().map_err(|_| RecordError::Convergence)?;
        if !at.is_power_of_two() || *at < 2 || *at > mean_of {
            return Err(RecordError::Convergence);
        }
        let values = bits.map(f32::from_bits);
        // Those that are not known are no numbers.
        if values.iter().any(|&squared| squared < 0.0 || squared.is_infinite()) {
            return Err(RecordError::Convergence);
        }
        Ok(Steps { at: *at, values })
    }
}

fn is_zero(n: &u32) -> bool {
    *n == 0
}

impl FilmLayout {
    /// Whether this film contains every sample of `other`, given that both are of the same image.
    pub fn has_all_of(&self, other: &Self) -> bool {
        fn covers<T: PartialOrd>(ranges: &[(T, T)], others: &[(T, T)]) -> bool {
            let is_covered = |(start, end): &(T, T)| start >= end || ranges.iter().any(|(s, e)| s <= start && end <= e);
            others.iter().all(is_covered)
        }
        let batches =
            |layout: &Self| layout.light_traced.as_ref().map_or_else(Vec::new, |traced| traced.batches.clone());
        (self.width, self.height, self.tile_size) == (other.width, other.height, other.tile_size)
            && self.blocks().zip(other.blocks()).all(|(block, other)| covers(&block.samples, &other.samples))
            && covers(&batches(self), &batches(other))
    }

    fn blocks(&self) -> impl Iterator<Item = &BlockRecord> {
        self.tiles.iter().flat_map(|tile| &tile.blocks)
    }
}

impl Film {
    /// Returns the data that is not stored per pixel.
    pub fn layout(&self) -> FilmLayout {
        let is_uneven = self.round.is_some_and(|round| !round.even);
        let of_block = |block: &Block| BlockRecord {
            samples: block.ranges.iter().map(|range| (range.start, range.end)).collect(),
            mean_of: block.mean_of,
            steps: StepsRecord::of(&block.steps),
            due: is_uneven.then(|| (block.base, block.due.into_iter().filter(|due| *due != NEVER).collect())),
            shadow_share: block.shadow_share.to_bits(),
        };
        let record = |tile: &FilmTile| {
            // Sorted, so that it does not depend on the order in which blocks were rendered.
            let mut bad = tile.bad.clone();
            bad.sort_unstable_by_key(|&(pixel, sample)| (sample, pixel));
            TileRecord {
                blocks: tile.blocks.iter().map(of_block).collect(),
                bad,
                light_mean_of: tile.light.mean_of,
                light_steps: StepsRecord::of(&tile.light.steps),
            }
        };
        let of_round =
            |&Round { from, to, budget, even, irregular }: &Round| RoundRecord { from, to, budget, even, irregular };
        let of_light = |light: &LightLayer| LightTracingRecord {
            batches: light.done.iter().map(|range| (range.start, range.end)).collect(),
            spp: light.spp,
        };
        FilmLayout {
            width: self.width(),
            height: self.height(),
            tile_size: self.tile_size(),
            tiles: self.tiles.iter().map(record).collect(),
            round: self.round.as_ref().map(of_round),
            light_traced: self.light.as_ref().map(of_light),
            caustics: self.caustic_plan,
        }
    }

    /// Converts the film to numbers; [`Self::from_record`] is the inverse.
    pub fn to_record(&self) -> FilmRecord {
        let n_pixels = self.width() as usize * self.height() as usize;
        let mut planes = vec![vec![0.0; n_pixels]; N_PLANES];
        for tile in &self.tiles {
            for (local, sum) in tile.sums.iter().enumerate() {
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * self.width() as usize + (tile.origin.x + x) as usize;
                let known = |samples: u32, means: &[DVec3]| means.get(local).filter(|_| samples > 0).copied();
                let before = known(tile.block_of(local).mean_of, &tile.before).unwrap_or_default();
                let light_before = known(tile.light.mean_of, &tile.light.before).unwrap_or_default();
                for (first, vector) in [(0, sum.sum), (3, sum.rest), (6, before), (15, light_before)] {
                    for (plane, number) in planes[first..].iter_mut().zip(vector.to_array()) {
                        plane[at] = number;
                    }
                }
            }
        }
        if let Some(light) = &self.light {
            for (at, sum) in light.sums.iter().enumerate() {
                let numbers = [sum.sum, sum.rest];
                for (plane, number) in planes[9..].iter_mut().zip(numbers.iter().flat_map(DVec3::to_array)) {
                    plane[at] = number;
                }
            }
        }
        FilmRecord { layout: self.layout(), planes, changes: self.changes() }
    }

    /// See [`FilmRecord::changes`].
    fn changes(&self) -> Option<Vec<Vec<f32>>> {
        let n_pixels = self.width() as usize * self.height() as usize;
        let mut planes = vec![vec![0.0; n_pixels]; N_CHANGE_PLANES];
        for tile in &self.tiles {
            for local in 0..tile.n_pixels() {
                let of_camera = tile.block_of(local).change(local, &tile.half_steps, &tile.last)?;
                let of_light = tile.light.change(local)?;
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * self.width() as usize + (tile.origin.x + x) as usize;
                for (plane, number) in planes.iter_mut().zip(of_camera.into_iter().chain(of_light)) {
                    plane[at] = number;
                }
            }
        }
        Some(planes)
    }

    /// Restores a film; the inverse of [`Self::to_record`].
    ///
    /// # Errors
    /// If the numbers contradict each other.
    pub fn from_record(record: &FilmRecord) -> Result<Self, RecordError> {
        let FilmLayout { width, height, tile_size, tiles, round: _, light_traced, caustics } = &record.layout;
        let (width, height, tile_size) = (*width, *height, *tile_size);
        let n_pixels = u64::from(width) * u64::from(height);
        if n_pixels == 0 || tile_size == 0 {
            return Err(RecordError::NoPixels);
        }
        let n_tiles = u64::from(width.div_ceil(tile_size)) * u64::from(height.div_ceil(tile_size));
        let planes_fit = record.planes.iter().all(|plane| plane.len() as u64 == n_pixels);
        let changes_fit = record.changes.as_ref().is_none_or(|planes| {
            planes.len() == N_CHANGE_PLANES && planes.iter().all(|plane| plane.len() as u64 == n_pixels)
        });
        if tiles.len() as u64 != n_tiles || record.planes.len() != N_PLANES || !planes_fit || !changes_fit {
            return Err(RecordError::Size);
        }
        // Samples that are not finite are left out of sums, see `FilmTile::bad`.
        if !record.planes.iter().flatten().all(|number| number.is_finite()) {
            return Err(RecordError::NotFinite);
        }
        let mut film = Self::with_tile_size(width, height, tile_size);
        for (tile, of_tile) in film.tiles.iter_mut().zip(tiles) {
            tile.take_samples(of_tile)?;
            let mut before = vec![DVec3::ZERO; tile.n_pixels()];
            let mut light_before = before.clone();
            for local in 0..tile.n_pixels() {
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * width as usize + (tile.origin.x + x) as usize;
                let vector = |first: usize| DVec3::from_array([0, 1, 2].map(|c| record.planes[first + c][at]));
                tile.sums[local] = ExactSum { sum: vector(0), rest: vector(3) };
                (before[local], light_before[local]) = (vector(6), vector(15));
            }
            if tile.blocks.iter().any(|block| block.mean_of > 0) {
                tile.before = before;
            }
            if tile.light.mean_of > 0 {
                tile.light.before = light_before;
            }
            if let Some(planes) = &record.changes {
                tile.take_changes(planes, width as usize);
            }
        }
        film.round = record.layout.round(&film)?;
        film.caustic_plan = *caustics;
        let is_wrong = |plan: CausticPlan| !plan.is_valid() || light_traced.is_some() && !plan.has_light_paths();
        if film.caustic_plan.map_or(light_traced.is_some(), is_wrong) {
            return Err(RecordError::LightPaths);
        }
        if let (Some(traced), Some(plan)) = (light_traced, film.caustic_plan) {
            let mut light = LightLayer::new(UVec2::new(width, height), 0, plan.light_path_stride);
            check_ranges(&traced.batches, light.batches_before(Self::MAX_SAMPLES))?;
            for (at, sum) in light.sums.iter_mut().enumerate() {
                let vector = |first: usize| DVec3::from_array([0, 1, 2].map(|c| record.planes[first + c][at]));
                *sum = ExactSum { sum: vector(9), rest: vector(12) };
            }
            light.done = traced.batches.iter().map(|&(start, end)| start..end).collect();
            if light.complete() != traced.spp {
                return Err(RecordError::LightPaths);
            }
            light.spp = traced.spp;
            film.light = Some(light);
        }
        Ok(film)
    }
}

impl FilmTile {
    /// Restores the sample ranges and the error statistics, without the planes.
    fn take_samples(&mut self, record: &TileRecord) -> Result<(), RecordError> {
        if record.blocks.len() != self.blocks.len() {
            return Err(RecordError::Size);
        }
        for (block, record) in self.blocks.iter_mut().zip(&record.blocks) {
            check_ranges(&record.samples, Film::MAX_SAMPLES)?;
            let spp: u64 = record.samples.iter().map(|(start, end)| u64::from(end - start)).sum();
            block.spp = u32::try_from(spp).map_err(|_| RecordError::TooManySamples)?;
            block.ranges = record.samples.iter().map(|&(start, end)| start..end).collect();
            block.mean_of = checked_mean(record.mean_of)?;
            block.steps = record.steps.steps(block.mean_of)?;
            if let Some((base, due)) = &record.due {
                let ascending = due.windows(2).all(|pair| pair[0] <= pair[1]);
                if due.len() > MAX_DOUBLINGS || !ascending || *base > block.spp {
                    return Err(RecordError::Allocation);
                }
                block.base = *base;
                block.due.iter_mut().zip(due).for_each(|(to, from)| *to = *from);
            }
            block.shadow_share = f32::from_bits(record.shadow_share);
            if !(block.shadow_share >= 0.0 && block.shadow_share.is_finite()) {
                return Err(RecordError::Allocation);
            }
        }
        self.bad = record.bad.clone();
        let mut n_bad = vec![0; self.n_pixels()];
        for (pixel, _) in &self.bad {
            let local = *pixel as usize;
            match n_bad.get_mut(local) {
                Some(n) if *n < self.block_of(local).spp => *n += 1,
                _ => return Err(RecordError::BadSamples),
            }
        }
        self.light.mean_of = checked_mean(record.light_mean_of)?;
        self.light.steps = record.light_steps.steps(self.light.mean_of)?;
        Ok(())
    }
}

/// Planes of one kind in [`FilmRecord::changes`].
const OF_LIGHT: usize = 4;

impl FilmTile {
    /// Restores the last doubling.
    ///
    /// - `planes`: as [`FilmRecord::changes`]; `width`: of the film in pixels.
    fn take_changes(&mut self, planes: &[Vec<f32>], width: usize) {
        let Self { origin, size, .. } = *self;
        let at = |local: usize| {
            let (x, y) = (local as u32 % size.x, local as u32 / size.x);
            (origin.y + y) as usize * width + (origin.x + x) as usize
        };
        // What is not finite tells nothing of the error.
        let number =
            |plane: usize, local: usize| Some(planes[plane][at(local)]).filter(|x| x.is_finite()).unwrap_or(0.0);
        let change = |local: usize, first: usize| Vec3::from_array([0, 1, 2].map(|c| number(first + c, local)));
        let n = self.n_pixels();
        if self.blocks.iter().any(|block| block.steps.at > 0) {
            let known = |local: usize| self.block_of(local).knows_half_step();
            self.half_steps = (0..n).map(|i| if known(i) { change(i, 0) } else { Vec3::NAN }).collect();
            self.last = (0..n).map(|local| number(OF_LIGHT - 1, local).max(0.0)).collect();
        }
        if self.light.steps.at > 0 {
            self.light.last = (0..n).map(|local| number(N_CHANGE_PLANES - 1, local).max(0.0)).collect();
        }
        if self.light.knows_half_step() {
            self.light.half_steps = (0..n).map(|local| change(local, OF_LIGHT)).collect();
        }
    }
}

fn checked_mean(samples: u32) -> Result<u32, RecordError> {
    if samples > 0 && !samples.is_power_of_two() { Err(RecordError::Convergence) } else { Ok(samples) }
}

impl FilmLayout {
    /// Restores and checks the round of a film with these samples.
    fn round(&self, film: &Film) -> Result<Option<Round>, RecordError> {
        let Some(&RoundRecord { from, to, budget, even, irregular }) = self.round.as_ref() else { return Ok(None) };
        let round = Round { from, to, budget, even, irregular };
        let has_all = |block: &Block| even || block.spp >= block.target(Some(&round), budget);
        let is_due = |block: &Block| block.due.iter().all(|due| *due == NEVER || (from < *due && *due <= to));
        let mut blocks = film.tiles.iter().flat_map(|tile| &tile.blocks);
        let fits = from <= budget && budget <= to && blocks.all(|block| has_all(block) && is_due(block));
        if fits { Ok(Some(round)) } else { Err(RecordError::Allocation) }
    }
}

/// - `most`: upper limit of the end of all ranges.
fn check_ranges<T: PartialOrd>(ranges: &[(T, T)], most: T) -> Result<(), RecordError> {
    let ascending = ranges.windows(2).all(|pair| pair[0].1 < pair[1].0);
    let whole = ranges.iter().all(|(start, end)| start <= end);
    if !ascending || !whole || ranges.is_empty() {
        return Err(RecordError::Ranges);
    }
    if ranges.last().is_some_and(|(_, end)| *end > most) {
        return Err(RecordError::Numbers);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_of_doublings_are_squares() {
        let steps = |value: f32| StepsRecord(4, vec![value.to_bits(); Steps::KEPT]).steps(4);
        assert!(steps(0.25).is_ok() && steps(f32::NAN).is_ok(), "unknown ones are not numbers");
        for wrong in [-0.25, f32::INFINITY] {
            assert_eq!(steps(wrong).err(), Some(RecordError::Convergence));
        }
    }

    #[test]
    fn sums_are_numbers() {
        let mut record = Film::new(4, 4).to_record();
        assert!(Film::from_record(&record).is_ok());
        for wrong in [f64::NAN, f64::INFINITY] {
            record.planes[2][5] = wrong;
            assert_eq!(Film::from_record(&record).err(), Some(RecordError::NotFinite));
        }
    }
}
