//! What a camera path must remember so that light found by it can be weighed against a light path.
//!
//! Let a path have vertices x₁ … xₖ from the camera to the light point y. Per unit of film, solid angle and étendue, the
//! ratio of the densities of the two ways to find it is a product of one factor a vertex:
//!
//! - x₁, which is joined to the lens: cos θᵢ / (G · p_eye), G = cos θₒ / (t² cos³ θ_lens · pixel area), of an orthographic
//!   camera cos θₒ / (cos θ_lens · pixel area);
//! - another vertex that scatters: p_lamp · cos θᵢ / (cos θₒ · p_eye), p_lamp and p_eye being its densities towards
//!   the camera's side (o) and the light's side (i);
//! - the same for one that scatters through a rough interface, times nᵢ² / nₒ²: étendue is n² times area, solid angle
//!   and cosine;
//! - a specular one: 1, because étendue is kept by mirrors and lenses; or the ratio of the cosines with the true
//!   and with the shading normal, where these differ, as étendue is kept about the shading normal (Veach 1997,
//!   section 5.3);
//! - the light: the density per étendue with which the line from y was chosen, times light paths.
//!
//! All cosines but those inside of densities are with the true normal. The factor n² of the medium that the camera is in
//! is left out: the light of a path that counts lies outside of all glass. Roulette is left out on both sides, which makes the weights no less valid.

use crate::integrators::caustics::pass::CausticPass;
use crate::prepare::casters::NO_CASTER;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::lights::power_weight;
use crate::shading::mis_state::MisState;
use crate::shading::vertex::Vertex;
use firstlight_kdtree::Hit;
use firstlight_simd::{Real, Vector3, select};
use glam::Vec3;

/// How a camera path goes on at a vertex.
pub(crate) struct MisBounce<'a> {
    pub vertex: &'a Vertex,
    pub hit: &'a Hit,
    /// Of the camera ray, if this is its hit.
    pub eye: Option<Vec3>,
    pub wi: Vec3,
    /// Per steradian; infinite if specular.
    pub pdf: f32,
    /// What was passed through, if anything was.
    pub through: Option<Interface>,
    /// The surface is a blend, of which the part is not known.
    pub blended: bool,
    pub before: MediumId,
    pub after: MediumId,
}

impl CausticPass<'_> {
    /// - `reverse_pdf`: density with which the vertex, reached from `wi`, would have scattered towards `wo`.
    #[inline]
    pub fn follow(&self, track: MisState, bounce: &MisBounce, reverse_pdf: impl FnOnce() -> f32) -> MisState {
        let MisBounce { vertex, wi, .. } = *bounce;
        let is_specular = bounce.pdf.is_infinite();
        if track.ratio.is_nan() && bounce.eye.is_none() || !is_reversible(bounce) {
            return MisState { gain: track.gain, ..MisState::default() };
        }
        let (cos_o, cos_i) = (vertex.wo.dot(vertex.geometric_normal), wi.dot(vertex.geometric_normal).abs());
        match (bounce.eye, is_specular) {
            (Some(_), true) => MisState::default(),
            (Some(eye), false) => {
                let cos_lens = -vertex.wo.dot(self.scene.camera.forward);
                let ratio = self.join_ratio(vertex.position.distance_squared(eye), cos_lens, cos_o, cos_i, bounce.pdf);
                let ratio = ratio / etendue_scale(bounce.through);
                MisState { ratio, caster: NO_CASTER, ..track }
            }
            (None, false) => {
                let ratio = track.ratio * reverse_pdf() * cos_i / (cos_o * bounce.pdf);
                let ratio = ratio / etendue_scale(bounce.through);
                MisState { ratio, caster: NO_CASTER, ..track }
            }
            (None, true) => {
                let ratio = track.ratio / etendue_gain_at(vertex, wi, vertex.wo);
                MisState { ratio, caster: self.casters.of_hit(bounce.hit), ..track }
            }
        }
    }

    /// The caster that a hit lies on, [`NO_CASTER`] if none.
    #[inline]
    pub fn caster_of(&self, hit: &Hit) -> u32 {
        self.casters.of_hit(hit)
    }

    /// The factor of the vertex that is joined to the lens, and of the number of paths.
    #[inline(always)]
    pub fn join_ratio<R: Real>(&self, distance2: R, cos_lens: R, cos_o: R, cos_i: R, pdf: R) -> R {
        let spread = match self.scene.camera.orthographic {
            // `Camera::spread`, rounded in an order of its own.
            None => distance2 * self.density_scale() * (cos_lens * cos_lens * cos_lens),
            Some(_) => cos_lens * self.density_scale(),
        };
        spread * cos_i / (cos_o * pdf)
    }

    /// Of light paths that are joined to a pixel.
    #[inline]
    pub fn density_scale(&self) -> f32 {
        self.paths_per_sample as f32 * self.pixel_area
    }

    /// Weight of light that a camera path finds on a light; `None` if light paths do not matter here.
    #[inline]
    pub fn camera_weight(&self, track: &MisState, media: MediumId, hit: &Hit, vertex: &Vertex) -> Option<f32> {
        if track.caster == NO_CASTER || track.ratio.is_nan() || media != MediumId::OUTSIDE {
            return None;
        }
        let light = self.scene.tables.lights.light_of(hit.object, hit.prim, vertex.front)?;
        let cos = vertex.wo.dot(vertex.geometric_normal);
        let density = self.casters.density(&self.scene.tables.lights, light, track.caster, vertex.position, cos);
        Some(self.weight_against(track.ratio * density))
    }

    /// Of the way whose competitor has `ratio` times its density.
    #[inline(always)]
    fn weight_against<R: Real>(&self, ratio: R) -> R {
        if self.techniques.mis {
            return power_weight(ratio);
        }
        select(ratio.is_positive(), ratio.all(0.0), ratio.all(1.0))
    }

    /// Weight of a light path that has `ratio` times the density of the one from the camera.
    #[inline(always)]
    pub fn light_path_weight<R: Real>(&self, ratio: R) -> R {
        ratio.all(1.0) - self.weight_against(ratio)
    }
}

/// n² on the side that a path comes from over n² beyond what it passes through by scattering; 1 where it passes through
/// nothing.
#[inline]
pub(crate) fn etendue_scale(through: Option<Interface>) -> f32 {
    through.map_or(1.0, |Interface { squeeze, .. }| squeeze * squeeze)
}

/// Whether a path from the other end could do the same.
///
/// Reflection must be seen from the front of the true surface on both ends, and glass that is left must have been
/// entered: an camera or a light inside of glass does not know that it is.
#[inline]
pub(crate) fn is_reversible(bounce: &MisBounce) -> bool {
    if bounce.through.is_some() {
        !bounce.blended && bounce.before != bounce.after
    } else {
        bounce.wi.dot(bounce.vertex.geometric_normal) > 0.0
    }
}

/// What a specular vertex does to the étendue of light that comes from `wi` and goes to `wo`: 1 where the true normal shades.
///
/// - `geometric`, `shading`: the two normals, unit.
#[inline(always)]
pub(crate) fn etendue_gain<R: Real>(geometric: Vector3<R>, shading: Vector3<R>, wi: Vector3<R>, wo: Vector3<R>) -> R {
    ((geometric.dot(wo) * shading.dot(wi)) / (geometric.dot(wi) * shading.dot(wo))).abs()
}

/// The same of the two normals of a vertex.
#[inline]
pub(crate) fn etendue_gain_at(vertex: &Vertex, wi: Vec3, wo: Vec3) -> f32 {
    etendue_gain(vertex.geometric_normal.into(), vertex.normal.into(), wi.into(), wo.into())
}
