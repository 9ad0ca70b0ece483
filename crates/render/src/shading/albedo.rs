//! What share of light a surface returns, about: the colour of a surface without its light.
//!
//! An estimate for views and feature buffers, not for transport: at one viewing angle, without what is lost between
//! microfacets.

use crate::core::material::{Material, MaterialId};
use crate::prepare::prepared::Prepared;
use crate::shading::principled::at::principled_at;
use crate::shading::vertex::Vertex;
use glam::Vec3;

/// Parts of parts that are looked into. Extraction lets no deeper blends through.
const DEEPEST_BLEND: u32 = 16;

/// Share of light that comes back from or passes a surface, per channel, 0..1. Emission does not count.
pub(crate) fn surface_albedo(scene: &Prepared, vertex: &Vertex, material: MaterialId) -> Vec3 {
    albedo_of_part(scene, vertex, material, 0).clamp(Vec3::ZERO, Vec3::ONE)
}

/// The same with what the surface emits, scaled to at most 1 so that its hue is kept: how an emitter looks beside others.
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
        Material::Blend { weight, a, b } => {
            let part = |id| albedo_of_part(scene, vertex, id, depth + 1);
            part(*a).lerp(part(*b), weight.eval(scene, point).clamp(0.0, 1.0))
        }
        Material::Phong { diffuse, specular, transparency, .. } => {
            let opaque = diffuse.eval(scene, point).lerp(Vec3::ONE, specular.eval(scene, point).clamp(0.0, 1.0));
            opaque.lerp(Vec3::ONE, transparency.clamp(0.0, 1.0))
        }
        Material::Principled { .. } => {
            let Some(layers) = principled_at(scene, id, vertex, &mut None, 0, false) else { return Vec3::ZERO };
            let transmitted = layers.transmission.map_or(Vec3::ZERO, |passed| passed.share * passed.tint);
            // What the dielectric does not reflect reaches what lies below it.
            layers.dielectric * layers.facing
                + (Vec3::ONE - layers.facing) * layers.diffuse
                + layers.metallic * layers.metal
                + transmitted
        }
        plain => plain.color().map_or(Vec3::ONE, |color| color.eval(scene, point)),
    }
}
