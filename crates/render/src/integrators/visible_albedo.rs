//! Approximate albedo of a surface: its colour without lighting.
//!
//! An estimate for views and feature buffers, not for transport: at one viewing angle, without the energy lost between
//! microfacets.

use crate::core::material::{Material, MaterialId};
use crate::prepare::prepared::Prepared;
use crate::shading::principled::at::principled_at;
use crate::shading::surface::lobe_at;
use crate::shading::vertex::Vertex;
use glam::Vec3;

/// Maximum nesting of blends that is evaluated. Extraction rejects deeper blends.
const DEEPEST_BLEND: u32 = 16;

/// Returns the reflected or transmitted share of light, per channel, 0..1, without emission.
pub(crate) fn surface_albedo(scene: &Prepared, vertex: &Vertex, material: MaterialId) -> Vec3 {
    albedo_of_part(scene, vertex, material, 0).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Like [`surface_albedo`], plus the emitted radiance, scaled to at most 1 so that its hue is kept: the look of an
/// emitter beside other surfaces.
pub(crate) fn visible_albedo(scene: &Prepared, vertex: &Vertex, material: MaterialId) -> Vec3 {
    let albedo = surface_albedo(scene, vertex, material);
    match scene.tables.emission[material as usize] {
        Some(emission) if vertex.front || emission.two_sided => {
            let emitted = vertex.emitted(scene, &emission);
            (albedo + emitted / emitted.max_element().max(1.0)).min(Vec3::ONE)
        }
        _ => albedo,
    }
}

fn albedo_of_part(scene: &Prepared, vertex: &Vertex, id: MaterialId, depth: u32) -> Vec3 {
    let point = vertex.texture_point;
    match &scene.shading.materials[id as usize] {
        Material::Emissive { .. } => Vec3::ZERO,
        Material::Blend { .. } if depth > DEEPEST_BLEND => Vec3::ZERO,
        Material::Blend { weight, a, b, by_side, .. } => {
            let part = |id| albedo_of_part(scene, vertex, id, depth + 1);
            part(*a).lerp(part(*b), vertex.share_of_second(scene, *weight, *by_side))
        }
        Material::Phong { diffuse, specular, transparency, .. } => {
            let opaque = diffuse.eval(scene, point).lerp(Vec3::ONE, specular.eval(scene, point).clamp(0.0, 1.0));
            opaque.lerp(Vec3::ONE, transparency.clamp(0.0, 1.0))
        }
        Material::Principled { .. } => {
            let Some(layers) = principled_at(scene, id, vertex, &mut None, 0, false) else { return Vec3::ZERO };
            let transmitted = layers.transmission.map_or(Vec3::ZERO, |passed| passed.share * passed.tint);
            Vec3::from(layers.color()) + transmitted
        }
        _ => lobe_at(scene, id, vertex, None).map_or(Vec3::ZERO, |lobe| lobe.albedo()),
    }
}
