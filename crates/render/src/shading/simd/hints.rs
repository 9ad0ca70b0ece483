//! Guiding distributions for sixteen surfaces; see [`crate::shading::guided::Guided`] for one.

use crate::prepare::guide::{Guide, Hints};
use crate::sampling::SamplerLanes;
use crate::shading::dimensions::DIM_LOBE;
use crate::shading::guided::{mixed_pdf, rest_of_choice};
use crate::shading::mis_state::MisState;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_simd::{Float, LANES, Mask, Simd, Vector, select};
use glam::Vec3;

/// The guiding distributions of each lane.
pub(crate) struct HintLanes<'a> {
    /// Lanes that have guiding distributions.
    pub told: Mask,
    pub hints: [Option<Hints<'a>>; LANES],
}

impl<'a> HintLanes<'a> {
    pub const NONE: Self = Self { told: 0, hints: [None; LANES] };

    /// - `mask`: lanes that scatter; `n_vertices`: number of path vertices including these.
    #[inline(always)]
    pub fn of<S: Simd>(
        s: S,
        guide: Option<&'a Guide>,
        n_vertices: u32,
        at: &HitGroup<S>,
        place: &SurfaceLanes<S>,
        mask: Mask,
    ) -> Self {
        let mut found = Self::NONE;
        let Some(guide) = guide else { return found };
        let mut asking = 0;
        if n_vertices > 1 {
            for lane in lanes_of(mask) {
                asking |= Mask::from(at.paths.track_of(at.indices[lane] as usize).is_lost()) << lane;
            }
        }
        if asking != 0 {
            let leaves = guide.leaves_at(s, asking, place.position);
            let positions = place.position.to_arrays();
            for lane in lanes_of(asking) {
                found.hints[lane] = guide.in_leaf(leaves[lane], vec3_of(&positions, lane));
                found.told |= Mask::from(found.hints[lane].is_some()) << lane;
            }
        }
        found
    }

    /// Returns the pdf of the mixture, given that of the surface.
    #[inline(always)]
    pub fn mixed<S: Simd>(&self, s: S, wi: Vector<S>, pdf: Float<S>) -> Float<S> {
        if self.told == 0 {
            return pdf;
        }
        let (directions, mut hinted) = (wi.to_arrays(), [0.0; LANES]);
        for (lane, hints) in self.hints.iter().enumerate() {
            if let Some(hints) = hints {
                hinted[lane] = hints.pdf_lanes(s, vec3_of(&directions, lane));
            }
        }
        select(self.told, mixed_pdf(pdf, Float::load(s, &hinted)), pdf)
    }

    /// Returns the random number that selects a part of a surface, rescaled where the guiding distribution was not
    /// selected.
    #[inline(always)]
    pub fn u_lobe<S: Simd>(&self, sampler: &SamplerLanes<S>, dimension: u32) -> Float<S> {
        let u = sampler.single(dimension + DIM_LOBE);
        if self.told == 0 { u } else { select(self.told, rest_of_choice(u), u) }
    }

    /// Returns the MIS state of a lane whose throughput is multiplied by `weight`.
    #[inline(always)]
    pub fn track<S: Simd>(&self, at: &HitGroup<S>, lane: usize, weight: &[[f32; LANES]; 3]) -> MisState {
        let track = at.paths.track_of(at.indices[lane] as usize);
        if self.told >> lane & 1 != 0 { track.guided(vec3_of(weight, lane)) } else { track }
    }
}

#[inline(always)]
pub(crate) fn vec3_of(arrays: &[[f32; LANES]; 3], lane: usize) -> Vec3 {
    Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane])
}
