//! Colours as numbers: linear Rec. 709.

use glam::Vec3;

/// Relative luminance.
#[inline]
pub(crate) fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
