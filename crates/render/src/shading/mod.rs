//! What light does at a surface and between surfaces: one hit at a time here, sixteen in [`simd`].

pub(crate) mod bsdf;
pub(crate) mod dielectric;
pub(crate) mod dimensions;
pub(crate) mod ggx;
pub(crate) mod glass_loss;
pub(crate) mod guided;
pub(crate) mod interface;
pub(crate) mod lights;
pub(crate) mod medium;
pub(crate) mod metal;
pub(crate) mod mis_state;
pub(crate) mod paths;
pub(crate) mod rough_glass;
pub(crate) mod simd;
pub(crate) mod surface;
