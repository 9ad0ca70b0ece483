//! Resampling of lights: several points on lights compete for one shadow ray.
//!
//! The contribution of a point on a light to a glossy surface varies with the point, and testing it without a shadow ray
//! is cheap. So a few points are sampled, and one of them is chosen in proportion to its unoccluded contribution
//! (importance resampling: Talbot, Cline and Egbert 2005). With M points whose contributions over pdf are w₁ … w_M, the
//! chosen one counts (w₁ + … + w_M) / (M wᵢ) times, so the mean does not change.
//!
//! The MIS weights are those of M light samples per sample of the BSDF. The pdf that a path keeps of its last direction is
//! therefore that of the BSDF over M.

use crate::core::material::Material;
use crate::core::techniques::Techniques;
use crate::shading::simd::lanes::METAL;

/// Points on lights per shadow ray of a resampled surface: with eight, a sample of a metal mesh costs more than it gains.
pub(crate) const CANDIDATES: u32 = 4;

/// Whether the lights of surfaces with SIMD code for this kind of material are resampled; see [`is_resampled`].
#[inline(always)]
pub(crate) fn is_resampled_kind(techniques: &Techniques, kind: usize) -> bool {
    techniques.resampling && kind == METAL
}

/// Whether the lights of a surface are resampled: of rough metal, which has a lobe and nothing else.
pub(crate) fn is_resampled(techniques: &Techniques, material: &Material) -> bool {
    techniques.resampling && matches!(material, Material::Metal { .. })
}
