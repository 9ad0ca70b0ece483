//! Input of the denoiser.

use crate::denoise::parallel::{Stop, each};
use crate::film::halves::HalfSteps;
use glam::Vec3;

/// Squared difference of normals that counts as another surface.
pub(super) const OTHER_NORMAL: f32 = 0.02;
/// Difference of nearness that counts as another surface.
pub(super) const OTHER_NEARNESS: f32 = 0.02;

/// Properties of the visible surfaces, mean per pixel; each list row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Reflected share of light, 0..1 per channel; about 1 for emitters and misses.
    pub albedo: &'a [Vec3],
    /// Radiance that arrives from emitters and from beyond the scene without scattering, W·m⁻²·sr⁻¹.
    pub emitted: &'a [Vec3],
    /// Shading normal, mean over the pixel, so of length at most 1; zero for misses.
    pub normal: &'a [Vec3],
    /// Depth in metres; zero or infinite for misses.
    pub depth: &'a [f32],
    /// Whether a pixel shows an emitter, at least in part.
    pub emitters: &'a [bool],
}

/// An image to be denoised; all lists are row by row from the top and have `width * height` entries.
#[derive(Clone, Copy, Debug)]
pub struct DenoiseInput<'a> {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Mean radiance of each pixel, linear Rec. 709, W·m⁻²·sr⁻¹.
    pub color: &'a [Vec3],
    /// Variance estimate from parts of the samples; `None` for a single sample per pixel.
    pub half_steps: Option<&'a HalfSteps>,
    /// Properties of the visible surfaces.
    pub guides: Guides<'a>,
}

impl Guides<'_> {
    /// Returns the nearness of each pixel, −1/2..1/2: a decreasing function of depth that is 0 at the median depth and
    /// −1/2 at infinity. `None` if `stop` returned true.
    pub(super) fn nearness(&self, stop: Stop) -> Option<Vec<f32>> {
        let is_seen = |depth: f32| depth.is_finite() && depth > 0.0;
        let mut seen: Vec<f32> = self.depth.iter().copied().filter(|depth| is_seen(*depth)).collect();
        let middle = seen.len() / 2;
        let typical = if seen.is_empty() { 1.0 } else { *seen.select_nth_unstable_by(middle, f32::total_cmp).1 };
        let of = |depth: f32| if is_seen(depth) { typical / (typical + depth) - 0.5 } else { -0.5 };
        each(self.depth.len(), stop, |i| of(self.depth[i]))
    }
}

impl DenoiseInput<'_> {
    /// Number of pixels.
    pub fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// # Panics
    /// If the length of a list is not the number of pixels.
    pub(super) fn check(&self) {
        let n = self.n_pixels();
        let Guides { albedo, emitted, normal, depth, emitters } = self.guides;
        let lengths = [self.color.len(), albedo.len(), emitted.len(), normal.len(), depth.len(), emitters.len()];
        let halves = self.half_steps.is_none_or(|of| [of.steps.len(), of.late.len(), of.doubled.len()] == [n; 3]);
        assert!(n > 0 && lengths == [n; 6] && halves, "lists of {lengths:?} for {n} pixels");
    }
}
