//! Shading of sixteen paths at a time, for matte, mirror, glass, metal, and two of them in one surface.
//!
//! A wave's hits come sorted by kind of material, so the lanes of a chunk do the same. What is rare is done lane by
//! lane with the scalar code: textures, the glasses that a path is inside of, many lights, and pictures of the
//! surroundings. The scalar version of the whole is `path.rs`, which shades all other materials; tests
//! hold the two against each other.
//!
//! Start reading at [`shade`].

mod camera;
mod chunk;
mod classic;
mod classic_table;
mod coat;
mod emitters;
mod glass;
mod hints;
mod instances;
mod lights;
mod metal;
mod misses;
pub(super) mod place;
mod scatter;
mod sort;
mod tables;
mod texture;
mod track;
pub(super) mod warp;

use super::caustics::CausticPass;
use super::medium::{MediumId, MediumSets};
use super::path::{DIM_ROULETTE, ROULETTE_GRACE, Survival};
use super::paths::{PathBatch, PathLanes, ShadowBatch};
use super::{Material, Snapshot, Techniques};
pub(super) use camera::{Lens, Pixels};
pub(super) use chunk::Chunk;
use chunk::iors;
pub(super) use classic::{ClassicGroup, knows_classic, shade_classic};
pub(super) use classic_table::ClassicTable;
pub(super) use emitters::shade_emitters;
use firstlight_kdtree::HitBatch;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Mask, Simd, Vector, dispatch, select, select_vector};
use glam::Vec3;
pub(super) use hints::HintLanes;
use lights::{LightPoints, light_weight};
pub(super) use misses::shade_misses;
pub(super) use place::{At, Place};
pub(super) use scatter::{eval, sample, surface_of};
pub(super) use sort::{KINDS, SortedHits};
pub(super) use tables::COATED;
pub(super) use tables::{MaterialTable, SurfaceTable};
use track::BounceTracks;

/// Hits of one kind of material, and where their light and their paths go on.
pub(super) struct Group<'a> {
    pub scene: &'a Snapshot,
    pub techniques: &'a Techniques,
    pub caustics: Option<&'a CausticPass<'a>>,
    /// Segments so far.
    pub depth: u32,
    /// The first sample dimension of the vertices.
    pub dimension: u32,
    pub survival: Survival,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    /// Of each hit.
    pub materials: &'a [u32],
    /// Which of them.
    pub order: &'a [u32],
    pub next: &'a mut PathBatch,
    pub shadows: &'a mut ShadowBatch,
    pub sets: &'a mut MediumSets,
}

pub(super) const DIFFUSE: usize = 1;
pub(super) const MIRROR: usize = 2;
pub(super) const GLASS: usize = 3;
pub(super) const METAL: usize = 4;

/// Whether [`shade`] knows what to do with hits on materials of a kind.
pub(super) fn knows(kind: usize) -> bool {
    debug_assert_eq!(Material::Mirror { reflectance: super::ColorInput::Constant(Vec3::ONE) }.kind(), MIRROR);
    (DIFFUSE..=METAL).contains(&kind) || kind == COATED
}

/// Whether light sampling finds something for hits on materials of a kind.
pub(super) fn scatters(kind: usize) -> bool {
    [DIFFUSE, METAL, COATED].contains(&kind)
}

/// Shades hits on materials of one [`Material::kind`].
pub(super) fn shade(set: InstructionSet, kind: usize, group: Group) {
    match kind {
        DIFFUSE => dispatch!(set, shade_diffuse(group: Group)),
        MIRROR => dispatch!(set, shade_mirror(group: Group)),
        GLASS => dispatch!(set, shade_glass(group: Group)),
        METAL => dispatch!(set, shade_metal(group: Group)),
        _ => dispatch!(set, shade_coated(group: Group)),
    }
}

#[inline(always)]
fn shade_diffuse<S: Simd>(s: S, group: Group) {
    shade_kind::<S, DIFFUSE>(s, group);
}

#[inline(always)]
fn shade_mirror<S: Simd>(s: S, group: Group) {
    shade_kind::<S, MIRROR>(s, group);
}

#[inline(always)]
fn shade_glass<S: Simd>(s: S, group: Group) {
    shade_kind::<S, GLASS>(s, group);
}

#[inline(always)]
fn shade_metal<S: Simd>(s: S, group: Group) {
    shade_kind::<S, METAL>(s, group);
}

#[inline(always)]
fn shade_coated<S: Simd>(s: S, group: Group) {
    shade_kind::<S, COATED>(s, group);
}

#[inline(always)]
fn shade_kind<S: Simd, const KIND: usize>(s: S, group: Group) {
    let Group { scene, techniques, caustics, depth, dimension, survival, paths, hits, materials, order, .. } = group;
    let Group { next, shadows, sets, .. } = group;
    let features = &scene.shading.features;
    for chunk in order.chunks(LANES) {
        let chunk = Chunk::of(chunk);
        let Chunk { indices, mask } = chunk;
        let index = Bits::load(s, &indices);
        let at = At { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = Place::of(s, &at);
        let mut throughput = Vector::gather(&paths.throughput, index);
        let sampler = paths.sampler_lanes(index);
        let slot = Bits::gather(&paths.slot, index);
        let mut media = chunk.media(scene, paths);
        if features.media {
            let distance = Float::gather(&hits.t, index);
            throughput = throughput.times(transmittance(s, sets, mask, &media, distance));
        }
        let surface = surface_of::<S, KIND>(s, &at, &place, sets, &media);
        let hints = match caustics {
            Some(pass) if scatters(KIND) => HintLanes::of(s, pass, depth, &at, &place, mask & surface.smooth),
            _ => HintLanes::NONE,
        };
        if KIND != MIRROR && KIND != GLASS && techniques.light_sampling && features.light_sampling {
            let lit = mask & surface.smooth;
            if lit != 0 {
                let points =
                    s.call(LightPoints { scene, techniques, mask: lit, place: &place, sampler: &sampler, dimension });
                let (wi, found) = (points.wi, points.found);
                let (value, pdf) = eval::<S, KIND>(&surface, &place, wi);
                let pdf = hints.mixed(s, wi, pdf);
                let reached = wi.dot(place.reach_normal).is_positive();
                let found = found & reached & pdf.is_positive();
                let weight = light_weight(techniques, points.pdf, pdf) / points.pdf;
                let mut light = throughput.times(value).times(points.radiance) * weight;
                let found = found & !light.is_zero();
                if found != 0 {
                    let origin = place.leaving();
                    let infinite = points.infinite;
                    if features.glass && infinite & found != 0 {
                        let ior = iors(s, scene, sets, infinite & found, &media);
                        light = light * (ior * ior);
                    }
                    if features.media {
                        let distance = (points.target - place.position).length();
                        let passed = light.times(transmittance(s, sets, found & !infinite, &media, distance));
                        light = select_vector(infinite, light, passed);
                    }
                    // The direction spans the way to the light's own bounded point, where the ray ends.
                    let dir = select_vector(infinite, wi, points.target - origin);
                    let one = Float::splat(s, 1.0);
                    let t_max = select(infinite, one.all(f32::INFINITY), one);
                    shadows.append(found, [origin, dir], t_max, slot, light);
                }
            }
        }
        let bounce = sample::<S, KIND>(&at, &surface, &place, &hints, &sampler, dimension);
        let bounce = hints.follow::<S, KIND>(s, &surface, &place, &sampler, dimension, bounce);
        let beyond = bounce.wi.dot(place.geometric_normal).is_negative();
        let reached = bounce.wi.dot(place.reach_normal).is_positive();
        let mut go_on = mask & bounce.go_on;
        go_on &= (bounce.transmitted & beyond) | (!bounce.transmitted & reached);
        throughput = throughput.times(bounce.weight);
        if let Some(glass) = &surface.glass
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
        if KIND == GLASS {
            origin = select_vector(bounce.transmitted, place.passing(), origin);
        }
        if let (Some(pass), Some(tracks)) = (caustics, &mut next.tracks) {
            let of_bounce =
                BounceTracks { pass, at: &at, place: &place, hints: &hints, bounce: &bounce, media: &media };
            of_bounce.append::<KIND>(s, go_on, depth == 1, tracks);
        }
        let pdf = if techniques.light_sampling { bounce.pdf } else { bounce.pdf.all(f32::INFINITY) };
        let path = PathLanes { throughput, pdf, position: place.position, normal: place.normal, sampler, slot };
        next.append(go_on, origin, bounce.wi, &path);
        if let Some(next_media) = &mut next.media {
            next_media.extend(lanes_of(go_on).map(|lane| media[lane]));
        }
    }
}

#[inline(always)]
pub(super) fn lanes_of(mask: Mask) -> impl Iterator<Item = usize> {
    (0..LANES).filter(move |lane| mask >> lane & 1 != 0)
}

/// What is left of light after `distance` metres, lane by lane.
#[inline(always)]
pub(super) fn transmittance<S: Simd>(
    s: S,
    sets: &MediumSets,
    mask: Mask,
    media: &[MediumId; LANES],
    distance: Float<S>,
) -> Vector<S> {
    let distances = distance.to_array();
    let mut kept = [[1.0; LANES]; 3];
    for lane in lanes_of(mask) {
        let found = sets.transmittance(media[lane], distances[lane]);
        (kept[0][lane], kept[1][lane], kept[2][lane]) = (found.x, found.y, found.z);
    }
    Vector::from_arrays(s, &kept)
}
