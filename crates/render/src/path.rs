//! Unbiased path tracing, a wave of paths at a time.
//!
//! All paths of a wave are at the same depth: one batch of rays goes to the kernel, the hits are shaded, one batch of
//! shadow rays follows, and what survives is the next batch. Light is collected by next-event estimation and by
//! bounces, combined with the power heuristic (Veach 1997, chapter 9); smooth skies are left to bounces alone, which
//! find them as well as anything could. Paths end by Russian roulette, never by a limit unless one is asked for.
//! Materials of one lobe are shaded sixteen hits at a time (`wide/`); what is here shades all others, and whatever is
//! asked of it as the reference. Start reading at [`PathWave::trace`].

use super::bsdf::Scatter;
use super::caustics::{Bounce, CausticPass, Guided, Track};
use super::explain::Record;
use super::light::LightSample;
use super::medium::{MediumId, MediumSets};
use super::paths::{Path, PathBatch, ShadowBatch};
use super::renderer::{RayCounts, RenderSettings};
use super::surface::{Sides, Vertex, blend_at, lobe_at};
use super::wide::{self, Group, KINDS, SortedHits};
use super::{Material, MaterialId, Snapshot, Techniques};
use crate::sampling::Sampler;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, InstructionSet, RayClass};
use glam::Vec3;

/// Segments before Russian roulette begins: the first bounces carry most of the light.
const ROULETTE_DEPTH: u32 = 4;

/// Paths that keep a quarter of their light and more are not ended: what they would still find is worth their cost.
pub(super) const ROULETTE_GRACE: f32 = 4.0;

/// From here on even paths that lose nothing are ended now and then: between perfect mirrors they would go on for
/// ever. The way through nested glass is as much longer as it is nested.
pub(super) fn endless_depth(scene: &Snapshot) -> u32 {
    64 * scene.shading.bodies.deepest().clamp(1, 128)
}

/// What is kept of such paths at each vertex, at most. Light that escapes from a body at a smaller rate than it is ended by this
/// comes too rarely to be seen, so it is close to 1.
pub(super) const ENDLESS_SURVIVAL: f32 = 0.99;

/// Sample dimensions of the camera, and then of each vertex.
pub(super) const CAMERA_DIMENSIONS: u32 = 2;
const VERTEX_DIMENSIONS: u32 = 5;
pub(super) const DIM_LIGHT_POINT: u32 = 0;
pub(super) const DIM_DIRECTION: u32 = 1;
pub(super) const DIM_LIGHT: u32 = 2;
pub(super) const DIM_LOBE: u32 = 3;
pub(super) const DIM_ROULETTE: u32 = 4;

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
            track: Track::default(),
        }
    }
}

/// A camera ray and where its light goes.
pub(super) struct CameraPath {
    pub ray: Ray,
    pub sampler: Sampler,
    pub slot: u32,
    /// Of what it finds, see [`super::filter`].
    pub weight: f32,
}

/// Whether, and how, paths end by chance at a depth.
#[derive(Clone, Copy)]
pub(super) struct Survival {
    /// The most that may be kept; `None` while all paths go on.
    pub share: Option<f32>,
}

impl Survival {
    fn at(depth: u32, scene: &Snapshot, techniques: &Techniques) -> Self {
        let share = match depth {
            _ if depth >= endless_depth(scene) => Some(ENDLESS_SURVIVAL),
            ROULETTE_DEPTH.. if techniques.roulette => Some(1.0),
            _ => None,
        };
        Self { share }
    }
}

/// Scratch memory of one worker: cleared between waves, never given back.
#[derive(Default)]
pub(super) struct PathWave {
    paths: PathBatch,
    next: PathBatch,
    hits: HitBatch,
    sorted: SortedHits,
    shadows: ShadowBatch,
    sets: MediumSets,
    camera: MediumId,
    /// Segments of the longest path of the last wave.
    pub depth: u32,
    /// Looks on, when somebody wants to know.
    pub record: Option<Box<Record>>,
}

/// Of hits, see [`SortedHits::of_kind`]; the others are one more than [`Material::kind`].
const MISSES: usize = 0;
const EMITTERS: usize = 1;

impl PathWave {
    /// Before the paths of a picture: they begin in these media, see [`super::medium::Bodies::around`].
    pub fn begin_in(&mut self, scene: &Snapshot, camera_media: &[u32]) {
        self.camera = self.sets.start(scene, camera_media);
    }

    /// Follows the paths that `start` pushes, one a slot at most, and adds what they find to `radiance`, indexed by
    /// slot.
    ///
    /// `None` when `stop` said so; what is in `radiance` then is of no use.
    pub fn trace(
        &mut self,
        scene: &Snapshot,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        start: impl FnOnce(&mut PathBatch),
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        self.paths.start(radiance.len(), scene.shading.features.glass, caustics.is_some());
        start(&mut self.paths);
        self.paths.begin_in(self.camera);
        let mut counts = RayCounts { camera: self.paths.len() as u64, ..RayCounts::default() };
        let tree = &scene.geometry.tree;
        for depth in 1..=settings.max_depth {
            if self.paths.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            self.depth = depth;
            // Camera rays run side by side, and so do the shadow rays of what they hit.
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            tree.closest_hits(&self.paths.rays, class, &mut self.hits);
            scene.shading.bodies.contacts.settle(scene, &self.paths.rays, &mut self.hits);
            if let Some(record) = &mut self.record {
                record.see_hits(&self.paths, &self.hits);
            }
            self.shade(scene, depth, settings, caustics, radiance);
            if let Some(record) = &mut self.record {
                record.see_shaded(&self.paths, radiance);
            }
            self.shadows.settle(radiance, |rays, occluded| tree.any_hits(rays, class, occluded));
            if let Some(record) = &mut self.record {
                record.see_settled(scene, &self.shadows, radiance);
            }
            counts.shadow += self.shadows.rays.len() as u64;
            counts.bounce += self.next.len() as u64;
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(counts)
    }

    fn shade(
        &mut self,
        scene: &Snapshot,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        radiance: &mut [Vec3],
    ) {
        self.next.start(self.paths.len(), scene.shading.features.glass, caustics.is_some());
        self.shadows.start(self.paths.len());
        let set = settings.lanes.unwrap_or(InstructionSet::Portable);
        let kinds = &scene.shading.material_table.kinds;
        self.sorted.sort(set, scene, kinds, &self.hits, self.paths.len());
        let is_last = depth == settings.max_depth;
        let emitters_have_lanes = scene.shading.lights.has_lanes()
            && !scene.shading.material_table.textured_emission
            && scene.shading.environment_sampler.is_none();
        for kind in 0..KINDS {
            let order = self.sorted.of_kind(kind);
            if order.is_empty() {
                continue;
            }
            let group = Group {
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
            match (settings.lanes, kind) {
                (Some(set), MISSES) if scene.shading.environment_sampler.is_none() => {
                    wide::shade_misses(set, scene, &self.paths, &self.sets, order, radiance);
                }
                (_, MISSES) => self.shade_misses(scene, &settings.techniques, radiance),
                (Some(set), EMITTERS) if emitters_have_lanes => wide::shade_emitters(set, group, radiance),
                // What emits no light and is the end of its path adds nothing.
                (Some(_), _) if wide::knows(kind - 1) && is_last => {}
                (Some(set), _) if wide::knows(kind - 1) => wide::shade(set, kind - 1, group),
                _ => {
                    for k in 0..order.len() {
                        let i = self.sorted.of_kind(kind)[k] as usize;
                        self.shade_one(scene, depth, settings, caustics, i, radiance);
                    }
                }
            }
        }
    }

    fn shade_misses(&mut self, scene: &Snapshot, techniques: &Techniques, radiance: &mut [Vec3]) {
        if !scene.shading.features.environment {
            return;
        }
        let always = scene.shading.environment_sampler.is_none();
        for &i in self.sorted.of_kind(MISSES) {
            let i = i as usize;
            let dir = self.paths.rays.get(i).dir;
            let mut throughput = self.paths.throughput_of(i);
            if scene.shading.features.glass {
                throughput *= self.sets.environment_scale(self.paths.media_of(i));
            }
            if always {
                // Bounces alone find it.
                radiance[self.paths.slot[i] as usize] += throughput * scene.shading.environment.radiance(dir);
                continue;
            }
            let path = self.paths.get(i);
            radiance[path.slot as usize] += throughput * environment_light(scene, techniques, &path, dir);
        }
    }

    /// Shades one hit: the light that it emits, a light sample and a bounce.
    fn shade_one(
        &mut self,
        scene: &Snapshot,
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
        if scene.shading.features.media {
            path.throughput *= self.sets.transmittance(path.media, hit.t);
        }
        let material = self.sorted.materials[i];
        let vertex = Vertex::new(scene, &ray, &hit, material);
        if let Some(emission) = scene.shading.emission[material as usize]
            && vertex.front
        {
            let from_lamp = caustics.and_then(|pass| pass.eye_weight(&path.track, path.media, &hit, &vertex));
            let weight = from_lamp.unwrap_or_else(|| emitter_weight(scene, techniques, &path, &hit, ray.dir));
            let weight = emission.scale * weight;
            radiance[path.slot as usize] += path.throughput * weight * emission.radiance.eval(scene, vertex.uv);
        }
        if depth == settings.max_depth {
            return;
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
        let mut sides = (scene.shading.features.glass)
            .then(|| Sides::new(scene, &mut self.sets, path.media, &ray, &hit, material, vertex.front));
        if let Material::Blend { .. } | Material::Phong { .. } = &scene.shading.materials[material as usize] {
            if let Some(blend) = blend_at(scene, material, &vertex, sides.as_mut()) {
                self.scatter_told(step, &blend);
            }
        } else if let Some(lobe) = lobe_at(scene, material, &vertex, sides.as_mut()) {
            self.scatter_told(step, &lobe);
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

    /// Next-event estimation: one point on one light, and a shadow ray to it.
    #[inline]
    fn sample_light(&mut self, step: &Step, bsdf: &impl Scatter) {
        let &Step { scene, techniques, path, vertex, .. } = step;
        let (sampler, dimension) = (&path.sampler, step.dimension());
        let shading = &*scene.shading;
        let found = choose_light_point(scene, techniques, vertex.position, vertex.normal, sampler, dimension);
        let Some((target, sample)) = found else { return };
        let (value, pdf) = bsdf.eval(vertex.wo, sample.wi, vertex.normal);
        if pdf <= 0.0 || !vertex.is_reached_from(sample.wi) {
            return;
        }
        let weight = light_weight(techniques, sample.pdf, pdf) / sample.pdf;
        let mut light = path.throughput * value * sample.radiance * weight;
        if light == Vec3::ZERO {
            return;
        }
        if shading.features.glass && target.is_none() {
            light *= self.sets.environment_scale(path.media);
        }
        if shading.features.media
            && let Some(target) = target
        {
            light *= self.sets.transmittance(path.media, vertex.position.distance(target));
        }
        let origin = vertex.leaving(sample.wi);
        let shadow_ray = match target {
            // The direction spans the way to the light's own bounded point, where the ray ends: t = 1, excluded.
            Some(target) => Ray { origin, dir: target - origin, t_max: 1.0 },
            None => Ray::new(origin, sample.wi),
        };
        self.shadows.push(&shadow_ray, path.slot, light);
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
        if if sample.through.is_some() { !beyond } else { !vertex.is_reached_from(sample.wi) } {
            return;
        }
        path.throughput *= sample.weight;
        if let Some(through) = sample.through {
            path.media = through.beyond;
        }
        if let Some(pass) = step.caustics {
            let bounce = Bounce {
                vertex,
                hit: step.hit,
                eye: (depth == 1).then_some(path.position),
                wi: sample.wi,
                pdf: sample.pdf,
                transmitted: sample.through.is_some(),
                blended: matches!(scene.shading.materials[material as usize], Material::Blend { .. }),
                before: step.path.media,
                after: path.media,
            };
            let track = if step.is_told { path.track.guided(sample.weight) } else { path.track };
            path.track = pass.follow(track, &bounce, || bsdf.eval(sample.wi, vertex.wo, vertex.normal).1);
        }
        if let Some(most_kept) = Survival::at(depth, scene, techniques).share {
            // Inside glass throughput carries 1/n², which the way out gives back: it must not count as loss.
            let ior = if scene.shading.features.glass { self.sets.ior(path.media) } else { 1.0 };
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
        path.normal = vertex.normal;
        let origin = if sample.through.is_some() { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        self.next.push(&Ray::new(origin, sample.wi), &path);
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
        first_dimension(self.depth)
    }
}

fn first_dimension(depth: u32) -> u32 {
    CAMERA_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS
}

/// A point on a light, or a direction to the surroundings: then there is no target. Takes two pairs of dimensions.
#[inline]
pub(super) fn choose_light_point(
    scene: &Snapshot,
    techniques: &Techniques,
    position: Vec3,
    normal: Vec3,
    sampler: &Sampler,
    dimension: u32,
) -> Option<(Option<Vec3>, LightSample)> {
    let u = sampler.pair(dimension + DIM_LIGHT_POINT);
    let shading = &*scene.shading;
    let share = environment_share(scene);
    let mut u_select = None;
    let mut select = || *u_select.get_or_insert_with(|| sampler.single(dimension + DIM_LIGHT));
    if share > 0.0 && (share >= 1.0 || select() < share) {
        let environment = shading.environment_sampler.as_ref().expect("a share without a sampler");
        let (wi, pdf) = environment.sample(u)?;
        let radiance = shading.environment.radiance(wi);
        return Some((None, LightSample { target: wi, wi, pdf: pdf * share, radiance }));
    }
    let u_light = || ((select() - share) / (1.0 - share)).clamp(0.0, 1.0f32.next_down());
    let mut sample = shading.lights.sample(&shading.textures, techniques, position, normal, u_light, u)?;
    sample.pdf *= 1.0 - share;
    Some((Some(sample.target), sample))
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
