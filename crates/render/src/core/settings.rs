//! What decides the samples of a picture besides the scene.

use crate::core::filter::PixelFilter;
use crate::core::techniques::Techniques;
use firstlight_kdtree::InstructionSet;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The light model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// The truth: unbiased path tracing.
    #[default]
    #[serde(alias = "Path")]
    Path,
    /// The classic local model with shadows and recursive mirrors and glass.
    #[serde(alias = "Phong")]
    Phong,
}

/// How samples are spread over the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleAllocation {
    /// Every pixel gets as many.
    #[default]
    Uniform,
    /// More where the error is larger, so that this error of the whole picture falls fastest.
    Adaptive(ErrorMetric),
}

/// The error that an adaptive allocation minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorMetric {
    /// relMSE: that of linear light relative to its level, which is what is estimated, too.
    #[default]
    RelativeMse,
    /// The squared error of the encoded picture: dark pixels count more, those above white little.
    Display {
        /// Exposure of the display, factors of two.
        exposure_stops: f32,
    },
}

/// What decides the samples of a picture besides the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// The light model.
    pub integrator: Integrator,
    /// Longest path in segments; 1 shows emitters alone. `u32::MAX` is unbounded.
    pub max_depth: u32,
    /// Picks the random numbers of all samples: another seed gives independent noise.
    pub seed: u32,
    /// Weights of the light around the middle of a pixel.
    pub filter: PixelFilter,
    /// Techniques of variance reduction that are used.
    pub techniques: Techniques,
    /// How samples are spread over the pixels.
    pub allocation: SampleAllocation,
    /// With which instructions sixteen paths are shaded at a time; `None` shades one after the other, which is what
    /// tests compare with. All sets give the same bits.
    #[doc(hidden)]
    pub simd: Option<InstructionSet>,
}

/// Settings that no picture comes of.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SettingsError {
    /// [`RenderSettings::max_depth`] is 0.
    #[error("a path of 0 segments sees nothing: use at least 1 for `max_depth`, or leave it out for no limit")]
    NoDepth,
}

impl RenderSettings {
    /// Whether a picture comes of them.
    ///
    /// # Errors
    /// When `max_depth` is 0.
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
