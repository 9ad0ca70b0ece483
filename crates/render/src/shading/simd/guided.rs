//! Surfaces with guided sampling, sixteen at a time.

use crate::prepare::guide::SHARE;
use crate::sampling::SamplerLanes;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE};
use crate::shading::simd::bounce::Bounce;
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::lanes::{TRANSLUCENT, lanes_of};
use crate::shading::simd::scatter::{SurfaceScatter, eval};
use crate::shading::simd::surface::SurfaceLanes;
use firstlight_simd::{Real, Simd, Vector, select, select_vector};
use glam::Vec2;

impl HintLanes<'_> {
    /// Samples the guiding distributions in some of the lanes that have them, and weights all of these lanes over both
    /// techniques.
    #[inline(always)]
    pub fn follow<S: Simd, const KIND: usize>(
        &self,
        s: S,
        surface: &SurfaceScatter<S>,
        place: &SurfaceLanes<S>,
        sampler: &SamplerLanes<S>,
        dimension: u32,
        bounce: Bounce<S>,
    ) -> Bounce<S> {
        if self.told == 0 {
            return bounce;
        }
        let choice = sampler.single(dimension + DIM_LOBE);
        let sent = self.told & choice.lt(choice.all(SHARE));
        let mut wi = bounce.wi;
        if sent != 0 {
            let ([u, v], u_exit) = (sampler.pair(dimension + DIM_DIRECTION), choice / choice.all(SHARE));
            let (us, vs, exits, mut directions) = (u.to_array(), v.to_array(), u_exit.to_array(), wi.to_arrays());
            for lane in lanes_of(sent) {
                if let Some(hints) = &self.hints[lane] {
                    let wi = hints.sample(exits[lane], Vec2::new(us[lane], vs[lane]));
                    (directions[0][lane], directions[1][lane], directions[2][lane]) = (wi.x, wi.y, wi.z);
                }
            }
            wi = Vector::from_arrays(s, &directions);
        }
        let (value, pdf) = eval::<S, KIND>(surface, place, wi);
        let pdf = self.mixed(s, wi, pdf);
        // A specular part is sampled by the surface only.
        let specular = self.told & !sent & bounce.pdf.all(f32::MAX).lt(bounce.pdf);
        let mixed = self.told & !specular;
        let found = (sent | bounce.go_on) & pdf.is_positive() & !value.is_zero();
        let over_both = Vector { x: value.x / pdf, y: value.y / pdf, z: value.z / pdf };
        let weight = select_vector(mixed, over_both, bounce.weight);
        let alone = select_vector(specular, weight * (pdf.all(1.0) / pdf.all(1.0 - SHARE)), weight);
        Bounce {
            go_on: (bounce.go_on & !mixed) | (found & mixed),
            wi: select_vector(mixed, wi, bounce.wi),
            weight: alone,
            pdf: select(mixed, pdf, bounce.pdf),
            transmitted: if KIND == TRANSLUCENT {
                (mixed & wi.dot(place.normal).is_negative()) | (!mixed & bounce.transmitted)
            } else {
                bounce.transmitted
            },
        }
    }
}
