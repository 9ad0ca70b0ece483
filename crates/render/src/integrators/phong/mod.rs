//! The classic local model, a wave of rays at a time: Phong 1975 for direct light, Whitted 1980 for mirrors and glass.
//!
//! Each light adds a diffuse part, a highlight, and a small ambient share to surfaces that it cannot reach. Lights with
//! an area are sampled at one new point per sample, so that soft shadows converge; point lights cast hard shadows.
//! Smooth environments add ambient light without shadows. Mirrors and glass send reflected and refracted rays until
//! their weight is small; then Russian roulette decides, without bias (Arvo and Kirk 1990). All rays of a wave at the
//! same depth are traced in one batch.
//!
//! Hits on diffuse surfaces, and on those with one part that sends a ray, are shaded sixteen at a time
//! (`simd/classic.rs`). The code here shades all others, and is the reference for the SIMD code.
//!
//! Unlike [`crate::integrators::path`], it leaves out light from one diffuse surface to another, and caustics. Start
//! reading at [`PhongWave::trace`].

mod classic;
mod finish;
pub(crate) mod lobe;
pub(crate) mod shadow;

use crate::core::counts::RayCounts;
use crate::core::settings::RenderSettings;
use crate::integrators::common::survival::{ENDLESS_SURVIVAL, endless_depth};
use crate::integrators::phong::classic::ClassicGroup;
use crate::integrators::phong::finish::{Finish, Shiny};
use crate::integrators::phong::lobe::*;
use crate::integrators::phong::shadow::Shadows;
use crate::integrators::simd::misses::{self, Misses};
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::prepare::prepared::Prepared;
use crate::shading::dielectric::{fresnel, refract};
use crate::shading::interface::Interface;
use crate::shading::lights::power_heuristic;
use crate::shading::medium::MediumSets;
use crate::shading::paths::{Path, PathBatch};
use crate::shading::sides::Sides;
use crate::shading::vertex::{Vertex, material_of};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{HitBatch, RayClass};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Returns the MIS weight of a light that the ray of a path hits, where light sampling from a position has the pdf
/// `asked`.
#[inline]
fn share_of_light(path: &Path, asked: impl FnOnce(Vec3) -> f32) -> f32 {
    match path.pdf {
        f32::INFINITY => 1.0,
        DIRECT_ALREADY_SAMPLED => 0.0,
        pdf => power_heuristic(pdf, asked(path.position)),
    }
}

/// Index of misses in [`SortedHits::of_kind`]; the kinds of the table follow.
const MISSES: usize = 0;

/// Scratch memory of one worker: cleared between waves, never freed.
#[derive(Default)]
pub(crate) struct PhongWave {
    paths: PathBatch,
    next: PathBatch,
    hits: HitBatch,
    sorted: SortedHits,
    shadows: Shadows,
    sets: MediumSets,
}

impl PhongWave {
    /// Traces the paths that `start` pushes, at most one per slot, and adds their radiance to `radiance`, indexed by
    /// slot.
    ///
    /// The maximum depth counts as for path tracing: a light seen in two mirrors is three segments away. `None` if
    /// `stop` returned true; `radiance` is meaningless then.
    pub fn trace(
        &mut self,
        scene: &Prepared,
        settings: &RenderSettings,
        camera_media: &[u32],
        start: impl FnOnce(&mut PathBatch),
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        self.paths.start(radiance.len(), scene.tables.features.glass, false);
        start(&mut self.paths);
        let camera = self.sets.start(scene, camera_media);
        self.paths.begin_in(camera);
        let mut counts = RayCounts { camera: self.paths.len() as u64, ..RayCounts::default() };
        for depth in 1..=settings.max_depth {
            if self.paths.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            scene.closest_hits(&self.paths.rays, class, &mut self.hits);
            scene.settle(&self.paths.rays, &mut self.hits);
            self.shade(scene, depth, settings, radiance);
            counts.shadow += self.shadows.cast(scene, &mut self.sets, class, radiance);
            counts.bounce += self.next.len() as u64;
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(counts)
    }

    fn shade(&mut self, scene: &Prepared, depth: u32, settings: &RenderSettings, radiance: &mut [Vec3]) {
        let tables = &*scene.tables;
        let (n, is_last) = (self.paths.len(), depth == settings.max_depth);
        self.next.start(n, tables.features.glass, false);
        let n_lights = tables.lights.n_each() + usize::from(tables.environment_sampler.is_some());
        self.shadows.start(scene, n_lights, n);
        let mut finish = Finish::new();
        let Some(set) = settings.simd else {
            for i in 0..n {
                self.shade_one(scene, depth, is_last, i, &mut finish, radiance);
            }
            return;
        };
        let kinds = &tables.classic.kinds;
        self.sorted.sort(set, scene, kinds, &self.hits, n);
        for kind in 0..KINDS {
            let order = self.sorted.of_kind(kind);
            if order.is_empty() {
                continue;
            }
            if kind == MISSES && tables.environment_sampler.is_none() {
                let (techniques, paths, sets) = (&settings.techniques, &self.paths, &self.sets);
                let misses = Misses { scene, techniques, caustics: None, paths, sets, order, radiance };
                misses::shade_misses(set, misses);
                continue;
            }
            if kind > MISSES && classic::knows_classic(scene, kind as u32 - 1) {
                // Hits that do not emit and end their path contribute nothing.
                if is_last {
                    continue;
                }
                self.next.make_room(order.len());
                let group = ClassicGroup {
                    scene,
                    kind: kind as u32 - 1,
                    depth,
                    dimension: first_dimension(depth),
                    paths: &self.paths,
                    hits: &self.hits,
                    materials: &self.sorted.materials,
                    order,
                    next: &mut self.next,
                    shadows: &mut self.shadows,
                    sets: &self.sets,
                    radiance: &mut *radiance,
                };
                classic::shade_classic(set, group);
                continue;
            }
            for k in 0..order.len() {
                let i = self.sorted.of_kind(kind)[k] as usize;
                self.shade_one(scene, depth, is_last, i, &mut finish, radiance);
            }
        }
    }

    /// Shades one hit or miss.
    fn shade_one(
        &mut self,
        scene: &Prepared,
        depth: u32,
        is_last: bool,
        i: usize,
        finish: &mut Finish,
        radiance: &mut [Vec3],
    ) {
        let tables = &*scene.tables;
        let mut path = self.paths.get(i);
        let ray = self.paths.rays.get(i);
        let slot = path.slot as usize;
        let Some(hit) = self.hits.get(i) else {
            if tables.features.environment {
                let sampler = &tables.environment_sampler;
                let share = sampler.as_ref().map_or(1.0, |sampler| share_of_light(&path, |_| sampler.pdf(ray.dir)));
                let throughput = path.throughput * self.sets.environment_scale(path.media);
                radiance[slot] += throughput * share * scene.shading.environment.radiance(ray.dir);
            }
            return;
        };
        if tables.features.media {
            path.throughput *= self.sets.transmittance(path.media, hit.t);
        }
        let material = material_of(scene, &hit);
        let vertex = Vertex::new(scene, &ray, &hit, material);
        if let Some(emission) = tables.emission[material as usize]
            && (vertex.front || emission.two_sided)
        {
            let share = match tables.lights.light_of(hit.object, hit.prim, vertex.front) {
                None => 1.0,
                // A point light is visible to the camera only: in a mirror its sphere would be a speck that few samples
                // hit.
                Some(id) if depth > 1 && tables.lights.is_point(id) => 0.0,
                Some(id) => share_of_light(&path, |from| {
                    tables.lights.pdf_each(id, from, ray.dir, from.distance(vertex.position))
                }),
            };
            radiance[slot] += path.throughput * share * vertex.emitted(scene, &emission);
        }
        if is_last {
            return;
        }
        let step = PhongStep { scene, path: &path, vertex: &vertex, depth };
        let glass = tables.features.glass;
        let mut sides =
            glass.then(|| Sides::new(scene, &mut self.sets, path.media, &ray, &hit, material, vertex.front));
        finish.look_up(scene, material, &vertex, sides.as_mut());
        if finish.is_lit() {
            radiance[slot] += path.throughput * self.light(&step, finish);
        }
        // A pane sends two.
        self.next.make_room(2 * finish.shiny().len());
        for (k, shiny) in finish.shiny().iter().enumerate() {
            self.send(&step, shiny, step.dimension() + DIM_SHINY + 3 * k as u32);
        }
    }

    /// Returns ambient light; direct light waits for its shadow rays.
    fn light(&mut self, step: &PhongStep, finish: &Finish) -> Vec3 {
        let PhongStep { scene, path, vertex, .. } = *step;
        let tables = &*scene.tables;
        let mirrored = vertex.mirrored();
        let sets = &self.sets;
        let mut ambient = Vec3::ZERO;
        let mut direct = |k: usize, radiance: Vec3, wi: Vec3, target: Option<Vec3>, pdf: Option<f32>| {
            if !vertex.is_reached_from(wi) {
                return;
            }
            let light = path.throughput * finish.reflected(wi, vertex.normal, mirrored, pdf) * radiance;
            if light != Vec3::ZERO {
                self.shadows.push(k, path, light, vertex.leaving(wi), wi, target);
            }
        };
        let dimension = step.dimension();
        tables.lights.sample_each(
            &scene.shading.textures,
            vertex.position,
            &path.sampler,
            dimension,
            |k, sample, is_point| {
                let mut arriving = sample.radiance / sample.pdf;
                if tables.features.media && !sample.is_far {
                    arriving *= sets.transmittance(path.media, vertex.position.distance(sample.target));
                }
                let target = (!sample.is_far).then_some(sample.target);
                ambient += finish.ambient * arriving * (AMBIENT_SHARE * FRAC_1_PI);
                direct(k, arriving, sample.wi, target, (!is_point).then_some(sample.pdf));
            },
        );
        if let Some(environment) = &tables.environment_sampler {
            if let Some((wi, pdf)) = environment.sample(path.sampler.pair(dimension + DIM_ENVIRONMENT)) {
                let arriving = scene.shading.environment.radiance(wi) / pdf;
                direct(tables.lights.n_each(), arriving, wi, None, Some(pdf));
            }
        } else if tables.features.environment {
            let scale = sets.environment_scale(path.media);
            ambient += finish.ambient * Vec3::from(tables.ambient.radiance(vertex.normal.into())) * scale;
        }
        ambient
    }

    /// Sends the rays of a mirror, a highlight or glass.
    fn send(&mut self, step: &PhongStep, shiny: &Shiny, dimension: u32) {
        let PhongStep { path, vertex, .. } = *step;
        match *shiny {
            Shiny::Mirror { tint } => {
                self.follow(step, path.throughput * tint, vertex.mirrored(), None, f32::INFINITY, dimension);
            }
            Shiny::Gloss { tint, exponent, rough } => {
                let mirrored = vertex.mirrored();
                let weight = path.throughput * tint;
                if rough {
                    let u = path.sampler.pair(dimension + 1).to_array();
                    let wi = Vec3::from(within_lobe(mirrored.into(), exponent, u));
                    if vertex.is_reached_from(wi) && wi.dot(vertex.normal) > 0.0 {
                        let pdf = lobe_pdf(exponent, mirrored.dot(wi));
                        self.follow(step, weight, wi, None, pdf, dimension);
                        return;
                    }
                    // Directions below the surface are replaced by the centre of the lobe.
                }
                self.follow(step, weight, mirrored, None, DIRECT_ALREADY_SAMPLED, dimension);
            }
            Shiny::Pane { share, interface } => {
                let Interface { eta, radiance_eta, .. } = interface;
                let (reflectance, cos_t) = fresnel(vertex.normal.dot(vertex.wo).clamp(0.0, 1.0), eta);
                let weight = path.throughput * share;
                self.follow(step, weight * reflectance, vertex.mirrored(), None, f32::INFINITY, dimension);
                if reflectance < 1.0 {
                    let wi = refract(vertex.wo.into(), vertex.normal.into(), eta, cos_t).into();
                    // Radiance scales with n² across the interface: the factor η².
                    let weight = weight * ((1.0 - reflectance) * radiance_eta * radiance_eta);
                    self.follow(step, weight, wi, Some(interface), f32::INFINITY, dimension + 2);
                }
            }
        }
    }

    /// - `through`: the interface that is passed, if any; `pdf`: see [`DIRECT_ALREADY_SAMPLED`].
    fn follow(
        &mut self,
        step: &PhongStep,
        mut weight: Vec3,
        wi: Vec3,
        through: Option<Interface>,
        pdf: f32,
        dimension: u32,
    ) {
        let PhongStep { scene, path, vertex, depth } = *step;
        // The true surface decides to which side a direction leads.
        let reached =
            if through.is_some() { wi.dot(vertex.geometric_normal) < 0.0 } else { vertex.is_reached_from(wi) };
        if !reached {
            return;
        }
        let media = through.map_or(path.media, |interface| interface.beyond);
        // Weights inside glass contain 1/n², which is restored on leaving: it must not count as a loss.
        let ior = self.sets.ior(media);
        let most = weight.abs().max_element() * ior * ior / least_weight(depth);
        let survival = if depth >= endless_depth(scene) { most.min(ENDLESS_SURVIVAL) } else { most.min(1.0) };
        if survival < 1.0 {
            if path.sampler.single(dimension) >= survival {
                return;
            }
            weight /= survival;
        }
        let origin = if through.is_some() { vertex.passing(wi) } else { vertex.leaving(wi) };
        let next = Path { throughput: weight, media, pdf, position: vertex.position, normal: vertex.normal, ..*path };
        self.next.push(&Ray::new(origin, wi), &next);
    }
}

/// One hit of one ray.
#[derive(Clone, Copy)]
struct PhongStep<'a> {
    scene: &'a Prepared,
    path: &'a Path,
    vertex: &'a Vertex,
    /// Number of segments so far.
    depth: u32,
}

impl PhongStep<'_> {
    /// First sample dimension of this vertex.
    fn dimension(&self) -> u32 {
        first_dimension(self.depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    #[test]
    fn directions_fill_the_lobe_as_its_density_says() {
        let axis = Vec3::new(0.48, -0.6, 0.64);
        for exponent in [0.0, 5.0, 80.0, 1e5] {
            let n = 4096;
            let pair = |i| Sampler::new(1, 0, 0, i).pair(0).to_array();
            let cosines = (0..n).map(|i| axis.dot(within_lobe(axis.into(), exponent, pair(i)).into()));
            // ∫ cos · (n + 1) / 2π · cosⁿ dω = (n + 1) / (n + 2).
            let mean = cosines.sum::<f32>() / n as f32;
            let expected = (exponent + 1.0) / (exponent + 2.0);
            assert!((mean - expected).abs() < 1e-3, "{exponent}: {mean} for {expected}");
        }
    }
}
