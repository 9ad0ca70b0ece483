//! Records a wave of paths from outside: tracing does not know about it.
//!
//! A wave adds radiance to a slot at four moments per depth: where a chain of specular surfaces brings light, where a
//! path leaves the scene, where it hits an emitter, and where a shadow ray is unoccluded. With one path per slot, the change of a slot between two observations is the
//! contribution of one such moment. Differences of `f32` sums are exact in `f64`, so all parts add up to the sample.

use crate::core::delta_light::{DeltaLight, Origin};
use crate::prepare::prepared::Prepared;
use crate::shading::paths::{PathBatch, ShadowBatch};
use firstlight_kdtree::HitBatch;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::geometry::robust::gamma;
use glam::{DVec3, Vec3};

/// Origin of a contribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightSource {
    /// An object of the snapshot.
    Object(u32),
    /// A delta light, by its index in [`crate::core::snapshot::Shading::delta_lights`].
    Delta(u32),
    /// The environment.
    Sky,
    /// A point at the very edge of an emitter, which a ray towards it misses: the emitter cannot be determined.
    Rim,
}

/// Sampling technique of a contribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FoundBy {
    /// BSDF sampling: the path hit the light.
    Itself,
    /// Light sampling at a vertex, also by a chain of specular surfaces.
    Asking,
}

/// End of a segment of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// On an object, in the snapshot's frame, metres.
    Surface {
        /// The point, metres.
        position: Vec3,
        /// Index of the object in the snapshot; `u32::MAX` at the edge of a light, where it is unknown.
        object: u32,
    },
    /// At a delta light, in the snapshot's frame, metres.
    Light {
        /// The point, metres.
        position: Vec3,
        /// As in [`LightSource::Delta`].
        light: u32,
    },
    /// The environment, in this direction.
    Sky {
        /// Unit, away from the scene.
        direction: Vec3,
    },
}

/// A light sample with a contribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// The sampled light.
    pub source: LightSource,
    /// The sampled point or direction.
    pub place: Place,
    /// Number of specular surfaces between the vertex and the light; panes do not count.
    pub between: u32,
    /// Contribution to the pixel in this sample, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
}

/// The end of one segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathVertex {
    /// Where the segment ends.
    pub place: Place,
    /// Throughput from here to the pixel.
    pub throughput: Vec3,
    /// Contribution of emission at this vertex, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
    /// The light sample at this vertex; `None` if there is none or it contributes nothing.
    pub asked: Option<Asked>,
    /// Light of a delta light that mirrors and glass bring to this vertex; likewise.
    pub chain: Option<Asked>,
}

/// The path of one sample.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedPath {
    /// Number of the sample within its pixel.
    pub sample: u32,
    /// Point on the lens.
    pub origin: Vec3,
    /// One per segment, in order.
    pub vertices: Vec<PathVertex>,
    /// Radiance of the sample in the film, W·m⁻²·sr⁻¹.
    pub radiance: Vec3,
}

/// The paths of one wave, by slot.
#[derive(Debug, Default)]
pub struct Record {
    pub paths: Vec<TracedPath>,
    /// Radiance per slot at the last observation.
    before: Vec<Vec3>,
}

impl Record {
    /// Creates slots for these samples.
    pub fn new(samples: impl Iterator<Item = u32>) -> Self {
        let empty = |sample| TracedPath { sample, origin: Vec3::ZERO, vertices: Vec::new(), radiance: Vec3::ZERO };
        let paths: Vec<TracedPath> = samples.map(empty).collect();
        Self { before: vec![Vec3::ZERO; paths.len()], paths }
    }

    /// Records the ends of the rays of a depth, before shading.
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
            path.vertices.push(PathVertex { place, throughput, radiance: DVec3::ZERO, asked: None, chain: None });
        }
    }

    /// Records the light that a chain of specular surfaces has brought to the last vertex of a path: a change of the slot
    /// comes from it.
    ///
    /// - `ray`: from the last of these surfaces to the light; `between`: their number.
    pub fn see_chain(&mut self, scene: &Prepared, slot: u32, (ray, between): (&Ray, u32), radiance: &[Vec3]) {
        let gained = self.gained(slot as usize, radiance);
        let Some(light) = delta_light_of(scene, ray) else { return };
        let place = match ray.t_max.is_finite() {
            true => Place::Light { position: ray.at(ray.t_max), light },
            false => Place::Sky { direction: ray.dir },
        };
        let vertex = self.paths[slot as usize].vertices.last_mut().expect("its hit has been seen");
        vertex.chain = Some(Asked { source: LightSource::Delta(light), place, between, radiance: gained });
    }

    /// Records emission after shading: a change of the slot comes from the path's last vertex.
    pub fn see_shaded(&mut self, batch: &PathBatch, radiance: &[Vec3]) {
        for i in 0..batch.len() {
            let slot = batch.slot[i] as usize;
            let gained = self.gained(slot, radiance);
            let vertex = self.paths[slot].vertices.last_mut().expect("its hit has been seen");
            vertex.radiance = gained;
        }
    }

    /// Records light samples after the shadow rays: a change of the slot comes from them.
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
                // The ray ends just before the emitter without a hit but for panes, so the next hit behind it is the emitter.
                let emitter = scene.closest_hit_behind_panes(&Ray { t_max: f32::INFINITY, ..ray });
                let emitter = emitter.filter(|hit| scene.tables.lights.shines(hit.object, hit.prim));
                let object = emitter.map_or(HitBatch::MISS, |hit| hit.object);
                let source = emitter.map_or(LightSource::Rim, |hit| LightSource::Object(hit.object));
                (source, Place::Surface { position: ray.at(ray.t_max), object })
            };
            let vertex = self.paths[slot].vertices.last_mut().expect("its hit has been seen");
            vertex.asked = Some(Asked { source, place, between: 0, radiance: gained });
        }
    }

    /// Returns the paths after the end of the wave.
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

/// Returns the delta light to which a shadow ray leads; the first one if several coincide.
fn delta_light_of(scene: &Prepared, ray: &Ray) -> Option<u32> {
    let end = ray.at(ray.t_max);
    let is_its = |light: &DeltaLight| match light.origin() {
        // Shadow rays end before a point by a few roundings.
        Origin::At(position, _) => {
            let size = position.length() + ray.origin.length() + ray.dir.length();
            ray.t_max.is_finite() && end.distance(position) <= gamma(64) * size
        }
        Origin::Far(direction) => ray.t_max.is_infinite() && ray.dir == -direction,
    };
    scene.shading.delta_lights.iter().position(is_its).map(|light| light as u32)
}
