//! Sample sequences, and maps from the unit square to discs, spheres and lights.
//!
//! Every number is a function of (seed, pixel, sample, dimension): [`Sampler`]. Knows no scene.

mod alias;
mod distribution;
mod hash;
mod sobol;
mod spherical_quad;
mod spherical_triangle;
pub(crate) mod warp;

pub use alias::AliasTable;
pub use distribution::PictureDistribution;
pub use hash::{hash_combine, hash_u32};
pub(crate) use sobol::SamplerLanes;
pub use sobol::{Sampler, SamplerOf};
pub use spherical_quad::SphericalQuad;
pub use spherical_triangle::SphericalTriangle;
pub use warp::{
    cone_pdf, cosine_hemisphere_pdf, one_minus_cos_from_sin2, polygon_disc, uniform_cone, uniform_triangle,
};

use glam::{Vec2, Vec3};

/// Samples the unit disc uniformly; preserves stratification (Shirley and Chiu 1997).
#[inline]
pub fn uniform_disc(u: Vec2) -> Vec2 {
    warp::uniform_disc(u.to_array()).into()
}

/// Samples the hemisphere about +z by cosine; pdf [`cosine_hemisphere_pdf`].
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    warp::cosine_hemisphere(u.to_array()).into()
}
