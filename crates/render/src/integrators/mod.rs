//! Integrators: waves of paths over [`crate::shading`].

pub(crate) mod caustics;
pub(crate) mod features;
pub(crate) mod first_surfaces;
pub(crate) mod path;
pub(crate) mod phong;
pub(crate) mod record;
pub(crate) mod resampling;
pub(crate) mod seen;
pub(crate) mod simd;
pub(crate) mod survival;
pub(crate) mod work;
