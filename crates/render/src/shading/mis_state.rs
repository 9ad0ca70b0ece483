//! State of a camera path for MIS weights against light paths.

use crate::prepare::casters::NO_CASTER;
use glam::Vec3;

/// MIS state of a camera path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MisState {
    /// Pdf of sampling the path from the light over that from the camera, without the light's factor; NaN if no light
    /// path can be this path.
    pub ratio: f32,
    /// Caster on which the last vertex lies, if it was specular.
    pub caster: u32,
    /// Approximate factor by which guiding has raised the pdfs of directions so far: Russian roulette must not treat
    /// the correspondingly small throughput as a loss.
    pub gain: f32,
}

impl Default for MisState {
    fn default() -> Self {
        Self { ratio: f32::NAN, caster: NO_CASTER, gain: 1.0 }
    }
}

impl MisState {
    /// - `ratio`: NaN if no light path can be the path so far.
    /// - `caster`: caster of the last vertex, if it was specular; [`NO_CASTER`] otherwise.
    #[inline(always)]
    pub fn new(ratio: f32, caster: u32, gain: f32) -> Self {
        Self { ratio, caster, gain }
    }

    /// See [`crate::integrators::common::caustics_pass::CausticPass::follow`]; NaN if no light path can be the path so far.
    #[inline(always)]
    pub fn ratio(&self) -> f32 {
        self.ratio
    }

    /// Whether no light path can be the path so far or its continuation.
    pub fn is_lost(&self) -> bool {
        self.ratio.is_nan()
    }

    /// Whether the last vertex was specular, and a light path can be the path so far.
    pub fn is_gathered(&self) -> bool {
        self.caster != NO_CASTER && !self.is_lost()
    }

    pub fn guided(mut self, weight: Vec3) -> Self {
        self.gain /= weight.abs().max_element().clamp(f32::MIN_POSITIVE, 1.0);
        self
    }
}
