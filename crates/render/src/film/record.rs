//! A film as plain numbers, for keeping it on disk, and back.

use crate::film::error::RecordError;
use crate::film::estimate::TileConvergence;
use crate::film::exact_sum::ExactSum;
use crate::film::light_layer::LightLayer;
use crate::film::tiles::{Film, FilmTile};
use glam::{DVec3, UVec2};
use serde::{Deserialize, Serialize};

/// Numbers for each pixel: three channels of the sum, of its rest, of the mean at the last power of two, and of sum and
/// rest of the traced light.
pub const N_PLANES: usize = 15;

/// All that is in a film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmRecord {
    /// Size, tiles and samples.
    pub layout: FilmLayout,
    /// Row by row from the top, [`N_PLANES`] of them.
    pub planes: Vec<Vec<f64>>,
}

/// What is not a number for each pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmLayout {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Pixels.
    pub tile_size: u32,
    /// Row by row from the top.
    pub tiles: Vec<TileRecord>,
    /// What is known of the traced light, where there is such light.
    #[serde(rename = "lamps")]
    pub light_traced: Option<LightTracingRecord>,
}

/// Light paths that are in the film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightTracingRecord {
    /// First batch and the one after the last, of each range.
    pub batches: Vec<(u64, u64)>,
    /// Samples of the whole picture that are complete.
    pub spp: u32,
}

/// Which samples a tile has, and what is known of its error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileRecord {
    /// First sample and the one after the last, of each range.
    pub samples: Vec<(u32, u32)>,
    /// Pixel of the tile and number of each sample that was left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bad: Vec<(u32, u32)>,
    /// How many samples the means at the last power of two have.
    pub mean_of: u32,
    /// The bits of what each doubling changed.
    pub steps: Vec<u64>,
}

impl FilmLayout {
    /// Whether every sample of `other` is here too, if both are of one picture.
    pub fn has_all_of(&self, other: &Self) -> bool {
        fn covers<T: PartialOrd>(ranges: &[(T, T)], others: &[(T, T)]) -> bool {
            let is_covered = |(start, end): &(T, T)| start >= end || ranges.iter().any(|(s, e)| s <= start && end <= e);
            others.iter().all(is_covered)
        }
        let batches =
            |layout: &Self| layout.light_traced.as_ref().map_or_else(Vec::new, |traced| traced.batches.clone());
        (self.width, self.height, self.tile_size) == (other.width, other.height, other.tile_size)
            && self.tiles.iter().zip(&other.tiles).all(|(tile, other)| covers(&tile.samples, &other.samples))
            && covers(&batches(self), &batches(other))
    }
}

impl Film {
    /// What is not a number for each pixel.
    pub fn layout(&self) -> FilmLayout {
        let record = |tile: &FilmTile| TileRecord {
            samples: tile.ranges.iter().map(|range| (range.start, range.end)).collect(),
            bad: tile.bad.clone(),
            mean_of: tile.convergence.checkpoint_spp,
            steps: tile.convergence.steps.iter().map(|step| step.to_bits()).collect(),
        };
        let of_light = |light: &LightLayer| LightTracingRecord {
            batches: light.done.iter().map(|range| (range.start, range.end)).collect(),
            spp: light.spp,
        };
        FilmLayout {
            width: self.width(),
            height: self.height(),
            tile_size: self.tile_size(),
            tiles: self.tiles.iter().map(record).collect(),
            light_traced: self.light.as_ref().map(of_light),
        }
    }

    /// All numbers of the film; [`Self::from_record`] is the inverse.
    pub fn to_record(&self) -> FilmRecord {
        let n_pixels = self.width() as usize * self.height() as usize;
        let mut planes = vec![vec![0.0; n_pixels]; N_PLANES];
        for tile in &self.tiles {
            for (local, sum) in tile.sums.iter().enumerate() {
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * self.width() as usize + (tile.origin.x + x) as usize;
                let checkpoint = tile.convergence.checkpoint.get(local).copied().unwrap_or_default();
                let numbers = [sum.sum, sum.rest, checkpoint];
                for (plane, number) in planes.iter_mut().zip(numbers.iter().flat_map(DVec3::to_array)) {
                    plane[at] = number;
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
        FilmRecord { layout: self.layout(), planes }
    }

    /// The film with these numbers; the inverse of [`Self::to_record`].
    ///
    /// # Errors
    /// When the numbers contradict each other.
    pub fn from_record(record: &FilmRecord) -> Result<Self, RecordError> {
        let FilmLayout { width, height, tile_size, tiles, light_traced } = &record.layout;
        let (width, height, tile_size) = (*width, *height, *tile_size);
        let n_pixels = u64::from(width) * u64::from(height);
        if n_pixels == 0 || tile_size == 0 {
            return Err(RecordError::NoPixels);
        }
        let n_tiles = u64::from(width.div_ceil(tile_size)) * u64::from(height.div_ceil(tile_size));
        let planes_fit = record.planes.iter().all(|plane| plane.len() as u64 == n_pixels);
        if tiles.len() as u64 != n_tiles || record.planes.len() != N_PLANES || !planes_fit {
            return Err(RecordError::Size);
        }
        let mut film = Self::with_tile_size(width, height, tile_size);
        for (tile, record_of_tile) in film.tiles.iter_mut().zip(tiles) {
            let n_pixels = tile.n_pixels();
            check_ranges(&record_of_tile.samples, Self::MAX_SAMPLES)?;
            let spp: u64 = record_of_tile.samples.iter().map(|(start, end)| u64::from(end - start)).sum();
            tile.spp = u32::try_from(spp).map_err(|_| RecordError::TooManySamples)?;
            tile.ranges = record_of_tile.samples.iter().map(|&(start, end)| start..end).collect();
            tile.bad = record_of_tile.bad.clone();
            let n_bad_at_most = tile.spp as usize;
            let mut n_bad = vec![0; n_pixels];
            for (pixel, _) in &tile.bad {
                match n_bad.get_mut(*pixel as usize) {
                    Some(n) if *n < n_bad_at_most => *n += 1,
                    _ => return Err(RecordError::BadSamples),
                }
            }
            let mut checkpoint = Vec::new();
            for local in 0..n_pixels {
                let (x, y) = (local as u32 % tile.size.x, local as u32 / tile.size.x);
                let at = (tile.origin.y + y) as usize * width as usize + (tile.origin.x + x) as usize;
                let vector = |first: usize| DVec3::from_array([0, 1, 2].map(|c| record.planes[first + c][at]));
                tile.sums[local] = ExactSum { sum: vector(0), rest: vector(3) };
                checkpoint.push(vector(6));
            }
            if record_of_tile.mean_of > 0 {
                let n_doublings = record_of_tile.mean_of.ilog2() as usize;
                if !record_of_tile.mean_of.is_power_of_two() || record_of_tile.steps.len() != n_doublings {
                    return Err(RecordError::Convergence);
                }
                tile.convergence = TileConvergence {
                    n_values: 3.0 * checkpoint.len() as f64,
                    checkpoint,
                    checkpoint_spp: record_of_tile.mean_of,
                    steps: record_of_tile.steps.iter().map(|&bits| f64::from_bits(bits)).collect(),
                    // Not kept on disk: known again after the next doubling.
                    last: Vec::new(),
                };
            } else if !record_of_tile.steps.is_empty() {
                return Err(RecordError::Convergence);
            }
        }
        if let Some(traced) = light_traced {
            let mut light = LightLayer::new(UVec2::new(width, height), 0);
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

/// - `most`: that no range may go beyond.
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
