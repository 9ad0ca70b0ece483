//! Surfaces, lights and BSDFs for sixteen hits at a time. Rare cases use the scalar code of [`crate::shading`] lane by
//! lane; tests compare the two.

pub(crate) mod bounce;
mod coat;
mod glass;
mod guided;
pub(crate) mod hints;
mod inputs;
mod instances;
pub(crate) mod lane_group;
pub(crate) mod lanes;
pub(crate) mod layers;
pub(crate) mod lights;
mod metals;
mod normals;
pub(crate) mod scatter;
pub(crate) mod surface;
mod tangents;
pub(crate) mod texture;
