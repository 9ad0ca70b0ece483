//! Emission of surfaces that scatter as well.

use crate::core::techniques::Techniques;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::emission::emitted_light;
use crate::prepare::material_table::EMITS;
use crate::shading::paths::Path;
use crate::shading::simd::hints::vec3_of;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::vertex::Vertex;
use firstlight_simd::{Bits, Simd, Vector};
use glam::Vec3;

/// Adds what is emitted towards sixteen paths, one at a time.
#[inline(always)]
pub(crate) fn add_emission<S: Simd>(
    at: &HitGroup<S>,
    techniques: &Techniques,
    caustics: Option<&CausticPass>,
    place: &SurfaceLanes<S>,
    throughput: Vector<S>,
    radiance: &mut [Vec3],
) {
    let materials = Bits::gather(at.materials, at.index);
    let emits = at.mask & Bits::gather(&at.scene.tables.materials.flags, materials).has(EMITS);
    if emits == 0 {
        return;
    }
    let (vertices, throughput) = (place.stored(), throughput.to_arrays());
    for lane in lanes_of(emits) {
        let i = at.indices[lane] as usize;
        let hit = at.hits.get(i).expect("a hit is being shaded");
        let Some(emission) = &at.scene.tables.emission[at.materials[i] as usize] else { continue };
        let path = Path { throughput: vec3_of(&throughput, lane), ..at.paths.get(i) };
        let vertex = Vertex { texture_point: at.texture_point(lane, vertices.uv()), ..vertices.vertex(lane) };
        radiance[path.slot as usize] += emitted_light(at.scene, techniques, caustics, &path, &hit, &vertex, emission);
    }
}
