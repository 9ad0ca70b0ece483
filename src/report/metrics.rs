//! Error metrics of an image against a reference.

use crate::render::Display;
use crate::report::LinearPicture;
use crate::report::flip::flip;
use glam::DVec3;

/// Added to the square of the reference, so that black pixels do not dominate: the usual 0.01.
pub const RELATIVE_FLOOR: f64 = 0.01;

/// The errors of one image against its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Mean over pixels and channels of (x − ref)² / (ref² + 0.01).
    pub relative_mse: f64,
    /// Root of the mean over pixels and channels of (x − ref)², W·m⁻²·sr⁻¹.
    pub rmse: f64,
    /// Mean of FLIP over the developed images, 0 (no visible difference) to 1.
    pub flip: f64,
}

impl Distance {
    /// Compares two images of the same size; `display` determines how they are developed for the perceptual error.
    pub fn between(picture: &LinearPicture, reference: &LinearPicture, display: &Display) -> Self {
        assert_eq!(
            (picture.width, picture.height),
            (reference.width, reference.height),
            "only images of one size can be compared"
        );
        let (mut relative, mut absolute) = (DVec3::ZERO, DVec3::ZERO);
        for (x, truth) in picture.pixels.iter().zip(&reference.pixels) {
            let truth = truth.as_dvec3();
            let squares = (x.as_dvec3() - truth).powf(2.0);
            relative += squares / (truth * truth + RELATIVE_FLOOR);
            absolute += squares;
        }
        let n = 3.0 * reference.pixels.len() as f64;
        let developed = |picture: &LinearPicture| {
            picture.pixels.iter().map(|&light| display.tone_mapped(light)).collect::<Vec<_>>()
        };
        Self {
            relative_mse: relative.element_sum() / n,
            rmse: (absolute.element_sum() / n).sqrt(),
            flip: flip(&developed(reference), &developed(picture), picture.width as usize),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn distances_are_those_worked_out_by_hand() {
        let picture = |pixels: [Vec3; 2]| LinearPicture { width: 2, height: 1, pixels: pixels.to_vec() };
        let reference = picture([Vec3::new(0.3, 0.0, 1.0), Vec3::splat(2.0)]);
        let other = picture([Vec3::new(0.5, 0.1, 1.0), Vec3::new(2.0, 1.0, 2.5)]);
        let found = Distance::between(&other, &reference, &Display::default());
        // 0.04 / 0.10 + 0.01 / 0.01 + 0 + 0 + 1 / 4.01 + 0.25 / 4.01, over 6 values.
        let expected = (0.4 + 1.0 + 1.25 / 4.01) / 6.0;
        assert!((found.relative_mse - expected).abs() < 1e-6, "{found:?} for {expected}");
        // (0.04 + 0.01 + 1 + 0.25) / 6.
        assert!((found.rmse - (1.3_f64 / 6.0).sqrt()).abs() < 1e-6, "{found:?}");
        assert!(found.flip > 0.0);
        let none = Distance::between(&reference, &reference, &Display::default());
        assert_eq!(none, Distance { relative_mse: 0.0, rmse: 0.0, flip: 0.0 });
    }
}
