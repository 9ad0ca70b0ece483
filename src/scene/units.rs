//! Angles and lenses in the units of scene files.

/// Two directions are parallel if the sine of the angle between them is less: below the root of the machine precision,
/// less than half of the digits of their cross product mean anything.
pub const LEAST_SINE: f64 = 1.5e-8;

/// Half the diameter of a lens, metres, for a film 24 mm high, which sees `vfov_deg` through a focal length of
/// 12 mm / tan(vfov / 2).
pub(crate) fn lens_radius_of(vfov_deg: f64, f_stop: f64) -> f64 {
    let focal_length = 0.012 / (0.5 * vfov_deg).to_radians().tan();
    0.5 * focal_length / f_stop
}

/// Degrees as `f32` radians. Whole turns are taken out first, which is exact, so that any finite angle means something.
pub(crate) fn radians(angle_deg: f64) -> f32 {
    (angle_deg % 360.0).to_radians() as f32
}
