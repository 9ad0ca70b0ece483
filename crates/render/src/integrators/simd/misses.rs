//! Rays that leave the scene, sixteen at a time, for environments that are no images.

use crate::core::environment::{Environment, sky_gradient};
use crate::prepare::prepared::Prepared;
use crate::shading::medium::MediumSets;
use crate::shading::paths::PathBatch;
use crate::shading::simd::lane_group::{LaneGroup, iors};
use crate::shading::simd::lanes::lanes_of;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Simd, Vector, dispatch};
use glam::Vec3;

/// Adds the radiance of the environment along the rays of `order`; see [`Environment::radiance`].
pub(crate) fn shade_misses(
    set: InstructionSet,
    scene: &Prepared,
    paths: &PathBatch,
    sets: &MediumSets,
    order: &[u32],
    radiance: &mut [Vec3],
) {
    dispatch!(
        set,
        misses(scene: &Prepared, paths: &PathBatch, sets: &MediumSets, order: &[u32], radiance: &mut [Vec3])
    );
}

#[inline(always)]
fn misses<S: Simd>(s: S, scene: &Prepared, paths: &PathBatch, sets: &MediumSets, order: &[u32], radiance: &mut [Vec3]) {
    for chunk in order.chunks(LANES) {
        let chunk = LaneGroup::of(chunk);
        let LaneGroup { indices, mask } = chunk;
        let index = Bits::load(s, &indices);
        let arriving = match &scene.shading.environment {
            Environment::Black => return,
            Environment::Constant(light) => Vector::splat(s, *light),
            Environment::Gradient { zenith, horizon, ground } => {
                let colors = [Vector::splat(s, *zenith), Vector::splat(s, *horizon), Vector::splat(s, *ground)];
                sky_gradient(colors, Float::gather(&paths.rays.dir_y, index))
            }
            Environment::Image { .. } => {
                let mut found = [[0.0; LANES]; 3];
                for lane in lanes_of(mask) {
                    let light = scene.shading.environment.radiance(paths.rays.get(indices[lane] as usize).dir);
                    (found[0][lane], found[1][lane], found[2][lane]) = (light.x, light.y, light.z);
                }
                Vector::from_arrays(s, &found)
            }
        };
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
