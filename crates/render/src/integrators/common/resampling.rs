//! Resampling of lights: several points on lights compete for one shadow ray.
//!
//! The contribution of a point on a light to a glossy surface varies with the point, and testing it without a shadow ray
//! is cheap. So a few points are sampled, and one of them is chosen in proportion to its unoccluded contribution
//! (importance resampling: Talbot, Cline and Egbert 2005). With M points whose contributions over pdf are w₁ … w_M, the
//! chosen one counts (w₁ + … + w_M) / (M wᵢ) times, so the mean does not change.
//!
//! The MIS weights are those of M light samples per sample of the BSDF. The pdf that a path keeps of its last direction is
//! therefore that of the BSDF over M.

use crate::core::techniques::Techniques;
use crate::shading::simd::lanes::METAL;
use firstlight_simd::{Real, Vector3};

/// Points on lights per shadow ray of a resampled surface: with eight, a sample of a metal mesh costs more than it gains.
pub(crate) const CANDIDATES: u32 = 4;

/// Whether the lights of surfaces of a kind are resampled: of rough metal, which has a lobe and nothing else.
///
/// - `kind`: see [`MaterialKind`](crate::core::material::MaterialKind).
#[inline(always)]
pub(crate) fn is_resampled(techniques: &Techniques, kind: usize) -> bool {
    techniques.resampling && kind == METAL
}

/// What the choice of light samples and the roulette of shadow rays go by: the mean of the channels.
#[inline(always)]
pub(crate) fn worth<R: Real>(light: Vector3<R>) -> R {
    let light = light.abs();
    (light.x + light.y + light.z) * (1.0 / 3.0)
}
