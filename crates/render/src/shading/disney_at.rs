//! Parameters of Disney's BSDF at a surface point.

use crate::core::material::{Material, MaterialId, ScalarInput};
use crate::prepare::prepared::Prepared;
use crate::shading::disney::{Disney, Through};
use crate::shading::disney_layers::{DisneyInputs, DisneyLayers};
use crate::shading::interface::{Interface, MediumId};
use crate::shading::lookups::Lookups;
use crate::shading::sides::Sides;
use crate::shading::vertex::Vertex;
use glam::{Vec2, Vec3};

/// Evaluates a material at a vertex.
///
/// - `sides`, `leaf`: as of [`crate::shading::principled::at::principled_at`].
pub(crate) fn disney_at(
    scene: &Prepared,
    id: MaterialId,
    vertex: &Vertex,
    sides: &mut Option<&mut Sides>,
    leaf: u32,
) -> Option<Disney> {
    let Material::Disney {
        base_color,
        metallic,
        roughness,
        anisotropic,
        ior,
        specular_tint,
        transmission,
        thin_walled,
        diffuse_transmission,
        flatness,
        sheen,
        sheen_tint,
        clearcoat,
        clearcoat_gloss,
    } = &scene.shading.materials[id as usize]
    else {
        return None;
    };
    let lookups = Lookups::new(scene, vertex.texture_point);
    let share = |input: &ScalarInput| lookups.scalar(*input).clamp(0.0, 1.0);
    let color = lookups.color(*base_color).clamp(Vec3::ZERO, Vec3::ONE);
    let is_solid = !thin_walled;
    let inputs = DisneyInputs {
        color: color.into(),
        metallic: if is_solid { share(metallic) } else { 0.0 },
        roughness: share(roughness),
        anisotropic: share(anisotropic),
        ior: *ior,
        specular_tint: share(specular_tint),
        transmission: share(transmission),
        flatness: share(flatness),
        sheen: share(sheen),
        sheen_tint: share(sheen_tint),
        clearcoat: if is_solid { share(clearcoat) } else { 0.0 },
        clearcoat_gloss: if is_solid { share(clearcoat_gloss) } else { 0.0 },
    };
    let clear = inputs.transmission;
    let (mut layers, through) = if is_solid {
        let passes = (1.0 - inputs.metallic) * clear;
        let through = (passes > 0.0).then(|| {
            let interface = match sides {
                Some(sides) => sides.interface(scene, leaf),
                None => Interface { eta: 1.0 / ior, radiance_eta: 1.0, beyond: MediumId::OUTSIDE },
            };
            Through::Solid { share: passes, tint: color.powf(0.5), interface, is_front: vertex.front }
        });
        // Inside, only what passes is seen.
        let never_passes = matches!(transmission, ScalarInput::Constant(share) if *share <= 0.0);
        if !vertex.front && through.is_none() && !never_passes {
            return None;
        }
        (DisneyLayers::solid(&inputs), through)
    } else {
        let beyond = (0.5 * lookups.scalar(*diffuse_transmission)).clamp(0.0, 1.0);
        let through = (clear > 0.0 || beyond > 0.0).then(|| Through::Thin {
            clear: clear * color,
            facets: inputs.facets((0.65 * ior - 0.35) * inputs.roughness),
            diffuse: (1.0 - clear) * beyond * color,
            here: sides.as_ref().map_or(MediumId::OUTSIDE, |sides| sides.here),
        });
        (DisneyLayers::sheet(&inputs, beyond), through)
    };
    if !layers.facets.is_isotropic() {
        layers.tangent = Some(vertex.tangent.along(Vec2::X, vertex.normal).into());
    }
    Some(Disney { layers, through })
}
