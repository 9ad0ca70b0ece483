//! Direct light of sixteen hits: points on lights, and shadow rays to them.

use crate::core::techniques::Techniques;
use crate::integrators::common::resampling::{CANDIDATES, is_resampled, worth};
use crate::prepare::prepared::Prepared;
use crate::sampling::SamplerLanes;
use crate::shading::dimensions::{first_dimension, resampling_dimension, shadow_roulette_dimension};
use crate::shading::interface::MediumId;
use crate::shading::lights::light_weight;
use crate::shading::medium::MediumSets;
use crate::shading::paths::ShadowBatch;
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::lane_group::iors;
use crate::shading::simd::lanes::{TRANSLUCENT, transmittance};
use crate::shading::simd::lights::LightPoints;
use crate::shading::simd::scatter::{SurfaceScatter, eval};
use crate::shading::simd::surface::SurfaceLanes;
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, select, select_vector};

/// Hits that lights may reach.
pub(crate) struct DirectLanes<'a, S: Simd> {
    pub scene: &'a Prepared,
    pub techniques: &'a Techniques,
    /// Number of segments so far.
    pub depth: u32,
    pub mask: Mask,
    pub place: &'a SurfaceLanes<S>,
    pub surface: &'a SurfaceScatter<'a, S>,
    pub hints: &'a HintLanes<'a>,
    pub media: &'a [MediumId; LANES],
    pub throughput: Vector<S>,
    pub sampler: &'a SamplerLanes<S>,
    pub slot: Bits<S>,
    /// Per slot, see [`FilmTile::shadow_thresholds`](crate::film::tile::FilmTile::shadow_thresholds); empty if all
    /// shadow rays are traced.
    pub thresholds: &'a [f32],
}

/// Points on lights, and their light if they are unoccluded.
#[derive(Clone, Copy)]
struct LightCandidate<S: Simd> {
    found: Mask,
    infinite: Mask,
    target: Vector<S>,
    wi: Vector<S>,
    light: Vector<S>,
}

impl<S: Simd> DirectLanes<'_, S> {
    /// Appends shadow rays to points on lights.
    #[inline(always)]
    pub fn add<const KIND: usize>(&self, s: S, sets: &mut MediumSets, shadows: &mut ShadowBatch) {
        let &Self { scene, place, media, slot, .. } = self;
        let chosen = match is_resampled(self.techniques, KIND) {
            true => self.resampled::<KIND>(s),
            false => self.candidate::<KIND>(s, 0, 1.0),
        };
        let LightCandidate { infinite, target, wi, mut light, .. } = chosen;
        let found = self.roulette(chosen.found, &mut light);
        if found == 0 {
            return;
        }
        let mut origin = place.leaving();
        if KIND == TRANSLUCENT {
            origin = select_vector(wi.dot(place.normal).is_negative(), place.passing(), origin);
        }
        if scene.tables.features.glass && infinite & found != 0 {
            let ior = iors(s, scene, sets, infinite & found, media);
            light = light * (ior * ior);
        }
        if scene.tables.features.media {
            let distance = (target - place.position).length();
            let passed = light.times(transmittance(s, sets, found & !infinite, media, distance));
            light = select_vector(infinite, light, passed);
        }
        // `dir` leads to the light's own bounded point, where the ray ends.
        let dir = select_vector(infinite, wi, target - origin);
        let one = Float::splat(s, 1.0);
        let t_max = select(infinite, one.all(f32::INFINITY), one);
        shadows.append(found, [origin, dir], t_max, slot, light);
    }

    /// Returns light sample number `k`.
    ///
    /// - `n`: number of light samples per sample of the BSDF, for the MIS weight.
    #[inline(always)]
    fn candidate<const KIND: usize>(&self, s: S, k: u32, n: f32) -> LightCandidate<S> {
        let &Self { scene, techniques, mask, place, surface, hints, sampler, .. } = self;
        let points = s.call(&LightPoints {
            scene,
            techniques,
            mask,
            position: place.position,
            normal: place.normal,
            both_sides: KIND == TRANSLUCENT,
            sampler,
            dimension: first_dimension(self.depth),
            candidate: k,
        });
        let wi = points.wi;
        let (value, pdf) = eval::<S, KIND>(surface, place, wi);
        let pdf = hints.mixed(s, wi, pdf);
        let mut reached = wi.dot(place.reach_normal).is_positive();
        if KIND == TRANSLUCENT {
            let passes = wi.dot(place.normal).is_negative();
            reached = (passes & wi.dot(place.geometric_normal).is_negative()) | (!passes & reached);
        }
        let found = points.found & reached & pdf.is_positive();
        let weight = light_weight(techniques, points.pdf * n, pdf) / points.pdf;
        let light = self.throughput.times(value).times(points.radiance) * weight;
        let found = found & !light.is_zero();
        LightCandidate { found, infinite: points.infinite, target: points.target, wi, light }
    }

    /// Chooses one of several light samples; see [`crate::integrators::common::resampling`].
    #[inline(always)]
    fn resampled<const KIND: usize>(&self, s: S) -> LightCandidate<S> {
        let zero = Float::splat(s, 0.0);
        let worth_of = |of: &LightCandidate<S>| select(of.found, worth(of.light), zero);
        let mut u = self.sampler.single(resampling_dimension(self.depth));
        let mut chosen = self.candidate::<KIND>(s, 0, CANDIDATES as f32);
        let mut own = worth_of(&chosen);
        let mut sum = own;
        for k in 1..CANDIDATES {
            let other = self.candidate::<KIND>(s, k, CANDIDATES as f32);
            let others = worth_of(&other);
            sum += others;
            let share = others / sum;
            let takes = other.found & u.lt(share);
            let rest = select(takes, u / share, (u - share) / (zero.all(1.0) - share));
            u = select(other.found, rest.at_most(1.0f32.next_down()), u);
            own = select(takes, others, own);
            chosen = LightCandidate {
                found: chosen.found | takes,
                infinite: chosen.infinite & !takes | other.infinite & takes,
                target: select_vector(takes, other.target, chosen.target),
                wi: select_vector(takes, other.wi, chosen.wi),
                light: select_vector(takes, other.light, chosen.light),
            };
        }
        chosen.light = chosen.light * (sum / (own * CANDIDATES as f32));
        chosen
    }

    /// Roulette of shadow rays; returns the lanes whose rays are traced.
    #[inline(always)]
    fn roulette(&self, found: Mask, light: &mut Vector<S>) -> Mask {
        if found == 0 || self.thresholds.is_empty() {
            return found;
        }
        let kept = worth(*light) / Float::gather(self.thresholds, self.slot);
        let one = kept.all(1.0);
        let at_stake = found & kept.lt(one);
        if at_stake == 0 {
            return found;
        }
        let survives = self.sampler.single(shadow_roulette_dimension(self.depth)).lt(kept);
        *light = *light * select(at_stake, one / kept, one);
        found & (!at_stake | survives)
    }
}
