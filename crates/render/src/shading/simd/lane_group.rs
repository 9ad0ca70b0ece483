//! Groups of up to sixteen hits.

use crate::prepare::prepared::Prepared;
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::paths::PathBatch;
use crate::shading::simd::lanes::lanes_of;
use firstlight_simd::{Float, LANES, Mask, Simd};

/// Up to sixteen hits of a list.
pub(crate) struct LaneGroup {
    /// Indices of the hits; unused lanes repeat the first one.
    pub indices: [u32; LANES],
    /// Valid lanes.
    pub mask: Mask,
}

impl LaneGroup {
    /// - `some`: 1 to 16 indices.
    #[inline(always)]
    pub fn of(some: &[u32]) -> Self {
        let mut indices = [some[0]; LANES];
        indices[..some.len()].copy_from_slice(some);
        Self { indices, mask: if some.len() == LANES { Mask::MAX } else { (1 << some.len()) - 1 } }
    }

    /// Media of each path.
    #[inline(always)]
    pub fn media(&self, scene: &Prepared, paths: &PathBatch) -> [MediumId; LANES] {
        let mut media = [MediumId::OUTSIDE; LANES];
        if scene.tables.features.glass {
            for (lane, &i) in self.indices.iter().enumerate() {
                media[lane] = paths.media_of(i as usize);
            }
        }
        media
    }
}

/// Returns the index of refraction n of each medium. Throughput inside contains 1/n², which is restored on leaving:
/// Russian roulette must not treat it as a loss.
#[inline(always)]
pub(crate) fn iors<S: Simd>(
    s: S,
    scene: &Prepared,
    sets: &MediumSets,
    mask: Mask,
    media: &[MediumId; LANES],
) -> Float<S> {
    let mut ior = [1.0; LANES];
    if scene.tables.features.glass {
        for lane in lanes_of(mask).filter(|&lane| media[lane] != MediumId::OUTSIDE) {
            ior[lane] = sets.ior(media[lane]);
        }
    }
    Float::load(s, &ior)
}
