//! The maps of [`crate::sampling`], sixteen points at a time.

use firstlight_simd::{Float, Real, Simd, Vector, select, sin_cos_eighth};
use std::f32::consts::{FRAC_PI_4, TAU};

/// See [`crate::sampling::warp::uniform_disc`].
#[inline(always)]
pub(crate) fn uniform_disc<S: Simd>([u, v]: [Float<S>; 2]) -> [Float<S>; 2] {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    let across = y.abs().lt(x.abs());
    let (r, short) = (select(across, x, y), select(across, y, x));
    let divisor = select(r.is_zero(), r.all(1.0), r);
    let (sin, cos) = sin_cos_eighth(short / divisor * FRAC_PI_4);
    let (long, short) = (r * cos, r * sin);
    [select(across, long, short), select(across, short, long)]
}

/// See [`crate::sampling::warp::cosine_hemisphere`].
#[inline(always)]
pub(crate) fn cosine_hemisphere<S: Simd>(u: [Float<S>; 2]) -> Vector<S> {
    let [x, y] = uniform_disc(u);
    let z = (x.all(1.0) - (x * x + y * y)).at_least(0.0).sqrt();
    Vector { x, y, z }
}

/// See [`crate::sampling::warp::one_minus_cos_from_sin2`].
#[inline(always)]
pub(crate) fn one_minus_cos_from_sin2<S: Simd>(sin2: Float<S>) -> Float<S> {
    sin2 / ((sin2.all(1.0) - sin2).at_least(0.0).sqrt() + 1.0)
}

/// See [`crate::sampling::warp::cone_pdf`].
#[inline(always)]
pub(crate) fn cone_pdf<S: Simd>(one_minus_cos_max: Float<S>) -> Float<S> {
    one_minus_cos_max.all(1.0) / (one_minus_cos_max * TAU)
}
