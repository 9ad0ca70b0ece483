//! Environment images of other layouts and orientations, as the equirectangular images that are rendered.

use firstlight_format::sources::EnvironmentLayout;
use firstlight_render::ImageTexture;
use glam::{DMat3, DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Height of images beyond which the result is no larger.
const MAX_HEIGHT: u32 = 4096;
/// Height beyond which texels have fewer samples.
const FINE_HEIGHT: u32 = 1024;
/// Height to which images with interpolated colours are enlarged at most.
const MAX_INTERPOLATED: u32 = 2048;

/// The image as an equirectangular one about +Y whose middle column is in direction −Z, as [`firstlight_render::Environment`]
/// has it.
///
/// - `axes`: rows of the matrix from directions of the world to those of the image. The pole of an image is +Y of its
///   directions in the equirectangular layout, and +Z in the one of equal areas.
pub fn equirectangular(image: &ImageTexture, layout: EnvironmentLayout, axes: Option<[[f64; 3]; 3]>) -> ImageTexture {
    let height = match layout {
        EnvironmentLayout::Equirectangular => image.height,
        EnvironmentLayout::EqualArea => image.height.max(image.width),
        // Texels of one colour each stand for the slopes between those of the image.
        EnvironmentLayout::Interpolated => image.height.saturating_mul(8).min(MAX_INTERPOLATED).max(image.height),
    };
    // No more texels than a strip of pixels has, several times over.
    let texels = u64::from(image.width) * u64::from(image.height);
    let most = if layout == EnvironmentLayout::Interpolated { height } else { (4 * texels).isqrt() as u32 };
    let height = height.min(most).clamp(1, MAX_HEIGHT);
    let width = 2 * height;
    // Samples of a texel along each side, so that no light between two of them is lost. Light that matters has many texels
    // of a large image.
    let samples = match layout {
        EnvironmentLayout::Interpolated => 1,
        _ if height > FINE_HEIGHT => 2,
        _ => 4,
    };
    let image_from_world = axes.map_or(DMat3::IDENTITY, |rows| DMat3::from_cols_array_2d(&rows).transpose());
    let texel = |x: i64, y: i64| {
        let (x, y) = (x.clamp(0, i64::from(image.width) - 1), y.clamp(0, i64::from(image.height) - 1));
        image.linear(x as usize + y as usize * image.width as usize)
    };
    let size = DVec2::new(image.width.into(), image.height.into());
    let radiance = |direction: DVec3| {
        let direction = (image_from_world * direction).normalize_or(DVec3::Z);
        let point = match layout {
            EnvironmentLayout::Equirectangular => {
                let u = 0.5 + direction.x.atan2(-direction.z) / TAU;
                DVec2::new(u.rem_euclid(1.0), direction.y.clamp(-1.0, 1.0).acos() / PI)
            }
            EnvironmentLayout::EqualArea => equal_area(direction),
            EnvironmentLayout::Interpolated => {
                let u = (0.5 + direction.x.atan2(-direction.z) / TAU) * size.x - 0.5;
                let v = direction.y.clamp(-1.0, 1.0).acos() / PI * (size.y - 1.0);
                let (x, y) = (u.floor() as i64, v.floor() as i64);
                let around = |x: i64| x.rem_euclid(i64::from(image.width).max(1));
                let row = |y: i64| texel(around(x), y).lerp(texel(around(x + 1), y), (u - u.floor()) as f32);
                return row(y).lerp(row(y + 1), (v - v.floor()) as f32);
            }
        } * size;
        texel(point.x.floor() as i64, point.y.floor() as i64)
    };
    // Sine and cosine at the samples of all texels along one side.
    let angles = |n: u32, of: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        (0..n * samples).map(|k| of((f64::from(k) + 0.5) / f64::from(n * samples)).sin_cos()).collect()
    };
    let (azimuths, polars) = (angles(width, &|u| (u - 0.5) * TAU), angles(height, &|v| v * PI));
    let row = |y: u32| -> Vec<Vec3> {
        let own = |cell: u32| (cell * samples) as usize..((cell + 1) * samples) as usize;
        let at = |x: u32| {
            let mut sum = Vec3::ZERO;
            for (sin_polar, cos_polar) in &polars[own(y)] {
                for (sin, cos) in &azimuths[own(x)] {
                    sum += radiance(DVec3::new(sin_polar * sin, *cos_polar, -sin_polar * cos));
                }
            }
            sum / (samples * samples) as f32
        };
        (0..width).map(at).collect()
    };
    let rows: Vec<Vec<Vec3>> = (0..height).into_par_iter().map(row).collect();
    ImageTexture::from_linear(width, height, rows.concat())
}

/// Coordinates in the unit square of a direction, by a map of equal areas: +z is the middle, −z the corners.
///
/// Source: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"; rows count from the top.
fn equal_area(direction: DVec3) -> DVec2 {
    let size = direction.abs();
    // The radius in the square, and the angle as a share of a quarter turn.
    let radius = (1.0 - size.z).max(0.0).sqrt();
    let angle = size.y.atan2(size.x) / (2.0 * FRAC_PI_4);
    let (mut u, mut v) = (radius * (1.0 - angle), radius * angle);
    if direction.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    0.5 + 0.5 * DVec2::new(u.copysign(direction.x), v.copysign(direction.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_render::Texels;

    /// The inverse map, from the same paper.
    fn direction_of(point: DVec2) -> DVec3 {
        let [u, v] = (2.0 * point - 1.0).to_array();
        let distance = 1.0 - (u.abs() + v.abs());
        let radius = 1.0 - distance.abs();
        let angle = if radius == 0.0 { 1.0 } else { (v.abs() - u.abs()) / radius + 1.0 } * FRAC_PI_4;
        let ring = radius * (2.0 - radius * radius).sqrt();
        let z = (1.0 - radius * radius).copysign(distance);
        DVec3::new(angle.cos().copysign(u) * ring, angle.sin().copysign(v) * ring, z)
    }

    #[test]
    fn the_map_of_equal_areas_is_inverse_to_its_inverse() {
        for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
            let point = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.3) / 40.0;
            let direction = direction_of(point);
            assert!((direction.length() - 1.0).abs() < 1e-12);
            assert!((equal_area(direction) - point).length() < 1e-9, "{point} {direction}");
        }
        assert_eq!(equal_area(DVec3::Z), DVec2::splat(0.5));
    }

    fn image(width: u32, height: u32, at: impl Fn(u32, u32) -> Vec3) -> ImageTexture {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| at(x, y));
        ImageTexture { width, height, texels: Texels::F32(texels.collect()) }
    }

    #[test]
    fn light_of_an_image_stays_where_and_as_much_as_it_is() {
        // One bright texel: its radiance times its share of the sphere, and its direction.
        let n = 32;
        let (x, y) = (20, 9);
        let source = image(n, n, |i, j| if (i, j) == (x, y) { Vec3::ONE } else { Vec3::ZERO });
        // The image has +z up; here +y is up and −z of the world is its +y.
        let axes = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
        let found = equirectangular(&source, EnvironmentLayout::EqualArea, Some(axes));
        let (mut power, mut moment) = (0.0, DVec3::ZERO);
        for (i, j) in (0..found.width).flat_map(|i| (0..found.height).map(move |j| (i, j))) {
            let polar = (f64::from(j) + 0.5) / f64::from(found.height) * PI;
            let azimuth = ((f64::from(i) + 0.5) / f64::from(found.width) - 0.5) * TAU;
            let direction = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
            let weight = polar.sin() * f64::from(found.linear((j * found.width + i) as usize).x);
            power += weight;
            moment += weight * direction;
        }
        let solid_angle = power * TAU / f64::from(found.width) * PI / f64::from(found.height);
        assert!((solid_angle / (4.0 * PI / f64::from(n * n)) - 1.0).abs() < 0.06, "{solid_angle}");
        let own = direction_of(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / f64::from(n));
        let expected = DVec3::new(own.x, own.z, -own.y);
        assert!((moment.normalize() - expected).length() < 0.03, "{} for {expected}", moment.normalize());
    }

    #[test]
    fn colours_between_texels_are_interpolated_and_rows_reach_the_poles() {
        // Red is the column, green the row.
        let source = image(8, 5, |i, j| Vec3::new(i as f32, j as f32, 0.0));
        let found = equirectangular(&source, EnvironmentLayout::Interpolated, None);
        assert_eq!((found.width, found.height), (80, 40));
        let at = |i: u32, j: u32| found.linear((i + j * found.width) as usize);
        for (i, j) in [(10, 3), (41, 20), (60, 39)] {
            let column = (f64::from(i) + 0.5) / 10.0 - 0.5;
            let row = (f64::from(j) + 0.5) / 40.0 * 4.0;
            let expected = DVec3::new(column, row, 0.0).as_vec3();
            assert!((at(i, j) - expected).abs().max_element() < 1e-5, "{} for {expected}", at(i, j));
        }
        // Across the seam, half of each side.
        assert!((at(0, 0).x - (0.45 * 7.0)).abs() < 1e-5, "{}", at(0, 0));
    }

    #[test]
    fn a_strip_of_pixels_does_not_become_a_large_image() {
        let strip = image(4000, 1, |_, _| Vec3::ONE);
        let found = equirectangular(&strip, EnvironmentLayout::EqualArea, None);
        assert!(found.len() < 10 * strip.len() && found.linear(0) == Vec3::ONE, "{}", found.len());
    }

    #[test]
    fn an_upright_image_stays_as_it_is() {
        let source = image(8, 4, |i, j| Vec3::new(i as f32, j as f32, 1.0));
        let same = equirectangular(&source, EnvironmentLayout::Equirectangular, None);
        assert!((0..source.len()).all(|i| same.linear(i) == source.linear(i)) && same.len() == source.len());
    }
}
