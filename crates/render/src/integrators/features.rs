//! Features along camera paths: the first non-specular surface, seen through mirrors and smooth glass.
//!
//! The paths are those of the image: the same camera rays, and at specular surfaces the same random numbers, so that a
//! feature of a sample belongs to the radiance of that sample. No light is evaluated, and no path continues beyond the
//! first scattering surface. The features are the same for both integrators.
//!
//! What guides the denoiser must have as little noise as possible: there both the reflected and the refracted path of
//! the first glass are followed, mixed by their probabilities, and later the more probable one.
//!
//! Diffuse and layered surfaces are handled sixteen at a time (`simd/first_hits.rs`), all others one by one. Start reading at
//! [`FeatureWave::trace`].

use crate::core::material::{Material, MaterialId};
use crate::core::settings::RenderSettings;
use crate::integrators::common::seen::Seen;
use crate::integrators::simd::first_hits::{FirstHits, see_first_hits};
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::integrators::visible_albedo::visible_albedo;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE, first_dimension};
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::paths::{Path, PathBatch};
use crate::shading::principled::at::principled_at;
use crate::shading::scatter::{BsdfSample, Scatter};
use crate::shading::sides::Sides;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::Vertex;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, InstructionSet, RayClass};
use glam::Vec3;

/// Number of segments after which a surface counts even if it is specular: paths between two parallel mirrors never
/// end.
const MOST_SEGMENTS: u32 = 32;

const MISSES: usize = 0;

/// A second path from the first surface of a slot.
struct FeatureBranch {
    /// Of the camera ray.
    slot: u32,
    /// Probability of this path, 0..1.
    share: f32,
}

/// What features are for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum FeatureUse {
    /// Feature buffers that are saved.
    #[default]
    Saved,
    /// The denoiser: free of the noise of glass as far as possible, with emitted light, and with the material of the
    /// surface that is seen, in mirrors and through glass too, instead of that which the camera ray hits; an emitter's if
    /// there is one.
    Denoiser,
    /// Light that is put on surfaces: as for the denoiser, with the albedo of what scatters light alone, so black where an
    /// emitter or the environment is seen.
    Relighting,
}

impl FeatureUse {
    /// Whether features are not saved, but make an image.
    fn makes_image(self) -> bool {
        self != Self::Saved
    }
}

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
    /// Hits that are not handled sixteen at a time.
    left: Vec<u32>,
    /// Per slot: depth along the view axis so far in metres, and depth per metre of the present segment.
    way: Vec<(f32, f32)>,
    /// The second paths of slots, in slots of their own.
    branches: Vec<FeatureBranch>,
    purpose: FeatureUse,
}

impl FeatureWave {
    /// Sets the media in which the paths of an image start; must be called first.
    pub fn begin_in(&mut self, scene: &Prepared, camera_media: &[u32], purpose: FeatureUse) {
        self.camera = self.sets.start(scene, camera_media);
        self.purpose = purpose;
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
        self.branches.clear();
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
            let most_next =
                if depth == 1 && self.purpose.makes_image() { 2 * self.paths.len() } else { self.paths.len() };
            self.next.start(most_next, glass, false);
            self.see(scene, settings, depth, depth == most);
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        let emits = |id: MaterialId| scene.tables.emission.get(id as usize).is_some_and(Option::is_some);
        for (branch, k) in self.branches.iter().zip(n_slots..) {
            let (first, second) = (self.seen[branch.slot as usize], self.seen[k]);
            let material = if emits(second.material) { second.material } else { first.material };
            self.seen[branch.slot as usize] = Seen { material, ..first.mixed_with(&second, branch.share) };
        }
        Some(&self.seen[..n_slots])
    }

    fn see(&mut self, scene: &Prepared, settings: &RenderSettings, depth: u32, is_last: bool) {
        let set = settings.simd.unwrap_or(InstructionSet::Portable);
        self.sorted.sort(set, scene, &scene.tables.materials.kinds, &self.hits, self.paths.len());
        // Later segments are few, and have state.
        let in_lanes = depth == 1 && settings.simd.is_some() && !scene.tables.features.media;
        for kind in 0..KINDS {
            if kind != MISSES && in_lanes {
                let order = self.sorted.of_kind(kind);
                let (paths, hits, materials) = (&self.paths, &self.hits, &self.sorted.materials);
                let (seen, left) = (&mut self.seen[..], &mut self.left);
                let group = FirstHits { scene, paths, hits, materials, order, seen, left };
                if see_first_hits(set, kind - 1, group) {
                    for k in 0..self.left.len() {
                        self.see_one(scene, depth, is_last, self.left[k] as usize);
                    }
                    self.left.clear();
                    continue;
                }
            }
            for k in 0..self.sorted.of_kind(kind).len() {
                let i = self.sorted.of_kind(kind)[k] as usize;
                if kind == MISSES {
                    let slot = self.paths.slot[i] as usize;
                    let seen = &mut self.seen[slot];
                    seen.albedo = self.paths.throughput_of(i);
                    if self.purpose.makes_image() {
                        let dir = self.paths.rays.get(i).dir;
                        seen.emitted = seen.albedo * scene.shading.environment.radiance(dir);
                    }
                    if self.purpose == FeatureUse::Relighting {
                        seen.albedo = Vec3::ZERO;
                    }
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
        if !is_last && let Some(Bounces { first, second }) = self.specular_bounces(scene, depth, &path, &at) {
            self.way[slot].0 = along;
            self.go_on(&path, vertex, &first);
            if let Some(second) = second {
                self.branches.push(FeatureBranch {
                    slot: path.slot,
                    share: second.probability / (first.probability + second.probability),
                });
                path.slot = self.seen.len() as u32;
                self.seen.push(self.seen[slot]);
                self.way.resize(self.way.len().max(self.seen.len()), (0.0, 0.0));
                self.way[path.slot as usize] = self.way[slot];
                self.go_on(&path, vertex, &second);
            }
            return;
        }
        let emission = scene.tables.emission[material as usize].filter(|light| vertex.front || light.two_sided);
        let albedo = match self.purpose {
            FeatureUse::Relighting if emission.is_some() => Vec3::ZERO,
            _ => path.throughput * visible_albedo(scene, vertex, material),
        };
        let seen = &mut self.seen[slot];
        (seen.albedo, seen.normal, seen.position) = (albedo, vertex.normal, vertex.position);
        seen.depth = along;
        if self.purpose.makes_image() {
            seen.material = material;
            seen.emitted = emission.map_or(Vec3::ZERO, |emission| path.throughput * vertex.emitted(scene, &emission));
        }
    }

    /// Continues a path from a specular surface.
    fn go_on(&mut self, path: &Path, vertex: &Vertex, sample: &BsdfSample) {
        let mut path = *path;
        // Removes the n² scale of radiance, which is no colour.
        let radiance_eta = sample.through.map_or(1.0, |interface| interface.radiance_eta);
        path.throughput *= sample.weight / (radiance_eta * radiance_eta);
        let origin = match sample.through {
            Some(interface) => {
                path.media = interface.beyond;
                vertex.passing(sample.wi)
            }
            None => vertex.leaving(sample.wi),
        };
        self.next.push(&Ray::new(origin, sample.wi), &path);
    }

    /// Samples the continuations at a purely specular surface; `None` at all others, or if no path goes on.
    fn specular_bounces(&mut self, scene: &Prepared, depth: u32, path: &Path, at: &Met) -> Option<Bounces> {
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
        let lobes = match (self.purpose.makes_image(), depth) {
            (false, _) => Lobes::AsInImage,
            (true, 1) => Lobes::Both,
            (true, _) => Lobes::MoreProbable,
        };
        let mut sides = (scene.tables.features.glass)
            .then(|| Sides::new(scene, &mut self.sets, path.media, ray, hit, id, vertex.front));
        match material {
            Material::Principled { .. } => {
                let bsdf = principled_at(scene, id, vertex, &mut sides.as_mut(), 0, true)?;
                bounces(&bsdf, vertex, &path.sampler, depth, lobes)
            }
            Material::Blend { .. } | Material::Phong { .. } => {
                bounces(&blend_at(scene, id, vertex, sides.as_mut())?, vertex, &path.sampler, depth, lobes)
            }
            _ => bounces(&lobe_at(scene, id, vertex, sides.as_mut())?, vertex, &path.sampler, depth, lobes),
        }
    }
}

/// A hit of a path.
struct Met {
    ray: Ray,
    hit: Hit,
    material: MaterialId,
    vertex: Vertex,
}

/// Which lobes of a specular surface are followed.
#[derive(Clone, Copy)]
enum Lobes {
    /// That of the image, at random.
    AsInImage,
    /// The more probable of two.
    MoreProbable,
    /// The first and the last one, if they differ.
    Both,
}

/// Continuations of a path.
struct Bounces {
    first: BsdfSample,
    second: Option<BsdfSample>,
}

/// Returns `None` if the surface is not purely specular, or no path goes on.
fn bounces(bsdf: &impl Scatter, vertex: &Vertex, sampler: &Sampler, depth: u32, lobes: Lobes) -> Option<Bounces> {
    if bsdf.has_non_specular() {
        return None;
    }
    let dimension = first_dimension(depth);
    let u = sampler.pair(dimension + DIM_DIRECTION);
    let sample = |u_lobe: &dyn Fn() -> f32| {
        let sample = bsdf.sample(vertex.wo, vertex.normal, u_lobe, u)?;
        let leads_on = match sample.through {
            Some(_) => sample.wi.dot(vertex.geometric_normal) < 0.0,
            None => vertex.is_reached_from(sample.wi),
        };
        (leads_on && sample.weight != Vec3::ZERO).then_some(sample)
    };
    let only = |first: BsdfSample| Bounces { first, second: None };
    match lobes {
        Lobes::AsInImage => sample(&|| sampler.single(dimension + DIM_LOBE)).map(only),
        Lobes::MoreProbable => sample(&|| 0.5).map(only),
        Lobes::Both => match (sample(&|| 0.0), sample(&|| 1.0f32.next_down())) {
            (Some(first), Some(second)) => Some(Bounces { first, second: (second.wi != first.wi).then_some(second) }),
            (one, other) => one.or(other).map(only),
        },
    }
}
