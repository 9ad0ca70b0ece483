//! Angles and lens radii in the units of scene files.

/// Two directions count as parallel if the sine of their angle is smaller: about the square root of the machine
/// epsilon, below which their cross product has lost more than half of its digits.
pub const LEAST_SINE: f64 = 1.5e-8;

/// Radius of the aperture, metres, for a film 24 mm high: the focal length is 12 mm / tan(vfov / 2).
pub(crate) fn lens_radius_of(vfov_deg: f64, f_stop: f64) -> f64 {
    let focal_length = 0.012 / (0.5 * vfov_deg).to_radians().tan();
    0.5 * focal_length / f_stop
}

/// Degrees to `f32` radians. Whole turns are removed first, which is exact, so that any finite angle is valid.
pub fn radians(angle_deg: f64) -> f32 {
    (angle_deg % 360.0).to_radians() as f32
}
