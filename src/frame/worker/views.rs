//! Cached results computed from the film or the scene.

use crate::frame::core::denoising::DenoiseFilter;
use crate::render::{Denoised, Inspected, Inspection, StillImage};
use glam::UVec2;
use std::time::{Duration, Instant};

/// Cached results; each has the key that it is valid for.
#[derive(Default)]
pub struct Views {
    /// The latest inspection of the scene.
    pub inspected: Option<(ViewKey, Inspected)>,
    /// Depth per pixel of the film.
    pub depths: Option<(ViewKey, Vec<f32>)>,
    /// The latest denoised image.
    pub settled: Option<Settled>,
    /// When the film may be denoised again: samples come first.
    pub settle_again: Option<Instant>,
    /// Generation and divider of the image whose light is taken over by the next one.
    pub relit: Option<(u64, u32)>,
    /// When a film at full resolution may be smoothed again.
    pub smooth_again: Option<(ViewKey, Instant)>,
}

/// Identifies what a cached result was computed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewKey {
    pub generation: u64,
    pub inspection: Inspection,
    pub size: UVec2,
}

/// A denoised image.
pub struct Settled {
    pub key: ViewKey,
    /// The filter that was asked for.
    pub filter: DenoiseFilter,
    /// The filter that was used: firstlight's own where the other one failed.
    pub by: DenoiseFilter,
    pub spp: u32,
    /// Samples per pixel of its guides.
    pub guide_samples: u32,
    pub denoised: Denoised,
    /// The same for images of the next views, until it is taken.
    pub still: Option<StillImage>,
    /// Without the feature buffers, which are gathered once per view.
    pub took: Duration,
}
