//! The environment as an image file of another layout.

use firstlight_render::Environment;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Rows of an image from which on it does not matter whether colours are interpolated.
pub(crate) const FINE: u32 = 512;
/// Rows of the image of a gradient.
const GRADIENT_ROWS: u32 = 1024;

/// The direction of a place in the unit square, by a map of equal areas: the middle is +Z, the corners are −Z.
///
/// Source: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"; rows count from the top.
fn equal_area(u: f64, v: f64) -> DVec3 {
    let (u, v) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let distance = 1.0 - (u.abs() + v.abs());
    let radius = 1.0 - distance.abs();
    let angle = if radius == 0.0 { 1.0 } else { (v.abs() - u.abs()) / radius + 1.0 } * FRAC_PI_4;
    let ring = radius * (2.0 - radius * radius).sqrt();
    let z = (1.0 - radius * radius).copysign(distance);
    let (sin, cos) = angle.sin_cos();
    DVec3::new(cos.copysign(u) * ring, sin.copysign(v) * ring, z)
}

/// The environment as a square of equal areas, row by row: its side and the radiance of each texel. The middle of the
/// image is in direction +Z of the world.
pub(crate) fn square_image(environment: &Environment) -> (u32, Vec<Vec3>) {
    let side = match environment {
        Environment::Image { image, .. } => image.height.clamp(FINE, 2048),
        _ => GRADIENT_ROWS,
    };
    // Texels of the equirectangular image are smaller near its poles.
    const SAMPLES: u32 = 4;
    let texel = |x: u32, y: u32| {
        let cells = (0..SAMPLES).flat_map(|j| (0..SAMPLES).map(move |i| (i, j)));
        let place = |cell: u32, k: u32| (f64::from(cell) + (f64::from(k) + 0.5) / f64::from(SAMPLES)) / f64::from(side);
        let sum: Vec3 = cells.map(|(i, j)| environment.radiance(equal_area(place(x, i), place(y, j)).as_vec3())).sum();
        sum / (SAMPLES * SAMPLES) as f32
    };
    (side, by_rows(side, side, texel))
}

/// The environment as longitude and latitude: width, height and the radiance of each texel. The middle column is in
/// direction −Z, the first and last row at the poles, as Mitsuba interpolates.
pub(crate) fn round_image(environment: &Environment) -> (u32, u32, Vec<Vec3>) {
    let (width, height) = match environment {
        // Texels of one colour, between which Mitsuba would interpolate.
        Environment::Image { image, .. } => {
            let times = FINE.div_ceil(image.height);
            (times * image.width, times * image.height + 1)
        }
        // Its rows have one colour each.
        _ => (8, GRADIENT_ROWS),
    };
    let radiance = |x: f64, y: f64| {
        let (azimuth, polar) = ((x - 0.5) * TAU, y.clamp(1e-6, 1.0 - 1e-6) * PI);
        let direction = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
        environment.radiance(direction.as_vec3())
    };
    let texel = |x: u32, y: u32| {
        let (u, v) = ((f64::from(x) + 0.5) / f64::from(width), f64::from(y) / f64::from(height - 1));
        // The mean of the texels above and below.
        let step = 0.5 / f64::from(height - 1);
        0.5 * (radiance(u, v - 0.5 * step) + radiance(u, v + 0.5 * step))
    };
    (width, height, by_rows(width, height, texel))
}

/// The texels of an image, row by row.
fn by_rows(width: u32, height: u32, texel: impl Fn(u32, u32) -> Vec3 + Sync) -> Vec<Vec3> {
    let rows = (0..height).into_par_iter();
    rows.flat_map_iter(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect()
}
