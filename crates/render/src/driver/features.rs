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
use crate::integrators::features::FeatureWave;
use crate::integrators::path::CameraPath;
use crate::integrators::seen::Seen;
use crate::integrators::simd::camera::CameraRays;
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use glam::{UVec2, Vec3};
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
    gather(snapshot, settings, size, samples, Ids::None, stop)
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
    gather(snapshot, settings, size, samples, Ids::AtCamera, stop)
}

/// Like [`gather_features_and_ids`], where materials are those of the surfaces to which all other features belong, seen
/// in mirrors and through glass.
pub(crate) fn gather_features_and_materials_beyond(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<FeatureBuffers> {
    gather(snapshot, settings, size, samples, Ids::Beyond, stop)
}

/// Which ids are gathered.
#[derive(Clone, Copy, PartialEq)]
enum Ids {
    None,
    /// Object and material that the camera ray hits.
    AtCamera,
    /// That object, and the material of the first non-specular surface.
    Beyond,
}

/// Rows per band, and columns per part of it: blocks of 4 × 4 rays are traced together.
const BAND: u32 = 8;
const PART: u32 = 128;

/// Paths in flight at once.
const WAVE_SIZE: usize = 4096;

fn gather(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    ids: Ids,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<FeatureBuffers> {
    assert!(size.min_element() > 0 && samples > 0, "{samples} samples of {size} pixels");
    settings.check().unwrap_or_else(|error| panic!("{error}"));
    snapshot.camera.check().unwrap_or_else(|error| panic!("{error}"));
    let filter = FilterSampler::new(settings.filter);
    let lens = CameraRays {
        camera: &snapshot.camera,
        size,
        filter: &filter,
        seed: settings.seed,
        even_samples: settings.techniques.even_samples,
    };
    let media = snapshot.camera_media();
    let mut buffers = FeatureBuffers::new(size.x, size.y, samples, ids != Ids::None);
    let look = Look { snapshot, settings, lens, samples };
    let done = bands_of(&mut buffers).into_par_iter().map_init(
        || {
            let mut worker = Worker::default();
            worker.wave.begin_in(snapshot, &media);
            worker.wave.materials_beyond = ids == Ids::Beyond;
            worker
        },
        |worker, mut band| {
            let rows = band.first_row..size.y.min(band.first_row + BAND);
            (0..size.x).step_by(PART as usize).all(|left| {
                let columns = left..size.x.min(left + PART);
                worker.look_at(&look, &mut band, rows.clone(), columns, stop)
            })
        },
    );
    done.all(|done| done).then_some(buffers)
}

/// Input of all parts.
struct Look<'a> {
    snapshot: &'a Prepared,
    settings: &'a RenderSettings,
    lens: CameraRays<'a>,
    samples: u32,
}

/// The rows of one band in all buffers.
struct Band<'a> {
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

fn bands_of(buffers: &mut FeatureBuffers) -> Vec<Band<'_>> {
    let FeatureBuffers { width, albedo, normal, position, depth, coverage, variance, ids, .. } = buffers;
    let n = (*width * BAND) as usize;
    let [mut albedo, mut normal, mut position] = [albedo, normal, position].map(|list| list.chunks_mut(n));
    let [mut depth, mut coverage] = [depth, coverage].map(|list| list.chunks_mut(n));
    let [mut albedo_variance, mut normal_variance, mut position_variance] =
        [&mut variance.albedo, &mut variance.normal, &mut variance.position].map(|list| list.chunks_mut(n));
    let mut depth_variance = variance.depth.chunks_mut(n);
    let mut ids = ids.as_mut().map(|ids| [&mut ids.objects, &mut ids.materials].map(|list| list.chunks_mut(n)));
    let band = |first_row| {
        Some(Band {
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
struct Worker {
    wave: FeatureWave,
    sums: Vec<Sums>,
    ids: Vec<[IdCounts; 2]>,
}

impl Worker {
    /// Gathers the features of a part of a band; false if `stop` returned true.
    fn look_at(
        &mut self,
        look: &Look,
        band: &mut Band,
        rows: Range<u32>,
        columns: Range<u32>,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> bool {
        let Look { snapshot, settings, lens, samples } = look;
        let origin = UVec2::new(columns.start, rows.start);
        let pixels = pixels_in_blocks(origin, UVec2::new(columns.len() as u32, rows.len() as u32));
        let n_pixels = pixels.local.len();
        let at = |local: usize| {
            let (x, y) = (local % columns.len(), local / columns.len());
            y * lens.size.x as usize + columns.start as usize + x
        };
        self.sums.clear();
        self.sums.resize(n_pixels, Sums::default());
        self.ids.clear();
        self.ids.resize(if band.ids.is_some() { n_pixels } else { 0 }, Default::default());
        let step = (WAVE_SIZE / n_pixels).clamp(1, *samples as usize) as u32;
        for first in (0..*samples).step_by(step as usize) {
            let numbers = first..(*samples).min(first.saturating_add(step));
            let slot = |sample: u32| (sample - numbers.start) * n_pixels as u32;
            let start = |paths: &mut PathBatch| {
                for sample in numbers.clone() {
                    if let Some(set) = settings.simd
                        && lens.is_plain()
                    {
                        lens.start_paths(set, &pixels, 0..pixels.local.len(), sample, slot(sample), paths);
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
            if *samples == 1 {
                for (local, seen) in seen.iter().enumerate() {
                    band.set_one(at(local), seen);
                }
            } else {
                for one in seen.chunks_exact(n_pixels) {
                    self.sums.iter_mut().zip(one).for_each(|(sums, seen)| sums.add(seen));
                }
            }
            for one in seen.chunks_exact(n_pixels) {
                for (counts, seen) in self.ids.iter_mut().zip(one).filter(|(_, seen)| seen.object != Seen::NONE) {
                    counts[0].add(seen.object);
                    counts[1].add(seen.material);
                }
            }
        }
        if *samples > 1 {
            for (local, sums) in self.sums.iter().enumerate() {
                band.set_mean(at(local), sums, *samples);
            }
        }
        if let Some([objects, materials]) = &mut band.ids {
            for (local, [object, material]) in self.ids.iter().enumerate() {
                (objects[at(local)], materials[at(local)]) = (object.ranked(), material.ranked());
            }
        }
        true
    }
}

impl Band<'_> {
    /// Stores a pixel with a single sample.
    fn set_one(&mut self, at: usize, seen: &Seen) {
        (self.albedo[at], self.normal[at], self.position[at]) = (seen.albedo, seen.normal, seen.position);
        self.depth[at] = seen.depth;
        self.coverage[at] = if seen.depth.is_finite() { 1.0 } else { 0.0 };
    }

    /// Stores a pixel with several samples.
    fn set_mean(&mut self, at: usize, sums: &Sums, samples: u32) {
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

/// Sums of one pixel.
#[derive(Clone, Copy, Default)]
struct Sums {
    albedo: Moments,
    normal: Moments,
    position: Moments,
    /// The depth is component 0.
    depth: Moments,
    n_surfaces: u32,
}

impl Sums {
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
struct Moments {
    first: Option<Vec3>,
    sum: Vec3,
    squares: Vec3,
}

impl Moments {
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
        let mut moments = Moments::default();
        values.iter().for_each(|&value| moments.add(Vec3::splat(value)));
        let (mean, variance) = moments.mean(4.0);
        // Deviations −2, 0, −1 and 3: 14 / 3 of one value, a fourth of that of the mean.
        assert_eq!((mean.x, variance.x), (10005.0, 14.0 / 12.0));
        let mut alike = Moments::default();
        (0..7).for_each(|_| alike.add(Vec3::splat(0.3)));
        assert_eq!(alike.mean(7.0), (Vec3::splat(0.3), Vec3::ZERO), "nothing is rounded where all are alike");
    }
}
