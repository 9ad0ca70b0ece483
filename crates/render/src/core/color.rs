//! Colours: linear Rec. 709.

use firstlight_simd::{Real, Vector3};
use glam::Vec3;

/// Relative luminance of linear Rec. 709.
#[inline]
pub fn luminance(color: Vec3) -> f32 {
    luminance_of(color.into())
}

/// Relative luminance of one colour or sixteen.
#[inline(always)]
pub(crate) fn luminance_of<R: Real>(color: Vector3<R>) -> R {
    color.x * 0.2126 + color.y * 0.7152 + color.z * 0.0722
}
