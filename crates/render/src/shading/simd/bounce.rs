//! Sampled continuations of sixteen paths.

use crate::prepare::material_table::TEXTURED;
use crate::shading::scatter::Sampled;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::simd::texture::looked_up;
use firstlight_simd::{Bits, Float, Mask, Simd, Vector};

/// Sampled directions of sixteen paths.
pub(crate) struct Bounce<S: Simd> {
    pub go_on: Mask,
    pub wi: Vector<S>,
    pub weight: Vector<S>,
    pub pdf: Float<S>,
    pub transmitted: Mask,
}

impl<S: Simd> From<Sampled<Float<S>>> for Bounce<S> {
    #[inline(always)]
    fn from(Sampled { go_on, wi, weight, pdf, .. }: Sampled<Float<S>>) -> Self {
        Self { go_on, wi, weight, pdf, transmitted: 0 }
    }
}

/// Returns albedo or reflectance by rows of the material table, with textures.
#[inline(always)]
pub(crate) fn colors_of<S: Simd>(s: S, at: &HitGroup<S>, place: &SurfaceLanes<S>, row: Bits<S>) -> Vector<S> {
    let table = &at.scene.tables.materials;
    let color = Vector::gather(&table.color, row);
    if !at.scene.tables.features.textures {
        return color;
    }
    let textured = at.mask & Bits::gather(&table.flags, row).has(TEXTURED);
    looked_up(s, at.scene, &table.inputs, row, textured, place, color)
}
