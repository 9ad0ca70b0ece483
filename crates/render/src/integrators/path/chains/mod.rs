//! Light of delta lights that arrives through mirrors and glass where no light path can bring it.
//!
//! A camera path that meets a mirror or glass before it scatters cannot be found by a light path, which would have to be
//! connected to the lens there, nor does it ever hit a light without size. Here the way is searched for: the
//! direction from which a ray, bent by a chain of specular surfaces, arrives at the light ([`walk`]), from random
//! starts in the cone around a caster. How likely a start leads to the solution that it found is unknown; the number of
//! further starts until one leads there again has the reciprocal as its mean: specular manifold sampling, Zeltner,
//! Georgiev and Jakob 2020, section 4.3.
//!
//! The light of a solution is that of a light of no size, seen under the solid angle that the chain makes of it: for a
//! point of intensity I, I / |dA / dω|, where dA is the area across the ray at the light into which the chain spreads the
//! solid angle dω; for light from infinity with irradiance E, E / |dω′ / dω|.

mod chain;
mod walk;

use crate::core::settings::RenderSettings;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::path::chains::chain::ChainTracer;
use crate::integrators::path::chains::walk::{Solution, Walk};
use crate::prepare::delta_lines::{cone_around, sample_cone, strength_towards};
use crate::prepare::light::delta::{DeltaSample, DeltaSource};
use crate::sampling::Sampler;
use crate::shading::dimensions::chain_dimension;
use crate::shading::medium::MediumSets;
use crate::shading::paths::Path;
use crate::shading::scatter::Scatter;
use crate::shading::vertex::Vertex;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{RayBatch, RayClass};
use glam::Vec3;

/// Share of the vertices from which chains are searched for.
const SHARE: f32 = 0.125;

/// Maximum number of starts until a solution must be found again. More would matter only for solutions that fewer starts
/// than one in so many lead to.
const MOST_STARTS: u32 = 256;

/// Solutions whose directions differ by less than this fraction of the cone are the same.
const SAME: f32 = 1e-3;

impl CausticPass<'_> {
    /// Whether there are lights that only chains can find for paths that no light path can be.
    pub fn has_chains(&self) -> bool {
        self.scene.tables.lights.has_delta()
    }
}

/// A vertex that may be lit by a chain.
pub(super) struct Lit<'a> {
    pub pass: &'a CausticPass<'a>,
    pub settings: &'a RenderSettings,
    /// With its throughput at the vertex.
    pub path: &'a Path,
    pub vertex: &'a Vertex,
    /// Number of segments so far.
    pub depth: u32,
}

/// Whether chains are searched for from the end of segment `depth` of a path.
pub(super) fn is_chosen(path: &Path, depth: u32) -> bool {
    path.track.is_lost() && random(path, depth, 0).single(0) < SHARE
}

impl Lit<'_> {
    /// Searches for a chain to a random delta light by way of a random caster.
    pub fn find(&self, bsdf: &impl Scatter, sets: &mut MediumSets) -> Option<FoundChain> {
        if !bsdf.has_non_specular() {
            return None;
        }
        let &Self { pass, path, vertex, depth, settings } = self;
        let scene = pass.scene;
        let choice = random(path, depth, 0);
        let (light, caster, pmf) = pass.casters.choose(choice.single(1));
        if light as usize >= scene.tables.lights.len() {
            return None;
        }
        let light_media = sets.within(scene, pass.casters.media_of(light)).of_all_channels();
        let light = scene.tables.lights.light(light);
        let source = light.shape.delta()?;
        let most_events = settings.max_depth.saturating_sub(depth + 1).min(chain::MOST_EVENTS as u32) as usize;
        let through = bsdf.through();
        let start = |dir: Vec3| {
            let passes = through.is_some() && dir.dot(vertex.normal) < 0.0;
            let media = through.filter(|_| passes).map_or(path.media, |interface| interface.beyond);
            let origin = if passes { vertex.passing(dir) } else { vertex.leaving(dir) };
            vertex.leads_on(dir, passes).then(|| (Ray::new(origin, dir), media))
        };
        let cone = cone_around(vertex.position, pass.casters.bounds(caster));
        let mut tracer = ChainTracer::new(pass, sets, path.sampler, caster, most_events);
        let walk = Walk { light: source, angle: angle_of(cone) };
        let found = |tracer: &mut ChainTracer, number: u32| -> Option<Solution> {
            let random = random(path, depth, number);
            let dir = sample_cone(cone, random.pair(0));
            let (ray, media) = start(dir)?;
            let chain = tracer.find(ray, media, light_media, &random)?;
            walk.run(tracer, dir, &chain, light_media, &start)
        };
        let solution = found(&mut tracer, 1)?;
        let (value, _) = bsdf.eval(vertex.wo, solution.dir, vertex.normal);
        let (ray, share) = self.last_segment(tracer.sets(), &source, &solution)?;
        let strength = strength_towards(light, &scene.shading.textures, -ray.dir.normalize());
        let light_here = path.throughput * value * solution.weight * share * strength;
        if light_here == Vec3::ZERO {
            return None;
        }
        let is_again = |other: &Solution| other.is_same(&solution, SAME * walk.angle);
        let n_starts = (1..MOST_STARTS).find(|i| found(&mut tracer, i + 1).is_some_and(|other| is_again(&other)));
        let n_starts = n_starts.unwrap_or(MOST_STARTS) as f32;
        let light = light_here * (n_starts / (SHARE * pmf * solution.spread));
        Some(FoundChain { light, ray, n_surfaces: solution.chain.len() as u32 })
    }

    /// The ray from the end of a chain to a light, and the share of its light that arrives; `None` if something is in
    /// the way.
    fn last_segment(&self, sets: &MediumSets, light: &DeltaSource<f32>, solution: &Solution) -> Option<(Ray, Vec3)> {
        let (scene, origin) = (self.pass.scene, solution.end.origin);
        let DeltaSample { found, target, .. } = light.seen_from(true, origin.into());
        let target = Vec3::from(target);
        let (ray, distance) = match light.is_far {
            true => (Ray::new(origin, target), 0.0),
            false => (Ray { origin, dir: target - origin, t_max: 1.0 }, target.distance(origin)),
        };
        let mut rays = RayBatch::default();
        rays.push(&ray);
        let mut occluded = Vec::new();
        let passed = scene.shadows(&rays, RayClass::Incoherent, &mut occluded);
        if !found || occluded[0] {
            return None;
        }
        let mut share = passed.iter().fold(Vec3::ONE, |share, (_, passed)| share * *passed);
        if scene.tables.features.media {
            share *= sets.transmittance(solution.media, distance);
        }
        Some((ray, share))
    }
}

/// A chain that brings light.
pub(super) struct FoundChain {
    /// Its light in the pixel, over its probability.
    pub light: Vec3,
    /// From its end to the light.
    pub ray: Ray,
    pub n_surfaces: u32,
}

/// Random numbers of a start; 0 for what all starts share.
fn random(path: &Path, depth: u32, number: u32) -> Sampler {
    let own = path.sampler.single(chain_dimension(depth)).to_bits();
    Sampler::independent(own, path.sampler.parts()[0], number, 0)
}

/// The angle that a cone fills, approximately, radians, at most 1.
fn angle_of((_, one_minus_cos_max): (Vec3, f32)) -> f32 {
    (2.0 * one_minus_cos_max).sqrt().min(1.0)
}
