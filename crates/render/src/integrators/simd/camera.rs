//! Camera rays, one or sixteen at a time.

use crate::core::camera::Camera;
use crate::core::filter::FilterSampler;
use crate::sampling::warp::uniform_disc;
use crate::sampling::{Sampler, SamplerLanes};
use crate::shading::paths::{PathBatch, PathLanes};
use firstlight_kdtree::geometry::Ray;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Mask, Real, Simd, Vector, dispatch};
use glam::{UVec2, Vec2, Vec3};
use std::ops::Range;

/// Pixels for which camera rays are generated, in the order of the rays.
#[derive(Default)]
pub(crate) struct Pixels {
    pub x: Vec<u32>,
    pub y: Vec<u32>,
    /// Index among the pixels of one sample.
    pub local: Vec<u32>,
}

/// Common parameters of all camera rays of an image.
#[derive(Clone, Copy)]
pub(crate) struct CameraRays<'a> {
    pub camera: &'a Camera,
    /// Size of the film in pixels.
    pub size: UVec2,
    pub filter: &'a FilterSampler,
    pub seed: u32,
    pub even_samples: bool,
    /// Where in its pixel each ray goes through, 0..1, and through the middle of the lens; `None` for random positions.
    pub at: Option<Vec2>,
}

impl CameraRays<'_> {
    /// Whether [`Self::start_paths`] supports filter and aperture.
    pub fn is_plain(&self) -> bool {
        let Self { camera, filter, .. } = self;
        self.at.is_some() || (filter.is_plain() && (camera.lens_radius == 0.0 || camera.has_round_lens()))
    }

    /// Samples a ray through a film position, by the pixel's filter, and a lens position; returns it with its sampler
    /// and its weight.
    #[inline]
    pub fn ray(&self, pixel: UVec2, sample: u32) -> (Ray, Sampler, f32) {
        let new_sampler = if self.even_samples { Sampler::of_pixel } else { Sampler::independent };
        let sampler = new_sampler(self.seed, pixel.x, pixel.y, sample);
        if let Some(at) = self.at {
            return (self.camera.middle_ray(pixel.as_vec2() + at, self.size.as_vec2()), sampler, 1.0);
        }
        let (offset, weight) = self.filter.sample(sampler.pair(0));
        let film = pixel.as_vec2() + offset;
        let lens = if self.camera.lens_radius > 0.0 { sampler.pair(1) } else { Vec2::ZERO };
        (self.camera.ray(film, self.size.as_vec2(), lens), sampler, weight)
    }

    /// Appends a path for each of the `wanted` pixels; `slot` is that of local pixel 0. Space must have been reserved.
    pub fn start_paths(
        &self,
        set: InstructionSet,
        pixels: &Pixels,
        wanted: Range<usize>,
        sample: u32,
        slot: u32,
        to: &mut PathBatch,
    ) {
        let lens = *self;
        let at = [sample, slot];
        dispatch!(set, start(lens: CameraRays, pixels: &Pixels, wanted: Range<usize>, at: [u32; 2], to: &mut PathBatch));
    }
}

#[inline(always)]
fn start<S: Simd>(
    s: S,
    lens: CameraRays,
    pixels: &Pixels,
    wanted: Range<usize>,
    [sample, slot]: [u32; 2],
    to: &mut PathBatch,
) {
    let (camera, size) = (lens.camera, lens.size.as_vec2());
    let one = Float::splat(s, 1.0);
    for first in wanted.clone().step_by(LANES) {
        let count = (wanted.end - first).min(LANES);
        let mask = if count == LANES { Mask::MAX } else { (1 << count) - 1 };
        let (x, y) = (load_some(s, &pixels.x[first..wanted.end]), load_some(s, &pixels.y[first..wanted.end]));
        let sampler = if lens.even_samples {
            SamplerLanes::of_pixels(lens.seed, [x, y], sample)
        } else {
            SamplerLanes::all_independent(lens.seed, [x, y], sample)
        };
        let [dx, dy] = match lens.at {
            Some(at) => at.to_array().map(|x| one.all(x)),
            None => lens.filter.sample_lanes(sampler.pair(0)),
        };
        let aperture = (camera.lens_radius > 0.0 && lens.at.is_none()).then(|| uniform_disc(sampler.pair(1)));
        let (origin, dir) = camera.rays([x.to_float() + dx, y.to_float() + dy], size, aperture);
        let path = PathLanes {
            throughput: Vector::splat(s, Vec3::ONE),
            pdf: one.all(f32::INFINITY),
            position: origin,
            normal: dir,
            sampler,
            slot: load_some(s, &pixels.local[first..wanted.end]) + slot,
        };
        to.append(mask, origin, dir, &path);
        if let Some(media) = &mut to.media {
            media.resize(media.len() + count, Default::default());
        }
        if let Some(tracks) = &mut to.tracks {
            tracks.resize(tracks.len() + count, Default::default());
        }
    }
}

#[inline(always)]
fn load_some<S: Simd>(s: S, from: &[u32]) -> Bits<S> {
    if let Some(all) = from.first_chunk() {
        return Bits::load(s, all);
    }
    let mut some = [0; LANES];
    some[..from.len()].copy_from_slice(from);
    Bits::load(s, &some)
}
