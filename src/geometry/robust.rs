//! Bounded rounding error and the offset of ray origins that follows from it.
//!
//! No epsilon in the renderer is tuned: each hit brings a bound on the error of its position, and a ray that
//! leaves the hit starts beyond that bound along the geometric normal (Pharr, Jakob and Humphreys,
//! "Physically Based Rendering", 4th edition, section 6.8).

use glam::Vec3;

/// Unit roundoff of `f32`: half the distance from 1 to the next number.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// The bound γ(n) on the relative error of `n` chained roundings (Higham 2002, section 3.1).
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let n = n as f32 * UNIT_ROUNDOFF;
    n / (1.0 - n)
}

/// Moves `point` off its surface so that no ray towards `dir` can meet that surface again.
///
/// - `error`: bound on the absolute error of `point`, metres per axis.
/// - `geometric_normal`: unit, either orientation.
///
/// The result lies on the side of the surface to which `dir` points.
#[inline]
pub fn offset_ray_origin(point: Vec3, error: Vec3, geometric_normal: Vec3, dir: Vec3) -> Vec3 {
    let distance = geometric_normal.abs().dot(error);
    let offset = distance * if dir.dot(geometric_normal) < 0.0 { -geometric_normal } else { geometric_normal };
    // The addition rounds too: one more step away from the surface makes up for it.
    let away = |p: f32, o: f32| match p + o {
        sum if o > 0.0 => sum.next_up(),
        sum if o < 0.0 => sum.next_down(),
        sum => sum,
    };
    Vec3::new(away(point.x, offset.x), away(point.y, offset.y), away(point.z, offset.z))
}
