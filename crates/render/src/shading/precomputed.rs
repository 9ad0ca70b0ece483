//! Which tables of integrals materials need.

use crate::core::material::{ColorInput, Material, ScalarInput};
use crate::shading::{anisotropic_albedo, ggx, glass_loss, layer_albedo};
use glam::Vec3;

/// Computes the tables that materials need, on all threads.
pub(crate) fn compute_for(materials: &[Material]) {
    for material in materials {
        match material {
            Material::Principled { anisotropy, sheen_color, .. } => {
                ggx::ALBEDOS.compute();
                ggx::SCHLICK_MEANS.compute();
                if *anisotropy != ScalarInput::Constant(0.0) {
                    anisotropic_albedo::compute();
                }
                if *sheen_color != ColorInput::Constant(Vec3::ZERO) {
                    layer_albedo::compute_sheen();
                }
                if material.scatters_through() {
                    glass_loss::LOSSES.compute();
                }
            }
            Material::Metal { compensate: true, .. } => ggx::ALBEDOS.compute(),
            Material::RoughGlass { compensate: true, .. } => glass_loss::LOSSES.compute(),
            _ => {}
        }
    }
}
