//! What the integrators ask of a surface: how it scatters, and a direction to go on in.
//!
//! [`Scatter::eval`] and [`Scatter::sample`] are one family. Directions are unit, in world space, leaving
//! the surface; `normal` is the shading normal on the side of `wo`. Perfectly specular lobes have no `eval`: only
//! sampling finds them.

use crate::shading::interface::Interface;
use glam::{Vec2, Vec3};

/// What the integrator asks of a surface, be it one lobe or a blend.
pub(crate) trait Scatter {
    /// Whether light sampling can find anything: some lobe is not perfectly specular.
    fn has_non_specular(&self) -> bool;

    /// f · |cos| of all lobes that are not specular, and the density of sampling `wi` through one of them; zero for `wi`
    /// behind `normal` but for what [`Self::through`] tells.
    ///
    /// Where light passes through, `wo` and `wi` may change sides: the surface is then seen from behind `normal`.
    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32);

    /// What light from behind `normal` passes through, where [`Self::eval`] knows of such light. In blends only sampling
    /// finds it, as if it were specular: each part leads into a medium of its own.
    fn through(&self) -> Option<Interface>;

    /// - `u_lobe`: chooses the lobe, and between reflection and refraction; asked for only where there is a choice;
    /// - `u`: the direction.
    ///
    /// `None` when the sample carries no light.
    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample>;
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfSample {
    pub wi: Vec3,
    /// f · |cos| / pdf.
    pub weight: Vec3,
    /// Per steradian; infinite for a perfectly specular lobe.
    pub pdf: f32,
    /// What was passed through, where `wi` lies beyond the surface.
    pub through: Option<Interface>,
}
