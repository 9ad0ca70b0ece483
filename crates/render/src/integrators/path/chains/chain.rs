//! Chains of specular surfaces, and rays along them.

use crate::core::material::Material;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::sampling::Sampler;
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::principled::at::principled_at;
use crate::shading::scatter::{BsdfSample, Scatter};
use crate::shading::sides::Sides;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::{Vertex, material_of};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, RayBatch, RayClass};
use glam::{Vec2, Vec3};
use smallvec::SmallVec;

/// Maximum number of specular surfaces of a chain.
pub(super) const MOST_EVENTS: usize = 4;

/// Rays that are traced together: one, and two on either side of it.
pub(super) const RAYS: usize = 5;

/// First dimension of the events of a start, after its direction.
const DIM_EVENTS: u32 = 1;

/// What a surface of a chain does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    /// Whether light passes it or is reflected.
    pub passes: bool,
    /// The random number that chose this.
    u: f32,
}

/// What the surfaces of a chain do, in order.
pub(super) type Events = SmallVec<[Event; MOST_EVENTS]>;

/// Which of the things that a surface does is wanted.
#[derive(Clone, Copy)]
enum Wanted {
    /// The one that a random number chooses.
    AtRandom(f32),
    Same(Event),
}

/// The end of a ray along a chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChainEnd {
    /// From the last surface.
    pub ray: Ray,
    pub media: MediumId,
    /// Light at the first ray over light here.
    pub weight: Vec3,
}

/// Traces rays along chains.
pub(super) struct ChainTracer<'a, 'b> {
    pass: &'a CausticPass<'a>,
    sets: &'b mut MediumSets,
    /// Of the path, for the channel of dispersed light.
    sampler: Sampler,
    /// The first surface of a chain.
    caster: u32,
    most_events: usize,
    rays: RayBatch,
    hits: HitBatch,
}

impl<'a, 'b> ChainTracer<'a, 'b> {
    pub fn new(
        pass: &'a CausticPass<'a>,
        sets: &'b mut MediumSets,
        sampler: Sampler,
        caster: u32,
        most_events: usize,
    ) -> Self {
        Self { pass, sets, sampler, caster, most_events, rays: RayBatch::default(), hits: HitBatch::default() }
    }

    pub fn sets(&self) -> &MediumSets {
        self.sets
    }

    /// Returns the chain that a random walk from a ray finds; `None` if it does not end in the media of the light.
    ///
    /// Surfaces reflect or pass light at random. The walk ends at the first surface that is not specular, or at random
    /// wherever it may.
    pub fn find(&mut self, ray: Ray, media: MediumId, light_media: MediumId, random: &Sampler) -> Option<Events> {
        let (mut events, mut at) = (Events::new(), ChainEnd { ray, media, weight: Vec3::ONE });
        loop {
            let may_end = !events.is_empty() && at.media.of_all_channels() == light_media;
            if events.len() == self.most_events {
                return may_end.then_some(events);
            }
            let dimension = DIM_EVENTS + 2 * events.len() as u32;
            let u = random.single(dimension);
            self.hit(&[at.ray]);
            let next = self.hits.get(0).and_then(|hit| {
                let is_on_way = !events.is_empty() || self.pass.caster_of(&hit) == self.caster;
                is_on_way.then(|| self.bent(&at, &hit, Wanted::AtRandom(u)))?
            });
            match next {
                Some(next) if !(may_end && random.single(dimension + 1) < 0.5) => {
                    events.push(Event { passes: next.1, u });
                    at = next.0;
                }
                _ => return may_end.then_some(events),
            }
        }
    }

    /// Returns the ends of rays along a chain; `None` if one of them leaves it.
    pub fn follow(&mut self, starts: &[(Ray, MediumId)], events: &Events) -> Option<SmallVec<[ChainEnd; RAYS]>> {
        let mut ends: SmallVec<[ChainEnd; RAYS]> =
            starts.iter().map(|&(ray, media)| ChainEnd { ray, media, weight: Vec3::ONE }).collect();
        for (i, event) in events.iter().enumerate() {
            let rays: SmallVec<[Ray; RAYS]> = ends.iter().map(|end| end.ray).collect();
            self.hit(&rays);
            for (k, end) in ends.iter_mut().enumerate() {
                let hit = self.hits.get(k)?;
                if i == 0 && self.pass.caster_of(&hit) != self.caster {
                    return None;
                }
                *end = self.bent(end, &hit, Wanted::Same(*event))?.0;
            }
            if ends.iter().any(|end| end.media != ends[0].media) {
                return None;
            }
        }
        Some(ends)
    }

    fn hit(&mut self, rays: &[Ray]) {
        self.rays.clear();
        rays.iter().for_each(|ray| self.rays.push(ray));
        self.pass.scene.closest_hits(&self.rays, RayClass::Incoherent, &mut self.hits);
        self.pass.scene.settle(&self.rays, &mut self.hits);
    }

    /// Returns the ray after a specular surface, and whether it has passed it; `None` if the surface does not do this.
    fn bent(&mut self, at: &ChainEnd, hit: &Hit, wanted: Wanted) -> Option<(ChainEnd, bool)> {
        let scene = self.pass.scene;
        let (ray, mut media) = (&at.ray, at.media);
        let material = material_of(scene, hit);
        let mut weight = at.weight;
        if scene.tables.features.media {
            weight *= self.sets.transmittance(media, hit.t);
        }
        let vertex = Vertex::new(scene, ray, hit, material);
        let mut sides = (scene.tables.features.glass)
            .then(|| Sides::new(scene, self.sets, media, ray, hit, material, vertex.front));
        if let Some(sides) = &mut sides
            && let Some(factor) = sides.disperse(scene, material, &self.sampler)
        {
            weight *= factor;
            media = sides.here;
        }
        let sample = match &scene.shading.materials[material as usize] {
            Material::Principled { .. } => {
                let layers = principled_at(scene, material, &vertex, &mut sides.as_mut(), 0, true)?;
                specular(&layers.seen_along(vertex.wo, vertex.normal), &vertex, wanted)
            }
            Material::Blend { .. } | Material::Phong { .. } => {
                specular(&blend_at(scene, material, &vertex, sides.as_mut())?, &vertex, wanted)
            }
            _ => specular(&lobe_at(scene, material, &vertex, sides.as_mut())?, &vertex, wanted),
        }?;
        let passes = sample.through.is_some();
        // Blends pass light as if they were specular, also where they are not; light sampling finds what panes let pass.
        let is_left_out =
            scene.shading.materials[material as usize].is_blended() || scene.tables.panes[material as usize];
        if passes && is_left_out || !vertex.leads_on(sample.wi, passes) {
            return None;
        }
        if let Some(through) = sample.through {
            media = through.beyond;
        }
        let origin = if passes { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        weight *= sample.weight * sample.probability;
        Some((ChainEnd { ray: Ray::new(origin, sample.wi), media, weight }, passes))
    }
}

/// Samples a specular lobe that does what is wanted.
fn specular(bsdf: &impl Scatter, vertex: &Vertex, wanted: Wanted) -> Option<BsdfSample> {
    let sample = |u: f32| {
        let sample = bsdf.sample(vertex.wo, vertex.normal, || u, Vec2::splat(0.5))?;
        sample.pdf.is_infinite().then_some(sample)
    };
    match wanted {
        Wanted::AtRandom(u) => sample(u),
        // Shares change along a surface, so that the same number may choose another lobe.
        Wanted::Same(Event { passes, u }) => [u, 0.0, 1.0f32.next_down(), 0.5]
            .into_iter()
            .find_map(|u| sample(u).filter(|sample| sample.through.is_some() == passes)),
    }
}
