//! Which tables of integrals the materials of a scene need.

use crate::core::material::{ColorInput, Material, ScalarInput};
use crate::prepare::prepared::Prepared;
use crate::shading::{anisotropic_albedo, coat, ggx, glass_loss, layer_albedo};
use glam::Vec3;

/// Computes the tables that its materials need, on all threads.
pub(crate) fn compute_for(scene: &Prepared) {
    coat::compute(&scene.tables.coats);
    for material in &scene.shading.materials {
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
            Material::Conductor { compensate: true, alpha_v, .. } => {
                ggx::ALBEDOS.compute();
                if *alpha_v != ScalarInput::Constant(0.0) {
                    ggx::SCHLICK_MEANS.compute();
                    anisotropic_albedo::compute();
                }
            }
            Material::RoughGlass { compensate: true, .. } => glass_loss::LOSSES.compute(),
            _ => {}
        }
    }
}
