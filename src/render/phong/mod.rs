//! The classic local model, a wave of rays at a time: Phong 1975 for light, Whitted 1980 for mirrors and glass.
//!
//! Each light adds a matte part, a highlight, and a small share to surfaces that it cannot reach (ambient). Lights
//! with an area are asked at one new point a sample, so that soft shadows get smooth as samples come in; point lights
//! cast hard ones. Smooth surroundings add ambient light without shadows. Mirrors and glass send rays of their own,
//! both reflected and refracted, until their weight is small; then chance decides, which costs no accuracy (Arvo and
//! Kirk 1990). All rays of a wave that are at the same depth go to the kernel in one batch.
//!
//! What it leaves out, and [`super::path`] does not: light from one matte surface to another, and caustics.
//! Start reading at [`PhongWave::trace`].

mod finish;
mod shadow;

use super::dielectric::{fresnel, refract};
use super::medium::MediumStack;
use super::path::CAMERA_DIMENSIONS;
use super::paths::PathBatch;
use super::renderer::RayCounts;
use super::surface::{Vertex, material_of};
use super::{MaterialId, Snapshot};
use crate::geometry::{Frame, Ray};
use crate::kdtree::{HitBatch, RayBatch, RayClass};
use crate::sampling::Sampler;
use finish::{Finish, Shiny};
use glam::{Vec2, Vec3};
use shadow::Shadows;
use std::f32::consts::{FRAC_1_PI, TAU};

/// Share of a light's fluence at a point that reaches surfaces there from all around, whatever is in its way: about
/// what the walls of a large, rather dark room send back.
const AMBIENT_SHARE: f32 = 0.05;

/// Rays that count for less than this are followed with a probability, and then for this much: a grey level of a
/// picture, and few enough rays behind any pixel.
const LEAST_WEIGHT: f32 = 1.0 / 64.0;

/// From here on rays that lose nothing are ended now and then, too.
const ENDLESS_DEPTH: u32 = 64;

/// Sample dimensions of each vertex: of the lights (see [`super::light::LightTable::sample_each`]), the environment,
/// and three for each shiny part.
const DIM_ENVIRONMENT: u32 = super::light::EACH_DIMENSIONS;
const DIM_SHINY: u32 = DIM_ENVIRONMENT + 1;
const VERTEX_DIMENSIONS: u32 = DIM_SHINY + 3 * super::bsdf::MAX_LOBES as u32;

/// A ray on its way.
#[derive(Clone, Copy)]
struct Walk {
    weight: Vec3,
    sampler: Sampler,
    slot: u32,
    media: MediumStack,
    lights: LightsMet,
}

/// What a ray may still bring of lights, which a highlight asks for by itself.
#[derive(Clone, Copy)]
enum LightsMet {
    /// All of it: nothing else has asked.
    Count,
    /// Nothing: a highlight has stood in for them.
    Counted,
    /// A share: the ray lies within a lobe, with this density per steradian, and lights were asked from `position`.
    Shared { pdf: f32, position: Vec3 },
}

impl LightsMet {
    /// How much counts of a light that is asked for with the density that `asked` tells for a position.
    #[inline]
    fn share(self, asked: impl FnOnce(Vec3) -> f32) -> f32 {
        match self {
            Self::Count => 1.0,
            Self::Counted => 0.0,
            Self::Shared { pdf, position } => share(pdf, asked(position)),
        }
    }
}

/// Weight of light that was found with density `own` where another way finds it with density `other` (the power
/// heuristic, Veach 1997, β = 2).
#[inline]
fn share(own: f32, other: f32) -> f32 {
    if other == 0.0 {
        return 1.0;
    }
    // By the ratio: squares of densities overflow for lights of a few pixels.
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// Scratch memory of one worker: cleared between waves, never given back.
#[derive(Default)]
pub(super) struct PhongWave {
    starts: PathBatch,
    rays: RayBatch,
    walks: Vec<Walk>,
    next_rays: RayBatch,
    next_walks: Vec<Walk>,
    hits: HitBatch,
    shadows: Shadows,
}

impl PhongWave {
    /// Follows the paths that `start` pushes, one a slot at most, and adds what they find to `radiance`, indexed by
    /// slot.
    ///
    /// `max_depth` as for paths: a light seen in two mirrors is three segments away. `None` when `stop` said so; what
    /// is in `radiance` then is of no use.
    pub fn trace(
        &mut self,
        scene: &Snapshot,
        max_depth: u32,
        start: impl FnOnce(&mut PathBatch),
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        self.starts.start(radiance.len(), false, false);
        start(&mut self.starts);
        std::mem::swap(&mut self.rays, &mut self.starts.rays);
        self.walks.clear();
        self.walks.extend((0..self.rays.len()).map(|i| Walk {
            weight: self.starts.throughput_of(i),
            sampler: self.starts.sampler(i),
            slot: self.starts.slot[i],
            media: MediumStack::default(),
            lights: LightsMet::Count,
        }));
        let mut counts = RayCounts { camera: self.rays.len() as u64, ..RayCounts::default() };
        for depth in 1..=max_depth {
            if self.rays.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            scene.geometry.tree.closest_hits(&self.rays, class, &mut self.hits);
            self.shade(scene, depth, max_depth, radiance);
            counts.shadow += self.shadows.cast(scene, class, radiance);
            counts.bounce += self.next_rays.len() as u64;
            std::mem::swap(&mut self.rays, &mut self.next_rays);
            std::mem::swap(&mut self.walks, &mut self.next_walks);
        }
        Some(counts)
    }

    fn shade(&mut self, scene: &Snapshot, depth: u32, max_depth: u32, radiance: &mut [Vec3]) {
        let shading = &*scene.shading;
        self.next_rays.clear();
        self.next_walks.clear();
        self.shadows.clear();
        let mut finish = Finish::new();
        for i in 0..self.rays.len() {
            let mut walk = self.walks[i];
            let ray = self.rays.get(i);
            let slot = walk.slot as usize;
            let Some(hit) = self.hits.get(i) else {
                if shading.features.environment {
                    let sampler = &shading.environment_sampler;
                    let share = sampler.as_ref().map_or(1.0, |sampler| walk.lights.share(|_| sampler.pdf(ray.dir)));
                    radiance[slot] += walk.weight * share * shading.environment.radiance(ray.dir);
                }
                continue;
            };
            if shading.features.media {
                walk.weight *= walk.media.transmittance(scene, hit.t);
            }
            let material = material_of(scene, &hit);
            let vertex = Vertex::new(scene, &ray, &hit, material);
            if let Some(emission) = shading.emission[material as usize]
                && vertex.front
            {
                let share = match shading.lights.light_of(hit.object, hit.prim) {
                    None => 1.0,
                    // A point shows to the eye alone: in a mirror its ball would be a speck that few samples meet.
                    Some(id) if depth > 1 && shading.lights.is_point(id) => 0.0,
                    Some(id) => walk
                        .lights
                        .share(|from| shading.lights.pdf_each(id, from, ray.dir, from.distance(vertex.position))),
                };
                radiance[slot] += walk.weight * share * emission.scale * emission.radiance.eval(scene, vertex.uv);
            }
            if depth == max_depth {
                continue;
            }
            let step = Step { scene, walk: &walk, vertex: &vertex, depth };
            finish.look_up(scene, material, &vertex, &walk.media);
            if finish.is_lit() {
                radiance[slot] += walk.weight * self.light(&step, &finish);
            }
            for (k, shiny) in finish.shiny().iter().enumerate() {
                self.send(&step, shiny, step.dimension() + DIM_SHINY + 3 * k as u32);
            }
        }
    }

    /// Ambient light, returned at once; direct light waits for its shadow rays.
    fn light(&mut self, step: &Step, finish: &Finish) -> Vec3 {
        let Step { scene, walk, vertex, .. } = *step;
        let shading = &*scene.shading;
        let mirrored = vertex.mirrored();
        let mut ambient = Vec3::ZERO;
        let mut direct = |radiance: Vec3, wi: Vec3, target: Option<Vec3>, pdf: Option<f32>| {
            if !vertex.is_reached_from(wi) {
                return;
            }
            let light = walk.weight * finish.reflected(wi, vertex.normal, mirrored, pdf) * radiance;
            if light != Vec3::ZERO {
                self.shadows.push(walk.slot, light, vertex.leaving(wi), wi, target);
            }
        };
        let dimension = step.dimension();
        shading.lights.sample_each(&shading.textures, vertex.position, &walk.sampler, dimension, |sample, is_point| {
            let mut arriving = sample.radiance / sample.pdf;
            if shading.features.media {
                arriving *= walk.media.transmittance(scene, vertex.position.distance(sample.target));
            }
            ambient += finish.ambient * arriving * (AMBIENT_SHARE * FRAC_1_PI);
            direct(arriving, sample.wi, Some(sample.target), (!is_point).then_some(sample.pdf));
        });
        if let Some(environment) = &shading.environment_sampler {
            if let Some((wi, pdf)) = environment.sample(walk.sampler.pair(dimension + DIM_ENVIRONMENT)) {
                direct(shading.environment.radiance(wi) / pdf, wi, None, Some(pdf));
            }
        } else if shading.features.environment {
            ambient += finish.ambient * shading.ambient.radiance(vertex.normal);
        }
        ambient
    }

    /// The rays of a mirror or of glass.
    fn send(&mut self, step: &Step, shiny: &Shiny, dimension: u32) {
        let Step { walk, vertex, .. } = *step;
        match *shiny {
            Shiny::Mirror { tint } => {
                self.follow(step, walk.weight * tint, vertex.mirrored(), None, LightsMet::Count, dimension);
            }
            Shiny::Gloss { tint, exponent, rough } => {
                let mirrored = vertex.mirrored();
                let weight = walk.weight * tint;
                if rough {
                    let wi = within_lobe(mirrored, exponent, walk.sampler.pair(dimension + 1));
                    if vertex.is_reached_from(wi) && wi.dot(vertex.normal) > 0.0 {
                        let pdf = lobe_pdf(exponent, mirrored.dot(wi));
                        let lights = LightsMet::Shared { pdf, position: vertex.position };
                        self.follow(step, weight, wi, None, lights, dimension);
                        return;
                    }
                    // Below the surface there is nothing to see: the middle of the lobe stands in.
                }
                self.follow(step, weight, mirrored, None, LightsMet::Counted, dimension);
            }
            Shiny::Pane { share, eta, id } => {
                let (reflectance, cos_t) = fresnel(vertex.normal.dot(vertex.wo).clamp(0.0, 1.0), eta);
                let weight = walk.weight * share;
                self.follow(step, weight * reflectance, vertex.mirrored(), None, LightsMet::Count, dimension);
                if reflectance < 1.0 {
                    let wi = refract(vertex.wo, vertex.normal, eta, cos_t);
                    // Radiance is squeezed into a narrower cone where light is slower: the factor η².
                    let weight = weight * ((1.0 - reflectance) * eta * eta);
                    self.follow(step, weight, wi, Some(id), LightsMet::Count, dimension + 2);
                }
            }
        }
    }

    /// - `through`: the glass whose surface is crossed, if one is.
    fn follow(
        &mut self,
        step: &Step,
        mut weight: Vec3,
        wi: Vec3,
        through: Option<MaterialId>,
        lights: LightsMet,
        dimension: u32,
    ) {
        let Step { scene, walk, vertex, depth } = *step;
        // The true surface decides which side a direction leads to.
        let reached =
            if through.is_some() { wi.dot(vertex.geometric_normal) < 0.0 } else { vertex.is_reached_from(wi) };
        if !reached {
            return;
        }
        let media = through.map_or(walk.media, |id| walk.media.crossed(id, vertex.front));
        // Inside glass weights carry 1/n², which the way out gives back: it must not count as loss.
        let ior = if scene.shading.features.glass { media.ior(scene) } else { 1.0 };
        let most = weight.abs().max_element() * ior * ior / LEAST_WEIGHT;
        let survival = if depth >= ENDLESS_DEPTH { most.min(0.95) } else { most.min(1.0) };
        if survival < 1.0 {
            if walk.sampler.single(dimension) >= survival {
                return;
            }
            weight /= survival;
        }
        let origin = if through.is_some() { vertex.passing(wi) } else { vertex.leaving(wi) };
        self.next_rays.push(&Ray::new(origin, wi));
        self.next_walks.push(Walk { weight, media, lights, ..*walk });
    }
}

/// One hit of one ray.
#[derive(Clone, Copy)]
struct Step<'a> {
    scene: &'a Snapshot,
    walk: &'a Walk,
    vertex: &'a Vertex,
    /// Segments so far.
    depth: u32,
}

impl Step<'_> {
    /// The first sample dimension of this vertex.
    fn dimension(&self) -> u32 {
        CAMERA_DIMENSIONS + (self.depth - 1) * VERTEX_DIMENSIONS
    }
}

/// (n + 1) / 2π · cosⁿ about an axis, per steradian; `cos` may be negative.
#[inline]
fn lobe_pdf(exponent: f32, cos: f32) -> f32 {
    (exponent + 1.0) / TAU * cos.max(0.0).powf(exponent)
}

/// A unit direction with density [`lobe_pdf`] about `axis`.
#[inline]
fn within_lobe(axis: Vec3, exponent: f32, u: Vec2) -> Vec3 {
    let cos = (1.0 - u.x).powf(1.0 / (exponent + 1.0));
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
    Frame::around(axis).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, cos)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_fill_the_lobe_as_its_density_says() {
        let axis = Vec3::new(0.48, -0.6, 0.64);
        for exponent in [0.0, 5.0, 80.0, 1e5] {
            let n = 4096;
            let cosines = (0..n).map(|i| axis.dot(within_lobe(axis, exponent, Sampler::new(1, 0, 0, i).pair(0))));
            // ∫ cos · (n + 1) / 2π · cosⁿ dω = (n + 1) / (n + 2).
            let mean = cosines.sum::<f32>() / n as f32;
            let expected = (exponent + 1.0) / (exponent + 2.0);
            assert!((mean - expected).abs() < 1e-3, "{exponent}: {mean} for {expected}");
        }
    }
}
