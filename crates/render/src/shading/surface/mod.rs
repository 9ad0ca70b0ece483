//! The BSDF of the material at a vertex: one lobe, or a blend.

pub(crate) mod blend;

use crate::core::material::{Fresnel, Material, MaterialId};
use crate::prepare::prepared::Prepared;
use crate::shading::bsdf::Lobe;
use crate::shading::coat::Coat;
use crate::shading::disney_at::disney_at;
use crate::shading::interface::MediumId;
use crate::shading::metal::{Metal, Tint};
use crate::shading::microfacets::Microfacets;
use crate::shading::plastic::Plastic;
use crate::shading::principled::at::principled_at;
use crate::shading::rough_glass;
use crate::shading::sides::Sides;
use crate::shading::surface::blend::Blend;
use crate::shading::tangent::NormalShadowing;
use crate::shading::translucent::Translucent;
use crate::shading::vertex::Vertex;
use glam::{Vec2, Vec3};

/// Returns the lobes of a blend at a vertex; `None` if all of it is black.
///
/// - `sides`: required by transparent parts; without it they may be distinguished from others, but not sampled.
pub(crate) fn blend_at<'a>(
    scene: &'a Prepared,
    id: MaterialId,
    vertex: &Vertex,
    mut sides: Option<&mut Sides>,
) -> Option<Blend<'a>> {
    let mut blend = Blend::default();
    collect(scene, id, vertex, &mut sides, &mut 0, 1.0, &mut blend);
    if blend.is_empty() {
        return None;
    }
    blend.finish(vertex.turns_over.then(|| NormalShadowing::new(vertex.normal, vertex.interpolated_seen())));
    Some(blend)
}

/// - `n_leaves`: number of transparent parts so far, of any weight: counted like in [`crate::prepare::bodies::Bodies`].
fn collect<'a>(
    scene: &'a Prepared,
    id: MaterialId,
    vertex: &Vertex,
    sides: &mut Option<&mut Sides>,
    n_leaves: &mut u32,
    weight: f32,
    blend: &mut Blend<'a>,
) {
    let material = &scene.shading.materials[id as usize];
    let leaf = *n_leaves;
    *n_leaves += u32::from(material.is_clear());
    match material {
        Material::Blend { weight: share, a, b, by_side, .. } => {
            let share = vertex.share_of_second(scene, *share, *by_side);
            collect(scene, *a, vertex, sides, n_leaves, weight * (1.0 - share), blend);
            collect(scene, *b, vertex, sides, n_leaves, weight * share, blend);
        }
        _ if weight == 0.0 => {}
        Material::Phong { diffuse, specular, transparency, .. } => {
            let specular = specular.eval(scene, vertex.texture_point).clamp(0.0, 1.0);
            let opaque = weight * (1.0 - transparency);
            if opaque * (1.0 - specular) > 0.0 {
                blend.push(
                    Lobe::Diffuse { albedo: diffuse.eval(scene, vertex.texture_point) },
                    opaque * (1.0 - specular),
                );
            }
            if opaque * specular > 0.0 {
                blend.push(Lobe::Mirror { reflectance: Vec3::ONE }, opaque * specular);
            }
            if *transparency > 0.0 {
                blend.push(clear_lobe(scene, sides, leaf), weight * transparency);
            }
        }
        Material::Principled { .. } => {
            if let Some(layers) = principled_at(scene, id, vertex, sides, leaf, false) {
                blend.push_layers(layers, weight);
            }
        }
        Material::Disney { .. } => {
            if let Some(disney) = disney_at(scene, id, vertex, sides, leaf) {
                blend.push(Lobe::Disney(disney), weight);
            }
        }
        Material::Glass { .. } => blend.push(clear_lobe(scene, sides, leaf), weight),
        Material::RoughGlass { alpha, compensate, beckmann, .. } => {
            let alpha = alpha.eval(scene, vertex.texture_point);
            blend.push(rough_lobe(clear_lobe(scene, sides, leaf), alpha, *beckmann, *compensate), weight);
        }
        _ => {
            if let Some(lobe) = lobe_at(scene, id, vertex, sides.as_deref_mut()) {
                blend.push(lobe, weight);
            }
        }
    }
}

#[inline]
fn clear_lobe(scene: &Prepared, sides: &mut Option<&mut Sides>, leaf: u32) -> Lobe<'static> {
    match sides {
        Some(sides) => Lobe::Glass(sides.interface(scene, leaf)),
        None => Lobe::CLEAR,
    }
}

/// Replaces smooth glass by rough glass, if microfacets of this width change directions.
#[inline]
fn rough_lobe(smooth: Lobe<'static>, alpha: f32, beckmann: bool, compensate: bool) -> Lobe<'static> {
    match smooth {
        Lobe::Glass(interface) if !rough_glass::is_smooth(alpha, interface.eta) => {
            Lobe::RoughGlass { interface, facets: Microfacets::isotropic(alpha.min(1.0), beckmann), compensate }
        }
        _ => smooth,
    }
}

/// Returns the lobe of a plain material; `None` if the surface is black. `sides` as in [`blend_at`].
#[inline]
pub(crate) fn lobe_at<'a>(
    scene: &'a Prepared,
    id: MaterialId,
    vertex: &Vertex,
    mut sides: Option<&mut Sides>,
) -> Option<Lobe<'a>> {
    let uv = vertex.texture_point;
    let here = sides.as_ref().map_or(MediumId::OUTSIDE, |sides| sides.here);
    match &scene.shading.materials[id as usize] {
        Material::Diffuse { albedo } => Some(Lobe::Diffuse { albedo: albedo.eval(scene, uv) }),
        Material::Mirror { reflectance } => Some(Lobe::Mirror { reflectance: reflectance.eval(scene, uv) }),
        Material::Metal { alpha, reflectance, fresnel, compensate } => {
            let color = reflectance.eval(scene, uv).into();
            Some(Lobe::Metal(Metal {
                facets: Microfacets::isotropic(alpha.eval(scene, uv).clamp(0.0, 1.0), false),
                tangent: None,
                tint: Tint { color, schlick: *fresnel == Fresnel::Schlick, index: None },
                compensate: *compensate,
            }))
        }
        Material::Conductor { alpha, alpha_v, beckmann, eta, k, reflectance, compensate } => {
            let along = alpha.eval(scene, uv).clamp(0.0, 1.0);
            let across = alpha_v.eval(scene, uv).clamp(0.0, 1.0);
            let alpha = [along, if across > 0.0 { across } else { along }];
            let facets = Microfacets { alpha, beckmann: *beckmann }.at_least_rough();
            let color = reflectance.eval(scene, uv).into();
            Some(Lobe::Metal(Metal {
                facets,
                tangent: (!facets.is_isotropic()).then(|| vertex.tangent.along(Vec2::X, vertex.normal).into()),
                tint: Tint { color, schlick: false, index: Some([(*eta).into(), (*k).into()]) },
                compensate: *compensate,
            }))
        }
        Material::Plastic { diffuse, alpha, ior, specular, nonlinear, beckmann } => {
            let facets = Microfacets::isotropic(alpha.eval(scene, uv).clamp(0.0, 1.0), *beckmann);
            let coat = Coat::at(&scene.tables.coats, id, *ior, facets);
            let albedo = diffuse.eval(scene, uv).clamp(Vec3::ZERO, Vec3::ONE);
            let specular = specular.eval(scene, uv).clamp(0.0, 1.0);
            Some(Lobe::Plastic(Plastic::new(albedo.into(), *nonlinear, specular, coat)))
        }
        Material::Translucent { reflectance, transmittance } => {
            let [reflectance, transmittance] = [reflectance, transmittance].map(|color| color.eval(scene, uv).into());
            Some(Lobe::Translucent(Translucent::new(reflectance, transmittance), here))
        }
        Material::ThinGlass { ior, reflectance, transmittance } => Some(Lobe::ThinGlass {
            ior: *ior,
            reflectance: reflectance.eval(scene, uv),
            transmittance: transmittance.eval(scene, uv),
            here,
        }),
        Material::Disney { .. } => disney_at(scene, id, vertex, &mut sides, 0).map(Lobe::Disney),
        Material::Glass { .. } => Some(clear_lobe(scene, &mut sides, 0)),
        Material::RoughGlass { alpha, compensate, beckmann, .. } => {
            Some(rough_lobe(clear_lobe(scene, &mut sides, 0), alpha.eval(scene, uv), *beckmann, *compensate))
        }
        Material::Emissive { .. } | Material::Phong { .. } | Material::Principled { .. } | Material::Blend { .. } => {
            None
        }
    }
}
