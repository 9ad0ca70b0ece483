//! Paths and shadow rays in flight, as structures of arrays.

use crate::sampling::{Sampler, SamplerLanes};
use crate::shading::interface::MediumId;
use crate::shading::mis_state::MisState;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{RayBatch, append, append_bits};
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector};
use glam::Vec3;

/// The state of one path between two bounces.
#[derive(Clone, Copy)]
pub(crate) struct Path {
    pub throughput: Vec3,
    /// Pdf per steradian with which the last vertex sampled this direction; infinite if light sampling could not have
    /// sampled it.
    pub pdf: f32,
    /// The last vertex, for the pdf of light sampling there.
    pub position: Vec3,
    /// Normal at the last vertex; zero if light sampling used both sides.
    pub normal: Vec3,
    pub sampler: Sampler,
    pub slot: u32,
    pub media: MediumId,
    /// For MIS weights against light paths.
    pub track: MisState,
}

/// Many paths and their next rays. The arrays may be longer than the number of paths.
#[derive(Default)]
pub(crate) struct PathBatch {
    pub rays: RayBatch,
    pub throughput: [Vec<f32>; 3],
    pub pdf: Vec<f32>,
    pub position: [Vec<f32>; 3],
    pub normal: [Vec<f32>; 3],
    pub stream: Vec<u32>,
    pub reversed_index: Vec<u32>,
    pub screen: Vec<u32>,
    pub slot: Vec<u32>,
    /// Present only if some surface transmits light.
    pub media: Option<Vec<MediumId>>,
    /// Present only if there are light paths.
    pub tracks: Option<Vec<MisState>>,
}

/// Sixteen paths, of which a mask selects the valid ones.
#[derive(Clone, Copy)]
pub(crate) struct PathLanes<S: Simd> {
    pub throughput: Vector<S>,
    pub pdf: Float<S>,
    pub position: Vector<S>,
    pub normal: Vector<S>,
    pub sampler: SamplerLanes<S>,
    pub slot: Bits<S>,
}

impl PathBatch {
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// Removes all paths and reserves space for `n` new ones.
    pub fn start(&mut self, n: usize, with_media: bool, with_tracks: bool) {
        self.rays.clear();
        self.make_room(n);
        restart(&mut self.media, with_media);
        restart(&mut self.tracks, with_tracks);
    }

    /// Reserves space for `n` more paths.
    pub fn make_room(&mut self, n: usize) {
        self.rays.make_room(n);
        let least = self.len() + n + LANES;
        if self.slot.len() < least {
            let floats = self.throughput.iter_mut().chain(&mut self.position).chain(&mut self.normal);
            floats.chain([&mut self.pdf]).for_each(|array| array.resize(least, 0.0));
            for array in [&mut self.stream, &mut self.reversed_index, &mut self.screen, &mut self.slot] {
                array.resize(least, 0);
            }
        }
    }

    /// Sets the media of all paths.
    pub fn begin_in(&mut self, id: MediumId) {
        if let Some(media) = &mut self.media {
            media.fill(id);
        }
    }

    #[inline]
    pub fn push(&mut self, ray: &Ray, path: &Path) {
        let i = self.len();
        set(&mut self.throughput, i, path.throughput);
        self.pdf[i] = path.pdf;
        set(&mut self.position, i, path.position);
        set(&mut self.normal, i, path.normal);
        [self.stream[i], self.reversed_index[i], self.screen[i]] = path.sampler.parts();
        self.slot[i] = path.slot;
        if let Some(media) = &mut self.media {
            media.push(path.media);
        }
        if let Some(tracks) = &mut self.tracks {
            tracks.push(path.track);
        }
        self.rays.push(ray);
    }

    #[inline]
    pub fn get(&self, i: usize) -> Path {
        Path {
            throughput: get(&self.throughput, i),
            pdf: self.pdf[i],
            position: get(&self.position, i),
            normal: get(&self.normal, i),
            sampler: self.sampler(i),
            slot: self.slot[i],
            media: self.media_of(i),
            track: self.track_of(i),
        }
    }

    #[inline]
    pub fn throughput_of(&self, i: usize) -> Vec3 {
        get(&self.throughput, i)
    }

    #[inline]
    pub fn sampler(&self, i: usize) -> Sampler {
        Sampler::from_parts([self.stream[i], self.reversed_index[i], self.screen[i]])
    }

    #[inline]
    pub fn media_of(&self, i: usize) -> MediumId {
        self.media.as_ref().map_or(MediumId::OUTSIDE, |media| media[i])
    }

    #[inline]
    pub fn track_of(&self, i: usize) -> MisState {
        self.tracks.as_ref().map_or(MisState::default(), |tracks| tracks[i])
    }

    #[inline(always)]
    pub fn sampler_lanes<S: Simd>(&self, at: Bits<S>) -> SamplerLanes<S> {
        let (stream, reversed_index) = (Bits::gather(&self.stream, at), Bits::gather(&self.reversed_index, at));
        let screen = Bits::gather(&self.screen, at);
        SamplerLanes { stream, reversed_index, screen }
    }

    /// Appends the lanes of `mask`, without their media and MIS states.
    #[inline(always)]
    pub fn append<S: Simd>(&mut self, mask: Mask, origin: Vector<S>, dir: Vector<S>, path: &PathLanes<S>) {
        let at = self.len();
        append_vector(&mut self.throughput, at, mask, path.throughput);
        append(&mut self.pdf, at, mask, path.pdf);
        append_vector(&mut self.position, at, mask, path.position);
        append_vector(&mut self.normal, at, mask, path.normal);
        append_bits(&mut self.stream, at, mask, path.sampler.stream);
        append_bits(&mut self.reversed_index, at, mask, path.sampler.reversed_index);
        append_bits(&mut self.screen, at, mask, path.sampler.screen);
        append_bits(&mut self.slot, at, mask, path.slot);
        self.rays.append(mask, origin, dir, path.pdf.all(f32::INFINITY));
    }
}

/// Shadow rays, and the contribution of each if it is unoccluded.
#[derive(Default)]
pub(crate) struct ShadowBatch {
    pub rays: RayBatch,
    pub slot: Vec<u32>,
    light: [Vec<f32>; 3],
    occluded: Vec<bool>,
}

impl ShadowBatch {
    /// Removes all rays and reserves space for `n` new ones.
    pub fn start(&mut self, n: usize) {
        self.rays.clear();
        self.rays.make_room(n);
        let least = n + LANES;
        if self.slot.len() < least {
            self.slot.resize(least, 0);
            self.light.iter_mut().for_each(|array| array.resize(least, 0.0));
        }
    }

    #[inline]
    pub fn push(&mut self, ray: &Ray, slot: u32, light: Vec3) {
        let i = self.rays.len();
        self.slot[i] = slot;
        set(&mut self.light, i, light);
        self.rays.push(ray);
    }

    #[inline(always)]
    pub fn append<S: Simd>(
        &mut self,
        mask: Mask,
        [origin, dir]: [Vector<S>; 2],
        t_max: Float<S>,
        slot: Bits<S>,
        light: Vector<S>,
    ) {
        let at = self.rays.len();
        append_bits(&mut self.slot, at, mask, slot);
        append_vector(&mut self.light, at, mask, light);
        self.rays.append(mask, origin, dir, t_max);
    }

    /// Contribution of a ray if it is unoccluded.
    #[inline]
    pub fn light_of(&self, i: usize) -> Vec3 {
        get(&self.light, i)
    }

    /// Traces the rays, and adds the contributions of unoccluded ones to `radiance`.
    ///
    /// - `trace`: returns rays of which only a share of the light arrives.
    pub fn settle(
        &mut self,
        radiance: &mut [Vec3],
        trace: impl FnOnce(&RayBatch, &mut Vec<bool>) -> Vec<(usize, Vec3)>,
    ) {
        for (i, share) in trace(&self.rays, &mut self.occluded) {
            let light = share * get(&self.light, i);
            set(&mut self.light, i, light);
        }
        for i in 0..self.rays.len() {
            if !self.occluded[i] {
                radiance[self.slot[i] as usize] += get(&self.light, i);
            }
        }
    }
}

/// Clears the list and creates it if necessary; drops it if it is not `wanted`.
fn restart<T>(list: &mut Option<Vec<T>>, wanted: bool) {
    if wanted {
        list.get_or_insert_default().clear();
    } else {
        *list = None;
    }
}

#[inline]
pub(crate) fn get(arrays: &[Vec<f32>; 3], i: usize) -> Vec3 {
    Vec3::new(arrays[0][i], arrays[1][i], arrays[2][i])
}

#[inline]
pub(crate) fn set(arrays: &mut [Vec<f32>; 3], i: usize, v: Vec3) {
    (arrays[0][i], arrays[1][i], arrays[2][i]) = (v.x, v.y, v.z);
}

#[inline(always)]
pub(crate) fn append_vector<S: Simd>(to: &mut [Vec<f32>; 3], at: usize, mask: Mask, lanes: Vector<S>) {
    append(&mut to[0], at, mask, lanes.x);
    append(&mut to[1], at, mask, lanes.y);
    append(&mut to[2], at, mask, lanes.z);
}
