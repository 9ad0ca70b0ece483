//! Rough metal at sixteen points; see [`crate::shading::metal`].

use crate::prepare::material_table::{COMPENSATE, SCHLICK};
use crate::shading::ggx;
use crate::shading::metal::Metal;
use crate::shading::simd::lanes::lanes_of;
use firstlight_simd::{Bits, Float, LANES, Mask, Simd, Vector, frame_around};

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
        let (cos, alphas) = (wo.z.to_array(), alpha.to_array());
        let mut lanes = [0.0; LANES];
        lanes_of(compensated).for_each(|i| lanes[i] = ggx::lost_over_returned(cos[i], alphas[i]));
        lost = Float::load(s, &lanes);
    }
    Metal::new(axes, wo, alpha, reflectance, flags.has(SCHLICK), lost)
}
