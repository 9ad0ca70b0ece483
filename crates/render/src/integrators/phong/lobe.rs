//! What the classic model is made of: weights, sample dimensions and the lobe of a highlight.

use crate::shading::dimensions::CAMERA_DIMENSIONS;
use firstlight_kdtree::geometry::Frame;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Share of a light's fluence at a point that reaches surfaces there from all around, whatever is in its way: about
/// what the walls of a large, rather dark room send back.
pub(crate) const AMBIENT_SHARE: f32 = 0.05;

/// Rays at a depth that count for less than this are followed with a probability, and then for this much: a grey level
/// of a picture, and few enough rays behind any pixel. Deep within glass it is all of a sample, so that as many rays go on
/// as come in, however many surfaces split them.
#[inline]
pub(crate) fn least_weight(depth: u32) -> f32 {
    if depth < 64 { 1.0 / 64.0 } else { 1.0 }
}

/// Sample dimensions of each vertex: of the lights (see [`crate::prepare::light::LightTable::sample_each`]), the environment,
/// and three for each shiny part.
pub(crate) const DIM_ENVIRONMENT: u32 = crate::prepare::light::EACH_DIMENSIONS;
pub(crate) const DIM_SHINY: u32 = DIM_ENVIRONMENT + 1;
const VERTEX_DIMENSIONS: u32 = DIM_SHINY + 3 * crate::core::material::MAX_LOBES as u32;

/// What a ray may still bring of lights, which a highlight asks for by itself, as the density that it keeps: infinite for
/// all of it, because nothing else has asked; this for nothing, because a highlight has stood in for them; else the ray lies
/// within a lobe, with that density per steradian, and lights were asked from where it starts.
pub(crate) const DIRECT_ALREADY_SAMPLED: f32 = 0.0;

pub(crate) fn first_dimension(depth: u32) -> u32 {
    CAMERA_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS
}

/// (n + 1) / 2π · cosⁿ about an axis, per steradian; `cos` may be negative.
#[inline]
pub(crate) fn lobe_pdf(exponent: f32, cos: f32) -> f32 {
    (exponent + 1.0) / TAU * cos.max(0.0).powf(exponent)
}

/// A unit direction with density [`lobe_pdf`] about `axis`.
#[inline]
pub(crate) fn within_lobe(axis: Vec3, exponent: f32, u: Vec2) -> Vec3 {
    let cos = (1.0 - u.x).powf(1.0 / (exponent + 1.0));
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
    Frame::around(axis).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, cos)).normalize()
}
