//! Features of camera rays that hit diffuse surfaces, sixteen at a time; see [`crate::integrators::features`].

use crate::integrators::common::seen::Seen;
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use crate::shading::simd::bounce::colors_of;
use crate::shading::simd::lane_group::LaneGroup;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_kdtree::HitBatch;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Real, Simd, Vector, dispatch};
use glam::Vec3;

/// Hits of camera rays on plain diffuse materials.
pub(crate) struct DiffuseHits<'a> {
    pub scene: &'a Prepared,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    /// Material per hit.
    pub materials: &'a [u32],
    /// Indices of the hits.
    pub order: &'a [u32],
    /// Features by slot.
    pub seen: &'a mut [Seen],
}

/// Stores the features of each hit.
pub(crate) fn see_diffuse(set: InstructionSet, group: DiffuseHits) {
    dispatch!(set, see(group: DiffuseHits));
}

#[inline(always)]
fn see<S: Simd>(s: S, group: DiffuseHits) {
    let DiffuseHits { scene, paths, hits, materials, order, seen } = group;
    let forward = Vector::splat(s, scene.camera.forward);
    for chunk in order.chunks(LANES) {
        let LaneGroup { indices, mask } = LaneGroup::of(chunk);
        let index = Bits::load(s, &indices);
        let at = HitGroup { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = SurfaceLanes::of(s, &at);
        let color = colors_of(s, &at, &place, Bits::gather(materials, index));
        let (zero, one) = (Float::splat(s, 0.0), Float::splat(s, 1.0));
        let within = |channel: Float<S>| channel.max(zero).min(one).to_array();
        let albedo = [within(color.x), within(color.y), within(color.z)];
        let (normal, position) = (place.normal.to_arrays(), place.position.to_arrays());
        // `wo` is the negated direction of the ray.
        let depth = (Float::gather(&hits.t, index) * -place.wo.dot(forward)).to_array();
        let vector =
            |arrays: &[[f32; LANES]; 3], lane: usize| Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane]);
        for lane in lanes_of(mask) {
            let i = indices[lane] as usize;
            seen[paths.slot[i] as usize] = Seen {
                albedo: vector(&albedo, lane),
                emitted: Vec3::ZERO,
                normal: vector(&normal, lane),
                position: vector(&position, lane),
                depth: depth[lane],
                object: hits.object[i],
                material: materials[i],
            };
        }
    }
}
