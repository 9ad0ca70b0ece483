//! Roulette of shadow rays: from which contribution on they are traced for certain.
//!
//! A shadow ray that carries little light costs as much as any other. Let samples of a pixel have variance V and cost C,
//! and a shadow ray cost c. Tracing a ray of contribution x with probability q saves (1 − q) c and adds x² (1 / q − 1) of
//! variance. To first order, variance times cost is least at q = x / t with t = √(V c / C), and q = 1 for x above t. This
//! is efficiency-aware roulette (Rath et al. 2022) where it needs no estimate: the contribution is known, only its
//! occlusion is not. A ray that is traced then counts t, so roulette makes no bright samples.
//!
//! The threshold of a pixel is the mean of its samples at the last power of two times a share that is decided with the
//! allocation. Both are of earlier samples than those that they concern, so each sample keeps its mean. A pixel that is
//! darker than its block has a lower threshold, and one that has found no light yet has none.

use crate::film::block::Block;
use crate::film::tile::FilmTile;
use crate::integrators::common::work::SHADOW_RAY;

/// Returns the threshold relative to the level of a pixel.
///
/// - `variance`: of one sample, relative to the squared level.
/// - `cost`: of one sample, in the unit of [`Work`](crate::integrators::common::work::Work).
pub(crate) fn share_of(variance: f64, cost: f64) -> f32 {
    (variance * SHADOW_RAY / cost).sqrt() as f32
}

impl FilmTile {
    /// Contributions below which shadow rays are subject to roulette, per pixel of a block, row by row: mean of the
    /// channels, W·m⁻²·sr⁻¹.
    pub fn shadow_thresholds<'a>(&'a self, block: &'a Block) -> impl Iterator<Item = f32> + 'a {
        let level = |local: usize| {
            self.before.get(local).filter(|_| block.mean_of > 0).map_or(0.0, |mean| mean.element_sum() / 3.0)
        };
        block.locals(self.size.x).map(move |local| block.shadow_share * level(local).max(0.0) as f32)
    }
}
