//! The classic model: weights, sample dimensions and the lobe of a highlight.

use crate::shading::dimensions::CAMERA_DIMENSIONS;
use firstlight_simd::{Elementary, Vector3, frame_around};
use std::f32::consts::TAU;

/// Share of a light's fluence at a point that reaches surfaces there as ambient light, whatever occludes it: about the
/// light reflected by the walls of a large, rather dark room.
pub(crate) const AMBIENT_SHARE: f32 = 0.05;

/// Weight below which a ray at this depth is continued with a probability, and then has this weight: about one grey
/// level of an image, and few enough rays per pixel. At large depths inside glass it is 1, so that the number of rays
/// does not grow, however many surfaces split them.
#[inline]
pub(crate) fn least_weight(depth: u32) -> f32 {
    if depth < 64 { 1.0 / 64.0 } else { 1.0 }
}

/// Sample dimensions of each vertex: those of the lights (see [`crate::prepare::light::LightTable::sample_each`]), the
/// environment, and three for each shiny part.
pub(crate) const DIM_ENVIRONMENT: u32 = crate::prepare::light::EACH_DIMENSIONS;
pub(crate) const DIM_SHINY: u32 = DIM_ENVIRONMENT + 1;
const VERTEX_DIMENSIONS: u32 = DIM_SHINY + 3 * crate::core::material::MAX_LOBES as u32;

/// Value of [`Path::pdf`](crate::shading::paths::Path) that says how much a ray may still contribute of the lights,
/// which highlights sample themselves: infinite for all of it, because nothing has sampled them; this value for
/// nothing, because a highlight replaces them; otherwise the pdf per steradian of a ray within a lobe, whose origin has
/// sampled lights as well.
pub(crate) const DIRECT_ALREADY_SAMPLED: f32 = 0.0;

pub(crate) fn first_dimension(depth: u32) -> u32 {
    CAMERA_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS
}

/// (n + 1) / 2π · cosⁿ about an axis, per steradian; `cos` may be negative.
#[inline(always)]
pub(crate) fn lobe_pdf<R: Elementary>(exponent: R, cos: R) -> R {
    (exponent + 1.0) * (1.0 / TAU) * cos.at_least(0.0).at_most(1.0).power(exponent)
}

/// Samples a unit direction with pdf [`lobe_pdf`] about `axis`.
#[inline(always)]
pub(crate) fn within_lobe<R: Elementary>(axis: Vector3<R>, exponent: R, [u, v]: [R; 2]) -> Vector3<R> {
    let one = u.all(1.0);
    let cos = (one - u).power(one / (exponent + 1.0));
    let sin = (one - cos * cos).at_least(0.0).sqrt();
    let (sin_phi, cos_phi) = (v * TAU).sin_cos();
    Vector3 { x: sin * cos_phi, y: sin * sin_phi, z: cos }.to_world(&frame_around(axis)).normalize()
}
