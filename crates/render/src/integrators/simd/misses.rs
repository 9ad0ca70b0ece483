//! Rays that leave the scene, sixteen at a time.

use crate::core::techniques::Techniques;
use crate::prepare::prepared::Prepared;
use crate::shading::environment_sampling::EnvironmentSampling;
use crate::shading::lights::bounce_weight;
use crate::shading::medium::MediumSets;
use crate::shading::paths::PathBatch;
use crate::shading::simd::lane_group::{LaneGroup, iors};
use crate::shading::simd::lanes::lanes_of;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Real, Simd, Vector, dispatch, select};
use glam::Vec3;

/// Adds the radiance of the environment along the rays of `order`, with the MIS weight against light sampling.
pub(crate) fn shade_misses(
    set: InstructionSet,
    scene: &Prepared,
    techniques: &Techniques,
    paths: &PathBatch,
    sets: &MediumSets,
    order: &[u32],
    radiance: &mut [Vec3],
) {
    dispatch!(
        set,
        misses(scene: &Prepared, techniques: &Techniques, paths: &PathBatch, sets: &MediumSets, order: &[u32], radiance: &mut [Vec3])
    );
}

#[inline(always)]
fn misses<S: Simd>(
    s: S,
    scene: &Prepared,
    techniques: &Techniques,
    paths: &PathBatch,
    sets: &MediumSets,
    order: &[u32],
    radiance: &mut [Vec3],
) {
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
        let light = throughput.times(arriving).to_arrays();
        for lane in lanes_of(mask) {
            let slot = paths.slot[indices[lane] as usize];
            radiance[slot as usize] += Vec3::new(light[0][lane], light[1][lane], light[2][lane]);
        }
    }
}
