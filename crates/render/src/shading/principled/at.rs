//! Parameters of a layered material at a surface point.

use crate::core::fresnel::reflectance_of;
use crate::core::material::{ColorInput, Material, MaterialId, ScalarInput};
use crate::prepare::prepared::Prepared;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::lookups::Lookups;
use crate::shading::principled::iridescence::ThinFilm;
use crate::shading::principled::layers::{BaseInputs, Inside, Principled, Transmission};
use crate::shading::sheen;
use crate::shading::sides::Sides;
use crate::shading::vertex::Vertex;
use glam::{Vec2, Vec3};

/// Evaluates a layered material at a vertex.
///
/// - `sides`: required by transmissive materials; without it they may be distinguished from others, but not sampled.
/// - `leaf`: index of its transparent part in the material that it belongs to.
/// - `is_lit`: whether light sampling includes light from the far side; otherwise only BSDF sampling finds it.
pub(crate) fn principled_at(
    scene: &Prepared,
    id: MaterialId,
    vertex: &Vertex,
    sides: &mut Option<&mut Sides>,
    leaf: u32,
    is_lit: bool,
) -> Option<Principled> {
    let Material::Principled {
        base_color,
        metallic,
        roughness,
        ior,
        specular,
        specular_color,
        transmission,
        thin_walled,
        anisotropy,
        anisotropy_rotation,
        anisotropy_map,
        sheen_color,
        sheen_roughness,
        clearcoat,
        clearcoat_roughness,
        clearcoat_normal_map,
        iridescence,
        iridescence_ior,
        iridescence_min,
        iridescence_max,
        iridescence_map,
        ..
    } = &scene.shading.materials[id as usize]
    else {
        return None;
    };
    let lookups = Lookups::new(scene, vertex.texture_point);
    let share = |input: &ScalarInput| lookups.scalar(*input).clamp(0.0, 1.0);
    let color = |input: &ColorInput| lookups.color(*input).clamp(Vec3::ZERO, Vec3::ONE);
    let (base, metallic) = (color(base_color), share(metallic));
    let roughness = share(roughness);
    let transmitting = share(transmission);
    let inputs = BaseInputs {
        color: base.into(),
        metallic,
        roughness,
        specular: share(specular),
        specular_color: (reflectance_of(*ior) * lookups.color(*specular_color).max(Vec3::ZERO)).into(),
    };
    let mut layers = Principled::of_base(&inputs, vertex.normal.into());
    let film_share = share(iridescence);
    if film_share > 0.0 {
        let nanometres = iridescence_min + (iridescence_max - iridescence_min) * share(iridescence_map);
        let film = ThinFilm { share: film_share, ior: *iridescence_ior, thickness: 1e-9 * nanometres };
        let cos = vertex.normal.dot(vertex.wo).clamp(0.0, 1.0);
        layers.facing = film.tint(layers.facing.into(), cos).into();
        layers.metal = film.tint(base, cos).into();
    }
    let anisotropy = share(anisotropy);
    if anisotropy > 0.0 {
        let map = color(anisotropy_map);
        layers.widen(anisotropy * map.z);
        let across = Vec2::from_angle(anisotropy_rotation.to_radians()).rotate(2.0 * Vec2::new(map.x, map.y) - 1.0);
        let along = vertex.tangent.along(across.normalize_or(Vec2::X), vertex.normal);
        layers.tangent = Some(along.into());
    }
    layers.transmission = (transmitting > 0.0 && metallic < 1.0).then(|| {
        let inside = if *thin_walled {
            Inside::Thin(sides.as_ref().map_or(MediumId::OUTSIDE, |sides| sides.here))
        } else {
            Inside::Solid(match sides {
                Some(sides) => sides.interface(scene, leaf),
                None => Interface { eta: 1.0 / ior, radiance_eta: 1.0, beyond: MediumId::OUTSIDE },
            })
        };
        Transmission { share: (1.0 - metallic) * transmitting, tint: base, inside, is_lit }
    });
    let opaque = (1.0 - metallic) * (1.0 - transmitting);
    layers.diffuse = (opaque * base).into();
    if !thin_walled {
        layers.dielectric = opaque;
    }
    layers.sheen = color(sheen_color).into();
    layers.sheen_alpha = sheen::alpha_of(share(sheen_roughness));
    layers.coat = share(clearcoat);
    layers.coat_alpha = share(clearcoat_roughness).powi(2);
    if layers.coat > 0.0 {
        layers.coat_normal = vertex.mapped_normal(scene, *clearcoat_normal_map).into();
    }
    let is_mapped = vertex.is_mapped() || (layers.coat > 0.0 && clearcoat_normal_map.is_normal_map());
    if is_mapped && layers.transmission.is_none() {
        layers.true_normal = Some(vertex.reach_normal().into());
    }
    Some(layers)
}
