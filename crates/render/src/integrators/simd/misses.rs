//! Rays that leave the scene, sixteen at a time.

use crate::core::techniques::Techniques;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::prepare::prepared::Prepared;
use crate::shading::environment_sampling::EnvironmentSampling;
use crate::shading::lights::bounce_weight;
use crate::shading::medium::MediumSets;
use crate::shading::paths::PathBatch;
use crate::shading::simd::lane_group::{LaneGroup, iors};
use crate::shading::simd::lanes::lanes_of;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Real, Simd, Vector, dispatch, select};
use glam::Vec3;

/// Rays that leave the scene.
pub(crate) struct Misses<'a> {
    pub scene: &'a Prepared,
    pub techniques: &'a Techniques,
    pub caustics: Option<&'a CausticPass<'a>>,
    pub paths: &'a PathBatch,
    pub sets: &'a MediumSets,
    /// Indices of the rays.
    pub order: &'a [u32],
    /// By slot.
    pub radiance: &'a mut [Vec3],
}

/// Adds the radiance of the environment along the rays, with the MIS weights against light sampling and light paths.
pub(crate) fn shade_misses(set: InstructionSet, misses: Misses) {
    dispatch!(set, shade(misses: Misses));
}

#[inline(always)]
fn shade<S: Simd>(s: S, misses: Misses) {
    let Misses { scene, techniques, caustics, paths, sets, order, radiance } = misses;
    if !scene.tables.features.environment {
        return;
    }
    let sampling = EnvironmentSampling::of(scene, techniques);
    for chunk in order.chunks(LANES) {
        let chunk = LaneGroup::of(chunk);
        let LaneGroup { indices, mask } = chunk;
        let index = Bits::load(s, &indices);
        let rays = &paths.rays;
        let dir = Vector {
            x: Float::gather(&rays.dir_x, index),
            y: Float::gather(&rays.dir_y, index),
            z: Float::gather(&rays.dir_z, index),
        };
        let mut arriving = scene.shading.environment.radiance_lanes(mask, dir);
        if let Some(sampling) = sampling {
            let pdf = Float::gather(&paths.pdf, index);
            let (position, normal) = (Vector::gather(&paths.position, index), Vector::gather(&paths.normal, index));
            let other = sampling.pdf_lanes(position, normal, dir) * sampling.share(position, normal);
            let weight = bounce_weight(techniques, pdf, other);
            // All others could only have been found so.
            arriving = arriving * select(pdf.lt(pdf.all(f32::INFINITY)), weight, pdf.all(1.0));
        }
        let mut throughput = Vector::gather(&paths.throughput, index);
        if scene.tables.features.glass {
            // See [`MediumSets::environment_scale`].
            let ior = iors(s, scene, sets, mask, &chunk.media(scene, paths));
            throughput = throughput * (ior * ior);
        }
        if let Some(pass) = caustics
            && pass.casters.has_environment()
        {
            arriving = arriving * light_path_weights(s, pass, paths, &chunk);
        }
        let light = throughput.times(arriving).to_arrays();
        for lane in lanes_of(mask) {
            let slot = paths.slot[indices[lane] as usize];
            radiance[slot as usize] += Vec3::new(light[0][lane], light[1][lane], light[2][lane]);
        }
    }
}

/// MIS weights against light paths, one at a time; 1 where no light path can be the path.
#[inline(always)]
fn light_path_weights<S: Simd>(s: S, pass: &CausticPass, paths: &PathBatch, chunk: &LaneGroup) -> Float<S> {
    let mut weights = [1.0; LANES];
    for lane in lanes_of(chunk.mask) {
        let i = chunk.indices[lane] as usize;
        let track = paths.track_of(i);
        if track.is_gathered() {
            let weight = pass.environment_weight(&track, paths.media_of(i), paths.rays.get(i).dir);
            weights[lane] = weight.unwrap_or(1.0);
        }
    }
    Float::load(s, &weights)
}
