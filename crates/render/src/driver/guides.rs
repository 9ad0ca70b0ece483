//! What guides the denoiser: albedo, normal and depth of the first surface that is not specular.
//!
//! Gathered like [feature buffers](super::features), by camera rays alone, but only as sums of what the denoiser reads.
//! They can be extended: the first samples of a view give guides at once, and more samples better ones. Start reading at
//! [`GuideGatherer`].

use crate::core::filter::FilterSampler;
use crate::core::settings::RenderSettings;
use crate::denoise::Guides;
use crate::driver::features::{BAND, Look, Part, PartTracer};
use crate::integrators::seen::Seen;
use crate::prepare::prepared::Prepared;
use glam::{UVec2, Vec3};
use rayon::prelude::*;

/// What guides the denoiser, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceGuides {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Share of light that the surface reflects, 0..1 per channel.
    pub albedo: Vec<Vec3>,
    /// Shading normal, at most of length 1.
    pub normal: Vec<Vec3>,
    /// Metres along the view axis; infinite where nothing is hit.
    pub depth: Vec<f32>,
    /// Whether a pixel shows an emitter, in part at least, and be it in a mirror or through glass.
    pub emitters: Vec<bool>,
}

impl SurfaceGuides {
    /// The same as the denoiser takes them.
    pub fn as_guides(&self) -> Guides<'_> {
        let Self { albedo, normal, depth, emitters, .. } = self;
        Guides { albedo, normal, depth, emitters }
    }
}

/// Gathers the guides of the denoiser, on the current rayon pool; `None` if `stop` returned true.
///
/// - `size`: of the film, pixels, at least 1 each; `samples`: per pixel, at least 1.
///
/// # Panics
/// As [`GuideGatherer::gather`].
pub fn gather_guides(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<SurfaceGuides> {
    GuideGatherer::new(size).gather(snapshot, settings, samples, stop).map(|gatherer| gatherer.guides())
}

/// Gathers guides in steps: the sums of those samples that each pixel has so far, 64 bytes per pixel.
pub struct GuideGatherer {
    size: UVec2,
    samples: u32,
    sums: Vec<Sums>,
}

impl GuideGatherer {
    /// - `size`: of the film, pixels.
    pub fn new(size: UVec2) -> Self {
        Self { size, samples: 0, sums: vec![Sums::default(); size.x as usize * size.y as usize] }
    }

    /// Samples per pixel so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Adds the samples that are missing of `samples` per pixel, on the current rayon pool; `None` if `stop`, which is
    /// called often, returned true.
    ///
    /// - `snapshot`, `settings`: the same in all steps.
    ///
    /// The sums are a function of scene, settings, size and number of samples, independent of the steps, the number of
    /// threads and the instruction set. Uses other samples than the image: with the same ones, the noise of features at
    /// an edge would correlate with that of the image, and the denoiser would keep it.
    ///
    /// # Panics
    /// If the size is 0, or [`RenderSettings::check`] or [`Camera::check`](crate::core::camera::Camera::check) fails.
    pub fn gather(
        mut self,
        snapshot: &Prepared,
        settings: &RenderSettings,
        samples: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let settings = RenderSettings { seed: settings.seed ^ OTHER_SEED, ..*settings };
        let (size, missing) = (self.size, self.samples..samples);
        let filter = FilterSampler::new(settings.filter);
        let look = Look::new(snapshot, &settings, &filter, size);
        let media = snapshot.camera_media();
        let is_emitter = |seen: &Seen| {
            seen.object != Seen::NONE
                && snapshot.tables.emission.get(seen.material as usize).is_some_and(Option::is_some)
        };
        let add = |sums: &mut Sums, seen: &Seen| sums.add(seen, is_emitter(seen));
        let bands = self.sums.par_chunks_mut((size.x * BAND) as usize).enumerate();
        let done = bands.map_init(
            || PartTracer::begin(snapshot, &media, true),
            |tracer, (band, sums)| {
                Part::of_band(band as u32 * BAND, size).all(|part| {
                    tracer.trace(&look, &part, missing.clone(), stop, |seen| {
                        let rows = part.rows_in_band(size.x);
                        for (row, seen) in rows.zip(seen.chunks_exact(part.n_columns())) {
                            sums[row].iter_mut().zip(seen).for_each(|(sums, seen)| add(sums, seen));
                        }
                    })
                })
            },
        );
        let done = done.all(|done| done);
        self.samples = self.samples.max(samples);
        done.then_some(self)
    }

    /// Means over the samples so far, at least one.
    pub fn guides(&self) -> SurfaceGuides {
        debug_assert!(self.samples > 0, "no samples");
        let n = self.samples as f32;
        SurfaceGuides {
            width: self.size.x,
            height: self.size.y,
            albedo: self.sums.par_iter().map(|sums| sums.albedo.mean(n)).collect(),
            normal: self.sums.par_iter().map(|sums| sums.normal.mean(n)).collect(),
            depth: self.sums.par_iter().map(Sums::mean_depth).collect(),
            emitters: self.sums.par_iter().map(|sums| sums.emits).collect(),
        }
    }
}

/// Changes the seed, so that guides and image have different samples.
const OTHER_SEED: u32 = 0x9e37_79b9;

/// Sums of one pixel.
#[derive(Clone, Copy, Default)]
struct Sums {
    albedo: Sum,
    normal: Sum,
    /// Of the first sample that hits a surface, metres.
    first_depth: f32,
    /// Relative to that one.
    depth: f32,
    n_surfaces: u32,
    has_samples: bool,
    emits: bool,
}

impl Sums {
    #[inline]
    fn add(&mut self, seen: &Seen, emits: bool) {
        if !self.has_samples {
            (self.albedo.first, self.normal.first, self.has_samples) = (seen.albedo, seen.normal, true);
        }
        self.albedo.add(seen.albedo);
        self.normal.add(seen.normal);
        if seen.depth.is_finite() {
            if self.n_surfaces == 0 {
                self.first_depth = seen.depth;
            }
            self.depth += seen.depth - self.first_depth;
            self.n_surfaces += 1;
        }
        self.emits |= emits;
    }

    fn mean_depth(&self) -> f32 {
        if self.n_surfaces == 0 { f32::INFINITY } else { self.first_depth + self.depth / self.n_surfaces as f32 }
    }
}

/// Sum relative to the first value, so that nothing is rounded where all are alike.
#[derive(Clone, Copy, Default)]
struct Sum {
    first: Vec3,
    away: Vec3,
}

impl Sum {
    #[inline]
    fn add(&mut self, value: Vec3) {
        self.away += value - self.first;
    }

    fn mean(&self, n: f32) -> Vec3 {
        self.first + self.away / n
    }
}
