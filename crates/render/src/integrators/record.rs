//! What happens in a wave of paths, written down from outside: nothing that is traced knows of it.
//!
//! A wave adds light to a slot at three moments of each depth: where a path leaves the scene, where it runs into a
//! emitter, and where a shadow ray gets through. With one path a slot, what a slot gained between two looks is the light
//! of one such moment. Differences of `f32` sums are exact in `f64`, so all parts add up to the sample.

use crate::core::delta_light::DeltaLight;
use crate::prepare::prepared::Prepared;
use crate::shading::paths::{PathBatch, ShadowBatch};
use firstlight_kdtree::HitBatch;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::geometry::robust::gamma;
use glam::{DVec3, Vec3};

/// Where light came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightSource {
    /// An object of the snapshot.
    Object(u32),
    /// A light without size, by its place in [`crate::core::snapshot::Shading::delta_lights`].
    Delta(u32),
    /// What is around the scene.
    Sky,
    /// A point on the very rim of an emitter, where a ray towards it passes by: whose it is cannot be told.
    Rim,
}

/// How it was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FoundBy {
    /// The path ran into the light.
    Itself,
    /// A vertex asked the light for its share.
    Asking,
}

/// Where a segment of a path ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// On an object, in the frame of the snapshot, metres.
    Surface {
        /// The point, metres.
        position: Vec3,
        /// Index of the object in the snapshot; `u32::MAX` at the rim of a light, where it is not known.
        object: u32,
    },
    /// At a light without size, in the frame of the snapshot, metres.
    Light {
        /// The point, metres.
        position: Vec3,
        /// As of [`LightSource::Delta`].
        light: u32,
    },
    /// Outside of the scene, in this direction (unit).
    Sky {
        /// Unit, from the scene outwards.
        direction: Vec3,
    },
}

/// Light that a vertex asked for and got.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// The light that was asked.
    pub source: LightSource,
    /// The point that was asked, or the direction.
    pub place: Place,
    /// What the pixel got of it in this sample, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
}

/// The end of one segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathVertex {
    /// Where the segment ends.
    pub place: Place,
    /// Of light that arrives here, the share that reaches the pixel.
    pub throughput: Vec3,
    /// What the pixel got of the light that shines from here, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
    /// What light sampling found from here; `None` where it was not used or found nothing.
    pub asked: Option<Asked>,
}

/// One sample.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedPath {
    /// Number of the sample within its pixel.
    pub sample: u32,
    /// On the lens.
    pub origin: Vec3,
    /// One a segment, in order.
    pub vertices: Vec<PathVertex>,
    /// What the film gets.
    pub radiance: Vec3,
}

/// The paths of one wave, by slot.
#[derive(Debug, Default)]
pub struct Record {
    pub paths: Vec<TracedPath>,
    /// What each slot had at the last look.
    before: Vec<Vec3>,
}

impl Record {
    /// Of slots for these samples.
    pub fn new(samples: impl Iterator<Item = u32>) -> Self {
        let empty = |sample| TracedPath { sample, origin: Vec3::ZERO, vertices: Vec::new(), radiance: Vec3::ZERO };
        let paths: Vec<TracedPath> = samples.map(empty).collect();
        Self { before: vec![Vec3::ZERO; paths.len()], paths }
    }

    /// Where the rays of a depth end, before anything is shaded.
    pub fn see_hits(&mut self, batch: &PathBatch, hits: &HitBatch) {
        for i in 0..batch.len() {
            let path = &mut self.paths[batch.slot[i] as usize];
            let ray = batch.rays.get(i);
            if path.vertices.is_empty() {
                path.origin = ray.origin;
            }
            let place = match hits.get(i) {
                Some(hit) => Place::Surface { position: ray.at(hit.t), object: hit.object },
                None => Place::Sky { direction: ray.dir.normalize() },
            };
            let throughput = batch.throughput_of(i);
            path.vertices.push(PathVertex { place, throughput, radiance: DVec3::ZERO, asked: None });
        }
    }

    /// After shading: whatever a path of this depth has gained shines from where it ended.
    pub fn see_shaded(&mut self, batch: &PathBatch, radiance: &[Vec3]) {
        for i in 0..batch.len() {
            let slot = batch.slot[i] as usize;
            let gained = self.gained(slot, radiance);
            let vertex = self.paths[slot].vertices.last_mut().expect("its hit has been seen");
            vertex.radiance = gained;
        }
    }

    /// After the shadow rays: whatever was gained now came along them.
    pub fn see_settled(&mut self, scene: &Prepared, shadows: &ShadowBatch, radiance: &[Vec3]) {
        for i in 0..shadows.rays.len() {
            let slot = shadows.slot[i] as usize;
            let gained = self.gained(slot, radiance);
            if gained == DVec3::ZERO {
                continue;
            }
            let ray = shadows.rays.get(i);
            let delta = delta_light_of(scene, &ray);
            let (source, place) = if ray.t_max == f32::INFINITY {
                (delta.map_or(LightSource::Sky, LightSource::Delta), Place::Sky { direction: ray.dir.normalize() })
            } else if let Some(light) = delta {
                (LightSource::Delta(light), Place::Light { position: ray.at(ray.t_max), light })
            } else {
                // It ends a hair in front of the emitter and met nothing, so whatever comes next is the emitter.
                let emitter = scene.closest_hit(&Ray { t_max: f32::INFINITY, ..ray });
                let emitter = emitter.filter(|hit| scene.tables.lights.shines(hit.object, hit.prim));
                let object = emitter.map_or(HitBatch::MISS, |hit| hit.object);
                let source = emitter.map_or(LightSource::Rim, |hit| LightSource::Object(hit.object));
                (source, Place::Surface { position: ray.at(ray.t_max), object })
            };
            let vertex = self.paths[slot].vertices.last_mut().expect("its hit has been seen");
            vertex.asked = Some(Asked { source, place, radiance: gained });
        }
    }

    /// The wave is over.
    pub fn finish(mut self, radiance: &[Vec3]) -> Vec<TracedPath> {
        for (path, radiance) in self.paths.iter_mut().zip(radiance) {
            path.radiance = *radiance;
        }
        self.paths
    }

    fn gained(&mut self, slot: usize, radiance: &[Vec3]) -> DVec3 {
        let before = std::mem::replace(&mut self.before[slot], radiance[slot]);
        radiance[slot].as_dvec3() - before.as_dvec3()
    }
}

/// The light without size that a shadow ray leads to; the first of several in one place.
fn delta_light_of(scene: &Prepared, ray: &Ray) -> Option<u32> {
    let end = ray.at(ray.t_max);
    let is_its = |light: &DeltaLight| match *light {
        // Shadow rays end in front of a point by a few roundings.
        DeltaLight::Point { position, .. } | DeltaLight::Spot { position, .. } => {
            let size = position.length() + ray.origin.length() + ray.dir.length();
            ray.t_max.is_finite() && end.distance(position) <= gamma(64) * size
        }
        DeltaLight::Directional { direction, .. } => ray.t_max.is_infinite() && ray.dir == -direction,
    };
    scene.shading.delta_lights.iter().position(is_its).map(|light| light as u32)
}
