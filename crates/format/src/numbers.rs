//! Numbers in single precision as people write them.

use glam::DVec3;

/// A number in single precision as the shortest decimal number that stands for it: 0.7 rather than 0.699999988.
pub fn short(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

/// A colour in `f64`, each channel as in [`short`].
pub fn short_color(color: glam::Vec3) -> DVec3 {
    DVec3::from_array(color.to_array().map(short))
}
