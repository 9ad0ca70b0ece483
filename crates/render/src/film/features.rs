//! Feature buffers: properties of the visible surfaces per pixel, without lighting. Means and variances of albedo,
//! normal, position and depth, and shares of objects and materials.
//!
//! They are a function of scene, camera, size, seed, filter and the number of feature samples: they use samples 0 up to
//! that number of each pixel, whichever samples the film has. So films of parts of an image have the same feature
//! buffers, bit for bit, and so has their merged film.

use glam::Vec3;
use std::cmp::Reverse;

/// Feature buffers of an image; each list has one entry per pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureBuffers {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// Colour of the first non-specular surface, times the colours of the mirrors and glass on the path to it, 0..1.
    /// For a path that leaves the scene, the product of those colours alone (white without any). Emitters: their
    /// radiance, scaled to at most 1.
    pub albedo: Vec<Vec3>,
    /// Shading normal of that surface in world space, on the visible side: the mean of unit vectors, and of zero for
    /// samples that hit nothing, so its length is at most 1.
    pub normal: Vec<Vec3>,
    /// Position in the snapshot's frame, metres, mean over the samples that hit a surface; zero where none does.
    pub position: Vec<Vec3>,
    /// Depth along the view axis in metres, summed over the whole path: a mirror image lies behind the mirror. Mean
    /// over the samples that hit a surface; infinite where none does.
    pub depth: Vec<f32>,
    /// Share of the samples that hit a surface, 0..1.
    pub coverage: Vec<f32>,
    /// Variances of the means.
    pub variance: FeatureVariances,
    /// Shares of objects and materials, if requested.
    pub ids: Option<FeatureIds>,
}

/// Variances of the means of [`FeatureBuffers`], in squares of their units: the variance of one sample divided by the
/// number of samples. All zero for a single sample.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureVariances {
    /// Per channel.
    pub albedo: Vec<Vec3>,
    /// Per axis.
    pub normal: Vec<Vec3>,
    /// Per axis.
    pub position: Vec<Vec3>,
    /// Over the samples that hit a surface.
    pub depth: Vec<f32>,
}

/// Objects and materials per pixel, those of the surface that the camera ray hits first: a mirror or a glass counts as
/// itself, not as the object seen in it, so that it can be separated from its neighbours.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureIds {
    /// By index of the object in the snapshot.
    pub objects: Vec<IdShares>,
    /// By [`MaterialId`](crate::core::material::MaterialId).
    pub materials: Vec<IdShares>,
}

/// The ids that most samples of a pixel hit, sorted by descending number of samples, then by ascending id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdShares {
    /// Pairs of an id and its number of samples; 0 samples for an unused entry.
    pub ranks: [(u32, u32); Self::RANKS],
}

impl IdShares {
    /// Number of ids stored per pixel.
    pub const RANKS: usize = 6;

    /// No ids.
    pub const NONE: Self = Self { ranks: [(u32::MAX, 0); Self::RANKS] };

    /// The used entries.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> {
        self.ranks.into_iter().take_while(|&(_, samples)| samples > 0)
    }
}

impl FeatureBuffers {
    /// Bytes per pixel.
    pub const BYTES_A_PIXEL: usize = 6 * size_of::<Vec3>() + 3 * size_of::<f32>() + 2 * size_of::<IdShares>();

    pub(crate) fn new(width: u32, height: u32, samples: u32, with_ids: bool) -> Self {
        let n = width as usize * height as usize;
        let (vectors, numbers) = (|| vec![Vec3::ZERO; n], || vec![0.0; n]);
        let ids = || vec![IdShares::NONE; n];
        Self {
            width,
            height,
            samples,
            albedo: vectors(),
            normal: vectors(),
            position: vectors(),
            depth: numbers(),
            coverage: numbers(),
            variance: FeatureVariances { albedo: vectors(), normal: vectors(), position: vectors(), depth: numbers() },
            ids: with_ids.then(|| FeatureIds { objects: ids(), materials: ids() }),
        }
    }
}

/// Sample counts per id of one pixel: exact up to [`IdCounts::MOST`] different ids; further ids are not counted.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct IdCounts {
    ids: [u32; Self::MOST],
    counts: [u32; Self::MOST],
    n: usize,
}

impl IdCounts {
    const MOST: usize = 16;

    /// Counts a sample that hits this id.
    #[inline]
    pub fn add(&mut self, id: u32) {
        if let Some(at) = self.ids[..self.n].iter().position(|&known| known == id) {
            self.counts[at] += 1;
        } else if self.n < Self::MOST {
            (self.ids[self.n], self.counts[self.n]) = (id, 1);
            self.n += 1;
        }
    }

    pub fn ranked(&self) -> IdShares {
        let mut all = [(u32::MAX, 0); Self::MOST];
        for (slot, pair) in all.iter_mut().zip(self.ids.into_iter().zip(self.counts)).take(self.n) {
            *slot = pair;
        }
        all.sort_unstable_by_key(|&(id, count)| (Reverse(count), id));
        IdShares { ranks: std::array::from_fn(|k| all[k]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_ranked_by_how_many_samples_see_them() {
        let mut counts = IdCounts::default();
        for id in [7, 3, 3, 9, 7, 3, 1] {
            counts.add(id);
        }
        let found: Vec<_> = counts.ranked().iter().collect();
        assert_eq!(found, [(3, 3), (7, 2), (1, 1), (9, 1)]);
        assert_eq!(IdCounts::default().ranked(), IdShares::NONE);
        (0..100).for_each(|id| counts.add(id));
        assert_eq!(counts.ranked().iter().count(), IdShares::RANKS, "the rest is left out");
    }
}
