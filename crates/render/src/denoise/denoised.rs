//! The result.

use glam::Vec3;

/// A denoised image.
#[derive(Clone, Debug, PartialEq)]
pub struct Denoised {
    /// Radiance of each pixel, raw and filtered combined, row by row from the top; W·m⁻²·sr⁻¹.
    pub color: Vec<Vec3>,
    /// Filtered share of each pixel, 0..1; it goes to zero as the raw image becomes better than the filter.
    pub share: Vec<f32>,
    /// Estimated root of relMSE, like [`ErrorEstimate::relative`](crate::film::estimate::ErrorEstimate::relative) of
    /// the raw image.
    pub error: f64,
    /// Bounds of an interval that contains the true error with a probability of about 95 %.
    pub error_95: [f64; 2],
}
