//! Features along camera paths: the first non-specular surface, seen through mirrors and smooth glass.
//!
//! The paths are those of the image: the same camera rays, and at specular surfaces the same random numbers, so that a
//! feature of a sample belongs to the radiance of that sample. No light is evaluated, and no path continues beyond the
//! first scattering surface. The features are the same for both integrators.
//!
//! Diffuse surfaces are handled sixteen at a time (`simd/first_hits.rs`), all others one by one. Start reading at
//! [`FeatureWave::trace`].

use crate::core::material::{Material, MaterialId};
use crate::core::settings::RenderSettings;
use crate::integrators::seen::Seen;
use crate::integrators::simd::first_hits::{DiffuseHits, see_diffuse};
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::albedo::visible_albedo;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE, first_dimension};
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::paths::{Path, PathBatch};
use crate::shading::principled::at::principled_at;
use crate::shading::scatter::{BsdfSample, Scatter};
use crate::shading::sides::Sides;
use crate::shading::simd::lanes::DIFFUSE;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::Vertex;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, InstructionSet, RayClass};
use glam::Vec3;

/// Number of segments after which a surface counts even if it is specular: paths between two parallel mirrors never
/// end.
const MOST_SEGMENTS: u32 = 32;

const MISSES: usize = 0;

/// Scratch memory of one worker.
#[derive(Default)]
pub(crate) struct FeatureWave {
    paths: PathBatch,
    next: PathBatch,
    hits: HitBatch,
    sorted: SortedHits,
    sets: MediumSets,
    camera: MediumId,
    seen: Vec<Seen>,
    /// Per slot: depth along the view axis so far in metres, and depth per metre of the present segment.
    way: Vec<(f32, f32)>,
    /// Whether the material is that of the surface that is seen, in mirrors and through glass too, instead of that which
    /// the camera ray hits.
    pub materials_beyond: bool,
}

impl FeatureWave {
    /// Sets the media in which the paths of an image start; must be called first.
    pub fn begin_in(&mut self, scene: &Prepared, camera_media: &[u32]) {
        self.camera = self.sets.start(scene, camera_media);
    }

    /// Traces the paths that `start` pushes, one per slot, with throughput 1, and returns the features of each slot.
    ///
    /// `None` if `stop` returned true.
    pub fn trace(
        &mut self,
        scene: &Prepared,
        settings: &RenderSettings,
        n_slots: usize,
        start: impl FnOnce(&mut PathBatch),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<&[Seen]> {
        let glass = scene.tables.features.glass;
        self.paths.start(n_slots, glass, false);
        start(&mut self.paths);
        self.paths.begin_in(self.camera);
        self.seen.clear();
        self.seen.resize(n_slots, Seen::NOTHING);
        self.way.resize(n_slots.max(self.way.len()), (0.0, 0.0));
        let most = settings.max_depth.min(MOST_SEGMENTS);
        for depth in 1..=most {
            if self.paths.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            scene.closest_hits(&self.paths.rays, class, &mut self.hits);
            scene.settle(&self.paths.rays, &mut self.hits);
            self.next.start(self.paths.len(), glass, false);
            self.see(scene, settings, depth, depth == most);
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(&self.seen)
    }

    fn see(&mut self, scene: &Prepared, settings: &RenderSettings, depth: u32, is_last: bool) {
        let set = settings.simd.unwrap_or(InstructionSet::Portable);
        self.sorted.sort(set, scene, &scene.tables.materials.kinds, &self.hits, self.paths.len());
        // Later segments are few, and have state.
        let in_lanes = depth == 1 && settings.simd.is_some() && !scene.tables.features.media;
        for kind in 0..KINDS {
            if kind == DIFFUSE + 1 && in_lanes {
                let order = self.sorted.of_kind(kind);
                let (paths, hits, materials) = (&self.paths, &self.hits, &self.sorted.materials);
                let group = DiffuseHits { scene, paths, hits, materials, order, seen: &mut self.seen };
                see_diffuse(set, group);
                continue;
            }
            for k in 0..self.sorted.of_kind(kind).len() {
                let i = self.sorted.of_kind(kind)[k] as usize;
                if kind == MISSES {
                    let slot = self.paths.slot[i] as usize;
                    self.seen[slot].albedo = self.paths.throughput_of(i);
                } else {
                    self.see_one(scene, depth, is_last, i);
                }
            }
        }
    }

    /// Handles one hit, and continues the path if the surface is specular.
    fn see_one(&mut self, scene: &Prepared, depth: u32, is_last: bool, i: usize) {
        let Some(hit) = self.hits.get(i) else { return };
        let (ray, mut path, material) = (self.paths.rays.get(i), self.paths.get(i), self.sorted.materials[i]);
        if scene.tables.features.media {
            path.throughput *= self.sets.transmittance(path.media, hit.t);
        }
        let slot = path.slot as usize;
        if depth == 1 {
            (self.seen[slot].object, self.seen[slot].material) = (hit.object, material);
            self.way[slot] = (0.0, ray.dir.dot(scene.camera.forward));
        }
        let (so_far, axial) = self.way[slot];
        let along = so_far + hit.t * axial;
        let at = Met { vertex: Vertex::new(scene, &ray, &hit, material), ray, hit, material };
        let vertex = &at.vertex;
        if !is_last && let Some(sample) = self.specular_bounce(scene, depth, &path, &at) {
            self.way[slot].0 = along;
            // Removes the n² scale of radiance, which is no colour.
            let squeeze = sample.through.map_or(1.0, |interface| interface.squeeze);
            path.throughput *= sample.weight / (squeeze * squeeze);
            let origin = match sample.through {
                Some(interface) => {
                    path.media = interface.beyond;
                    vertex.passing(sample.wi)
                }
                None => vertex.leaving(sample.wi),
            };
            self.next.push(&Ray::new(origin, sample.wi), &path);
            return;
        }
        let albedo = path.throughput * visible_albedo(scene, vertex, material);
        let seen = &mut self.seen[slot];
        (seen.albedo, seen.normal, seen.position) = (albedo, vertex.normal, vertex.position);
        seen.depth = along;
        if self.materials_beyond {
            seen.material = material;
        }
    }

    /// Samples the continuation at a purely specular surface, as in the image; `None` at all others.
    fn specular_bounce(&mut self, scene: &Prepared, depth: u32, path: &Path, at: &Met) -> Option<BsdfSample> {
        let Met { ray, hit, material: id, vertex } = at;
        let id = *id;
        let material = &scene.shading.materials[id as usize];
        if let Material::Diffuse { .. } | Material::Emissive { .. } = material {
            return None;
        }
        if let Some(emission) = scene.tables.emission[id as usize]
            && (vertex.front || emission.two_sided)
        {
            return None;
        }
        let mut sides = (scene.tables.features.glass)
            .then(|| Sides::new(scene, &mut self.sets, path.media, ray, hit, id, vertex.front));
        let first = first_dimension(depth);
        let sample = match material {
            Material::Principled { .. } => {
                bounce(&principled_at(scene, id, vertex, &mut sides.as_mut(), 0, true)?, vertex, &path.sampler, first)
            }
            Material::Blend { .. } | Material::Phong { .. } => {
                bounce(&blend_at(scene, id, vertex, sides.as_mut())?, vertex, &path.sampler, first)
            }
            _ => bounce(&lobe_at(scene, id, vertex, sides.as_mut())?, vertex, &path.sampler, first),
        }?;
        let passes = sample.through.is_some();
        let leads_on =
            if passes { sample.wi.dot(vertex.geometric_normal) < 0.0 } else { vertex.is_reached_from(sample.wi) };
        (leads_on && sample.weight != Vec3::ZERO).then_some(sample)
    }
}

/// A hit of a path.
struct Met {
    ray: Ray,
    hit: Hit,
    material: MaterialId,
    vertex: Vertex,
}

fn bounce(bsdf: &impl Scatter, vertex: &Vertex, sampler: &Sampler, first: u32) -> Option<BsdfSample> {
    if bsdf.has_non_specular() {
        return None;
    }
    let (u_lobe, u) = (|| sampler.single(first + DIM_LOBE), sampler.pair(first + DIM_DIRECTION));
    bsdf.sample(vertex.wo, vertex.normal, u_lobe, u)
}
