//! Numbers that fill a square evenly, and the maps from squares to discs, spheres and lights.
//!
//! Every number is a function of (seed, pixel, sample, dimension): [`Sampler`]. Knows no scene.

mod alias;
mod distribution;
mod hash;
pub(crate) mod offset_simd;
mod sobol;
mod sobol_simd;
mod spherical_quad;
mod spherical_triangle;
mod warp;
pub(crate) mod warp_simd;

pub use alias::AliasTable;
pub use distribution::PictureDistribution;
pub use hash::{hash_combine, hash_u32};
pub use sobol::Sampler;
pub(crate) use sobol_simd::SamplerLanes;
pub use spherical_quad::SphericalQuad;
pub use spherical_triangle::SphericalTriangle;
pub use warp::{
    cone_pdf, cosine_hemisphere, cosine_hemisphere_pdf, one_minus_cos_from_sin2, polygon_disc, uniform_cone,
    uniform_disc, uniform_triangle,
};
