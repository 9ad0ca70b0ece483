//! Scattering at surfaces and transport between them: for one hit at a time here, for sixteen in [`simd`].

pub(crate) mod anisotropic_albedo;
pub(crate) mod bsdf;
pub(crate) mod cutouts;
pub(crate) mod dielectric;
pub(crate) mod dimensions;
pub(crate) mod ggx;
pub(crate) mod glass_loss;
pub(crate) mod guided;
pub(crate) mod integral_table;
pub(crate) mod interface;
pub(crate) mod layer_albedo;
pub(crate) mod lights;
mod lookups;
pub(crate) mod medium;
pub(crate) mod metal;
pub(crate) mod mis_state;
pub(crate) mod paths;
pub(crate) mod precomputed;
pub(crate) mod principled;
pub(crate) mod rough_glass;
pub(crate) mod scatter;
pub(crate) mod sheen;
pub(crate) mod sides;
pub(crate) mod simd;
pub(crate) mod surface;
pub(crate) mod tangent;
pub(crate) mod vertex;
