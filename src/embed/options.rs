//! Options of a rendering: size, light model, target, callbacks.

use crate::embed::Error;
use crate::frame::{Progress, Target};
use crate::render::{ErrorMetric, Integrator, PixelFilter, RenderSettings, SampleAllocation};
use crate::scene::{check_film_size, check_max_depth};
use std::fmt;

/// The answer of a progress callback: whether rendering continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Rendering continues until the target is reached.
    Continue,
    /// Rendering ends; the image has the samples taken so far.
    StopCondition,
}

type OnProgress = Box<dyn Fn(&Progress) -> Flow + Send + Sync>;
type StopCondition = Box<dyn Fn() -> bool + Send + Sync>;

/// Options of a rendering. An option that is not set keeps the scene's value.
///
/// ```
/// # use firstlight::prelude::*;
/// let options = RenderOptions::default().size(64, 48).spp(4);
/// ```
#[derive(Default)]
pub struct RenderOptions {
    pub(super) size: Option<(u32, u32)>,
    target: Target,
    integrator: Option<Integrator>,
    max_depth: Option<u32>,
    seed: Option<u32>,
    filter: Option<PixelFilter>,
    allocation: Option<SampleAllocation>,
    pub(super) exposure: f32,
    pub(super) threads: Option<usize>,
    pub(super) features: bool,
    pub(super) denoise: bool,
    on_progress: Option<OnProgress>,
    stop: Option<StopCondition>,
}

impl RenderOptions {
    /// Samples per pixel if no target is set.
    pub const DEFAULT_SPP: u32 = 256;

    /// Sets the size of the image in pixels.
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = Some((width, height));
        self
    }

    /// Sets the target in samples per pixel, the mean over all pixels. The first target that is reached ends the rendering.
    pub fn spp(mut self, spp: u32) -> Self {
        self.target.spp = Some(spp);
        self
    }

    /// Sets the target in seconds; each pixel gets at least one sample.
    pub fn seconds(mut self, seconds: f64) -> Self {
        self.target.seconds = Some(seconds);
        self
    }

    /// Sets the target as the estimated relative error of the whole image: 0.01 is 1 %.
    pub fn error(mut self, relative: f64) -> Self {
        self.target.error = Some(relative);
        self
    }

    /// Sets the light model, in place of the scene's.
    pub fn integrator(mut self, integrator: Integrator) -> Self {
        self.integrator = Some(integrator);
        self
    }

    /// Sets the longest path in segments, at least 1; 1 shows emitters alone.
    pub fn max_depth(mut self, segments: u32) -> Self {
        self.max_depth = Some(segments);
        self
    }

    /// Sets the random seed: another seed gives different noise of the same strength.
    pub fn seed(mut self, seed: u32) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Sets the pixel reconstruction filter.
    pub fn filter(mut self, filter: PixelFilter) -> Self {
        self.filter = Some(filter);
        self
    }

    /// Sets how samples are allocated to pixels: more where the relative error is larger unless this is set, or the scene was
    /// opened from an image that has another allocation.
    pub fn allocation(mut self, allocation: SampleAllocation) -> Self {
        self.allocation = Some(allocation);
        self
    }

    /// Sets the stops added to the scene's exposure; affects PNG files only, never
    /// [`Image::pixels`](crate::embed::Image::pixels).
    pub fn exposure(mut self, stops: f32) -> Self {
        self.exposure = stops;
        self
    }

    /// Sets the number of threads; the default is one per processor. The image is the same for any number.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = Some(threads);
        self
    }

    /// Gathers albedo, normal, depth, position, objects and materials of each pixel too:
    /// [`Image::features`](crate::embed::Image::features).
    pub fn features(mut self) -> Self {
        self.features = true;
        self
    }

    /// Denoises the image, when it is finished or stopped: [`Image::denoised`](crate::embed::Image::denoised).
    pub fn denoise(mut self) -> Self {
        self.denoise = true;
        self
    }

    /// Sets a callback that runs a few times per second on the thread that renders.
    pub fn on_progress(mut self, on_progress: impl Fn(&Progress) -> Flow + Send + Sync + 'static) -> Self {
        self.on_progress = Some(Box::new(on_progress));
        self
    }

    /// Sets a stop condition, which all threads evaluate often: `true` ends the rendering within milliseconds. Pixels
    /// may then have different numbers of samples, or none.
    pub fn stop_when(mut self, stop: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        self.stop = Some(Box::new(stop));
        self
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        if let Some((width, height)) = self.size {
            check_film_size(width, height)?;
        }
        check_max_depth(self.max_depth)?;
        self.target.check()?;
        Ok(())
    }

    pub(super) fn target(&self) -> Target {
        let is_open = self.target == Target::default();
        Target { spp: self.target.spp.or(is_open.then_some(Self::DEFAULT_SPP)), ..self.target }
    }

    /// Returns the settings of a rendering; `of_scene` supplies what is not set, `of_image` the allocation of the image that
    /// the scene was opened from.
    pub(super) fn settings(&self, of_scene: RenderSettings, of_image: Option<SampleAllocation>) -> RenderSettings {
        const DEFAULT: SampleAllocation = SampleAllocation::Adaptive(ErrorMetric::RelativeMse);
        RenderSettings {
            integrator: self.integrator.unwrap_or(of_scene.integrator),
            max_depth: self.max_depth.unwrap_or(of_scene.max_depth),
            seed: self.seed.unwrap_or(of_scene.seed),
            filter: self.filter.unwrap_or(of_scene.filter),
            allocation: self.allocation.or(of_image).unwrap_or(DEFAULT),
            ..of_scene
        }
    }

    pub(super) fn progress(&self, now: &Progress) -> bool {
        self.on_progress.as_ref().is_none_or(|on_progress| on_progress(now) == Flow::Continue)
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop())
    }
}

impl fmt::Debug for RenderOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RenderOptions")
            .field("size", &self.size)
            .field("target", &self.target)
            .field("integrator", &self.integrator)
            .field("max_depth", &self.max_depth)
            .field("seed", &self.seed)
            .field("filter", &self.filter)
            .field("allocation", &self.allocation)
            .field("exposure", &self.exposure)
            .field("threads", &self.threads)
            .field("features", &self.features)
            .field("denoise", &self.denoise)
            .finish_non_exhaustive()
    }
}
