//! Shading of sixteen paths at a time, for the materials of one lobe: matte, mirror, glass and metal.
//!
//! A wave's hits come sorted by kind of material, so the lanes of a chunk do the same. What is rare is done lane by
//! lane with the scalar code: hits on meshes, textures, the glasses that a path is inside of, many lights, and
//! pictures of the surroundings. The scalar version of the whole is `path.rs`, which shades all other materials; tests
//! hold the two against each other.
//!
//! Start reading at [`shade`].

mod camera;
mod metal;
pub(super) mod place;
mod sort;
mod tables;
pub(super) mod warp;

use super::bsdf::{SMALLEST_ALPHA, Scatter};
use super::caustics::{CausticPass, Track};
use super::light::LightLanes;
use super::medium::MediumStack;
use super::path::{
    DIM_DIRECTION, DIM_LIGHT_POINT, DIM_LOBE, DIM_ROULETTE, ROULETTE_GRACE, Survival, choose_light_point,
};
use super::paths::{PathBatch, PathLanes, ShadowBatch};
use super::surface::{Vertex, color_at, lobe_at, scalar_at};
use super::{Material, Snapshot, Techniques};
use crate::kdtree::HitBatch;
use crate::lanes::{
    Bits, Float, InstructionSet, LANES, Mask, Simd, Vector, dispatch, frame_around, select, select_vector,
};
use crate::sampling::{Sampler, SamplerLanes};
pub(super) use camera::{Lens, Pixels};
use glam::{Vec2, Vec3};
use metal::MetalLanes;
use place::{At, Place};
pub(super) use sort::{KINDS, SortedHits};
use std::f32::consts::FRAC_1_PI;
pub(super) use tables::{MaterialTable, SurfaceTable};
use warp::cosine_hemisphere;

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
}

const DIFFUSE: usize = 1;
const MIRROR: usize = 2;
const GLASS: usize = 3;
const METAL: usize = 4;

/// Whether [`shade`] knows what to do with hits on materials of a kind.
pub(super) fn knows(kind: usize) -> bool {
    debug_assert_eq!(Material::Mirror { reflectance: super::ColorInput::Constant(Vec3::ONE) }.kind(), MIRROR);
    (DIFFUSE..=METAL).contains(&kind)
}

/// Whether [`shade`] knows the kind, and light sampling finds something for it.
pub(super) fn scatters(kind: usize) -> bool {
    [DIFFUSE, METAL].contains(&kind)
}

/// Shades hits on materials of one [`Material::kind`].
pub(super) fn shade(set: InstructionSet, kind: usize, group: Group) {
    match kind {
        DIFFUSE => dispatch!(set, shade_diffuse(group: Group)),
        MIRROR => dispatch!(set, shade_mirror(group: Group)),
        GLASS => dispatch!(set, shade_glass(group: Group)),
        _ => dispatch!(set, shade_metal(group: Group)),
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

/// Adds the light of hits on emitters, weighted against light sampling having found it.
///
/// Only where [`super::LightTable::has_lanes`] and no emission is textured; `dimension`, `survival`, `next` and
/// `shadows` of the group are not used.
pub(super) fn shade_emitters(set: InstructionSet, group: Group, radiance: &mut [Vec3]) {
    dispatch!(set, shade_emissive(group: Group, radiance: &mut [Vec3]));
}

#[inline(always)]
fn shade_emissive<S: Simd>(s: S, group: Group, radiance: &mut [Vec3]) {
    let Group { scene, techniques, paths, hits, materials, order, .. } = group;
    let shading = &*scene.shading;
    for chunk in order.chunks(LANES) {
        let mut indices = [chunk[0]; LANES];
        indices[..chunk.len()].copy_from_slice(chunk);
        let mask = if chunk.len() == LANES { Mask::MAX } else { (1 << chunk.len()) - 1 };
        let index = Bits::load(s, &indices);
        let at = At { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = Place::new(s, &at);
        let pdf = Float::gather(&paths.pdf, index);
        let distance = Float::gather(&hits.t, index);
        let color = Vector::gather(&shading.material_table.color, Bits::gather(materials, index));
        let mut light = Vector::gather(&paths.throughput, index).times(color);
        let rivals = mask & place.front & pdf.lt(pdf.all(f32::INFINITY));
        if rivals != 0 {
            let mut id = [0; LANES];
            let mut known = 0;
            for lane in lanes_of(rivals) {
                let i = indices[lane] as usize;
                if let Some(light) = shading.lights.light_of(hits.object[i], hits.prim[i]) {
                    id[lane] = light;
                    known |= 1 << lane;
                }
            }
            let (position, normal) = (Vector::gather(&paths.position, index), Vector::gather(&paths.normal, index));
            let id = Bits::load(s, &id);
            let other = shading.lights.pdf_lanes(techniques, id, position, normal, -place.wo, distance);
            let weight = if techniques.mis {
                light_weight(techniques, pdf, other)
            } else {
                select(other.is_positive(), pdf.all(0.0), pdf.all(1.0))
            };
            light = light * select(known, weight, pdf.all(1.0));
        }
        if scene.shading.features.media {
            let media = indices.map(|i| paths.media_of(i as usize));
            light = light.times(transmittance(s, scene, mask, &media, distance));
        }
        let light = light.to_arrays();
        for lane in lanes_of(mask & place.front) {
            let slot = paths.slot[indices[lane] as usize];
            radiance[slot as usize] += Vec3::new(light[0][lane], light[1][lane], light[2][lane]);
        }
    }
}

/// How the surface of each lane scatters.
struct Surface<S: Simd> {
    /// Albedo or reflectance.
    color: Vector<S>,
    metal: Option<MetalLanes<S>>,
    /// Lanes that light sampling can do something for.
    smooth: Mask,
}

/// Directions in which paths go on.
struct Bounce<S: Simd> {
    go_on: Mask,
    wi: Vector<S>,
    weight: Vector<S>,
    pdf: Float<S>,
    transmitted: Mask,
}

#[inline(always)]
fn shade_kind<S: Simd, const KIND: usize>(s: S, group: Group) {
    let Group { scene, techniques, caustics, depth, dimension, survival, paths, hits, materials, order, next, shadows } =
        group;
    let features = &scene.shading.features;
    for chunk in order.chunks(LANES) {
        let mut indices = [chunk[0]; LANES];
        indices[..chunk.len()].copy_from_slice(chunk);
        let mask = if chunk.len() == LANES { Mask::MAX } else { (1 << chunk.len()) - 1 };
        let index = Bits::load(s, &indices);
        let at = At { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = Place::new(s, &at);
        let mut throughput = Vector::gather(&paths.throughput, index);
        let sampler = paths.sampler_lanes(index);
        let slot = Bits::gather(&paths.slot, index);
        let mut media = [MediumStack::default(); LANES];
        if features.glass {
            for (lane, &i) in indices.iter().enumerate() {
                media[lane] = paths.media_of(i as usize);
            }
        }
        if features.media {
            let distance = Float::gather(&hits.t, index);
            throughput = throughput.times(transmittance(s, scene, mask, &media, distance));
        }
        let surface = surface_of::<S, KIND>(s, &at, &place);
        if KIND != MIRROR && KIND != GLASS && techniques.light_sampling && features.light_sampling {
            let lit = mask & surface.smooth;
            if lit != 0 {
                let points = light_points(s, scene, techniques, lit, &place, &sampler, dimension);
                let (wi, found) = (points.wi, points.found);
                let (value, pdf) = eval::<S, KIND>(&surface, &place, wi);
                let reached = wi.dot(place.reach_normal).is_positive();
                let found = found & reached & pdf.is_positive();
                let weight = light_weight(techniques, points.pdf, pdf) / points.pdf;
                let mut light = throughput.times(value).times(points.radiance) * weight;
                let found = found & !light.is_zero();
                if found != 0 {
                    let origin = place.leaving();
                    let infinite = points.infinite;
                    if features.media {
                        let distance = (points.target - place.position).length();
                        let passed = light.times(transmittance(s, scene, found & !infinite, &media, distance));
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
        let bounce = sample::<S, KIND>(s, &at, &surface, &place, &sampler, dimension, &media);
        let beyond = bounce.wi.dot(place.geometric_normal).is_negative();
        let reached = bounce.wi.dot(place.reach_normal).is_positive();
        let mut go_on = mask & bounce.go_on;
        go_on &= (bounce.transmitted & beyond) | (!bounce.transmitted & reached);
        throughput = throughput.times(bounce.weight);
        if KIND == GLASS {
            for lane in lanes_of(go_on & bounce.transmitted) {
                let front = place.front >> lane & 1 != 0;
                media[lane] = media[lane].crossed(materials[indices[lane] as usize], front);
            }
        }
        if let Some(most_kept) = survival.share {
            let mut most = throughput.abs().max_element();
            if features.glass {
                let mut ior = [1.0; LANES];
                for lane in lanes_of(go_on).filter(|&lane| !media[lane].is_empty()) {
                    ior[lane] = media[lane].ior(scene);
                }
                let ior = Float::load(s, &ior);
                most = most * ior * ior;
            }
            if paths.tracks.is_some() {
                most = most * Float::load(s, &indices.map(|i| paths.track_of(i as usize).gain));
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
            tracks.extend(follow(pass, &at, &place, &bounce, go_on, depth == 1, &media));
        }
        let pdf = if techniques.light_sampling { bounce.pdf } else { bounce.pdf.all(f32::INFINITY) };
        let path = PathLanes { throughput, pdf, position: place.position, normal: place.normal, sampler, slot };
        next.append(go_on, origin, bounce.wi, &path);
        if let Some(next_media) = &mut next.media {
            next_media.extend(lanes_of(go_on).map(|lane| media[lane]));
        }
    }
}

/// What the lanes of `go_on` must remember against paths from the lamps, one at a time.
///
/// - `media`: behind the bounce; `is_first`: these are the hits of camera rays.
#[inline(always)]
fn follow<S: Simd>(
    pass: &CausticPass,
    at: &At<S>,
    place: &Place<S>,
    bounce: &Bounce<S>,
    go_on: Mask,
    is_first: bool,
    media: &[MediumStack; LANES],
) -> impl Iterator<Item = Track> {
    let vectors = [place.position, place.geometric_normal, place.normal, place.wo, bounce.wi].map(|v| v.to_arrays());
    let [us, vs, pdfs] = [place.uv[0], place.uv[1], bounce.pdf].map(|x| x.to_array());
    let (front, transmitted) = (place.front, bounce.transmitted);
    lanes_of(go_on).map(move |lane| {
        let i = at.indices[lane] as usize;
        let [position, geometric_normal, normal, wo, wi] =
            std::array::from_fn(|k| Vec3::new(vectors[k][0][lane], vectors[k][1][lane], vectors[k][2][lane]));
        let vertex = Vertex {
            position,
            error: Vec3::ZERO,
            geometric_normal,
            normal,
            uv: Vec2::new(us[lane], vs[lane]),
            front: front >> lane & 1 != 0,
            wo,
            lift: Vec3::ZERO,
        };
        let (before, after) = (at.paths.media_of(i), media[lane]);
        let bounce = super::caustics::Bounce {
            vertex: &vertex,
            hit: &at.hits.get(i).expect("a hit is being shaded"),
            eye: is_first.then(|| at.paths.rays.get(i).origin),
            wi,
            pdf: pdfs[lane],
            transmitted: transmitted >> lane & 1 != 0,
            blended: false,
            before,
            after,
        };
        let lobe = || lobe_at(at.scene, at.materials[i], &vertex, &before);
        pass.follow(at.paths.track_of(i), &bounce, || lobe().map_or(0.0, |lobe| lobe.eval(wi, wo, normal).1))
    })
}

#[inline(always)]
fn lanes_of(mask: Mask) -> impl Iterator<Item = usize> {
    (0..LANES).filter(move |lane| mask >> lane & 1 != 0)
}

/// The parameters of the surfaces; black and without lobe only where the scalar code would say so too.
#[inline(always)]
fn surface_of<S: Simd, const KIND: usize>(s: S, at: &At<S>, place: &Place<S>) -> Surface<S> {
    let table = &at.scene.shading.material_table;
    let material = Bits::gather(at.materials, at.index);
    let flags = Bits::gather(&table.flags, material);
    let mut color = Vector::gather(&table.color, material);
    let mut alpha = Float::splat(s, 0.0);
    if KIND == METAL {
        alpha = Float::gather(&table.alpha, material);
    }
    let textured = at.mask & flags.has(tables::TEXTURED);
    if at.scene.shading.features.textures && textured != 0 && KIND != GLASS {
        let (us, vs) = (place.uv[0].to_array(), place.uv[1].to_array());
        let (mut colors, mut alphas) = (color.to_arrays(), alpha.to_array());
        for lane in lanes_of(textured) {
            let uv = Vec2::new(us[lane], vs[lane]);
            let material = at.materials[at.indices[lane] as usize];
            let found = color_at(at.scene, material, uv);
            (colors[0][lane], colors[1][lane], colors[2][lane]) = (found.x, found.y, found.z);
            if KIND == METAL {
                alphas[lane] = scalar_at(at.scene, material, uv);
            }
        }
        color = Vector::from_arrays(s, &colors);
        alpha = Float::load(s, &alphas);
    }
    if KIND == METAL {
        let metal = MetalLanes::new(s, at.mask, place.normal, place.wo, alpha, color, flags);
        let smooth = Float::splat(s, SMALLEST_ALPHA).le(alpha);
        return Surface { color, metal: Some(metal), smooth };
    }
    Surface { color, metal: None, smooth: if KIND == DIFFUSE { Mask::MAX } else { 0 } }
}

/// f · cos, and the density of finding `wi` by a bounce; zero for `wi` behind the normal.
#[inline(always)]
fn eval<S: Simd, const KIND: usize>(surface: &Surface<S>, place: &Place<S>, wi: Vector<S>) -> (Vector<S>, Float<S>) {
    let cos = place.normal.dot(wi);
    let above = cos.is_positive();
    let zero = cos.all(0.0);
    if let Some(metal) = &surface.metal
        && KIND == METAL
    {
        let found = metal.eval(metal.local(wi));
        let valid = above & metal.facing();
        let value = found.tint * found.value;
        let pdf = select(valid, found.pdf, zero);
        return (value, pdf);
    }
    let pdf = select(above, cos * FRAC_1_PI, zero);
    (surface.color * pdf, pdf)
}

#[inline(always)]
fn sample<S: Simd, const KIND: usize>(
    s: S,
    at: &At<S>,
    surface: &Surface<S>,
    place: &Place<S>,
    sampler: &SamplerLanes<S>,
    dimension: u32,
    media: &[MediumStack; LANES],
) -> Bounce<S> {
    let infinite = Float::splat(s, f32::INFINITY);
    let normal = place.normal;
    let cos_o = normal.dot(place.wo);
    match KIND {
        DIFFUSE => {
            let local = cosine_hemisphere(sampler.pair(dimension + DIM_DIRECTION));
            let wi = local.to_world(&frame_around(normal));
            let go_on = local.z.is_positive();
            Bounce { go_on, wi, weight: surface.color, pdf: local.z * FRAC_1_PI, transmitted: 0 }
        }
        METAL => {
            let metal = surface.metal.as_ref().expect("metal has metal parameters");
            let [wi, local] = metal.sample(sampler.pair(dimension + DIM_DIRECTION));
            let found = metal.eval(local);
            let go_on = metal.facing() & local.z.is_positive();
            let mut bounce = Bounce { go_on, wi, weight: found.tint * found.weight, pdf: found.pdf, transmitted: 0 };
            if !surface.smooth & at.mask != 0 {
                let smooth = surface.smooth;
                let tint = metal::fresnel(metal.flags, metal.reflectance, cos_o);
                bounce.go_on |= !smooth;
                bounce.wi = select_vector(smooth, bounce.wi, mirrored(place.wo, normal));
                bounce.weight = select_vector(smooth, bounce.weight, tint);
                bounce.pdf = select(smooth, bounce.pdf, infinite);
            }
            bounce
        }
        GLASS => {
            let mut eta = [1.0; LANES];
            for lane in lanes_of(at.mask) {
                let material = at.materials[at.indices[lane] as usize];
                eta[lane] = media[lane].eta(at.scene, material, place.front >> lane & 1 != 0);
            }
            let eta = Float::load(s, &eta);
            let one = eta.all(1.0);
            let cos_i = cos_o.at_least(0.0).at_most(1.0);
            let cos2_t = (one - eta) * (eta + 1.0) + (eta * cos_i) * (eta * cos_i);
            let total = cos2_t.le(eta.all(0.0));
            let cos_t = cos2_t.at_least(0.0).sqrt();
            let perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
            let parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
            let reflectance = (perpendicular * perpendicular + parallel * parallel) * 0.5;
            let alike = s.eq(eta.v, one.v) & !total;
            let reflectance = select(total, one, select(alike, eta.all(0.0), reflectance));
            let cos_t = select(alike, cos_i, cos_t);
            let reflected = sampler.single(dimension + DIM_LOBE).lt(reflectance);
            let refracted = place.wo * -eta + normal * (eta * cos_o - cos_t);
            let wi = select_vector(reflected, mirrored(place.wo, normal), refracted.normalize());
            let squeeze = select(reflected, one, eta * eta);
            let weight = Vector { x: squeeze, y: squeeze, z: squeeze };
            Bounce { go_on: Mask::MAX, wi, weight, pdf: infinite, transmitted: !reflected }
        }
        _ => {
            let wi = mirrored(place.wo, normal);
            Bounce { go_on: Mask::MAX, wi, weight: surface.color, pdf: infinite, transmitted: 0 }
        }
    }
}

#[inline(always)]
fn mirrored<S: Simd>(wo: Vector<S>, normal: Vector<S>) -> Vector<S> {
    (normal * (normal.dot(wo) * 2.0) - wo).normalize()
}

/// A point on a light for each lane.
struct Points<S: Simd> {
    found: Mask,
    /// Lanes whose light comes from outside the scene.
    infinite: Mask,
    target: Vector<S>,
    wi: Vector<S>,
    pdf: Float<S>,
    radiance: Vector<S>,
}

#[inline(always)]
fn light_points<S: Simd>(
    s: S,
    scene: &Snapshot,
    techniques: &Techniques,
    mask: Mask,
    place: &Place<S>,
    sampler: &SamplerLanes<S>,
    dimension: u32,
) -> Points<S> {
    let shading = &*scene.shading;
    if shading.environment_sampler.is_none() {
        let u = sampler.pair(dimension + DIM_LIGHT_POINT);
        let found = shading.lights.sample_lanes(techniques, mask, place.position, place.normal, u);
        if let Some(LightLanes { found, target, wi, pdf, radiance }) = found {
            return Points { found, infinite: 0, target, wi, pdf, radiance };
        }
    }
    let (positions, normals) = (place.position.to_arrays(), place.normal.to_arrays());
    let parts = [sampler.stream, sampler.reversed_index, sampler.screen].map(|part| part.to_array());
    let mut arrays = [[0.0; LANES]; 10];
    let (mut found, mut infinite) = (0, 0);
    for lane in lanes_of(mask) {
        let at = |arrays: &[[f32; LANES]; 3]| Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane]);
        let sampler = Sampler::from_parts([0, 1, 2].map(|part: usize| parts[part][lane]));
        let point = choose_light_point(scene, techniques, at(&positions), at(&normals), &sampler, dimension);
        if let Some((target, sample)) = point {
            found |= 1 << lane;
            infinite |= Mask::from(target.is_none()) << lane;
            let values = [sample.target, sample.wi, sample.radiance];
            let values = values.iter().flat_map(|v| v.to_array()).chain([sample.pdf]);
            arrays.iter_mut().zip(values).for_each(|(array, value)| array[lane] = value);
        }
    }
    let [a, b, c, d, e, f, g, h, i, pdf] = arrays;
    Points {
        found,
        infinite,
        target: Vector::from_arrays(s, &[a, b, c]),
        wi: Vector::from_arrays(s, &[d, e, f]),
        pdf: Float::load(s, &pdf),
        radiance: Vector::from_arrays(s, &[g, h, i]),
    }
}

/// Weight of light that light sampling found with density `own`, and a bounce would have found with `other`.
#[inline(always)]
fn light_weight<S: Simd>(techniques: &Techniques, own: Float<S>, other: Float<S>) -> Float<S> {
    let one = own.all(1.0);
    if !techniques.mis {
        return one;
    }
    let ratio = other / own;
    one / (ratio * ratio + 1.0)
}

/// What is left of light after `distance` metres, lane by lane.
#[inline(always)]
fn transmittance<S: Simd>(
    s: S,
    scene: &Snapshot,
    mask: Mask,
    media: &[MediumStack; LANES],
    distance: Float<S>,
) -> Vector<S> {
    let distances = distance.to_array();
    let mut kept = [[1.0; LANES]; 3];
    for lane in lanes_of(mask) {
        let found = media[lane].transmittance(scene, distances[lane]);
        (kept[0][lane], kept[1][lane], kept[2][lane]) = (found.x, found.y, found.z);
    }
    Vector::from_arrays(s, &kept)
}
