//! Hints of where gathered light comes from, for sixteen surfaces; see [`super::super::caustics::Guided`] for one.

use super::super::caustics::{CausticPass, HINTED, Hints, Track};
use super::super::path::{DIM_DIRECTION, DIM_LOBE};
use super::lanes_of;
use super::place::{At, Place};
use super::scatter::{Bounce, Surface, eval};
use crate::sampling::SamplerLanes;
use firstlight_simd::{Float, LANES, Mask, Simd, Vector, select, select_vector};
use glam::{Vec2, Vec3};

/// What each lane is told.
pub(crate) struct HintLanes<'a> {
    /// Lanes that have hints.
    pub told: Mask,
    hints: [Option<Hints<'a>>; LANES],
}

impl<'a> HintLanes<'a> {
    pub const NONE: Self = Self { told: 0, hints: [None; LANES] };

    /// - `mask`: lanes that scatter; `n_vertices`: up to and with these.
    #[inline(always)]
    pub fn of<S: Simd>(s: S, pass: &'a CausticPass, n_vertices: u32, at: &At<S>, place: &Place<S>, mask: Mask) -> Self {
        let mut found = Self::NONE;
        let Some(guide) = pass.guide() else { return found };
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

    /// The density of the mixture, given that of the surface alone.
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
        select(self.told, pdf + (Float::load(s, &hinted) - pdf) * HINTED, pdf)
    }

    /// The number that chooses a part of a surface: what is left of it where the choice was not to follow a hint.
    #[inline(always)]
    pub fn u_lobe<S: Simd>(&self, sampler: &SamplerLanes<S>, dimension: u32) -> Float<S> {
        let u = sampler.single(dimension + DIM_LOBE);
        let rest = ((u - HINTED) / u.all(1.0 - HINTED)).at_least(0.0).at_most(1.0f32.next_down());
        if self.told == 0 { u } else { select(self.told, rest, u) }
    }

    /// Sends some of the lanes that have hints where these say, and weights all of those over both ways.
    #[inline(always)]
    pub fn follow<S: Simd, const KIND: usize>(
        &self,
        s: S,
        surface: &Surface<S>,
        place: &Place<S>,
        sampler: &SamplerLanes<S>,
        dimension: u32,
        bounce: Bounce<S>,
    ) -> Bounce<S> {
        if self.told == 0 {
            return bounce;
        }
        let choice = sampler.single(dimension + DIM_LOBE);
        let sent = self.told & choice.lt(choice.all(HINTED));
        let mut wi = bounce.wi;
        if sent != 0 {
            let ([u, v], u_exit) = (sampler.pair(dimension + DIM_DIRECTION), choice / choice.all(HINTED));
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
        // A part that is perfectly smooth is found by the surface alone.
        let smooth = self.told & !sent & bounce.pdf.all(f32::MAX).lt(bounce.pdf);
        let mixed = self.told & !smooth;
        let found = (sent | bounce.go_on) & pdf.is_positive() & !value.is_zero();
        let over_both = Vector { x: value.x / pdf, y: value.y / pdf, z: value.z / pdf };
        let weight = select_vector(mixed, over_both, bounce.weight);
        let alone = select_vector(smooth, weight * (pdf.all(1.0) / pdf.all(1.0 - HINTED)), weight);
        Bounce {
            go_on: (bounce.go_on & !mixed) | (found & mixed),
            wi: select_vector(mixed, wi, bounce.wi),
            weight: alone,
            pdf: select(mixed, pdf, bounce.pdf),
            transmitted: bounce.transmitted,
        }
    }

    /// Of a lane whose throughput is multiplied by `weight`.
    #[inline(always)]
    pub fn track<S: Simd>(&self, at: &At<S>, lane: usize, weight: &[[f32; LANES]; 3]) -> Track {
        let track = at.paths.track_of(at.indices[lane] as usize);
        if self.told >> lane & 1 != 0 { track.guided(vec3_of(weight, lane)) } else { track }
    }
}

#[inline(always)]
fn vec3_of(arrays: &[[f32; LANES]; 3], lane: usize) -> Vec3 {
    Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane])
}
