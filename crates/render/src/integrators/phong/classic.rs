//! The classic model for sixteen hits at a time; see `phong/` for the scalar code and the model.
//!
//! Supports diffuse surfaces and those with one part that sends a ray. Each hit sends at most one ray and samples each
//! light once, and the rays to one light are stored together: so the order in which contributions are added to a pixel
//! does not depend on which hits share a register.

use crate::integrators::common::survival::{ENDLESS_SURVIVAL, endless_depth};
use crate::integrators::phong::lobe::{
    AMBIENT_SHARE, DIM_ENVIRONMENT, DIM_SHINY, DIRECT_ALREADY_SAMPLED, least_weight, lobe_pdf, within_lobe,
};
use crate::integrators::phong::shadow::Shadows;
use crate::prepare::classic_table::{GLOSS, Inputs, MATTE, ROUGH};
use crate::prepare::light::arrays::LightLanes;
use crate::prepare::material_table::SCHLICK;
use crate::prepare::prepared::Prepared;
use crate::sampling::{Sampler, SamplerLanes};
use crate::shading::dielectric;
use crate::shading::lights::power_heuristic;
use crate::shading::medium::MediumSets;
use crate::shading::metal::Tint;
use crate::shading::paths::{PathBatch, PathLanes};
use crate::shading::simd::lane_group::{LaneGroup, iors};
use crate::shading::simd::lanes::{lanes_of, transmittance};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::simd::texture::looked_up;
use firstlight_kdtree::HitBatch;
use firstlight_simd::{
    Bits, Float, InstructionSet, Kernel, LANES, Mask, Real, Simd, Vector, dispatch, select, select_vector,
};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Hits on materials of one kind of a [`crate::prepare::classic_table::ClassicTable`], and their outputs.
pub(crate) struct ClassicGroup<'a> {
    pub scene: &'a Prepared,
    pub kind: u32,
    /// Number of segments so far.
    pub depth: u32,
    /// First sample dimension of the vertices.
    pub dimension: u32,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    /// Material per hit.
    pub materials: &'a [u32],
    /// Indices of the hits.
    pub order: &'a [u32],
    pub next: &'a mut PathBatch,
    pub shadows: &'a mut Shadows,
    pub sets: &'a MediumSets,
    pub radiance: &'a mut [Vec3],
}

/// Whether [`shade_classic`] supports hits of a kind.
pub(crate) fn knows_classic(scene: &Prepared, kind: u32) -> bool {
    let lights = &scene.tables.lights;
    kind >= MATTE && (lights.is_empty() || lights.has_lanes())
}

/// Shades hits. Ambient light is added at once; direct light waits for its shadow rays.
pub(crate) fn shade_classic(set: InstructionSet, group: ClassicGroup) {
    dispatch!(set, shade(group: ClassicGroup));
}

/// The parts that direct light contributes to.
struct Lit<S: Simd> {
    mask: Mask,
    weight: Vector<S>,
    matte: Vector<S>,
    gloss: Option<Gloss<S>>,
}

/// A lobe of highlights.
struct Gloss<S: Simd> {
    tint: Vector<S>,
    exponent: Float<S>,
    mirrored: Vector<S>,
    rough: bool,
}

/// Arguments of [`crate::prepare::light::LightTable::sample_each`]; a separate function because of its size.
struct AskLight<'a, S: Simd> {
    scene: &'a Prepared,
    k: u32,
    mask: Mask,
    position: Vector<S>,
    sampler: &'a SamplerLanes<S>,
    dimension: u32,
}

impl<S: Simd> Kernel<S> for AskLight<'_, S> {
    type Output = (LightLanes<S>, Mask);

    #[inline(always)]
    fn run(self, _: S) -> Self::Output {
        let Self { scene, k, mask, position, sampler, dimension } = self;
        let textures = &scene.shading.textures;
        scene.tables.lights.sample_each_lanes(textures, k, mask, position, sampler, dimension)
    }
}

#[inline(always)]
fn shade<S: Simd>(s: S, group: ClassicGroup) {
    let ClassicGroup { scene, kind, depth, dimension, paths, hits, materials, order, next, shadows, sets, radiance } =
        group;
    let (tables, features) = (&*scene.tables, &scene.tables.features);
    let table = &tables.classic;
    let n_lights = tables.lights.n_each();
    let zero = Float::splat(s, 0.0);
    for chunk in order.chunks(LANES) {
        let chunk = LaneGroup::of(chunk);
        let LaneGroup { indices, mask } = chunk;
        let index = Bits::load(s, &indices);
        let at = HitGroup { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = SurfaceLanes::of(s, &at);
        let mut weight = Vector::gather(&paths.throughput, index);
        let sampler = paths.sampler_lanes(index);
        let slot = Bits::gather(&paths.slot, index);
        let media = chunk.media(scene, paths);
        if features.media {
            weight = weight.times(transmittance(s, sets, mask, &media, Float::gather(&hits.t, index)));
        }
        let row = Bits::gather(materials, index);
        let matte = color_of(s, &at, &table.matte, row, &place) * Float::gather(&table.matte.weight, row);
        let leaving = place.leaving();
        let (mut tint, mut exponent, mut wi) = (matte, zero, place.wo);
        if kind != MATTE {
            tint = color_of(s, &at, &table.shiny, row, &place);
            let schlick = Bits::gather(&table.flags, row).has(SCHLICK);
            let reflectance = Tint { color: tint, schlick, index: None };
            tint = reflectance.at(place.normal.dot(place.wo)) * Float::gather(&table.shiny.weight, row);
            exponent = Float::gather(&table.exponent, row);
            wi = dielectric::reflect(place.wo, place.normal);
        }
        let gloss =
            (kind == GLOSS || kind == ROUGH).then_some(Gloss { tint, exponent, mirrored: wi, rough: kind == ROUGH });
        let is_black = if gloss.is_some() { 0 } else { matte.is_zero() };
        let lit = Lit { mask: mask & !is_black, weight, matte, gloss };
        if lit.mask != 0 {
            let mut ambient = Vector { x: zero, y: zero, z: zero };
            for k in 0..n_lights {
                let position = place.position;
                let asked = AskLight { scene, k: k as u32, mask: lit.mask, position, sampler: &sampler, dimension };
                let (light, is_point) = s.call(asked);
                let mut arriving = light.radiance * (zero.all(1.0) / light.pdf);
                if features.media {
                    let distance = (light.target - place.position).length();
                    let passed = arriving.times(transmittance(s, sets, light.found & !light.is_far, &media, distance));
                    arriving = select_vector(light.is_far, arriving, passed);
                }
                let share = arriving.mul_all(AMBIENT_SHARE * FRAC_1_PI);
                ambient = ambient + select_vector(light.found, share, Vector::splat(s, Vec3::ZERO));
                let pdf = select(is_point, zero, light.pdf);
                let (found, seen) = reflect(&lit, &place, light.found, light.wi, pdf, arriving);
                if found != 0 {
                    let rays = [leaving, select_vector(light.is_far, light.wi, light.target - leaving)];
                    let t_max = select(light.is_far, zero.all(f32::INFINITY), zero.all(1.0));
                    shadows.append(k, found, rays, t_max, slot, seen, light.target, &media);
                }
            }
            if tables.environment_sampler.is_some() {
                let (from, wi, pdf, arriving) =
                    ask_environment(s, scene, lit.mask, &sampler, dimension + DIM_ENVIRONMENT);
                let (found, seen) = reflect(&lit, &place, from, wi, pdf, arriving * (zero.all(1.0) / pdf));
                if found != 0 {
                    shadows.append(n_lights, found, [leaving, wi], zero.all(f32::INFINITY), slot, seen, wi, &media);
                }
            } else if features.environment {
                let mut around = tables.ambient.radiance(place.normal);
                if features.glass {
                    let ior = iors(s, scene, sets, lit.mask, &media);
                    around = around * (ior * ior);
                }
                ambient = ambient + around;
            }
            let returned = matte * Float::gather(&table.ambient, row);
            let light = weight.times(returned.times(ambient)).to_arrays();
            let slots = slot.to_array();
            for lane in lanes_of(lit.mask) {
                radiance[slots[lane] as usize] += Vec3::new(light[0][lane], light[1][lane], light[2][lane]);
            }
        }
        if kind == MATTE {
            continue;
        }
        let mut pdf = zero.all(if kind == GLOSS { DIRECT_ALREADY_SAMPLED } else { f32::INFINITY });
        if kind == ROUGH {
            let sampled = within_lobe(wi, exponent, sampler.pair(dimension + DIM_SHINY + 1));
            let above = sampled.dot(place.normal).is_positive() & sampled.dot(place.reach_normal).is_positive();
            pdf = select(above, lobe_pdf(exponent, wi.dot(sampled)), zero.all(DIRECT_ALREADY_SAMPLED));
            wi = select_vector(above, sampled, wi);
        }
        let mut throughput = weight.times(tint);
        let mut go_on = mask & wi.dot(place.reach_normal).is_positive();
        let ior = iors(s, scene, sets, go_on, &media);
        let most = throughput.abs().max_element() * (1.0 / least_weight(depth)) * ior * ior;
        let survival = most.at_most(if depth >= endless_depth(scene) { ENDLESS_SURVIVAL } else { 1.0 });
        let at_stake = go_on & survival.lt(survival.all(1.0));
        if at_stake != 0 {
            go_on &= !at_stake | sampler.single(dimension + DIM_SHINY).lt(survival);
            throughput = throughput * select(at_stake, zero.all(1.0) / survival, zero.all(1.0));
        }
        if go_on == 0 {
            continue;
        }
        let path = PathLanes { throughput, pdf, position: place.position, normal: place.normal, sampler, slot };
        next.append(go_on, leaving, wi, &path);
        if let Some(next_media) = &mut next.media {
            next_media.extend(lanes_of(go_on).map(|lane| media[lane]));
        }
    }
}

#[inline(always)]
fn color_of<S: Simd>(s: S, at: &HitGroup<S>, inputs: &Inputs, row: Bits<S>, place: &SurfaceLanes<S>) -> Vector<S> {
    let mut color = Vector::gather(&inputs.color, row);
    if at.scene.tables.features.textures {
        let textured = at.mask & Bits::gather(&inputs.textured, row).has(1);
        color = looked_up(s, at.scene, &inputs.inputs, row, textured, place, color);
    }
    color
}

/// Returns the lanes of `found` that reflect light from `wi` to the viewer, and the reflected radiance.
///
/// - `pdf`: of sampling `wi`, 0 for light from a point; see [`crate::integrators::phong`] for the share of rough
///   highlights.
#[inline(always)]
fn reflect<S: Simd>(
    lit: &Lit<S>,
    place: &SurfaceLanes<S>,
    found: Mask,
    wi: Vector<S>,
    pdf: Float<S>,
    arriving: Vector<S>,
) -> (Mask, Vector<S>) {
    let cos = place.normal.dot(wi);
    let found = found & cos.is_positive() & wi.dot(place.reach_normal).is_positive();
    if found == 0 {
        return (0, arriving);
    }
    let mut value = lit.matte * (cos * FRAC_1_PI);
    if let Some(gloss) = &lit.gloss {
        let mut lobe = lobe_pdf(gloss.exponent, gloss.mirrored.dot(wi));
        if gloss.rough {
            lobe = lobe * select(pdf.is_zero(), pdf.all(1.0), power_heuristic(pdf, lobe));
        }
        value = value + gloss.tint * lobe;
    }
    let light = lit.weight.times(value).times(arriving);
    (found & !light.is_zero(), light)
}

/// Samples directions of an environment image, one at a time: returns the lanes that found one, their pdf and radiance.
#[inline(always)]
fn ask_environment<S: Simd>(
    s: S,
    scene: &Prepared,
    mask: Mask,
    sampler: &SamplerLanes<S>,
    dimension: u32,
) -> (Mask, Vector<S>, Float<S>, Vector<S>) {
    let parts = [sampler.stream.to_array(), sampler.reversed_index.to_array(), sampler.screen.to_array()];
    let (mut dir, mut pdf, mut radiance) = ([[0.0; LANES]; 3], [1.0; LANES], [[0.0; LANES]; 3]);
    let mut found = 0;
    if let Some(environment) = &scene.tables.environment_sampler {
        for lane in lanes_of(mask) {
            let sampler = Sampler::from_parts([parts[0][lane], parts[1][lane], parts[2][lane]]);
            if let Some((wi, density)) = environment.sample(sampler.pair(dimension)) {
                let light = scene.shading.environment.radiance(wi);
                (dir[0][lane], dir[1][lane], dir[2][lane]) = (wi.x, wi.y, wi.z);
                (radiance[0][lane], radiance[1][lane], radiance[2][lane]) = (light.x, light.y, light.z);
                pdf[lane] = density;
                found |= 1 << lane;
            }
        }
    }
    (found, Vector::from_arrays(s, &dir), Float::load(s, &pdf), Vector::from_arrays(s, &radiance))
}
