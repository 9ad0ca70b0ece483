//! Light samples for sixteen points, in SIMD where the lights support it; see
//! [`crate::shading::lights::choose_light_point`].

use crate::core::techniques::Techniques;
use crate::prepare::light::arrays::LightLanes;
use crate::prepare::prepared::Prepared;
use crate::sampling::{Sampler, SamplerLanes};
use crate::shading::dimensions::{DIM_LIGHT, DIM_LIGHT_POINT};
use crate::shading::lights::choose_light_point;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::SurfaceLanes;
use firstlight_simd::{Float, Kernel, LANES, Mask, Simd, Vector};
use glam::Vec3;

/// A light sample per lane.
pub(crate) struct FoundLights<S: Simd> {
    pub found: Mask,
    /// Lanes whose light is infinitely far away.
    pub infinite: Mask,
    pub target: Vector<S>,
    pub wi: Vector<S>,
    pub pdf: Float<S>,
    pub radiance: Vector<S>,
}

/// Arguments for a light sample per lane of `mask`; all kinds of materials share the code of the kernel.
pub(crate) struct LightPoints<'a, S: Simd> {
    pub scene: &'a Prepared,
    pub techniques: &'a Techniques,
    pub mask: Mask,
    pub place: &'a SurfaceLanes<S>,
    pub sampler: &'a SamplerLanes<S>,
    pub dimension: u32,
}

impl<S: Simd> Kernel<S> for LightPoints<'_, S> {
    type Output = FoundLights<S>;

    #[inline(always)]
    fn run(self, s: S) -> FoundLights<S> {
        light_points(s, &self)
    }
}

#[inline(always)]
fn light_points<S: Simd>(s: S, asked: &LightPoints<S>) -> FoundLights<S> {
    let &LightPoints { scene, techniques, mask, place, sampler, dimension } = asked;
    let tables = &*scene.tables;
    if tables.environment_sampler.is_none() {
        let u = sampler.pair(dimension + DIM_LIGHT_POINT);
        let mut u_select = u[0];
        if tables.lights.selects_apart() {
            u_select = sampler.single(dimension + DIM_LIGHT);
        }
        let found = tables.lights.sample_lanes(techniques, mask, place.position, place.normal, u_select, u);
        if let Some(LightLanes { found, target, wi, pdf, radiance, is_far }) = found {
            return FoundLights { found, infinite: is_far, target, wi, pdf, radiance };
        }
    }
    let (positions, normals) = (place.position.to_arrays(), place.normal.to_arrays());
    let parts = [sampler.stream.to_array(), sampler.reversed_index.to_array(), sampler.screen.to_array()];
    let mut arrays = [[0.0; LANES]; 10];
    let (mut found, mut infinite) = (0, 0);
    for lane in lanes_of(mask) {
        let at = |arrays: &[[f32; LANES]; 3]| Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane]);
        let sampler = Sampler::from_parts([parts[0][lane], parts[1][lane], parts[2][lane]]);
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
    FoundLights {
        found,
        infinite,
        target: Vector::from_arrays(s, &[a, b, c]),
        wi: Vector::from_arrays(s, &[d, e, f]),
        pdf: Float::load(s, &pdf),
        radiance: Vector::from_arrays(s, &[g, h, i]),
    }
}
