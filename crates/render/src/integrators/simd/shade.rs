//! Hits on one kind of material: direct light, and the continuation of paths.

use crate::core::techniques::Techniques;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::resampling::{CANDIDATES, is_resampled};
use crate::integrators::common::survival::{ROULETTE_GRACE, Survival};
use crate::integrators::simd::direct::DirectLanes;
use crate::integrators::simd::emission::add_emission;
use crate::integrators::simd::track::BounceMisStates;
use crate::prepare::layer_table::{LAYERED, LAYERED_RICHLY};
use crate::prepare::material_table::COATED;
use crate::prepare::prepared::Prepared;
use crate::shading::dimensions::DIM_ROULETTE;
use crate::shading::environment_sampling::samples_lights;
use crate::shading::medium::MediumSets;
use crate::shading::paths::{PathBatch, PathLanes, ShadowBatch};
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::lane_group::{LaneGroup, iors};
use crate::shading::simd::lanes::{
    DIFFUSE, DISNEY, GLASS, METAL, MIRROR, PLASTIC, TRANSLUCENT, lanes_of, transmittance,
};
use crate::shading::simd::scatter::{LobeLanes, layered_surface_of, sample, surface_of};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_kdtree::HitBatch;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Real, Simd, Vector, dispatch, select, select_vector};
use glam::Vec3;

/// Hits on one kind of material, and the outputs of their paths.
pub(crate) struct KindHits<'a> {
    pub scene: &'a Prepared,
    pub techniques: &'a Techniques,
    pub caustics: Option<&'a CausticPass<'a>>,
    /// Number of segments so far.
    pub depth: u32,
    /// First sample dimension of the vertices.
    pub dimension: u32,
    pub survival: Survival,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    /// Material per hit.
    pub materials: &'a [u32],
    /// Indices of the hits.
    pub order: &'a [u32],
    pub next: &'a mut PathBatch,
    pub shadows: &'a mut ShadowBatch,
    /// See [`DirectLanes::thresholds`].
    pub shadow_thresholds: &'a [f32],
    pub sets: &'a mut MediumSets,
    /// By slot.
    pub radiance: &'a mut [Vec3],
    /// Whether paths end here.
    pub is_last: bool,
}

/// Whether [`shade`] supports hits on materials of a kind.
pub(crate) fn knows(kind: usize) -> bool {
    [DIFFUSE, MIRROR, GLASS, METAL, PLASTIC, DISNEY, TRANSLUCENT, COATED, LAYERED, LAYERED_RICHLY].contains(&kind)
}

/// Whether light sampling contributes to hits on materials of a kind.
pub(crate) fn scatters(kind: usize) -> bool {
    [DIFFUSE, METAL, PLASTIC, DISNEY, TRANSLUCENT, COATED, LAYERED, LAYERED_RICHLY].contains(&kind)
}

/// Shades hits on materials of one [`MaterialKind`](crate::core::material::MaterialKind).
pub(crate) fn shade(set: InstructionSet, kind: usize, group: KindHits) {
    match kind {
        DIFFUSE => dispatch!(set, shade_kind::<_, DIFFUSE>(group: KindHits)),
        MIRROR => dispatch!(set, shade_kind::<_, MIRROR>(group: KindHits)),
        GLASS => dispatch!(set, shade_kind::<_, GLASS>(group: KindHits)),
        METAL => dispatch!(set, shade_kind::<_, METAL>(group: KindHits)),
        PLASTIC => dispatch!(set, shade_kind::<_, PLASTIC>(group: KindHits)),
        DISNEY => dispatch!(set, shade_kind::<_, DISNEY>(group: KindHits)),
        TRANSLUCENT => dispatch!(set, shade_kind::<_, TRANSLUCENT>(group: KindHits)),
        COATED => dispatch!(set, shade_kind::<_, COATED>(group: KindHits)),
        // Both kinds of layers share one copy of a large function.
        _ => dispatch!(set, shade_kind::<_, LAYERED>(group: KindHits)),
    }
}

#[inline(always)]
fn shade_kind<S: Simd, const KIND: usize>(s: S, group: KindHits) {
    let KindHits { scene, techniques, caustics, depth, dimension, survival, paths, hits, materials, order, .. } = group;
    let KindHits { next, shadows, shadow_thresholds, sets, radiance, is_last, .. } = group;
    let (features, samples_lights) = (&scene.tables.features, samples_lights(scene, techniques));
    for chunk in order.chunks(LANES) {
        let chunk = LaneGroup::of(chunk);
        let LaneGroup { indices, mask } = chunk;
        let index = Bits::load(s, &indices);
        let mut at = HitGroup { scene, paths, hits, materials, index, indices: &indices, mask };
        let mut place = SurfaceLanes::of(s, &at);
        let mask = at.without_black_backs(&place);
        at.mask = mask;
        if mask == 0 {
            continue;
        }
        let mut throughput = Vector::gather(&paths.throughput, index);
        let sampler = paths.sampler_lanes(index);
        let slot = Bits::gather(&paths.slot, index);
        let mut media = chunk.media(scene, paths);
        if features.media {
            let distance = Float::gather(&hits.t, index);
            throughput = throughput.times(transmittance(s, sets, mask, &media, distance));
        }
        let surface = if KIND > COATED {
            layered_surface_of(s, &at, &mut place)
        } else {
            surface_of::<S, KIND>(s, &at, &place, sets, &media)
        };
        if KIND > COATED {
            add_emission(&at, techniques, caustics, &place, throughput, radiance);
            if is_last {
                continue;
            }
        }
        let hints = match caustics {
            Some(pass) if scatters(KIND) => {
                HintLanes::of(s, pass.guide(), depth, &at, &place, mask & surface.non_specular)
            }
            _ => HintLanes::NONE,
        };
        if KIND != MIRROR && KIND != GLASS && samples_lights {
            let lit = mask & surface.non_specular;
            if lit != 0 {
                let (mask, place, surface, hints, media, sampler) = (lit, &place, &surface, &hints, &media, &sampler);
                let thresholds = shadow_thresholds;
                DirectLanes {
                    scene,
                    techniques,
                    depth,
                    mask,
                    place,
                    surface,
                    hints,
                    media,
                    throughput,
                    sampler,
                    slot,
                    thresholds,
                }
                .add::<KIND>(s, sets, shadows);
            }
        }
        let bounce = sample::<S, KIND>(&surface, &place, mask, &hints, &sampler, dimension);
        let bounce = hints.follow::<S, KIND>(s, &surface, &place, &sampler, dimension, bounce);
        let beyond = bounce.wi.dot(place.geometric_normal).is_negative();
        let reached = bounce.wi.dot(place.reach_normal).is_positive();
        let mut go_on = mask & bounce.go_on;
        go_on &= (bounce.transmitted & beyond) | (!bounce.transmitted & reached);
        throughput = throughput.times(bounce.weight);
        if let LobeLanes::Glass(glass) = &surface.lobe
            && KIND == GLASS
        {
            lanes_of(go_on & bounce.transmitted).for_each(|lane| media[lane] = glass.beyond[lane]);
        }
        if let Some(most_kept) = survival.share {
            let ior = iors(s, scene, sets, go_on, &media);
            let mut most = throughput.abs().max_element() * ior * ior;
            if paths.tracks.is_some() {
                let weight = bounce.weight.to_arrays();
                let mut gains = [1.0; LANES];
                lanes_of(go_on).for_each(|lane| gains[lane] = hints.track(&at, lane, &weight).gain);
                most = most * Float::load(s, &gains);
            }
            let kept = (most * ROULETTE_GRACE).at_most(most_kept);
            let at_stake = go_on & kept.lt(kept.all(1.0));
            if at_stake != 0 {
                let survives = sampler.single(dimension + DIM_ROULETTE).lt(kept);
                go_on &= !at_stake | survives;
                let scale = select(at_stake, kept.all(1.0) / kept, kept.all(1.0));
                throughput = throughput * scale;
            }
        }
        go_on &= !throughput.is_zero();
        if go_on == 0 {
            continue;
        }
        let mut origin = place.leaving();
        if KIND == GLASS || KIND == TRANSLUCENT {
            origin = select_vector(bounce.transmitted, place.passing(), origin);
        }
        if let (Some(pass), Some(tracks)) = (caustics, &mut next.tracks) {
            let of_bounce =
                BounceMisStates { pass, at: &at, place: &place, hints: &hints, bounce: &bounce, media: &media };
            of_bounce.append::<KIND>(s, go_on, depth == 1, tracks);
        }
        let mut pdf = if techniques.light_sampling { bounce.pdf } else { bounce.pdf.all(f32::INFINITY) };
        if is_resampled(techniques, KIND) {
            pdf = pdf / CANDIDATES as f32;
        }
        // Light sampling uses both sides where there is none.
        let normal = if KIND == TRANSLUCENT { Vector::all(pdf.all(0.0)) } else { place.normal };
        let path = PathLanes { throughput, pdf, position: place.position, normal, sampler, slot };
        next.append(go_on, origin, bounce.wi, &path);
        if let Some(next_media) = &mut next.media {
            next_media.extend(lanes_of(go_on).map(|lane| media[lane]));
        }
    }
}
