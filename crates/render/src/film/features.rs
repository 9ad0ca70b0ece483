//! Feature buffers: what each pixel shows, without light. Means and variances of albedo, normal, position and depth, and
//! shares of objects and materials.
//!
//! They are a function of scene, camera, size, seed, filter and the number of feature samples alone: samples 0 up to that
//! number of each pixel, whichever samples a film of the picture has. So films of parts of a picture have the same
//! feature buffers, bit for bit, and so has the film that they add up to.

use glam::Vec3;
use std::cmp::Reverse;

/// Feature buffers of a picture, row by row from the top; all lists have a number for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureBuffers {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples of each pixel, at least 1.
    pub samples: u32,
    /// Colour of the first surface that is not specular, times that of the mirrors and the glass on the way, 0..1. White,
    /// or the colour of the way, where the way leaves the scene. Emitters: their radiance, scaled to at most 1.
    pub albedo: Vec<Vec3>,
    /// Shading normal of that surface in world space, on the side that is seen, at most of length 1: the mean of unit
    /// vectors and, for samples that see nothing, zero.
    pub normal: Vec<Vec3>,
    /// Position in the frame of the snapshot, metres: the mean over samples that see a surface; zero where none does.
    pub position: Vec<Vec3>,
    /// Metres along the view axis, counted along the whole way: of a mirror image, as far as it lies behind the mirror.
    /// The mean over samples that see a surface; infinite where none does.
    pub depth: Vec<f32>,
    /// Share of samples that see a surface, 0..1.
    pub coverage: Vec<f32>,
    /// Variances of the means.
    pub variance: FeatureVariances,
    /// Where they were asked for.
    pub ids: Option<FeatureIds>,
}

/// Variances of the means of [`FeatureBuffers`], in squares of their units: of one sample, over the number of samples. All
/// zero where there is one sample alone.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureVariances {
    /// Per channel.
    pub albedo: Vec<Vec3>,
    /// Per axis.
    pub normal: Vec<Vec3>,
    /// Per axis.
    pub position: Vec<Vec3>,
    /// Of those samples that see a surface.
    pub depth: Vec<f32>,
}

/// Which objects and materials a pixel shows. What counts is the surface that the camera ray itself meets: a mirror or a glass is
/// itself, not what is seen in it, so that it can be told from what is around it.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureIds {
    /// By index of the object in the snapshot.
    pub objects: Vec<IdShares>,
    /// By [`MaterialId`](crate::core::material::MaterialId).
    pub materials: Vec<IdShares>,
}

/// The ids that most samples of a pixel see, most samples first and small ids before large ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdShares {
    /// An id and how many samples see it; 0 samples for none.
    pub ranks: [(u32, u32); Self::RANKS],
}

impl IdShares {
    /// How many ids a pixel keeps.
    pub const RANKS: usize = 6;

    /// No ids.
    pub const NONE: Self = Self { ranks: [(u32::MAX, 0); Self::RANKS] };

    /// Those that there are.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> {
        self.ranks.into_iter().take_while(|&(_, samples)| samples > 0)
    }
}

impl FeatureBuffers {
    /// Memory that a pixel takes, bytes.
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

/// Ids that the samples of one pixel have seen so far: exact up to [`IdCounts::MOST`] different ones, then new ones are
/// left out.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct IdCounts {
    ids: [u32; Self::MOST],
    counts: [u32; Self::MOST],
    n: usize,
}

impl IdCounts {
    const MOST: usize = 16;

    /// Another sample sees this.
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
