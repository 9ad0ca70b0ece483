//! What guides the denoiser: albedo, normal and depth of the first surface that is not specular, and the light that it
//! emits.
//!
//! Gathered like [feature buffers](crate::driver::features), by camera rays alone, but only as sums of what the denoiser reads.
//! They can be extended: the first samples of a view give guides at once, and more samples better ones. The noise of the
//! guides stays in the denoised image, at edges, in textures and in glass above all: pixels whose first samples differ
//! get more than the others. Start reading at [`GuideGatherer`].

use crate::core::filter::FilterSampler;
use crate::core::settings::RenderSettings;
use crate::denoise::Guides;
use crate::driver::features::{BAND, FEATURE_SAMPLES, Look, PART_PIXELS, Part, PartTracer};
use crate::film::tiles::Film;
use crate::integrators::common::seen::Seen;
use crate::integrators::features::FeatureUse;
use crate::integrators::simd::camera::Pixels;
use crate::prepare::prepared::Prepared;
use bytemuck::{Zeroable, zeroed_vec};
use glam::{UVec2, Vec3};
use rayon::prelude::*;

/// What guides the denoiser, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceGuides {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Share of light that the surface reflects, 0..1 per channel.
    pub albedo: Vec<Vec3>,
    /// Radiance that arrives from emitters and from beyond the scene without scattering, W·m⁻²·sr⁻¹; less where few of
    /// the samples have found it.
    pub emitted: Vec<Vec3>,
    /// Shading normal, at most of length 1.
    pub normal: Vec<Vec3>,
    /// Metres along the view axis; infinite where nothing is hit.
    pub depth: Vec<f32>,
    /// Whether the pixel sees an emitter, even partly, directly or by specular reflection or refraction.
    pub emitters: Vec<bool>,
}

impl SurfaceGuides {
    /// The same as the denoiser takes them.
    pub fn as_guides(&self) -> Guides<'_> {
        let Self { albedo, emitted, normal, depth, emitters, .. } = self;
        Guides { albedo, emitted, normal, depth, emitters }
    }
}

/// Samples per pixel that every pixel gets before any gets more.
const EVEN_SAMPLES: u32 = FEATURE_SAMPLES;
/// Samples per pixel beyond which guides do not get much better.
const MOST_SAMPLES: u32 = 64;

/// Samples per pixel of guides for the denoiser of an image: with more of its own, better ones pay.
///
/// - `spp`: samples per pixel of the image.
pub fn guide_samples(spp: u32) -> u32 {
    spp.saturating_mul(4).clamp(EVEN_SAMPLES, MOST_SAMPLES)
}

/// Gathers the guides of the denoiser, on the current rayon pool; `None` if `stop` returned true.
///
/// - `size`: of the film, pixels, at least 1 each; `samples`: per pixel, at least 1, see [`guide_samples`].
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
    let mut gatherer = GuideGatherer::default();
    gatherer.start(size);
    gatherer.gather(snapshot, settings, samples, stop).then_some(gatherer.guides)
}

/// Gathers guides in steps, with 141 bytes of memory per pixel, which the next view uses again; 41 once there are 64
/// samples.
#[derive(Default)]
pub struct GuideGatherer {
    samples: u32,
    /// Of those samples that each pixel has so far; meaningless without samples.
    sums: Vec<GuideSums>,
    /// Their means.
    guides: SurfaceGuides,
}

impl GuideGatherer {
    /// Begins with another view: there are no samples.
    ///
    /// - `size`: of the film, pixels, at least 1 each.
    pub fn start(&mut self, size: UVec2) {
        self.samples = 0;
        let n = size.x as usize * size.y as usize;
        (self.guides.width, self.guides.height) = (size.x, size.y);
        if self.guides.depth.len() != n {
            let SurfaceGuides { albedo, emitted, normal, depth, emitters, .. } = &mut self.guides;
            // The system gives zeroed memory when it is written first: by all threads, not here.
            (*albedo, *emitted, *normal) = (zeroed_vec(n), zeroed_vec(n), zeroed_vec(n));
            (*depth, *emitters) = (zeroed_vec(n), zeroed_vec(n));
        }
    }

    /// Samples per pixel so far, of those pixels that have most.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Means over the samples so far; meaningless without any.
    pub fn guides(&self) -> &SurfaceGuides {
        &self.guides
    }

    /// Gathers what the denoiser of a film needs; begins if there are no samples. As [`Self::gather`].
    pub fn gather_for(
        &mut self,
        snapshot: &Prepared,
        settings: &RenderSettings,
        film: &Film,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> bool {
        if self.samples == 0 {
            self.start(UVec2::new(film.width(), film.height()));
        }
        self.gather(snapshot, settings, guide_samples(film.spp()), stop)
    }

    /// Adds the samples that are missing of `samples` per pixel, on the current rayon pool. Returns false if `stop`, which
    /// is called often, returned true; the samples are discarded then. After 16 samples, only pixels whose samples vary
    /// are continued.
    ///
    /// - `snapshot`, `settings`: the same in all steps of a view.
    ///
    /// The sums are a function of scene, settings, size and number of samples, independent of the steps, the number of
    /// threads and the instruction set. Uses other samples than the image: with the same ones, the noise of features at
    /// an edge would correlate with that of the image, and the denoiser would keep it.
    ///
    /// # Panics
    /// If the size is 0, or [`RenderSettings::check`] or [`Camera::check`](crate::core::camera::Camera::check) fails.
    pub fn gather(
        &mut self,
        snapshot: &Prepared,
        settings: &RenderSettings,
        samples: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> bool {
        if self.samples >= samples {
            return true;
        }
        if self.sums.len() != self.guides.depth.len() {
            (self.samples, self.sums) = (0, zeroed_vec(self.guides.depth.len()));
        }
        let settings = RenderSettings { seed: settings.seed ^ OTHER_SEED, ..*settings };
        let size = UVec2::new(self.guides.width, self.guides.height);
        let (of_all, of_uneven) = (self.samples..samples.min(EVEN_SAMPLES), self.samples.max(EVEN_SAMPLES)..samples);
        let filter = FilterSampler::new(settings.filter);
        let look = Look::new(snapshot, &settings, &filter, size);
        let media = snapshot.camera_media();
        let is_emitter = |seen: &Seen| {
            seen.object != Seen::NONE
                && snapshot.tables.emission.get(seen.material as usize).is_some_and(Option::is_some)
        };
        let add = |sums: &mut GuideSums, seen: &Seen| sums.add(seen, is_emitter(seen));
        let done = self.bands((size.x * BAND) as usize).enumerate().map_init(
            || PartTracer::begin(snapshot, &media, FeatureUse::Denoiser),
            |tracer, (number, mut band)| {
                let first_row = number as u32 * BAND;
                if of_all.start == 0 {
                    band.sums.fill(GuideSums::default());
                }
                if !of_all.is_empty() {
                    let done = Part::of_band(first_row, size).all(|part| {
                        tracer.trace(&look, &part.pixels(), of_all.clone(), stop, |seen| {
                            let rows = part.rows_in_band(size.x);
                            for (row, seen) in rows.zip(seen.chunks_exact(part.n_columns())) {
                                band.sums[row].iter_mut().zip(seen).for_each(|(sums, seen)| add(sums, seen));
                            }
                        })
                    });
                    if !done {
                        return false;
                    }
                    (0..band.sums.len()).for_each(|i| band.set_mean(i, of_all.end));
                }
                of_uneven.is_empty()
                    || band.uneven_pixels(size.x).chunks(PART_PIXELS).all(|uneven| {
                        let pixels = Pixels {
                            x: uneven.iter().map(|i| i % size.x).collect(),
                            y: uneven.iter().map(|i| first_row + i / size.x).collect(),
                            local: (0..uneven.len() as u32).collect(),
                        };
                        let done = tracer.trace(&look, &pixels, of_uneven.clone(), stop, |seen| {
                            uneven.iter().zip(seen).for_each(|(&i, seen)| add(&mut band.sums[i as usize], seen));
                        });
                        if done {
                            uneven.iter().for_each(|&i| band.set_mean(i as usize, of_uneven.end));
                        }
                        done
                    })
            },
        );
        let done = done.all(|done| done);
        self.samples = if done { samples } else { 0 };
        if self.samples >= MOST_SAMPLES {
            // Further samples are unusual, and begin again.
            self.sums = Vec::new();
        }
        done
    }

    /// GuideSums and means of bands of the image, from the top.
    ///
    /// - `length`: of a band, pixels.
    fn bands(&mut self, length: usize) -> impl IndexedParallelIterator<Item = GuideBand<'_>> {
        let SurfaceGuides { albedo, emitted, normal, depth, emitters, .. } = &mut self.guides;
        let sums = self.sums.par_chunks_mut(length);
        let surfaces =
            albedo.par_chunks_mut(length).zip(emitted.par_chunks_mut(length)).zip(normal.par_chunks_mut(length));
        let rest = depth.par_chunks_mut(length).zip(emitters.par_chunks_mut(length));
        sums.zip(surfaces).zip(rest).map(|((sums, ((albedo, emitted), normal)), (depth, emitters))| GuideBand {
            sums,
            albedo,
            emitted,
            normal,
            depth,
            emitters,
        })
    }
}

/// Some rows of the image.
struct GuideBand<'a> {
    sums: &'a mut [GuideSums],
    albedo: &'a mut [Vec3],
    emitted: &'a mut [Vec3],
    normal: &'a mut [Vec3],
    depth: &'a mut [f32],
    emitters: &'a mut [bool],
}

impl GuideBand<'_> {
    /// - `i`: pixel of the band; `samples`: that it has.
    fn set_mean(&mut self, i: usize, samples: u32) {
        let sums = &mut self.sums[i];
        if samples == EVEN_SAMPLES {
            sums.is_uneven = sums.differ(samples as f32);
        }
        (self.albedo[i], self.normal[i]) = (sums.albedo.mean(samples as f32), sums.normal.mean(samples as f32));
        self.emitted[i] = sums.emitted.certain_part(samples as f32);
        (self.depth[i], self.emitters[i]) = (sums.mean_depth(), sums.emits);
    }

    /// The pixels whose first samples differ, in columns of four pixels, so that consecutive rays are coherent.
    ///
    /// - `width`: of the image, pixels.
    fn uneven_pixels(&self, width: u32) -> Vec<u32> {
        let of_band = (0..).zip(&*self.sums).filter(|(_, sums)| sums.is_uneven);
        let mut uneven: Vec<u32> = of_band.map(|(i, _)| i).collect();
        uneven.sort_by_key(|i| (i % width / 4, i / width));
        uneven
    }
}

/// Changes the seed, so that guides and image have different samples.
const OTHER_SEED: u32 = 0x9e37_79b9;

/// GuideSums of one pixel.
#[derive(Clone, Copy, Default, Zeroable)]
struct GuideSums {
    albedo: GuideSum,
    emitted: GuideSum,
    normal: GuideSum,
    /// Of the first sample that hits a surface, metres.
    first_depth: f32,
    /// Relative to that one.
    depth: f32,
    n_surfaces: u32,
    has_samples: bool,
    emits: bool,
    is_uneven: bool,
}

/// Variance of one sample from which on the samples of a pixel differ: of the albedo, relative to its square, and of the
/// normal.
const UNEVEN: f32 = 0.03;
/// Squared albedo below which differences do not count.
const BLACK: f32 = 1e-3;

impl GuideSums {
    #[inline]
    fn add(&mut self, seen: &Seen, emits: bool) {
        if !self.has_samples {
            (self.albedo.first, self.normal.first, self.has_samples) = (seen.albedo, seen.normal, true);
            self.emitted.first = seen.emitted;
        }
        self.albedo.add(seen.albedo);
        self.emitted.add(seen.emitted);
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

    /// Whether the samples differ so much that their mean is uncertain.
    ///
    /// - `n`: number of samples.
    fn differ(&self, n: f32) -> bool {
        let level = self.albedo.mean(n).length_squared().max(BLACK);
        let emitted = self.emitted.mean(n).length_squared().max(BLACK);
        self.albedo.variance(n) > UNEVEN * level
            || self.normal.variance(n) > UNEVEN
            || self.emitted.variance(n) > UNEVEN * emitted
    }

    fn mean_depth(&self) -> f32 {
        if self.n_surfaces == 0 { f32::INFINITY } else { self.first_depth + self.depth / self.n_surfaces as f32 }
    }
}

/// GuideSum relative to the first value, so that nothing is rounded where all are alike.
#[derive(Clone, Copy, Default, Zeroable)]
struct GuideSum {
    first: Vec3,
    away: Vec3,
    squares: f32,
}

impl GuideSum {
    #[inline]
    fn add(&mut self, value: Vec3) {
        let away = value - self.first;
        self.away += away;
        self.squares += away.length_squared();
    }

    fn mean(&self, n: f32) -> Vec3 {
        self.first + self.away / n
    }

    /// The mean, less what is as uncertain as it is large: of a light that a single sample has hit nothing is left
    /// (James and Stein 1961).
    fn certain_part(&self, n: f32) -> Vec3 {
        let mean = self.mean(n);
        let uncertain = self.variance(n) / (n * mean.length_squared()).max(1e-30);
        mean * (1.0 - uncertain).clamp(0.0, 1.0)
    }

    /// Variance of one sample, sum over the components.
    fn variance(&self, n: f32) -> f32 {
        self.squares / n - (self.away / n).length_squared()
    }
}
