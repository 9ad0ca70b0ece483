//! Surfaces, lights and scattering for sixteen hits at a time. What is rare is done lane by lane with the code of
//! [`crate::shading`] for one; tests hold the two against each other.

pub(crate) mod bounce;
mod coat;
mod glass;
mod guided;
pub(crate) mod hints;
mod instances;
pub(crate) mod lane_group;
pub(crate) mod lanes;
pub(crate) mod lights;
pub(crate) mod metal;
pub(crate) mod scatter;
pub(crate) mod surface;
pub(crate) mod texture;
