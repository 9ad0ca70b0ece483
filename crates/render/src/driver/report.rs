//! Result of a pass over the film, and invalid samples.

use crate::core::counts::RayCounts;
use crate::film::light_layer::LayerReport;
use crate::film::tile::FilmTile;
use glam::{UVec2, Vec3};

/// An invalid sample; replay it with the same scene, seed and settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadSample {
    /// Column of the pixel, from the left.
    pub x: u32,
    /// Row of the pixel, from the top.
    pub y: u32,
    /// Number of the sample within the pixel.
    pub sample: u32,
}

/// Result of [`advance`](crate::advance).
#[derive(Clone, Debug, Default)]
pub struct PassReport {
    /// False if it was stopped before every tile reached the target.
    pub completed: bool,
    /// Traced rays by class.
    pub rays: RayCounts,
    /// Number of samples that were rejected because they were not finite.
    pub n_bad: u64,
    /// The first few of them.
    pub bad: Vec<BadSample>,
    /// Number of samples brighter than any radiance in the scene can be, which is a bug of the program.
    pub n_above: u64,
    /// The first few of them.
    pub above: Vec<BadSample>,
}

impl PassReport {
    /// Returns the report of a completed pass without samples.
    pub(super) fn nothing() -> Self {
        Self { completed: true, ..Self::default() }
    }

    /// Adds the report of another part of the pass.
    pub(super) fn add(&mut self, other: Self) {
        self.completed &= other.completed;
        self.rays += other.rays;
        self.n_bad += other.n_bad;
        self.bad.extend(other.bad.into_iter().take(MAX_LISTED_BAD - self.bad.len()));
        self.n_above += other.n_above;
        self.above.extend(other.above.into_iter().take(MAX_LISTED_BAD - self.above.len()));
    }

    /// Adds the report of the light paths of the pass.
    pub(super) fn add_light(&mut self, light: LayerReport) {
        self.completed &= light.completed;
        self.rays += light.rays;
        self.n_bad += light.n_bad;
    }

    /// Adds up the reports of numbered parts, in the order of their numbers.
    pub(super) fn sum(mut parts: Vec<(usize, Self)>) -> Self {
        parts.sort_unstable_by_key(|(i, _)| *i);
        let mut total = Self::nothing();
        parts.into_iter().for_each(|(_, part)| total.add(part));
        total
    }

    /// Adds one sample of every pixel of a block to its tile, and counts invalid ones.
    ///
    /// - `seen`: row by row, W·m⁻²·sr⁻¹.
    /// - `bound`: upper bound of the radiance of a sample, if known.
    pub(super) fn add_sample(
        &mut self,
        tile: &mut FilmTile,
        block: usize,
        sample: u32,
        seen: &[Vec3],
        bound: Option<f32>,
    ) {
        for (place, light) in seen.iter().enumerate() {
            if bound.is_some_and(|bound| light.is_finite() && light.abs().max_element() > bound) {
                self.n_above += 1;
                if self.above.len() < MAX_LISTED_BAD {
                    let local = tile.blocks[block].locals(tile.size.x).nth(place).expect("a pixel of the block");
                    self.above.push(sample_at(tile, local as u32, sample));
                }
            }
        }
        let n_bad_before = tile.bad.len();
        tile.add_sample(block, sample, seen);
        let new_bad = &tile.bad[n_bad_before..];
        self.n_bad += new_bad.len() as u64;
        let room = MAX_LISTED_BAD - self.bad.len();
        self.bad.extend(new_bad.iter().take(room).map(|&(local, sample)| sample_at(tile, local, sample)));
    }
}

/// Maximum number of invalid samples that a report lists.
const MAX_LISTED_BAD: usize = 16;

fn sample_at(tile: &FilmTile, local: u32, sample: u32) -> BadSample {
    let pixel = tile.origin + UVec2::new(local % tile.size.x, local / tile.size.x);
    BadSample { x: pixel.x, y: pixel.y, sample }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_above_the_bound_are_counted_with_their_places_and_kept() {
        let origin = UVec2::new(32, 0);
        let mut tile = FilmTile::try_new(origin, UVec2::new(8, 4)).expect("memory for a few pixels");
        let mut report = PassReport::nothing();
        let seen: Vec<Vec3> = (0..8 * 4).map(|pixel| Vec3::splat(if pixel == 9 { 0.5 } else { 0.25 })).collect();
        for (sample, bound) in [(0, None), (1, Some(0.5)), (2, Some(0.499))] {
            report.add_sample(&mut tile, 0, sample, &seen, bound);
        }
        assert_eq!((report.n_above, report.n_bad), (1, 0));
        assert_eq!(report.above, [BadSample { x: 33, y: 1, sample: 2 }]);
        assert_eq!(tile.sums[9].sum, Vec3::splat(1.5).as_dvec3());
    }
}
