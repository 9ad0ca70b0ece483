//! Render settings: what determines the samples of an image besides the scene.

use crate::core::filter::PixelFilter;
use crate::core::techniques::Techniques;
use firstlight_kdtree::InstructionSet;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The integrator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// Unbiased path tracing.
    #[default]
    Path,
    /// The classic local model with shadows and recursive mirrors and glass.
    Phong,
}

/// Sample allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleAllocation {
    /// Every pixel gets the same number.
    #[default]
    Uniform,
    /// More samples where the error is larger, to reduce this error of the whole image fastest.
    Adaptive(ErrorMetric),
}

/// The error that an adaptive allocation minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorMetric {
    /// relMSE: the squared error of radiance relative to its level, which is also what is estimated.
    #[default]
    RelativeMse,
    /// The squared error of the encoded image: dark pixels count more, those above white little.
    Display {
        /// Exposure of the display in stops (factors of two).
        exposure_stops: f32,
    },
}

/// What determines the samples of an image besides the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// The integrator.
    pub integrator: Integrator,
    /// Maximum path length in segments; 1 shows emitters only. `u32::MAX` is unlimited.
    pub max_depth: u32,
    /// Seed of the random numbers of all samples: another seed gives independent noise.
    pub seed: u32,
    /// Reconstruction filter.
    pub filter: PixelFilter,
    /// Variance reduction techniques.
    pub techniques: Techniques,
    /// Sample allocation.
    pub allocation: SampleAllocation,
    /// Instruction set for shading sixteen paths at a time; `None` for the scalar code, which is the reference of
    /// tests. All instruction sets give the same bits.
    #[doc(hidden)]
    pub simd: Option<InstructionSet>,
}

/// Invalid settings.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SettingsError {
    /// [`RenderSettings::max_depth`] is 0.
    #[error("a path of 0 segments sees nothing: use at least 1 for `max_depth`, or leave it out for no limit")]
    NoDepth,
}

impl RenderSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// If `max_depth` is 0.
    pub fn check(&self) -> Result<(), SettingsError> {
        if self.max_depth == 0 { Err(SettingsError::NoDepth) } else { Ok(()) }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        let (filter, techniques) = (PixelFilter::Box, Techniques::default());
        Self {
            integrator: Integrator::Path,
            max_depth: u32::MAX,
            seed: 0,
            filter,
            techniques,
            allocation: SampleAllocation::Uniform,
            simd: Some(InstructionSet::detect()),
        }
    }
}
