//! Hits on emitters, sixteen at a time.

use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::simd::shade::KindHits;
use crate::shading::environment_sampling::environment_share;
use crate::shading::lights::bounce_weight;
use crate::shading::simd::lane_group::LaneGroup;
use crate::shading::simd::lanes::{lanes_of, transmittance};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Mask, Real, Simd, Vector, dispatch, select};
use glam::Vec3;

/// Adds the emission of hits with the MIS weight against light sampling.
///
/// Requires [`crate::prepare::light::LightTable::has_lanes`] and no textured emission, see
/// [`crate::prepare::material_table::MaterialTable`]; `dimension`, `survival`, `next` and `shadows` of the group are
/// unused.
pub(crate) fn shade_emitters(set: InstructionSet, group: KindHits) {
    dispatch!(set, shade_emissive(group: KindHits));
}

#[inline(always)]
fn shade_emissive<S: Simd>(s: S, group: KindHits) {
    let KindHits { scene, techniques, caustics, paths, hits, materials, order, ref sets, .. } = group;
    let tables = &*scene.tables;
    for chunk in order.chunks(LANES) {
        let LaneGroup { indices, mask } = LaneGroup::of(chunk);
        let index = Bits::load(s, &indices);
        let at = HitGroup { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = SurfaceLanes::of(s, &at);
        let pdf = Float::gather(&paths.pdf, index);
        let distance = Float::gather(&hits.t, index);
        let color = Vector::gather(&tables.materials.color, Bits::gather(materials, index));
        let mut light = Vector::gather(&paths.throughput, index).times(color);
        let mut weight = pdf.all(1.0);
        let rivals = mask & place.front & pdf.lt(pdf.all(f32::INFINITY));
        if rivals != 0 {
            let mut id = [0; LANES];
            let mut known = 0;
            for lane in lanes_of(rivals) {
                let i = indices[lane] as usize;
                if let Some(light) = tables.lights.light_of(hits.object[i], hits.prim[i], true) {
                    id[lane] = light;
                    known |= 1 << lane;
                }
            }
            let from = [Vector::gather(&paths.position, index), Vector::gather(&paths.normal, index)];
            let id = Bits::load(s, &id);
            // Behind a pane, the ray starts closer.
            let from_vertex = if tables.features.panes { (place.position - from[0]).length() } else { distance };
            let mut other = tables.lights.pdf_lanes(techniques, known, id, from, -place.wo, from_vertex);
            other = other * (other.all(1.0) - environment_share(scene, techniques, from[0], from[1]));
            if tables.materials.two_sided {
                other = with_two_sided(other, from_vertex, &group, &indices, known);
            }
            weight = select(known, bounce_weight(techniques, pdf, other), weight);
        }
        if let Some(pass) = caustics {
            weight = light_path_weights(s, pass, &at, &place, weight);
        }
        light = light * weight;
        if scene.tables.features.media {
            let media = indices.map(|i| paths.media_of(i as usize));
            light = light.times(transmittance(s, sets, mask, &media, distance));
        }
        let light = light.to_arrays();
        for lane in lanes_of(mask & place.front) {
            let slot = paths.slot[indices[lane] as usize];
            group.radiance[slot as usize] += Vec3::new(light[0][lane], light[1][lane], light[2][lane]);
        }
    }
}

/// Replaces the pdfs of light sampling for points that sampled both sides, one at a time.
fn with_two_sided<S: Simd>(
    pdf: Float<S>,
    distance: Float<S>,
    group: &KindHits,
    indices: &[u32; LANES],
    mask: Mask,
) -> Float<S> {
    let KindHits { scene, techniques, paths, hits, .. } = *group;
    let (mut pdfs, distances) = (pdf.to_array(), distance.to_array());
    for lane in lanes_of(mask) {
        let i = indices[lane] as usize;
        let path = paths.get(i);
        if path.normal == Vec3::ZERO
            && let Some(id) = scene.tables.lights.light_of(hits.object[i], hits.prim[i], true)
        {
            let (dir, distance) = (paths.rays.get(i).dir, distances[lane]);
            let pdf = scene.tables.lights.pdf(techniques, id, path.position, path.normal, dir, distance);
            let share = environment_share(scene, techniques, path.position.into(), path.normal.into());
            pdfs[lane] = (1.0 - share) * pdf;
        }
    }
    Float::load(pdf.s, &pdfs)
}

/// Replaces the weights of light that light paths could find as well, one at a time.
#[inline(always)]
fn light_path_weights<S: Simd>(
    s: S,
    pass: &CausticPass,
    at: &HitGroup<S>,
    place: &SurfaceLanes<S>,
    weight: Float<S>,
) -> Float<S> {
    let mut gathered = 0;
    for lane in lanes_of(at.mask & place.front) {
        gathered |= Mask::from(at.paths.track_of(at.indices[lane] as usize).is_gathered()) << lane;
    }
    if gathered == 0 {
        return weight;
    }
    let mut weights = weight.to_array();
    let vertices = place.stored();
    for lane in lanes_of(gathered) {
        let i = at.indices[lane] as usize;
        let hit = at.hits.get(i).expect("a hit is being shaded");
        let found = pass.camera_weight(&at.paths.track_of(i), at.paths.media_of(i), &hit, &vertices.vertex(lane));
        weights[lane] = found.unwrap_or(weights[lane]);
    }
    Float::load(s, &weights)
}
