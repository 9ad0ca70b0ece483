//! Lambert on both sides of a surface, at one point or at sixteen.

use crate::core::color::luminance_of;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::scatter::Sampled;
use firstlight_simd::{Real, Vector3, frame_around, select, select_vector};

/// A translucent surface; the sum of both shares is at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Translucent<R: Real = f32> {
    reflectance: Vector3<R>,
    transmittance: Vector3<R>,
}

impl<R: Real> Translucent<R> {
    /// Both are scaled where their sum exceeds 1.
    #[inline(always)]
    pub fn new(reflectance: Vector3<R>, transmittance: Vector3<R>) -> Self {
        let scale = (reflectance + transmittance).max(Vector3::all(reflectance.x.all(1.0)));
        Self { reflectance: reflectance.over(scale), transmittance: transmittance.over(scale) }
    }

    /// Share of light that is scattered to either side.
    #[inline(always)]
    pub fn albedo(&self) -> Vector3<R> {
        self.reflectance + self.transmittance
    }

    /// Colour and probability of one side.
    #[inline(always)]
    fn side(&self, passes: R::Mask) -> (Vector3<R>, R) {
        let color = select_vector(passes, self.transmittance, self.reflectance);
        let sum = luminance_of(self.albedo());
        (color, select(sum.is_positive(), luminance_of(color) / sum, sum.all(0.5)))
    }

    /// f · |cos| and pdf; `cos_o`, `cos_i`: cosines of both directions with the normal.
    #[inline(always)]
    pub fn eval(&self, cos_o: R, cos_i: R) -> (Vector3<R>, R) {
        let (color, pmf) = self.side((cos_i * cos_o).is_negative());
        let cosine = cosine_hemisphere_pdf(cos_i.abs());
        (color * cosine, pmf * cosine)
    }

    /// Returns a direction, and whether it is on the far side.
    ///
    /// - `u_choice`: selects the side; `u`: the direction.
    #[inline(always)]
    pub fn sample(&self, normal: Vector3<R>, u_choice: R, u: [R; 2]) -> (Sampled<R>, R::Mask) {
        let one = u_choice.all(1.0);
        let passes = u_choice.lt(self.side(one.is_positive()).1);
        let (color, pmf) = self.side(passes);
        let local = cosine_hemisphere(u);
        let wi = local.to_world(&frame_around(select_vector(passes, -normal, normal)));
        let go_on = local.z.is_positive() & pmf.is_positive();
        let pdf = pmf * cosine_hemisphere_pdf(local.z);
        (Sampled { go_on, wi, weight: color * (one / pmf), pdf, probability: one }, passes)
    }
}
