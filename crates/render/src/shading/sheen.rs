//! Sheen: fibres perpendicular to the surface that scatter grazing light.
//!
//! The distribution of normals is that of Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF";
//! visibility follows Neubelt and Pettineo 2013, as `KHR_materials_sheen` suggests for real-time use.

use firstlight_simd::{Elementary, Real};
use std::f32::consts::TAU;

/// Minimum width: narrower distributions would be concentrated at the horizon.
pub(crate) const LEAST_ALPHA: f32 = 0.005;

/// Returns the width for a roughness, 0..1.
#[inline(always)]
pub(crate) fn alpha_of<R: Real>(roughness: R) -> R {
    (roughness * roughness).at_least(LEAST_ALPHA).at_most(1.0)
}

/// Returns f of a sheen of strength 1, sr⁻¹; reciprocal.
///
/// - `cos_o`, `cos_i`, `cos_h`: cosines of the two directions and of their half vector with the normal; the first two
///   above 0.
#[inline(always)]
pub(crate) fn value<R: Elementary>(cos_o: R, cos_i: R, cos_h: R, alpha: R) -> R {
    let one = alpha.all(1.0);
    let inverse = one / alpha;
    let sin2 = (one - cos_h * cos_h).at_least(0.0);
    let distribution = (inverse + 2.0) * sin2.power(inverse * 0.5) / TAU;
    let hidden = (cos_o + cos_i - cos_o * cos_i) * 4.0;
    distribution / hidden.at_least(1e-6)
}
