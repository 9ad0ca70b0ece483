//! Sheen: fibres perpendicular to the surface that scatter grazing light.
//!
//! The distribution of normals is that of Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF";
//! visibility follows Neubelt and Pettineo 2013, as `KHR_materials_sheen` suggests for real-time use.

use std::f32::consts::TAU;

/// Minimum width: narrower distributions would be concentrated at the horizon.
pub(crate) const LEAST_ALPHA: f32 = 0.005;

/// Returns the width for a roughness, 0..1.
#[inline]
pub(crate) fn alpha_of(roughness: f32) -> f32 {
    (roughness * roughness).clamp(LEAST_ALPHA, 1.0)
}

/// Returns f of a sheen of strength 1, sr⁻¹; reciprocal.
///
/// - `cos_o`, `cos_i`, `cos_h`: cosines of the two directions and of their half vector with the normal; the first two
///   above 0.
#[inline]
pub(crate) fn value(cos_o: f32, cos_i: f32, cos_h: f32, alpha: f32) -> f32 {
    let inverse = 1.0 / alpha;
    let sin2 = (1.0 - cos_h * cos_h).max(0.0);
    let distribution = (2.0 + inverse) * sin2.powf(0.5 * inverse) / TAU;
    let hidden = 4.0 * (cos_o + cos_i - cos_o * cos_i);
    distribution / hidden.max(1e-6)
}
