//! Integrators: waves of paths over [`crate::shading`].

pub(crate) mod caustics;
pub(crate) mod common;
pub(crate) mod features;
pub(crate) mod path;
pub(crate) mod phong;
pub(crate) mod portals;
pub(crate) mod simd;
pub(crate) mod visible_albedo;
