//! MIS state of camera paths for weighting against light paths.
//!
//! Let a path have vertices x₁ … xₖ from the camera to the light point y. Per unit of film area, solid angle and
//! étendue, the ratio of the pdfs of the two techniques is a product of one factor per vertex:
//!
//! - x₁, which is connected to the lens: cos θᵢ / (G · p_camera), G = cos θₒ / (t² cos³ θ_lens · pixel area), for an
//!   orthographic camera cos θₒ / (cos θ_lens · pixel area);
//! - another scattering vertex: p_light · cos θᵢ / (cos θₒ · p_camera), where p_light and p_camera are its pdfs towards
//!   the camera's side (o) and the light's side (i);
//! - the same for one that scatters through a rough interface, times nᵢ² / nₒ²: étendue is n² times area, solid angle
//!   and cosine;
//! - a specular vertex: 1, because mirrors and lenses preserve étendue; or the ratio of the cosines with the true and
//!   with the shading normal, where these differ, because étendue is preserved about the shading normal (Veach 1997,
//!   section 5.3);
//! - the light: the pdf per étendue of sampling the line from y, times the number of light paths.
//!
//! All cosines except those inside of pdfs are with the true normal. The factor n² of the camera's medium is left out:
//! the light of a path that counts is outside of all glass. Russian roulette is left out on both sides, which leaves
//! the weights valid.

use crate::integrators::common::caustics_pass::CausticPass;
use crate::prepare::casters::NO_CASTER;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::lights::power_weight;
use crate::shading::mis_state::MisState;
use crate::shading::vertex::Vertex;
use firstlight_kdtree::Hit;
use firstlight_simd::{Real, Vector3, select};
use glam::Vec3;

/// A bounce of a camera path.
pub(crate) struct MisBounce<'a> {
    pub vertex: &'a Vertex,
    pub hit: &'a Hit,
    /// Direction of the camera ray, if this is its hit.
    pub eye: Option<Vec3>,
    pub wi: Vec3,
    /// Per steradian; infinite if specular.
    pub pdf: f32,
    /// The interface that was passed, if any.
    pub through: Option<Interface>,
    /// Whether the surface is a blend, whose sampled part is unknown.
    pub blended: bool,
    pub before: MediumId,
    pub after: MediumId,
}

impl CausticPass<'_> {
    /// Returns the state after a bounce.
    ///
    /// - `reverse_pdf`: pdf with which the vertex, reached from `wi`, would have scattered towards `wo`.
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
                MisState { ratio, caster: self.caster_of(bounce.hit), ..track }
            }
        }
    }

    /// Returns the caster of a hit, [`NO_CASTER`] if none.
    #[inline]
    pub fn caster_of(&self, hit: &Hit) -> u32 {
        self.casters.of_hit(hit)
    }

    /// The factor of the vertex that is connected to the lens, and of the number of paths.
    #[inline(always)]
    pub fn join_ratio<R: Real>(&self, distance2: R, cos_lens: R, cos_o: R, cos_i: R, pdf: R) -> R {
        let spread = match self.scene.camera.orthographic {
            // `Camera::spread`, rounded in a different order.
            None => distance2 * self.density_scale() * (cos_lens * cos_lens * cos_lens),
            Some(_) => cos_lens * self.density_scale(),
        };
        spread * cos_i / (cos_o * pdf)
    }

    /// Pdf scale of lens connections to a pixel: light paths per sample times pixel area.
    #[inline]
    pub fn density_scale(&self) -> f32 {
        self.paths_per_sample as f32 * self.pixel_area
    }

    /// MIS weight of a light that a camera path hits; `None` if light paths cannot find it.
    #[inline]
    pub fn camera_weight(&self, track: &MisState, media: MediumId, hit: &Hit, vertex: &Vertex) -> Option<f32> {
        if !track.is_gathered() || media.of_all_channels() != MediumId::OUTSIDE {
            return None;
        }
        let light = self.scene.tables.lights.light_of(hit.object, hit.prim, vertex.front)?;
        let cos = vertex.wo.dot(vertex.geometric_normal);
        let density = self.casters.density(&self.scene.tables.lights, light, track.caster, vertex.position, cos);
        Some(self.weight_against(track.ratio * density))
    }

    /// MIS weight of the environment in the direction `dir` of a camera path that leaves the scene; `None` if light paths
    /// cannot find it.
    #[inline]
    pub fn environment_weight(&self, track: &MisState, media: MediumId, dir: Vec3) -> Option<f32> {
        if !track.is_gathered() || media.of_all_channels() != MediumId::OUTSIDE {
            return None;
        }
        let density = self.casters.environment_density(&self.scene.tables.lights, track.caster, dir)?;
        Some(self.weight_against(track.ratio * density))
    }

    /// Weight of a technique whose competitor has `ratio` times its pdf.
    #[inline(always)]
    fn weight_against<R: Real>(&self, ratio: R) -> R {
        if self.techniques.mis {
            return power_weight(ratio);
        }
        select(ratio.is_positive(), ratio.all(0.0), ratio.all(1.0))
    }

    /// Weight of a light path that has `ratio` times the pdf of the camera path.
    #[inline(always)]
    pub fn light_path_weight<R: Real>(&self, ratio: R) -> R {
        ratio.all(1.0) - self.weight_against(ratio)
    }
}

/// Returns n² on the near side over n² on the far side of an interface that was passed by scattering; 1 without an
/// interface.
#[inline]
pub(crate) fn etendue_scale(through: Option<Interface>) -> f32 {
    through.map_or(1.0, |Interface { radiance_eta, .. }| radiance_eta * radiance_eta)
}

/// Whether a path from the other end could do the same.
///
/// Reflection must be on the front of the true surface for both ends, and glass that is left must have been entered: a
/// camera or a light inside of glass does not know that it is.
#[inline]
pub(crate) fn is_reversible(bounce: &MisBounce) -> bool {
    if bounce.through.is_some() {
        !bounce.blended && bounce.before != bounce.after
    } else {
        bounce.wi.dot(bounce.vertex.geometric_normal) > 0.0
    }
}

/// Factor by which a specular vertex changes the étendue of light from `wi` to `wo`: 1 if the shading normal is the
/// true normal.
///
/// - `geometric`, `shading`: the two normals, unit.
#[inline(always)]
pub(crate) fn etendue_gain<R: Real>(geometric: Vector3<R>, shading: Vector3<R>, wi: Vector3<R>, wo: Vector3<R>) -> R {
    ((geometric.dot(wo) * shading.dot(wi)) / (geometric.dot(wi) * shading.dot(wo))).abs()
}

/// Like [`etendue_gain`], for the normals of a vertex.
#[inline]
pub(crate) fn etendue_gain_at(vertex: &Vertex, wi: Vec3, wo: Vec3) -> f32 {
    etendue_gain(vertex.geometric_normal.into(), vertex.normal.into(), wi.into(), wo.into())
}
