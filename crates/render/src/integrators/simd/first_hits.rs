//! Features of camera rays that hit diffuse or layered surfaces, sixteen at a time; see [`crate::integrators::features`].

use crate::integrators::common::seen::Seen;
use crate::prepare::layer_table::{LAYERED, LAYERED_RICHLY};
use crate::prepare::material_table::EMITS;
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use crate::shading::simd::bounce::colors_of;
use crate::shading::simd::lane_group::LaneGroup;
use crate::shading::simd::lanes::{DIFFUSE, lanes_of};
use crate::shading::simd::layers::principled_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_kdtree::HitBatch;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Real, Simd, Vector, dispatch};
use glam::Vec3;

/// Hits of camera rays on materials of one kind.
pub(crate) struct FirstHits<'a> {
    pub scene: &'a Prepared,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    /// Material per hit.
    pub materials: &'a [u32],
    /// Indices of the hits.
    pub order: &'a [u32],
    /// Features by slot.
    pub seen: &'a mut [Seen],
    /// Receives the indices of the hits that are left to the scalar code: those that emit, or do nothing but mirror.
    pub left: &'a mut Vec<u32>,
}

/// Stores the features of each hit, or leaves it; false if hits on materials of a kind are not supported.
pub(crate) fn see_first_hits(set: InstructionSet, kind: usize, group: FirstHits) -> bool {
    match kind {
        DIFFUSE => dispatch!(set, see::<_, DIFFUSE>(group: FirstHits)),
        LAYERED | LAYERED_RICHLY => dispatch!(set, see::<_, LAYERED>(group: FirstHits)),
        _ => return false,
    }
    true
}

#[inline(always)]
fn see<S: Simd, const KIND: usize>(s: S, group: FirstHits) {
    let FirstHits { scene, paths, hits, materials, order, seen, left } = group;
    let forward = Vector::splat(s, scene.camera.forward);
    for chunk in order.chunks(LANES) {
        let LaneGroup { indices, mask } = LaneGroup::of(chunk);
        let index = Bits::load(s, &indices);
        let at = HitGroup { scene, paths, hits, materials, index, indices: &indices, mask };
        let mut place = SurfaceLanes::of(s, &at);
        let material = Bits::gather(materials, index);
        let (color, here) = if KIND == LAYERED {
            let layers = principled_of(s, &at, &mut place);
            let emits = Bits::gather(&scene.tables.materials.flags, material).has(EMITS);
            (layers.color(), mask & layers.scatters() & !emits)
        } else {
            (colors_of(s, &at, &place, material), at.without_black_backs(&place))
        };
        let (zero, one) = (Float::splat(s, 0.0), Float::splat(s, 1.0));
        let within = |channel: Float<S>| channel.max(zero).min(one).to_array();
        let albedo = [within(color.x), within(color.y), within(color.z)];
        let (normal, position) = (place.normal.to_arrays(), place.position.to_arrays());
        // `wo` is the negated direction of the ray.
        let depth = (Float::gather(&hits.t, index) * -place.wo.dot(forward)).to_array();
        let vector =
            |arrays: &[[f32; LANES]; 3], lane: usize| Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane]);
        for lane in lanes_of(here) {
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
        left.extend(lanes_of(mask & !here).map(|lane| indices[lane]));
    }
}
