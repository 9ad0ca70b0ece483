//! Cached results computed from the film or the scene.

use crate::render::{FeatureBuffers, Inspected, Inspection};
use glam::UVec2;
use std::time::Instant;

/// Cached results; each has the key that it is valid for.
#[derive(Default)]
pub struct Views {
    /// The latest inspection of the scene.
    pub inspected: Option<(ViewKey, Inspected)>,
    /// Depth per pixel of the film.
    pub depths: Option<(ViewKey, Vec<f32>)>,
    /// Feature buffers for the denoiser.
    pub guides: Option<(ViewKey, FeatureBuffers)>,
    /// When denoising may run again: samples come first.
    pub denoised: Option<(ViewKey, Instant)>,
}

/// Identifies what a cached result was computed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewKey {
    pub generation: u64,
    pub inspection: Inspection,
    pub size: UVec2,
}
