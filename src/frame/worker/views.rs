//! What was made of the film last and may do again.

use crate::render::{FeatureBuffers, Inspected, Inspection};
use glam::UVec2;
use std::time::Instant;

/// What was made last and may do again.
#[derive(Default)]
pub struct Views {
    /// The view of the scene, and what for.
    pub inspected: Option<(ViewKey, Inspected)>,
    /// Depths of the film's pixels, and what for.
    pub depths: Option<(ViewKey, Vec<f32>)>,
    /// What guides the denoiser, and what for.
    pub guides: Option<(ViewKey, FeatureBuffers)>,
    /// What was denoised last, and when it may be again: samples come first.
    pub denoised: Option<(ViewKey, Instant)>,
}

/// What a view of the scene was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewKey {
    pub generation: u64,
    pub inspection: Inspection,
    pub size: UVec2,
}
