//! Which tables of integrals materials need.

use crate::core::material::Material;
use crate::shading::{ggx, glass_loss};

/// Computes the tables that materials need, on all threads.
pub(crate) fn compute_for(materials: &[Material]) {
    for material in materials {
        match material {
            Material::Principled { .. } => {
                ggx::ALBEDOS.compute();
                ggx::SCHLICK_MEANS.compute();
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
