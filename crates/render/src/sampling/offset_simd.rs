//! [`firstlight_kdtree::geometry::robust::offset_ray_origin`] for sixteen points.

use firstlight_kdtree::geometry::robust::UNIT_ROUNDOFF;
use firstlight_simd::{Float, Real, Simd, Vector, select};

/// `distance` metres along `normal`.
#[inline(always)]
pub(crate) fn offset_origin<S: Simd>(point: Vector<S>, distance: Float<S>, normal: Vector<S>) -> Vector<S> {
    let offset = normal * distance;
    let sum = point + offset;
    Vector { x: rounded_away(sum.x, offset.x), y: rounded_away(sum.y, offset.y), z: rounded_away(sum.z, offset.z) }
}

#[inline(always)]
fn rounded_away<S: Simd>(sum: Float<S>, offset: Float<S>) -> Float<S> {
    let away = sum + (sum.abs() * (2.0 * UNIT_ROUNDOFF)).copysign(offset);
    select(offset.is_zero(), sum, away)
}
