//! Unbiased path tracing, a wave of paths at a time.
//!
//! All paths of a wave have the same depth: one batch of closest-hit queries, shading of the hits, one batch of shadow
//! rays; the surviving paths are the next batch. Direct light is found by light sampling (next-event estimation) and by
//! BSDF sampling, combined with the power heuristic (Veach 1997, chapter 9); smooth environments are left to BSDF
//! sampling, which finds them as well. Paths end by Russian roulette, without a depth limit unless requested. Common
//! materials are shaded sixteen hits at a time (`simd/`); the code here shades all others, and is the reference for the
//! SIMD code. Start reading at [`PathWave::trace`].

use crate::core::counts::RayCounts;
use crate::core::material::{Material, MaterialId};
use crate::core::settings::RenderSettings;
use crate::core::techniques::Techniques;
use crate::integrators::caustics::pass::CausticPass;
use crate::integrators::caustics::weight::MisBounce;
use crate::integrators::record::Record;
use crate::integrators::simd::shade::KindHits;
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::integrators::simd::{emitters, misses, shade};
use crate::integrators::survival::{ROULETTE_GRACE, Survival};
use crate::integrators::work::Work;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE, DIM_ROULETTE, first_dimension};
use crate::shading::guided::Guided;
use crate::shading::interface::MediumId;
use crate::shading::lights::{choose_light_point, emitter_weight, environment_light, light_weight};
use crate::shading::medium::MediumSets;
use crate::shading::mis_state::MisState;
use crate::shading::paths::{Path, PathBatch, ShadowBatch};
use crate::shading::principled::at::principled_at;
use crate::shading::scatter::Scatter;
use crate::shading::sides::Sides;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::Vertex;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, InstructionSet, RayClass};
use glam::Vec3;

impl From<CameraPath> for Path {
    fn from(CameraPath { ray, sampler, slot, weight }: CameraPath) -> Self {
        Self {
            throughput: Vec3::splat(weight),
            pdf: f32::INFINITY,
            position: ray.origin,
            normal: ray.dir,
            sampler,
            slot,
            media: MediumId::OUTSIDE,
            track: MisState::default(),
        }
    }
}

/// A camera ray and its destination.
pub(crate) struct CameraPath {
    pub ray: Ray,
    pub sampler: Sampler,
    pub slot: u32,
    /// Weight of its radiance, see [`crate::core::filter`].
    pub weight: f32,
}

/// Scratch memory of one worker: cleared between waves, never freed.
#[derive(Default)]
pub(crate) struct PathWave {
    paths: PathBatch,
    next: PathBatch,
    hits: HitBatch,
    sorted: SortedHits,
    shadows: ShadowBatch,
    sets: MediumSets,
    camera: MediumId,
    /// Segments of the longest path of the last wave.
    pub depth: u32,
    /// Records the paths if present.
    pub record: Option<Box<Record>>,
    /// Counts the cost if present.
    pub work: Option<Box<Work>>,
}

/// Index of misses in [`SortedHits::of_kind`]; materials have [`Material::kind`] + 1.
const MISSES: usize = 0;
const EMITTERS: usize = 1;

impl PathWave {
    /// Sets the media in which the paths of an image start, see [`crate::prepare::bodies::Bodies::around`]; must be
    /// called first.
    pub fn begin_in(&mut self, scene: &Prepared, camera_media: &[u32]) {
        self.camera = self.sets.start(scene, camera_media);
    }

    /// Traces the paths that `start` pushes, at most one per slot, and adds their radiance to `radiance`, indexed by
    /// slot.
    ///
    /// `None` if `stop` returned true; `radiance` is meaningless then.
    pub fn trace(
        &mut self,
        scene: &Prepared,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        start: impl FnOnce(&mut PathBatch),
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        self.paths.start(radiance.len(), scene.tables.features.glass, caustics.is_some());
        start(&mut self.paths);
        self.paths.begin_in(self.camera);
        let mut counts = RayCounts { camera: self.paths.len() as u64, ..RayCounts::default() };
        for depth in 1..=settings.max_depth {
            if self.paths.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            self.depth = depth;
            // Camera rays are coherent, and so are the shadow rays of their hits.
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            scene.closest_hits(&self.paths.rays, class, &mut self.hits);
            scene.settle(&self.paths.rays, &mut self.hits);
            if let Some(record) = &mut self.record {
                record.see_hits(&self.paths, &self.hits);
            }
            if let Some(work) = &mut self.work {
                work.add_rays(&self.hits, self.paths.len(), class);
                if depth > 1 && caustics.is_some_and(|pass| pass.guide().is_some()) {
                    work.add_told(scene, &self.paths, &self.hits);
                }
            }
            self.shade(scene, depth, settings, caustics, radiance);
            if let Some(record) = &mut self.record {
                record.see_shaded(&self.paths, radiance);
            }
            self.shadows.settle(radiance, |rays, occluded| scene.any_hits(rays, class, occluded));
            if let Some(record) = &mut self.record {
                record.see_settled(scene, &self.shadows, radiance);
            }
            counts.shadow += self.shadows.rays.len() as u64;
            if let Some(work) = &mut self.work {
                work.add_shadow_rays(self.shadows.rays.len());
            }
            counts.bounce += self.next.len() as u64;
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(counts)
    }

    fn shade(
        &mut self,
        scene: &Prepared,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        radiance: &mut [Vec3],
    ) {
        self.next.start(self.paths.len(), scene.tables.features.glass, caustics.is_some());
        self.shadows.start(self.paths.len());
        let set = settings.simd.unwrap_or(InstructionSet::Portable);
        let kinds = &scene.tables.materials.kinds;
        self.sorted.sort(set, scene, kinds, &self.hits, self.paths.len());
        let is_last = depth == settings.max_depth;
        let emitters_have_lanes = scene.tables.lights.has_lanes()
            && !scene.tables.materials.textured_emission
            && scene.tables.environment_sampler.is_none();
        for kind in 0..KINDS {
            let order = self.sorted.of_kind(kind);
            if order.is_empty() {
                continue;
            }
            let group = KindHits {
                scene,
                techniques: &settings.techniques,
                caustics,
                depth,
                dimension: first_dimension(depth),
                survival: Survival::at(depth, scene, &settings.techniques),
                paths: &self.paths,
                hits: &self.hits,
                materials: &self.sorted.materials,
                order,
                next: &mut self.next,
                shadows: &mut self.shadows,
                sets: &mut self.sets,
            };
            match (settings.simd, kind) {
                (Some(set), MISSES) if scene.tables.environment_sampler.is_none() => {
                    misses::shade_misses(set, scene, &self.paths, &self.sets, order, radiance);
                }
                (_, MISSES) => self.shade_misses(scene, &settings.techniques, radiance),
                (Some(set), EMITTERS) if emitters_have_lanes => emitters::shade_emitters(set, group, radiance),
                // Hits that do not emit and end their path contribute nothing.
                (Some(_), _) if shade::knows(kind - 1) && is_last => {}
                (Some(set), _) if shade::knows(kind - 1) => shade::shade(set, kind - 1, group),
                _ => {
                    for k in 0..order.len() {
                        let i = self.sorted.of_kind(kind)[k] as usize;
                        self.shade_one(scene, depth, settings, caustics, i, radiance);
                    }
                }
            }
        }
    }

    fn shade_misses(&mut self, scene: &Prepared, techniques: &Techniques, radiance: &mut [Vec3]) {
        if !scene.tables.features.environment {
            return;
        }
        let always = scene.tables.environment_sampler.is_none();
        for &i in self.sorted.of_kind(MISSES) {
            let i = i as usize;
            let dir = self.paths.rays.get(i).dir;
            let mut throughput = self.paths.throughput_of(i);
            if scene.tables.features.glass {
                throughput *= self.sets.environment_scale(self.paths.media_of(i));
            }
            if always {
                // Only BSDF sampling finds it.
                radiance[self.paths.slot[i] as usize] += throughput * scene.shading.environment.radiance(dir);
                continue;
            }
            let path = self.paths.get(i);
            radiance[path.slot as usize] += throughput * environment_light(scene, techniques, &path, dir);
        }
    }

    /// Shades one hit: emission, a light sample and a bounce.
    fn shade_one(
        &mut self,
        scene: &Prepared,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        i: usize,
        radiance: &mut [Vec3],
    ) {
        let techniques = &settings.techniques;
        let mut path = self.paths.get(i);
        let ray = self.paths.rays.get(i);
        let Some(hit) = self.hits.get(i) else { return };
        if scene.tables.features.media {
            path.throughput *= self.sets.transmittance(path.media, hit.t);
        }
        let material = self.sorted.materials[i];
        let vertex = Vertex::new(scene, &ray, &hit, material);
        if let Some(emission) = scene.tables.emission[material as usize]
            && (vertex.front || emission.two_sided)
        {
            let with_light_paths = caustics.and_then(|pass| pass.camera_weight(&path.track, path.media, &hit, &vertex));
            let weight = with_light_paths.unwrap_or_else(|| emitter_weight(scene, techniques, &path, &hit, &vertex));
            radiance[path.slot as usize] += path.throughput * weight * vertex.emitted(scene, &emission);
        }
        if depth == settings.max_depth {
            return;
        }
        let step = PathStep {
            scene,
            techniques,
            path: &path,
            vertex: &vertex,
            hit: &hit,
            material,
            depth,
            caustics,
            is_told: false,
        };
        let mut sides = (scene.tables.features.glass)
            .then(|| Sides::new(scene, &mut self.sets, path.media, &ray, &hit, material, vertex.front));
        let of_vertex = &scene.shading.materials[material as usize];
        if let Material::Principled { .. } = of_vertex {
            if let Some(layers) = principled_at(scene, material, &vertex, &mut sides.as_mut(), 0, true) {
                self.scatter_told(step, &layers);
            }
        } else if let Material::Blend { .. } | Material::Phong { .. } = of_vertex {
            if let Some(blend) = blend_at(scene, material, &vertex, sides.as_mut()) {
                self.scatter_told(step, &blend);
            }
        } else if let Some(lobe) = lobe_at(scene, material, &vertex, sides.as_mut()) {
            self.scatter_told(step, &lobe);
        }
    }

    /// Scatters with guiding distributions, if there are any.
    #[inline]
    fn scatter_told(&mut self, step: PathStep, bsdf: &impl Scatter) {
        let PathStep { path, vertex, depth, .. } = step;
        let hints = step.caustics.filter(|_| bsdf.has_non_specular());
        match hints.and_then(|pass| pass.hints(&path.track, depth, vertex.position)) {
            Some(hints) => self.scatter(PathStep { is_told: true, ..step }, &Guided { surface: bsdf, hints }),
            None => self.scatter(step, bsdf),
        }
    }

    #[inline]
    fn scatter(&mut self, step: PathStep, bsdf: &impl Scatter) {
        if step.scene.tables.features.light_sampling && step.techniques.light_sampling && bsdf.has_non_specular() {
            self.sample_light(&step, bsdf);
        }
        self.bounce(&step, bsdf);
    }

    /// Light sampling: one point on one light, and a shadow ray to it.
    #[inline]
    fn sample_light(&mut self, step: &PathStep, bsdf: &impl Scatter) {
        let &PathStep { scene, techniques, path, vertex, .. } = step;
        let (sampler, dimension) = (&path.sampler, step.dimension());
        let tables = &*scene.tables;
        let found = choose_light_point(scene, techniques, vertex.position, lit_side(vertex, bsdf), sampler, dimension);
        let Some((target, sample)) = found else { return };
        let (value, pdf) = bsdf.eval(vertex.wo, sample.wi, vertex.normal);
        let through = bsdf.through().filter(|_| sample.wi.dot(vertex.normal) < 0.0);
        if pdf <= 0.0 || !leads_on(vertex, sample.wi, through.is_some()) {
            return;
        }
        let media = through.map_or(path.media, |interface| interface.beyond);
        let weight = light_weight(techniques, sample.pdf, pdf) / sample.pdf;
        let mut light = path.throughput * value * sample.radiance * weight;
        if light == Vec3::ZERO {
            return;
        }
        if tables.features.glass && target.is_none() {
            light *= self.sets.environment_scale(media);
        }
        if tables.features.media
            && let Some(target) = target
        {
            light *= self.sets.transmittance(media, vertex.position.distance(target));
        }
        let origin = if through.is_some() { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        let shadow_ray = match target {
            // `dir` leads to the light's own bounded point, where the ray ends: t = 1, excluded.
            Some(target) => Ray { origin, dir: target - origin, t_max: 1.0 },
            None => Ray::new(origin, sample.wi),
        };
        self.shadows.push(&shadow_ray, path.slot, light);
    }

    /// Samples the continuation of the path, with Russian roulette.
    #[inline]
    fn bounce(&mut self, step: &PathStep, bsdf: &impl Scatter) {
        let &PathStep { scene, techniques, vertex, material, depth, .. } = step;
        let mut path = *step.path;
        let (sampler, dimension) = (path.sampler, step.dimension());
        let u = sampler.pair(dimension + DIM_DIRECTION);
        let u_lobe = || sampler.single(dimension + DIM_LOBE);
        let Some(sample) = bsdf.sample(vertex.wo, vertex.normal, u_lobe, u) else { return };
        if !leads_on(vertex, sample.wi, sample.through.is_some()) {
            return;
        }
        path.throughput *= sample.weight;
        if let Some(through) = sample.through {
            path.media = through.beyond;
        }
        if let Some(pass) = step.caustics {
            let bounce = MisBounce {
                vertex,
                hit: step.hit,
                eye: (depth == 1).then_some(path.position),
                wi: sample.wi,
                pdf: sample.pdf,
                through: sample.through,
                blended: scene.shading.materials[material as usize].is_blended(),
                before: step.path.media,
                after: path.media,
            };
            let track = if step.is_told { path.track.guided(sample.weight) } else { path.track };
            path.track = pass.follow(track, &bounce, || {
                let normal =
                    if sample.through.is_some() { vertex.normal_from_behind(sample.wi) } else { vertex.normal };
                bsdf.eval(sample.wi, vertex.wo, normal).1
            });
        }
        if let Some(most_kept) = Survival::at(depth, scene, techniques).share {
            // Throughput inside glass contains 1/n², which is restored on leaving: it must not count as a loss.
            let ior = if scene.tables.features.glass { self.sets.ior(path.media) } else { 1.0 };
            let most = ROULETTE_GRACE * path.throughput.abs().max_element() * ior * ior * path.track.gain;
            let survival = most.min(most_kept);
            if survival < 1.0 {
                if sampler.single(dimension + DIM_ROULETTE) >= survival {
                    return;
                }
                path.throughput /= survival;
            }
        }
        if path.throughput == Vec3::ZERO {
            return;
        }
        path.pdf = if techniques.light_sampling { sample.pdf } else { f32::INFINITY };
        path.position = vertex.position;
        path.normal = lit_side(vertex, bsdf);
        let origin = if sample.through.is_some() { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        self.next.push(&Ray::new(origin, sample.wi), &path);
    }
}

/// The side for light sampling: the normal, or zero for both sides.
#[inline]
fn lit_side(vertex: &Vertex, bsdf: &impl Scatter) -> Vec3 {
    if bsdf.through().is_some() { Vec3::ZERO } else { vertex.normal }
}

/// Whether a direction leads to the intended side of the true surface.
#[inline]
fn leads_on(vertex: &Vertex, wi: Vec3, passes: bool) -> bool {
    if passes { wi.dot(vertex.geometric_normal) < 0.0 } else { vertex.is_reached_from(wi) }
}

/// One vertex of one path.
struct PathStep<'a> {
    scene: &'a Prepared,
    techniques: &'a Techniques,
    path: &'a Path,
    vertex: &'a Vertex,
    hit: &'a Hit,
    material: MaterialId,
    /// Number of segments so far.
    depth: u32,
    caustics: Option<&'a CausticPass<'a>>,
    /// Whether directions are sampled with guiding.
    is_told: bool,
}

impl PathStep<'_> {
    /// First sample dimension of this vertex.
    fn dimension(&self) -> u32 {
        first_dimension(self.depth)
    }
}
