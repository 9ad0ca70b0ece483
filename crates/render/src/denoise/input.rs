//! What a denoiser is given.

use crate::film::halves::HalfSteps;
use glam::Vec3;

/// What is known of the surfaces that the pixels show, each row by row from the top: the mean over a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// The share of light that the surface reflects, 0..1 a channel; about 1 for emitters and where nothing is hit.
    pub albedo: &'a [Vec3],
    /// Shading normal; shorter than 1 where a pixel shows several, zero where nothing is hit.
    pub normal: &'a [Vec3],
    /// Metres from the camera; zero or infinite where nothing is hit.
    pub depth: &'a [f32],
    /// Whether a pixel shows an emitter, in part at least.
    pub emitters: &'a [bool],
}

/// A picture to be denoised; all lists are row by row from the top and have `width * height` entries.
#[derive(Clone, Copy, Debug)]
pub struct DenoiseInput<'a> {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Mean radiance of each pixel, linear Rec. 709, W·m⁻²·sr⁻¹.
    pub color: &'a [Vec3],
    /// What the halves of the samples say of the variance; `None` with a single sample a pixel.
    pub half_steps: Option<&'a HalfSteps>,
    /// Surfaces.
    pub guides: Guides<'a>,
}

impl DenoiseInput<'_> {
    /// Number of pixels.
    pub fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// # Panics
    /// When a list has another length than the picture has pixels.
    pub(super) fn check(&self) {
        let n = self.n_pixels();
        let Guides { albedo, normal, depth, emitters } = self.guides;
        let lengths = [self.color.len(), albedo.len(), normal.len(), depth.len(), emitters.len()];
        let halves = self.half_steps.is_none_or(|halves| halves.steps.len() == n && halves.scale.len() == n);
        assert!(n > 0 && lengths == [n; 5] && halves, "lists of {lengths:?} for {n} pixels");
    }
}
