//! Parameters of a layered material at a surface point.

use crate::core::material::{ColorInput, Material, MaterialId, SMALLEST_ALPHA, ScalarInput};
use crate::prepare::prepared::Prepared;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::lookups::Lookups;
use crate::shading::principled::iridescence::ThinFilm;
use crate::shading::principled::layers::{Inside, Principled, Transmission};
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
    let alpha = share(roughness).powi(2);
    let transmitting = share(transmission);
    let specular = share(specular);
    let at_normal = ((ior - 1.0) / (ior + 1.0)).powi(2);
    let facing = (at_normal * lookups.color(*specular_color).max(Vec3::ZERO)).min(Vec3::ONE) * specular;
    let film_share = share(iridescence);
    let (facing, metal) = if film_share > 0.0 {
        let nanometres = iridescence_min + (iridescence_max - iridescence_min) * share(iridescence_map);
        let film = ThinFilm { share: film_share, ior: *iridescence_ior, thickness: 1e-9 * nanometres };
        let cos = vertex.normal.dot(vertex.wo).clamp(0.0, 1.0);
        (film.tint(facing, cos), film.tint(base, cos))
    } else {
        (facing, base)
    };
    let opaque = (1.0 - metallic) * (1.0 - transmitting);
    let anisotropy = share(anisotropy);
    let (mut widths, mut direction) = ([alpha; 2], None);
    if anisotropy > 0.0 {
        let map = color(anisotropy_map);
        let strength = anisotropy * map.z;
        // The lobe is wider along the direction of anisotropy (`KHR_materials_anisotropy`).
        widths[0] = alpha + (1.0 - alpha) * strength * strength;
        if widths[0] >= SMALLEST_ALPHA {
            // A mirror along one direction only.
            widths[1] = alpha.max(SMALLEST_ALPHA);
        }
        let across = Vec2::from_angle(anisotropy_rotation.to_radians()).rotate(2.0 * Vec2::new(map.x, map.y) - 1.0);
        direction = Some(across.normalize_or(Vec2::X));
    }
    let transmission = (transmitting > 0.0 && metallic < 1.0).then(|| {
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
    let coat = share(clearcoat);
    let is_mapped = vertex.is_mapped() || (coat > 0.0 && clearcoat_normal_map.is_normal_map());
    let true_normal = (is_mapped && transmission.is_none()).then(|| vertex.reach_normal());
    Some(Principled {
        dielectric: if *thin_walled { 1.0 - metallic } else { opaque },
        facing,
        grazing: Vec3::splat(specular),
        diffuse: opaque * base,
        metallic,
        metal,
        alpha: widths,
        tangent: direction.map(|direction| vertex.tangent.along(direction, vertex.normal)),
        true_normal,
        transmission,
        sheen: color(sheen_color),
        sheen_alpha: sheen::alpha_of(share(sheen_roughness)),
        coat,
        coat_alpha: share(clearcoat_roughness).powi(2),
        coat_normal: if coat > 0.0 { vertex.mapped_normal(scene, *clearcoat_normal_map) } else { vertex.normal },
    })
}
