//! Unbiased path tracing, a wave of paths at a time.
//!
//! All paths of a wave are at the same depth: one batch of rays goes to the kernel, the hits are shaded, one batch of
//! shadow rays follows, and what survives is the next batch. Light is collected by next-event estimation and by
//! bounces, combined with the power heuristic (Veach 1997, chapter 9); smooth skies are left to bounces alone, which
//! find them as well as anything could. Paths end by Russian roulette, never by a limit unless one is asked for.
//! Start reading at [`PathWave::trace`].

use super::bsdf::Scatter;
use super::caustics::{Bounce, CausticPass, Guided, Track};
use super::light::LightSample;
use super::medium::MediumStack;
use super::renderer::{RayCounts, RenderSettings};
use super::surface::{Vertex, blend_at, lobe_at, material_of};
use super::{Material, MaterialId, Snapshot, Techniques};
use crate::geometry::Ray;
use crate::kdtree::{Hit, HitBatch, RayBatch, RayClass};
use crate::sampling::Sampler;
use glam::Vec3;

/// Segments before Russian roulette begins: the first bounces carry most of the light.
const ROULETTE_DEPTH: u32 = 5;

/// From here on even paths that lose nothing are ended now and then: between perfect mirrors they would go on for
/// ever.
const ENDLESS_DEPTH: u32 = 64;

/// Sample dimensions of the camera, and then of each vertex.
pub(super) const CAMERA_DIMENSIONS: u32 = 2;
const VERTEX_DIMENSIONS: u32 = 5;
const DIM_LIGHT_POINT: u32 = 0;
const DIM_DIRECTION: u32 = 1;
const DIM_LIGHT: u32 = 2;
const DIM_LOBE: u32 = 3;
const DIM_ROULETTE: u32 = 4;

/// A camera ray and where its light goes.
pub(super) struct CameraPath {
    pub ray: Ray,
    pub sampler: Sampler,
    pub slot: u32,
    /// Of what it finds, see [`super::filter`].
    pub weight: f32,
}

/// The state of one path between two bounces.
#[derive(Clone, Copy)]
struct Path {
    throughput: Vec3,
    /// Density per steradian with which the last vertex chose this direction; infinite if light sampling could not
    /// have.
    pdf: f32,
    /// The last vertex, for the density of light sampling there.
    position: Vec3,
    normal: Vec3,
    sampler: Sampler,
    slot: u32,
    media: MediumStack,
    /// Against paths from the lamps.
    track: Track,
}

/// Scratch memory of one worker: cleared between waves, never given back.
#[derive(Default)]
pub(super) struct PathWave {
    rays: RayBatch,
    paths: Vec<Path>,
    next_rays: RayBatch,
    next_paths: Vec<Path>,
    hits: HitBatch,
    /// Hits in the order in which they are shaded: by kind of material.
    order: Vec<u32>,
    kinds: Vec<u8>,
    shadow_rays: RayBatch,
    /// Slot and light of each shadow ray, if nothing is in its way.
    shadow_light: Vec<(u32, Vec3)>,
    occluded: Vec<bool>,
}

impl PathWave {
    /// Follows `camera_paths` to their ends and adds what they find to `radiance`, indexed by slot.
    ///
    /// `None` when `stop` said so; what is in `radiance` then is of no use.
    pub fn trace(
        &mut self,
        scene: &Snapshot,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        camera_paths: impl Iterator<Item = CameraPath>,
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        self.start(camera_paths);
        let mut counts = RayCounts { camera: self.rays.len() as u64, ..RayCounts::default() };
        for depth in 1..=settings.max_depth {
            if self.rays.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            // Camera rays run side by side, and so do the shadow rays of what they hit.
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            scene.geometry.tree.closest_hits(&self.rays, class, &mut self.hits);
            self.shade(scene, depth, settings, caustics, radiance);
            scene.geometry.tree.any_hits(&self.shadow_rays, class, &mut self.occluded);
            for (&(slot, light), &occluded) in self.shadow_light.iter().zip(&self.occluded) {
                if !occluded {
                    radiance[slot as usize] += light;
                }
            }
            counts.shadow += self.shadow_rays.len() as u64;
            counts.bounce += self.next_rays.len() as u64;
            std::mem::swap(&mut self.rays, &mut self.next_rays);
            std::mem::swap(&mut self.paths, &mut self.next_paths);
        }
        Some(counts)
    }

    fn start(&mut self, camera_paths: impl Iterator<Item = CameraPath>) {
        self.rays.clear();
        self.paths.clear();
        for CameraPath { ray, sampler, slot, weight } in camera_paths {
            self.rays.push(&ray);
            self.paths.push(Path {
                throughput: Vec3::splat(weight),
                pdf: f32::INFINITY,
                position: ray.origin,
                normal: ray.dir,
                sampler,
                slot,
                media: MediumStack::default(),
                track: Track::default(),
            });
        }
    }

    fn shade(
        &mut self,
        scene: &Snapshot,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        radiance: &mut [Vec3],
    ) {
        let techniques = &settings.techniques;
        self.next_rays.clear();
        self.next_paths.clear();
        self.shadow_rays.clear();
        self.shadow_light.clear();
        self.sort_by_material(scene);
        for k in 0..self.order.len() {
            let i = self.order[k] as usize;
            let mut path = self.paths[i];
            let ray = self.rays.get(i);
            let Some(hit) = self.hits.get(i) else {
                radiance[path.slot as usize] += path.throughput * environment_light(scene, techniques, &path, ray.dir);
                continue;
            };
            if scene.shading.features.media {
                path.throughput *= path.media.transmittance(scene, hit.t);
            }
            let material = material_of(scene, &hit);
            let vertex = Vertex::new(scene, &ray, &hit, material);
            if let Some(emission) = scene.shading.emission[material as usize]
                && vertex.front
            {
                let from_lamp = caustics.and_then(|pass| pass.eye_weight(&path.track, &path.media, &hit, &vertex));
                let weight = from_lamp.unwrap_or_else(|| emitter_weight(scene, techniques, &path, &hit, ray.dir));
                let weight = emission.scale * weight;
                radiance[path.slot as usize] += path.throughput * weight * emission.radiance.eval(scene, vertex.uv);
            }
            if depth == settings.max_depth {
                continue;
            }
            let step = Step {
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
            if let Material::Blend { .. } | Material::Phong { .. } = &scene.shading.materials[material as usize] {
                if let Some(blend) = blend_at(scene, material, &vertex, &path.media) {
                    self.scatter_told(step, &blend);
                }
            } else if let Some(lobe) = lobe_at(scene, material, &vertex, &path.media) {
                self.scatter_told(step, &lobe);
            }
        }
    }

    /// With hints, where there are any, of where gathered light comes from.
    #[inline]
    fn scatter_told(&mut self, step: Step, bsdf: &impl Scatter) {
        let Step { path, vertex, depth, .. } = step;
        let hints = step.caustics.filter(|_| bsdf.is_smooth());
        match hints.and_then(|pass| pass.hints(&path.track, depth, vertex.position)) {
            Some(hints) => self.scatter(Step { is_told: true, ..step }, &Guided { surface: bsdf, hints }),
            None => self.scatter(step, bsdf),
        }
    }

    #[inline]
    fn scatter(&mut self, step: Step, bsdf: &impl Scatter) {
        if step.scene.shading.features.light_sampling && step.techniques.light_sampling && bsdf.is_smooth() {
            self.sample_light(&step, bsdf);
        }
        self.bounce(&step, bsdf);
    }

    /// Hits of one kind of material follow each other, so that the processor finds them all alike.
    fn sort_by_material(&mut self, scene: &Snapshot) {
        let kind = |i: usize| match self.hits.get(i) {
            None => 0,
            Some(hit) => 1 + scene.shading.materials[material_of(scene, &hit) as usize].kind(),
        };
        let n = self.rays.len();
        let mut starts = [0u32; Material::KINDS + 2];
        let mut kinds = std::mem::take(&mut self.kinds);
        kinds.clear();
        kinds.extend((0..n).map(|i| kind(i) as u8));
        for &kind in &kinds {
            starts[usize::from(kind) + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        self.order.clear();
        self.order.resize(n, 0);
        for (i, &kind) in kinds.iter().enumerate() {
            let at = &mut starts[usize::from(kind)];
            self.order[*at as usize] = i as u32;
            *at += 1;
        }
        self.kinds = kinds;
    }

    /// Next-event estimation: one point on one light, and a shadow ray to it.
    #[inline]
    fn sample_light(&mut self, step: &Step, bsdf: &impl Scatter) {
        let &Step { scene, techniques, path, vertex, .. } = step;
        let (sampler, dimension) = (&path.sampler, step.dimension());
        let u = sampler.pair(dimension + DIM_LIGHT_POINT);
        let shading = &*scene.shading;
        let share = environment_share(scene);
        let mut u_select = None;
        let mut select = || *u_select.get_or_insert_with(|| sampler.single(dimension + DIM_LIGHT));
        let (target, sample) = if share > 0.0 && (share >= 1.0 || select() < share) {
            let environment = shading.environment_sampler.as_ref().expect("a share without a sampler");
            let Some((wi, pdf)) = environment.sample(u) else { return };
            let radiance = shading.environment.radiance(wi);
            (None, LightSample { target: wi, wi, pdf: pdf * share, radiance })
        } else {
            let u_light = || ((select() - share) / (1.0 - share)).clamp(0.0, 1.0f32.next_down());
            let found =
                shading.lights.sample(&shading.textures, techniques, vertex.position, vertex.normal, u_light, u);
            let Some(mut sample) = found else { return };
            sample.pdf *= 1.0 - share;
            (Some(sample.target), sample)
        };
        let (value, pdf) = bsdf.eval(vertex.wo, sample.wi, vertex.normal);
        if pdf <= 0.0 || !vertex.is_reached_from(sample.wi) {
            return;
        }
        let weight = light_weight(techniques, sample.pdf, pdf) / sample.pdf;
        let mut light = path.throughput * value * sample.radiance * weight;
        if light == Vec3::ZERO {
            return;
        }
        if shading.features.media
            && let Some(target) = target
        {
            light *= path.media.transmittance(scene, vertex.position.distance(target));
        }
        let origin = vertex.leaving(sample.wi);
        let shadow_ray = match target {
            // The direction spans the way to the light's own bounded point, where the ray ends: t = 1, excluded.
            Some(target) => Ray { origin, dir: target - origin, t_max: 1.0 },
            None => Ray::new(origin, sample.wi),
        };
        self.shadow_rays.push(&shadow_ray);
        self.shadow_light.push((path.slot, light));
    }

    /// Chooses how the path goes on, and whether.
    #[inline]
    fn bounce(&mut self, step: &Step, bsdf: &impl Scatter) {
        let &Step { scene, techniques, vertex, material, depth, .. } = step;
        let mut path = *step.path;
        let (sampler, dimension) = (path.sampler, step.dimension());
        let u = sampler.pair(dimension + DIM_DIRECTION);
        let u_lobe = || sampler.single(dimension + DIM_LOBE);
        let Some(sample) = bsdf.sample(vertex.wo, vertex.normal, u_lobe, u) else { return };
        // The true surface decides which side a direction leads to.
        let beyond = sample.wi.dot(vertex.geometric_normal) < 0.0;
        if if sample.transmitted { !beyond } else { !vertex.is_reached_from(sample.wi) } {
            return;
        }
        path.throughput *= sample.weight;
        if sample.transmitted {
            path.media = path.media.crossed(material, vertex.front);
        }
        if let Some(pass) = step.caustics {
            let bounce = Bounce {
                vertex,
                hit: step.hit,
                eye: (depth == 1).then_some(path.position),
                wi: sample.wi,
                pdf: sample.pdf,
                transmitted: sample.transmitted,
                blended: matches!(scene.shading.materials[material as usize], Material::Blend { .. }),
                before: step.path.media,
                after: path.media,
            };
            let track = if step.is_told { path.track.guided(sample.weight) } else { path.track };
            path.track = pass.follow(track, &bounce, || bsdf.eval(sample.wi, vertex.wo, vertex.normal).1);
        }
        if depth >= if techniques.roulette { ROULETTE_DEPTH } else { ENDLESS_DEPTH } {
            // Inside glass throughput carries 1/n², which the way out gives back: it must not count as loss.
            let ior = if scene.shading.features.glass { path.media.ior(scene) } else { 1.0 };
            let most = path.throughput.abs().max_element() * ior * ior * path.track.gain;
            let survival = if depth >= ENDLESS_DEPTH { most.min(0.95) } else { most.min(1.0) };
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
        path.normal = vertex.normal;
        let origin = if sample.transmitted { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        self.next_rays.push(&Ray::new(origin, sample.wi));
        self.next_paths.push(path);
    }
}

/// One vertex of one path.
struct Step<'a> {
    scene: &'a Snapshot,
    techniques: &'a Techniques,
    path: &'a Path,
    vertex: &'a Vertex,
    hit: &'a Hit,
    material: MaterialId,
    /// Segments so far.
    depth: u32,
    caustics: Option<&'a CausticPass<'a>>,
    /// Some directions are chosen by hints.
    is_told: bool,
}

impl Step<'_> {
    /// The first sample dimension of this vertex.
    fn dimension(&self) -> u32 {
        CAMERA_DIMENSIONS + (self.depth - 1) * VERTEX_DIMENSIONS
    }
}

/// Probability with which light sampling asks the environment rather than the finite lights.
#[inline]
fn environment_share(scene: &Snapshot) -> f32 {
    match (&scene.shading.environment_sampler, scene.shading.lights.is_empty()) {
        (None, _) => 0.0,
        (Some(_), true) => 1.0,
        (Some(_), false) => 0.5,
    }
}

/// Light from outside that a path runs into, weighted against light sampling having found it.
#[inline]
fn environment_light(scene: &Snapshot, techniques: &Techniques, path: &Path, dir: Vec3) -> Vec3 {
    if !scene.shading.features.environment {
        return Vec3::ZERO;
    }
    let radiance = scene.shading.environment.radiance(dir);
    match &scene.shading.environment_sampler {
        Some(sampler) if path.pdf.is_finite() => {
            radiance * bounce_weight(techniques, path.pdf, environment_share(scene) * sampler.pdf(dir))
        }
        _ => radiance,
    }
}

/// The same for an emitter that a path hits.
#[inline]
fn emitter_weight(scene: &Snapshot, techniques: &Techniques, path: &Path, hit: &Hit, dir: Vec3) -> f32 {
    let lights = &scene.shading.lights;
    if path.pdf.is_infinite() {
        return 1.0;
    }
    match lights.light_of(hit.object, hit.prim) {
        Some(id) => {
            let pdf = lights.pdf(techniques, id, path.position, path.normal, dir, hit.t);
            bounce_weight(techniques, path.pdf, (1.0 - environment_share(scene)) * pdf)
        }
        None => 1.0,
    }
}

/// Weight of light that light sampling found with density `own`, and a bounce would have found with `other`.
#[inline]
fn light_weight(techniques: &Techniques, own: f32, other: f32) -> f32 {
    if techniques.mis { power_heuristic(own, other) } else { 1.0 }
}

/// Weight of light that a bounce found with density `own`, and light sampling would have found with `other`.
#[inline]
fn bounce_weight(techniques: &Techniques, own: f32, other: f32) -> f32 {
    match (techniques.mis, other > 0.0) {
        (true, _) => power_heuristic(own, other),
        (false, can_be_sampled) => f32::from(!can_be_sampled),
    }
}

/// Weight of a sample found with density `own` that another method finds with density `other` (Veach 1997, β = 2).
#[inline]
fn power_heuristic(own: f32, other: f32) -> f32 {
    if other == 0.0 {
        return 1.0;
    }
    // By the ratio: squares of densities overflow for lights of a few pixels.
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}
