//! Interfaces of transparent surfaces, sixteen at a time; see [`crate::shading::medium`].

use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::HitGroup;
use firstlight_simd::{Float, LANES, Mask, Simd};

/// See [`crate::shading::interface::Interface`].
pub(crate) struct GlassLanes<S: Simd> {
    pub eta: Float<S>,
    pub radiance_eta: Float<S>,
    pub beyond: [MediumId; LANES],
}

impl<S: Simd> GlassLanes<S> {
    /// - `front`: lanes that hit it from outside; `media`: media of each path.
    #[inline(always)]
    pub fn of(s: S, at: &HitGroup<S>, front: Mask, sets: &mut MediumSets, media: &[MediumId; LANES]) -> Self {
        let (mut eta, mut radiance_eta, mut beyond) = ([1.0; LANES], [1.0; LANES], *media);
        for lane in lanes_of(at.mask) {
            let i = at.indices[lane] as usize;
            let (object, prim, front) = (at.hits.object[i], at.hits.prim[i], front >> lane & 1 != 0);
            let bodies = &at.scene.tables.bodies;
            let boundary = bodies.boundary(object, prim, at.materials[i], front);
            let others = match at.hits.get(i) {
                Some(hit) => at.scene.along_with(&hit, || at.paths.rays.get(i)),
                None => Vec::new(),
            };
            let interface = sets.interface(at.scene, media[lane], boundary, 0, &others);
            (eta[lane], radiance_eta[lane], beyond[lane]) = (interface.eta, interface.radiance_eta, interface.beyond);
        }
        Self { eta: Float::load(s, &eta), radiance_eta: Float::load(s, &radiance_eta), beyond }
    }
}
