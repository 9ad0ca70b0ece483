//! Which tables of integrals materials need.

use crate::core::material::Material;
use crate::shading::{ggx, glass_loss};

/// Computes the tables that materials need, on all threads.
pub(crate) fn compute_for(materials: &[Material]) {
    let is_any = |kind: fn(&Material) -> bool| materials.iter().any(kind);
    if is_any(|material| matches!(material, Material::Principled { .. } | Material::Metal { compensate: true, .. })) {
        ggx::ALBEDOS.compute();
    }
    if is_any(|material| matches!(material, Material::Principled { .. })) {
        ggx::SCHLICK_MEANS.compute();
    }
    if is_any(Material::scatters_through) {
        glass_loss::LOSSES.compute();
    }
}
