//! Surfaces with guided sampling, one at a time.

use crate::prepare::guide::{Hints, SHARE};
use crate::shading::interface::Interface;
use crate::shading::scatter::{BsdfSample, Scatter};
use firstlight_simd::Real;
use glam::{Vec2, Vec3};

/// A surface and the guiding distributions: replaces the surface for the integrator.
pub(crate) struct Guided<'a, S> {
    pub surface: &'a S,
    pub hints: Hints<'a>,
}

/// Pdf of the mixture that samples the guiding distributions with probability [`SHARE`], otherwise the surface.
///
/// - `surface`, `hints`: pdfs of the two, per steradian.
#[inline(always)]
pub(crate) fn mixed_pdf<R: Real>(surface: R, hints: R) -> R {
    surface + (hints - surface) * SHARE
}

/// Rescales the random number of a choice that fell on the surface to `[0, 1)`.
#[inline(always)]
pub(crate) fn rest_of_choice<R: Real>(choice: R) -> R {
    ((choice - SHARE) / (1.0 - SHARE)).at_least(0.0).at_most(1.0f32.next_down())
}

impl<S: Scatter> Scatter for Guided<'_, S> {
    fn has_non_specular(&self) -> bool {
        self.surface.has_non_specular()
    }

    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        let (value, pdf) = self.surface.eval(wo, wi, normal);
        (value, mixed_pdf(pdf, self.hints.pdf(wi)))
    }

    fn through(&self) -> Option<Interface> {
        self.surface.through()
    }

    fn straight(&self, wo: Vec3, normal: Vec3) -> Vec3 {
        self.surface.straight(wo, normal)
    }

    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        let choice = u_lobe();
        let wi = if choice < SHARE {
            self.hints.sample(choice / SHARE, u)
        } else {
            let rest = rest_of_choice(choice);
            let sample = self.surface.sample(wo, normal, || rest, u)?;
            if sample.pdf.is_infinite() {
                return Some(BsdfSample { weight: sample.weight / (1.0 - SHARE), ..sample });
            }
            sample.wi
        };
        let (value, pdf) = self.eval(wo, wi, normal);
        let through = self.through().filter(|_| normal.dot(wi) < 0.0);
        (pdf > 0.0 && value != Vec3::ZERO).then(|| BsdfSample {
            wi,
            weight: value / pdf,
            pdf,
            probability: 1.0,
            through,
        })
    }
}
