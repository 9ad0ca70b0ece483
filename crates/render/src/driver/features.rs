//! Gathers feature buffers: a pass over the first samples of each pixel that traces camera rays up to the first
//! non-specular surface.
//!
//! The pass is separate from rendering: it needs camera paths only, so it costs a small share of a sample, is the same
//! for both integrators, and a few samples suffice because features are much less noisy than light. Workers take bands
//! of rows; the samples of a pixel are summed in order by one worker, so the result does not depend on the number of
//! workers. Start reading at [`gather_features`].

use crate::core::filter::FilterSampler;
use crate::core::settings::RenderSettings;
use crate::driver::wave::pixels_in_blocks;
use crate::film::features::{FeatureBuffers, IdCounts, IdShares};
use crate::integrators::common::seen::Seen;
use crate::integrators::features::{FeatureUse, FeatureWave};
use crate::integrators::path::CameraPath;
use crate::integrators::simd::camera::{CameraRays, Pixels};
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Samples per pixel of [`gather_features`] for saved images: enough for smooth edges, at a small share of the time of
/// an image.
pub const FEATURE_SAMPLES: u32 = 16;

/// Gathers the features of each pixel from its samples 0 up to `samples`, on the current rayon pool. `None` if `stop`,
/// which is called often, returned true.
///
/// - `size`: of the film, pixels, at least 1 each; `samples`: at least 1.
///
/// The result is a function of the arguments, independent of the number of threads and the instruction set.
///
/// # Panics
/// If `size` or `samples` is 0, or [`RenderSettings::check`] or [`Camera::check`](crate::core::camera::Camera::check)
/// fails.
pub fn gather_features(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<FeatureBuffers> {
    gather(snapshot, settings, size, samples, false, stop)
}

/// Like [`gather_features`], with the ids of objects and materials.
///
/// # Panics
/// As [`gather_features`].
pub fn gather_features_and_ids(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<FeatureBuffers> {
    gather(snapshot, settings, size, samples, true, stop)
}

/// Rows per band, and columns per part of it: blocks of 4 × 4 rays are traced together.
pub(super) const BAND: u32 = 8;
const PART: u32 = 128;
/// Pixels that are traced together at most.
pub(super) const PART_PIXELS: usize = (BAND * PART) as usize;

/// Paths in flight at once.
const WAVE_SIZE: usize = 4096;

fn gather(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    with_ids: bool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<FeatureBuffers> {
    assert!(samples > 0, "{samples} samples of {size} pixels");
    let filter = FilterSampler::new(settings.filter);
    let look = Look::new(snapshot, settings, &filter, size);
    let media = snapshot.camera_media();
    let mut buffers = FeatureBuffers::new(size.x, size.y, samples, with_ids);
    let done = bands_of(&mut buffers).into_par_iter().map_init(
        || FeatureWorker { tracer: PartTracer::begin(snapshot, &media, FeatureUse::Saved), ..FeatureWorker::default() },
        |worker, mut band| {
            Part::of_band(band.first_row, size).all(|part| worker.look_at(&look, samples, &mut band, &part, stop))
        },
    );
    done.all(|done| done).then_some(buffers)
}

/// Input of all parts.
pub(super) struct Look<'a> {
    snapshot: &'a Prepared,
    settings: &'a RenderSettings,
    lens: CameraRays<'a>,
}

impl<'a> Look<'a> {
    /// # Panics
    /// If `size` is 0, or settings or camera are not possible.
    pub fn new(snapshot: &'a Prepared, settings: &'a RenderSettings, filter: &'a FilterSampler, size: UVec2) -> Self {
        assert!(size.min_element() > 0, "{size} pixels");
        settings.check().unwrap_or_else(|error| panic!("{error}"));
        snapshot.camera.check().unwrap_or_else(|error| panic!("{error}"));
        let (camera, even_samples) = (&snapshot.camera, settings.techniques.even_samples);
        let lens = CameraRays { camera, size, filter, seed: settings.seed, even_samples, at: None };
        Self { snapshot, settings, lens }
    }

    /// The same with rays through this place in pixels, 0..1, and the middle of the lens.
    pub fn at(self, place: Vec2) -> Self {
        Self { lens: CameraRays { at: Some(place), ..self.lens }, ..self }
    }
}

/// The rows of one band in all buffers.
struct FeatureBand<'a> {
    first_row: u32,
    albedo: &'a mut [Vec3],
    normal: &'a mut [Vec3],
    position: &'a mut [Vec3],
    depth: &'a mut [f32],
    coverage: &'a mut [f32],
    albedo_variance: &'a mut [Vec3],
    normal_variance: &'a mut [Vec3],
    position_variance: &'a mut [Vec3],
    depth_variance: &'a mut [f32],
    ids: Option<[&'a mut [IdShares]; 2]>,
}

fn bands_of(buffers: &mut FeatureBuffers) -> Vec<FeatureBand<'_>> {
    let FeatureBuffers { width, albedo, normal, position, depth, coverage, variance, ids, .. } = buffers;
    let n = (*width * BAND) as usize;
    let [mut albedo, mut normal, mut position] = [albedo, normal, position].map(|list| list.chunks_mut(n));
    let [mut depth, mut coverage] = [depth, coverage].map(|list| list.chunks_mut(n));
    let [mut albedo_variance, mut normal_variance, mut position_variance] =
        [&mut variance.albedo, &mut variance.normal, &mut variance.position].map(|list| list.chunks_mut(n));
    let mut depth_variance = variance.depth.chunks_mut(n);
    let mut ids = ids.as_mut().map(|ids| [&mut ids.objects, &mut ids.materials].map(|list| list.chunks_mut(n)));
    let band = |first_row| {
        Some(FeatureBand {
            first_row,
            albedo: albedo.next()?,
            normal: normal.next()?,
            position: position.next()?,
            depth: depth.next()?,
            coverage: coverage.next()?,
            albedo_variance: albedo_variance.next()?,
            normal_variance: normal_variance.next()?,
            position_variance: position_variance.next()?,
            depth_variance: depth_variance.next()?,
            ids: ids.as_mut().map(|lists| lists.each_mut().map(|list| list.next().expect("as many as of the others"))),
        })
    };
    (0..).step_by(BAND as usize).map_while(band).collect()
}

/// Scratch memory of one worker.
#[derive(Default)]
struct FeatureWorker {
    tracer: PartTracer,
    sums: Vec<FeatureSums>,
    ids: Vec<[IdCounts; 2]>,
}

impl FeatureWorker {
    /// Gathers the features of a part of a band; false if `stop` returned true.
    fn look_at(
        &mut self,
        look: &Look,
        samples: u32,
        band: &mut FeatureBand,
        part: &Part,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> bool {
        let n_pixels = part.n_pixels();
        let at = |local: usize| part.in_band(local, look.lens.size.x);
        self.sums.clear();
        self.sums.resize(n_pixels, FeatureSums::default());
        self.ids.clear();
        self.ids.resize(if band.ids.is_some() { n_pixels } else { 0 }, Default::default());
        let Self { tracer, sums, ids } = self;
        let done = tracer.trace(look, &part.pixels(), 0..samples, stop, |one| {
            if samples == 1 {
                for (local, seen) in one.iter().enumerate() {
                    band.set_one(at(local), seen);
                }
            } else {
                sums.iter_mut().zip(one).for_each(|(sums, seen)| sums.add(seen));
            }
            for (counts, seen) in ids.iter_mut().zip(one).filter(|(_, seen)| seen.object != Seen::NONE) {
                counts[0].add(seen.object);
                counts[1].add(seen.material);
            }
        });
        if !done {
            return false;
        }
        if samples > 1 {
            for (local, sums) in sums.iter().enumerate() {
                band.set_mean(at(local), sums, samples);
            }
        }
        if let Some([objects, materials]) = &mut band.ids {
            for (local, [object, material]) in ids.iter().enumerate() {
                (objects[at(local)], materials[at(local)]) = (object.ranked(), material.ranked());
            }
        }
        true
    }
}

/// A part of a band.
pub(super) struct Part {
    rows: Range<u32>,
    columns: Range<u32>,
}

impl Part {
    /// The parts of the band that begins in this row, from the left.
    pub fn of_band(first_row: u32, size: UVec2) -> impl Iterator<Item = Self> {
        let rows = first_row..size.y.min(first_row + BAND);
        (0..size.x).step_by(PART as usize).map(move |left| {
            let columns = left..size.x.min(left + PART);
            Self { rows: rows.clone(), columns }
        })
    }

    /// Its pixels, `local` row by row.
    pub fn pixels(&self) -> Pixels {
        let origin = UVec2::new(self.columns.start, self.rows.start);
        pixels_in_blocks(origin, UVec2::new(self.columns.len() as u32, self.rows.len() as u32))
    }

    pub fn n_pixels(&self) -> usize {
        self.rows.len() * self.columns.len()
    }

    pub fn n_columns(&self) -> usize {
        self.columns.len()
    }

    /// The indices of each row of the part in lists of the band.
    ///
    /// - `width`: of the image, pixels.
    pub fn rows_in_band(&self, width: u32) -> impl Iterator<Item = Range<usize>> {
        let (first, n) = (self.columns.start as usize, self.columns.len());
        (0..self.rows.len()).map(move |y| y * width as usize + first).map(move |at| at..at + n)
    }

    /// Index in lists of the band of a pixel of the part, both row by row.
    ///
    /// - `width`: of the image, pixels.
    pub fn in_band(&self, local: usize, width: u32) -> usize {
        let (x, y) = (local % self.columns.len(), local / self.columns.len());
        y * width as usize + self.columns.start as usize + x
    }
}

/// Traces the camera paths of parts of bands.
#[derive(Default)]
pub(super) struct PartTracer {
    wave: FeatureWave,
}

impl PartTracer {
    /// - `media`: in which camera paths start.
    pub fn begin(snapshot: &Prepared, media: &[u32], purpose: FeatureUse) -> Self {
        let mut tracer = Self::default();
        tracer.wave.begin_in(snapshot, media, purpose);
        tracer
    }

    /// Calls `each` with what each of the pixels sees in each of the samples, in ascending order; false if `stop` returned
    /// true.
    ///
    /// - `pixels`: `local` is the index in what `each` gets.
    pub fn trace(
        &mut self,
        look: &Look,
        pixels: &Pixels,
        samples: Range<u32>,
        stop: &(dyn Fn() -> bool + Sync),
        mut each: impl FnMut(&[Seen]),
    ) -> bool {
        let Look { snapshot, settings, lens } = look;
        let n_pixels = pixels.local.len();
        let step = (WAVE_SIZE / n_pixels).clamp(1, samples.len().max(1)) as u32;
        for first in samples.clone().step_by(step as usize) {
            let numbers = first..samples.end.min(first.saturating_add(step));
            let slot = |sample: u32| (sample - numbers.start) * n_pixels as u32;
            let start = |paths: &mut PathBatch| {
                for sample in numbers.clone() {
                    if let Some(set) = settings.simd
                        && lens.is_plain()
                    {
                        lens.start_paths(set, pixels, 0..n_pixels, sample, slot(sample), paths);
                        continue;
                    }
                    for i in 0..n_pixels {
                        let (ray, sampler, _) = lens.ray(UVec2::new(pixels.x[i], pixels.y[i]), sample);
                        // Weight 1: a filter with negative lobes weights radiance, not features.
                        let path = CameraPath { ray, sampler, slot: slot(sample) + pixels.local[i], weight: 1.0 };
                        paths.push(&{ path.ray }, &path.into());
                    }
                }
            };
            let Some(seen) = self.wave.trace(snapshot, settings, numbers.len() * n_pixels, start, stop) else {
                return false;
            };
            seen.chunks_exact(n_pixels).for_each(&mut each);
        }
        true
    }
}

impl FeatureBand<'_> {
    /// Stores a pixel with a single sample.
    fn set_one(&mut self, at: usize, seen: &Seen) {
        (self.albedo[at], self.normal[at], self.position[at]) = (seen.albedo, seen.normal, seen.position);
        self.depth[at] = seen.depth;
        self.coverage[at] = if seen.depth.is_finite() { 1.0 } else { 0.0 };
    }

    /// Stores a pixel with several samples.
    fn set_mean(&mut self, at: usize, sums: &FeatureSums, samples: u32) {
        let n = samples as f32;
        (self.albedo[at], self.albedo_variance[at]) = sums.albedo.mean(n);
        (self.normal[at], self.normal_variance[at]) = sums.normal.mean(n);
        self.coverage[at] = sums.n_surfaces as f32 / n;
        if sums.n_surfaces == 0 {
            self.depth[at] = f32::INFINITY;
            return;
        }
        let n = sums.n_surfaces as f32;
        (self.position[at], self.position_variance[at]) = sums.position.mean(n);
        let (depth, variance) = sums.depth.mean(n);
        (self.depth[at], self.depth_variance[at]) = (depth.x, variance.x);
    }
}

/// FeatureSums of one pixel.
#[derive(Clone, Copy, Default)]
struct FeatureSums {
    albedo: FeatureMoments,
    normal: FeatureMoments,
    position: FeatureMoments,
    /// The depth is component 0.
    depth: FeatureMoments,
    n_surfaces: u32,
}

impl FeatureSums {
    #[inline]
    fn add(&mut self, seen: &Seen) {
        self.albedo.add(seen.albedo);
        self.normal.add(seen.normal);
        if seen.depth.is_finite() {
            self.position.add(seen.position);
            self.depth.add(Vec3::X * seen.depth);
            self.n_surfaces += 1;
        }
    }
}

/// Sum and sum of squares relative to the first value, so that large values lose no digits.
#[derive(Clone, Copy, Default)]
struct FeatureMoments {
    first: Option<Vec3>,
    sum: Vec3,
    squares: Vec3,
}

impl FeatureMoments {
    #[inline]
    fn add(&mut self, value: Vec3) {
        let away = value - *self.first.get_or_insert(value);
        self.sum += away;
        self.squares += away * away;
    }

    /// Returns the mean and the variance of the mean of `n` values, `n` at least 1.
    fn mean(&self, n: f32) -> (Vec3, Vec3) {
        let mean = self.first.unwrap_or_default() + self.sum / n;
        let spread = (self.squares - self.sum * self.sum / n).max(Vec3::ZERO);
        (mean, if n > 1.0 { spread / (n * (n - 1.0)) } else { Vec3::ZERO })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_variances_are_those_of_the_values() {
        let values = [3.0, 5.0, 4.0, 8.0].map(|x| 1e4 + x);
        let mut moments = FeatureMoments::default();
        values.iter().for_each(|&value| moments.add(Vec3::splat(value)));
        let (mean, variance) = moments.mean(4.0);
        // Deviations −2, 0, −1 and 3: 14 / 3 of one value, a fourth of that of the mean.
        assert_eq!((mean.x, variance.x), (10005.0, 14.0 / 12.0));
        let mut alike = FeatureMoments::default();
        (0..7).for_each(|_| alike.add(Vec3::splat(0.3)));
        assert_eq!(alike.mean(7.0), (Vec3::splat(0.3), Vec3::ZERO), "nothing is rounded where all are alike");
    }
}
