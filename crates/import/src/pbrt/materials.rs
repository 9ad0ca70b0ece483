//! The materials of pbrt in ours: which kind stands for which, and what of it is lost.
//!
//! | pbrt | ours |
//! |---|---|
//! | `diffuse` | `diffuse` |
//! | `coateddiffuse` | `plastic` |
//! | `conductor` | `conductor`; `metal` where its reflectance is a texture |
//! | `coatedconductor` | `principled`: metal under a clear coat |
//! | `dielectric` | `glass`, `rough_glass` |
//! | `thindielectric` | `thin_glass` |
//! | `diffusetransmission` | `translucent` |
//! | `subsurface` | `diffuse`, told |
//! | `mix` | `blend` |
//! | `interface` | nothing: the surface is left out |

use crate::pbrt::material_inputs::{
    MaterialScope, Widths, alpha, color, conductor, dielectric, ior, of_conductor, principled, roughness,
};
use crate::pbrt::params::Params;
use crate::pbrt::textures::{Texture, product};
use crate::pbrt::version3;
use firstlight_files::printable;
use firstlight_format::parts::{InFile, MaterialPart};
use firstlight_format::sources::TextureSource;
use firstlight_format::value::ColorValue;
use glam::Vec3;

/// Version 4: α is the square root of the roughness.
const ROOT: Widths = Widths { default: 0.0, of_roughness: f32::sqrt };

/// A material of pbrt as one of ours; `None` for `interface`, which nothing can see.
///
/// - `absorption`: of the medium inside, per metre.
pub(crate) fn material(
    scope: &mut impl MaterialScope,
    kind: &str,
    params: &Params,
    absorption: Vec3,
) -> Option<MaterialPart> {
    let mut part = match kind {
        "" | "none" | "interface" => return None,
        "diffuse" => MaterialPart::Diffuse { albedo: color(scope, params, "reflectance", 0.5) },
        "coateddiffuse" => {
            let diffuse = color(scope, params, "reflectance", 0.5);
            let width = alpha(scope, params, "", &ROOT);
            let (ior, _) = ior(scope, params, "eta");
            if params.has("albedo") {
                scope.tell("a medium in its coat is not modelled: the coat is clear");
            }
            MaterialPart::Plastic {
                diffuse,
                alpha: scope.scalar_value(width),
                ior,
                specular: 1.0.into(),
                nonlinear: true,
                beckmann: false,
            }
        }
        "conductor" => {
            let conductor = conductor(scope, params, "");
            of_conductor(scope, params, conductor, &ROOT)
        }
        "coatedconductor" => {
            let mut part = principled(conductor(scope, params, "conductor.").color());
            let (base, coat) = (alpha(scope, params, "conductor.", &ROOT), alpha(scope, params, "interface.", &ROOT));
            if let MaterialPart::Principled { metallic, roughness: r, clearcoat, clearcoat_roughness, .. } = &mut part {
                (*metallic, *clearcoat) = (1.0.into(), 1.0.into());
                (*r, *clearcoat_roughness) = (roughness(scope, base), roughness(scope, coat));
            }
            scope.tell("its coat has an index of 1.5 and no thickness");
            part
        }
        "dielectric" => dielectric(scope, params, "eta", absorption, &ROOT),
        "thindielectric" => {
            let (ior, _) = ior(scope, params, "eta");
            MaterialPart::ThinGlass { ior, reflectance: ColorValue::grey(1.0), transmittance: ColorValue::grey(1.0) }
        }
        "diffusetransmission" => {
            let scale = scope.number(params, "scale").unwrap_or(Texture::Constant(Vec3::ONE));
            let mut scaled = |name: &str| {
                let color = scope.color(params, name).unwrap_or(Texture::Constant(Vec3::splat(0.25)));
                let color = product(&color, &scale).unwrap_or_else(|| {
                    scope.tell("a texture as its `scale` is not modelled beside another: it is left out");
                    color
                });
                scope.color_value(match color {
                    Texture::Constant(color) => Texture::Constant(color.clamp(Vec3::ZERO, Vec3::ONE)),
                    texture => texture,
                })
            };
            MaterialPart::Translucent { reflectance: scaled("reflectance"), transmittance: scaled("transmittance") }
        }
        "subsurface" => {
            scope.tell("subsurface scattering is not modelled: a diffuse surface is shown");
            MaterialPart::Diffuse { albedo: color(scope, params, "reflectance", 0.5) }
        }
        "mix" => {
            let of_version_3 = ["namedmaterial2", "namedmaterial1"].map(|name| params.string(name));
            let (amount, names) = match of_version_3 {
                // The amount of the first one there, a colour.
                [Some(second), Some(first)] => (scope.color(params, "amount"), vec![second, first]),
                _ => (scope.number(params, "amount"), params.strings("materials").iter().map(|it| &**it).collect()),
            };
            let amount = amount.unwrap_or(Texture::Constant(Vec3::splat(0.5)));
            let parts: Vec<String> = names.into_iter().take(2).filter_map(|name| scope.material(name)).collect();
            match <[String; 2]>::try_from(parts) {
                Ok(parts) => {
                    let [(first, a), (second, b)] = parts.map(|name| scope.without_normals(name));
                    if first != second {
                        scope.tell("normal maps of one of its `materials` alone are not modelled: both have that map");
                    }
                    with_normals(MaterialPart::blend(scope.scalar_value(amount), a, b), first.or(second))
                }
                Err(_) => {
                    scope.tell("it has no two `materials` that can be mixed: grey is shown");
                    MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) }
                }
            }
        }
        other => version3::material(scope, other, params, absorption).unwrap_or_else(|| {
            scope.tell(&format!("materials of the kind `{}` are not modelled: grey is shown", printable::name(other)));
            MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) }
        }),
    };
    if let Some(normals) = normals(scope, params) {
        part = match part {
            MaterialPart::Principled { .. } | MaterialPart::Blend { .. } => part,
            plain => {
                let name = scope.add(plain);
                MaterialPart::blend(0.0.into(), name.clone(), name)
            }
        };
        if let MaterialPart::Principled { normal_map, .. } | MaterialPart::Blend { normal_map, .. } = &mut part {
            *normal_map = normals;
        }
    }
    Some(part)
}

/// The normal map of a material, or the image of its displacement as a relief.
fn normals(scope: &mut impl MaterialScope, params: &Params) -> Option<ColorValue> {
    if let Some(name) = params.string("normalmap") {
        return scope.image(name);
    }
    // The latter is that of version 3.
    let name = if params.has("displacement") { "displacement" } else { "bumpmap" };
    match scope.number(params, name)? {
        Texture::Varying(mut source @ TextureSource::Image { .. }) => {
            if let TextureSource::Image { relief, tint, invert, .. } = &mut source {
                // Negative factors are depths, and an inverted image with one rises with its values.
                let is_negative = tint.0.x < 0.0;
                *relief = Some(if is_negative && !*invert { -1.0 } else { 1.0 });
                (tint.0, *invert) = (tint.0.abs(), *invert && !is_negative);
            }
            Some(scope.color_value(Texture::Varying(source)))
        }
        Texture::Varying(_) => {
            scope.tell("only images are modelled as bump maps: the surface is smooth");
            None
        }
        // The same height everywhere.
        Texture::Constant(_) => None,
    }
}

/// The same blend with a map of normals and its factor.
pub(crate) fn with_normals(mut blend: MaterialPart, normals: Option<(ColorValue, f32)>) -> MaterialPart {
    if let (Some(normals), MaterialPart::Blend { normal_map, normal_scale, .. }) = (normals, &mut blend) {
        (*normal_map, *normal_scale) = normals;
    }
    blend
}

/// The same surface as `principled`, which has what other kinds lack; `None` if it is not the same.
pub(crate) fn with_layers(part: &MaterialPart) -> Option<MaterialPart> {
    match part {
        MaterialPart::Principled { .. } => Some(part.clone()),
        MaterialPart::Diffuse { albedo } => {
            let mut layered: MaterialPart = firstlight_render::Material::<InFile>::principled(albedo.clone());
            if let MaterialPart::Principled { specular, .. } = &mut layered {
                *specular = 0.0.into();
            }
            Some(layered)
        }
        _ => None,
    }
}
