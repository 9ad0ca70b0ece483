//! Rough metal at sixteen points; see [`crate::shading::metal`].

use crate::prepare::material_table::{COMPENSATE, SCHLICK};
use crate::shading::ggx;
use crate::shading::metal::Metal;
use firstlight_simd::{Bits, Float, Mask, Simd, Vector, frame_around, select};

/// Metal seen along `wo`.
///
/// - `mask`: lanes that have it; `flags`: of the material table.
#[inline(always)]
pub(crate) fn metals<S: Simd>(
    s: S,
    mask: Mask,
    normal: Vector<S>,
    wo: Vector<S>,
    alpha: Float<S>,
    reflectance: Vector<S>,
    flags: Bits<S>,
) -> Metal<Float<S>> {
    let axes = frame_around(normal);
    let wo = wo.to_local(&axes);
    let mut lost = Float::splat(s, 0.0);
    let compensated = mask & flags.has(COMPENSATE);
    if compensated != 0 {
        lost = select(compensated, ggx::lost_over_returned(wo.z, alpha), lost);
    }
    Metal::new(axes, wo, alpha, reflectance, flags.has(SCHLICK), lost)
}
