//! The radiance that counts as 1 in relative errors.
//!
//! relMSE adds 0.01 to the squared level, so that black is no pole: it takes white for about 1. Where light is in physical
//! units, such as a sun of 100,000 lux, white is thousands, and a pixel that a light hits in one of many samples would
//! have an error of millions. There radiance counts in a unit near white, which follows from the lights alone.

use crate::prepare::ambient::AmbientLight;
use crate::prepare::light::LightTable;
use firstlight_simd::Vector3;
use glam::Vec3;
use std::f64::consts::PI;

/// White below which the unit is 1: scenes whose exposure nobody changes.
const USUAL: f64 = 64.0;

/// Returns the unit, W·m⁻²·sr⁻¹: 1, or a power of two above it.
///
/// - `reach`: radius of the scene, metres.
pub(super) fn radiance_unit(lights: &LightTable, ambient: &AmbientLight, reach: f32) -> f32 {
    // Intensity over all directions of all lights, at the distance of the radius, on a white surface.
    let of_lights: f64 = (0..lights.len() as u32)
        .map(|id| lights.light(id))
        .map(|light| f64::from(light.mean_radiance) * f64::from(light.shape.area()) / 4.0)
        .sum();
    let sky: Vec3 = ambient.radiance(Vector3::<f32>::from(Vec3::Y)).into();
    let white = of_lights / (PI * f64::from(reach).powi(2)) + f64::from(sky.max_element());
    if white > USUAL { white.log2().round().exp2() as f32 } else { 1.0 }
}
