//! The interface of BSDFs for the integrators: evaluation and sampling.
//!
//! [`Scatter::eval`] and [`Scatter::sample`] are one family. Directions are unit, in world space, leaving the surface;
//! `normal` is the shading normal on the side of `wo`. Perfectly specular lobes evaluate to zero: only sampling finds
//! them.

use crate::shading::interface::Interface;
use firstlight_simd::{Real, Vector3};
use glam::{Vec2, Vec3};

/// The BSDF of a surface: one lobe, a blend, or layers.
pub(crate) trait Scatter {
    /// Whether light sampling can contribute: some lobe is not perfectly specular.
    fn has_non_specular(&self) -> bool;

    /// Returns f · |cos| of all non-specular lobes, and the pdf per steradian of sampling `wi` by one of them; zero for
    /// `wi` behind `normal`, except where [`Self::through`] returns an interface.
    ///
    /// For transmitted light, `wo` and `wi` may be exchanged: the surface is then seen from behind `normal`.
    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32);

    /// The interface that light from behind `normal` passes, if [`Self::eval`] includes such light. In blends only
    /// sampling finds light from other media, as if it were specular: each part leads into a different one.
    fn through(&self) -> Option<Interface>;

    /// Share of light from straight behind the surface that goes on as it came: that of panes without thickness.
    /// [`Self::sample`] returns exactly `-wo` for it, as a perfectly specular lobe.
    fn straight(&self, _wo: Vec3, _normal: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    /// Samples a direction; `None` if the sample carries no light.
    ///
    /// - `u_lobe`: selects the lobe, and between reflection and refraction; evaluated only if there is a choice;
    /// - `u`: the direction.
    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample>;
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfSample {
    pub wi: Vec3,
    /// f · |cos| / pdf.
    pub weight: Vec3,
    /// Pdf per steradian; infinite for a perfectly specular lobe.
    pub pdf: f32,
    /// Probability with which a perfectly specular lobe was chosen; 1 for all others.
    pub probability: f32,
    /// The interface that was passed, if `wi` is on the far side.
    pub through: Option<Interface>,
}

/// A direction sampled at one point or at sixteen, by what stays in the medium of the viewer.
pub(crate) struct Sampled<R: Real> {
    /// Lanes in which it carries light.
    pub go_on: R::Mask,
    /// Unit, in world space.
    pub wi: Vector3<R>,
    /// f · cos / pdf.
    pub weight: Vector3<R>,
    /// As of [`BsdfSample`], like the probability.
    pub pdf: R,
    pub probability: R,
}

impl Sampled<f32> {
    #[inline]
    pub fn reflected(self) -> Option<BsdfSample> {
        let Self { go_on, wi, weight, pdf, probability } = self;
        go_on.then(|| BsdfSample { wi: wi.into(), weight: weight.into(), pdf, probability, through: None })
    }
}
