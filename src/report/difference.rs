//! The difference of an image from its reference, as an image.

use crate::frame::Print;
use crate::render::{Display, Film, ToneCurve};
use crate::report::{LinearPicture, RELATIVE_FLOOR};
use crate::scene::WriteError;
use crate::scene::whole_file::Replace;
use glam::Vec3;
use std::path::Path;

/// Relative difference that an image of 8 bits shows in full colour.
const FULL: f32 = 0.2;

/// Relative difference per pixel and channel, with its sign: (x − ref) / √(ref² + 0.01).
fn relative(picture: &LinearPicture, reference: &LinearPicture) -> Vec<Vec3> {
    let of_pixel = |(&shown, &truth): (&Vec3, &Vec3)| {
        let level = (truth * truth + RELATIVE_FLOOR as f32).map(f32::sqrt);
        (shown - truth) / level
    };
    picture.pixels.iter().zip(&reference.pixels).map(of_pixel).collect()
}

/// White where both are equal, red where the image is brighter, blue where it is darker, in full colour from 20 % on.
fn shade(difference: Vec3) -> Vec3 {
    let mean = (difference.element_sum() / (3.0 * FULL)).clamp(-1.0, 1.0);
    let other = 1.0 - mean.abs();
    if mean > 0.0 { Vec3::new(1.0, other, other) } else { Vec3::new(other, other, 1.0) }
}

/// Writes the difference: as numbers in an EXR, as colours in a PNG or JPEG.
///
/// # Errors
/// If the file cannot be written, or its name has no known extension.
pub fn write_difference(picture: &LinearPicture, reference: &LinearPicture, path: &Path) -> Result<(), WriteError> {
    let mut colors = relative(picture, reference);
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
        colors.iter_mut().for_each(|color| *color = shade(*color));
    }
    let size = (picture.width, picture.height);
    let (film, display) = (Film::new(size.0, size.1), Display { exposure_stops: 0.0, tone_curve: ToneCurve::Linear });
    Print { film: &film, display: &display, size, note: None, denoised: Some(&colors) }
        .write(path, Replace::AllButFilms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brighter_is_red_and_darker_is_blue() {
        let picture =
            |values: [f32; 3]| LinearPicture { width: 3, height: 1, pixels: values.map(Vec3::splat).to_vec() };
        let found = relative(&picture([1.1, 0.0, 2.0]), &picture([1.0, 0.0, 4.0]));
        assert!((found[0].x - 0.1 / 1.01_f32.sqrt()).abs() < 1e-6 && found[1] == Vec3::ZERO && found[2].x < -0.49);
        assert_eq!([shade(Vec3::ZERO), shade(found[2])], [Vec3::ONE, Vec3::Z]);
        let light = shade(found[0]);
        assert!(light.x == 1.0 && light.y == light.z && (0.4..0.6).contains(&light.y), "{light}");
    }
}
