//! The materials of pbrt in ours: which kind stands for which, and what of it is lost.
//!
//! | pbrt | ours |
//! |---|---|
//! | `diffuse` | `diffuse` |
//! | `coateddiffuse` | `principled`: a dielectric layer over a diffuse one |
//! | `conductor` | `metal` with the reflectance at normal incidence |
//! | `coatedconductor` | `principled`: metal under a clear coat |
//! | `dielectric` | `glass`, `rough_glass` |
//! | `thindielectric` | `principled`, thin walled |
//! | `diffusetransmission`, `subsurface` | `diffuse`, told |
//! | `mix` | `blend` |
//! | `interface` | nothing: the surface is left out |

use crate::pbrt::params::Params;
use crate::pbrt::spectrum::{Spectrum, UnknownSpectrum, conductor_reflectance};
use crate::pbrt::textures::Texture;
use firstlight_files::printable;
use firstlight_format::parts::{InFile, MaterialPart};
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::Fresnel;
use glam::{DVec3, Vec3};

/// Where the values of a material come from: textures become names, and what is not shown is told.
pub(crate) trait MaterialScope {
    /// A parameter that is a number or the name of a texture.
    fn number(&mut self, params: &Params, name: &str) -> Option<Texture>;
    /// A parameter that is a spectrum or the name of a texture.
    fn color(&mut self, params: &Params, name: &str) -> Option<Texture>;
    /// The value that a material refers to; a texture gets a name.
    fn color_value(&mut self, texture: Texture) -> ColorValue;
    /// Likewise; its red channel is used.
    fn scalar_value(&mut self, texture: Texture) -> ScalarValue;
    /// The path of an image in the scene file.
    fn image(&mut self, name: &str) -> Option<ColorValue>;
    /// The name of a material of the scene, for a mixture.
    fn material(&mut self, name: &str) -> Option<String>;
    /// Something about this material that is not shown.
    fn tell(&mut self, what: &str);
}

/// A GGX width where both directions have their own: their geometric mean.
fn alpha(scope: &mut impl MaterialScope, params: &Params, prefix: &str) -> Texture {
    let name = |end: &str| format!("{prefix}{end}");
    let both = scope.number(params, &name("roughness"));
    let u = scope.number(params, &name("uroughness")).or(both.clone());
    let v = scope.number(params, &name("vroughness")).or(both);
    let is_remapped = params.flag("remaproughness").unwrap_or(true);
    // pbrt, version 4: α is the square root of the roughness.
    let width = |roughness: f32| if is_remapped { roughness.max(0.0).sqrt() } else { roughness.max(0.0) };
    let value = match (u, v) {
        (Some(Texture::Constant(u)), Some(Texture::Constant(v))) => {
            if u.x != v.x {
                scope.tell("its highlights are of the same width in all directions");
            }
            Texture::Constant(Vec3::splat((width(u.x) * width(v.x)).sqrt()))
        }
        (Some(texture @ Texture::Varying(_)), _) | (_, Some(texture @ Texture::Varying(_))) => {
            if is_remapped {
                scope.tell("its texture of roughness is used as it is, without the square root");
            }
            texture
        }
        (Some(Texture::Constant(one)), None) | (None, Some(Texture::Constant(one))) => {
            Texture::Constant(Vec3::splat(width(one.x)))
        }
        (None, None) => Texture::Constant(Vec3::ZERO),
    };
    match value {
        // Below this, pbrt takes a surface for smooth.
        Texture::Constant(alpha) if alpha.x < 1e-3 => Texture::Constant(Vec3::ZERO),
        Texture::Constant(alpha) => Texture::Constant(alpha.min(Vec3::ONE)),
        texture => texture,
    }
}

/// The roughness of `principled` for a GGX width.
fn roughness(scope: &mut impl MaterialScope, alpha: Texture) -> ScalarValue {
    match alpha {
        Texture::Constant(alpha) => ScalarValue::Number(alpha.x.sqrt()),
        texture => {
            scope.tell("its texture of roughness is used as it is, without a square root");
            scope.scalar_value(texture)
        }
    }
}

fn color(scope: &mut impl MaterialScope, params: &Params, name: &str, default: f32) -> ColorValue {
    let value = scope.color(params, name).unwrap_or(Texture::Constant(Vec3::splat(default)));
    match value {
        Texture::Constant(color) => ColorValue::Rgb(color.clamp(Vec3::ZERO, Vec3::ONE)),
        texture => scope.color_value(texture),
    }
}

/// Index of refraction and dispersion.
fn ior(scope: &mut impl MaterialScope, params: &Params, name: &str) -> (f32, f32) {
    let spectrum = params.find(name).filter(|param| param.kind == "spectrum").and_then(|_| params.spectrum(name));
    let found = match spectrum {
        Some(spectrum) => spectrum.ior(),
        None => Ok((params.number(name).unwrap_or(1.5), 0.0)),
    };
    let (ior, dispersion) = found.unwrap_or_else(|UnknownSpectrum(name)| {
        scope.tell(&format!("the spectrum `{}` is not known: an index of 1.5 is used", printable::name(&name)));
        (1.5, 0.0)
    });
    let ior = ior as f32;
    // pbrt takes an index of 0 for 1.
    (if ior > 0.0 && ior.is_finite() { ior } else { 1.0 }, dispersion as f32)
}

/// Reflectance of a conductor at normal incidence.
fn conductor(scope: &mut impl MaterialScope, params: &Params, prefix: &str) -> ColorValue {
    if params.has("reflectance") {
        return color(scope, params, "reflectance", 1.0);
    }
    let name = |end: &str| format!("{prefix}{end}");
    if params.texture(&name("eta")).is_some() || params.texture(&name("k")).is_some() {
        scope.tell("textures of `eta` and `k` are not modelled: copper is used");
    }
    let part = |end: &str| params.spectrum(&name(end)).unwrap_or_else(|| Spectrum::Named(format!("metal-Cu-{end}")));
    let reflectance = conductor_reflectance(&part("eta"), &part("k")).unwrap_or_else(|UnknownSpectrum(name)| {
        scope.tell(&format!("the spectrum `{}` is not known: a grey metal is used", printable::name(&name)));
        DVec3::splat(0.7)
    });
    ColorValue::Rgb(reflectance.as_vec3())
}

fn principled(base_color: ColorValue) -> MaterialPart {
    MaterialPart::principled(base_color)
}

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
            let mut part = principled(color(scope, params, "reflectance", 0.5));
            let width = alpha(scope, params, "");
            let (index, _) = ior(scope, params, "eta");
            if let MaterialPart::Principled { roughness: r, ior: i, .. } = &mut part {
                (*r, *i) = (roughness(scope, width), index);
            }
            part
        }
        "conductor" => {
            let width = alpha(scope, params, "");
            let alpha = scope.scalar_value(width);
            let reflectance = conductor(scope, params, "");
            MaterialPart::Metal { alpha, reflectance, fresnel: Fresnel::Schlick, compensate: false }
        }
        "coatedconductor" => {
            let mut part = principled(conductor(scope, params, "conductor."));
            let (base, coat) = (alpha(scope, params, "conductor."), alpha(scope, params, "interface."));
            if let MaterialPart::Principled { metallic, roughness: r, clearcoat, clearcoat_roughness, .. } = &mut part {
                (*metallic, *clearcoat) = (1.0.into(), 1.0.into());
                (*r, *clearcoat_roughness) = (roughness(scope, base), roughness(scope, coat));
            }
            scope.tell("its coat has an index of 1.5 and no thickness");
            part
        }
        "dielectric" => {
            let (ior, dispersion) = ior(scope, params, "eta");
            let absorption = Rgb(absorption);
            match alpha(scope, params, "") {
                Texture::Constant(Vec3::ZERO) => MaterialPart::Glass { ior, absorption, dispersion },
                width => {
                    let alpha = scope.scalar_value(width);
                    MaterialPart::RoughGlass { alpha, ior, absorption, dispersion, compensate: false }
                }
            }
        }
        "thindielectric" => {
            let mut part = principled(ColorValue::grey(1.0));
            let (index, _) = ior(scope, params, "eta");
            if let MaterialPart::Principled { transmission, thin_walled, roughness, ior, .. } = &mut part {
                (*transmission, *thin_walled, *roughness, *ior) = (1.0.into(), true, 0.0.into(), index);
            }
            part
        }
        "diffusetransmission" => {
            scope.tell("light does not pass through it: diffuse transmission is not modelled");
            MaterialPart::Diffuse { albedo: color(scope, params, "reflectance", 0.25) }
        }
        "subsurface" => {
            scope.tell("subsurface scattering is not modelled: a diffuse surface is shown");
            MaterialPart::Diffuse { albedo: color(scope, params, "reflectance", 0.5) }
        }
        "mix" => {
            let amount = scope.number(params, "amount").unwrap_or(Texture::Constant(Vec3::splat(0.5)));
            let parts: Vec<String> =
                params.strings("materials").iter().take(2).filter_map(|name| scope.material(name)).collect();
            match <[String; 2]>::try_from(parts) {
                Ok([a, b]) => MaterialPart::blend(scope.scalar_value(amount), a, b),
                Err(_) => {
                    scope.tell("its two `materials` are not there: grey is shown");
                    MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) }
                }
            }
        }
        other => {
            scope.tell(&format!("materials of the kind `{}` are not modelled: grey is shown", printable::name(other)));
            MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) }
        }
    };
    if params.has("displacement") {
        scope.tell("bump maps are not modelled: the surface is smooth");
    }
    if let Some(normals) = params.string("normalmap").and_then(|name| scope.image(name)) {
        match with_layers(&part) {
            Some(mut layered) => {
                if let MaterialPart::Principled { normal_map, .. } = &mut layered {
                    *normal_map = normals;
                }
                part = layered;
            }
            None => scope.tell("its normal map is not modelled"),
        }
    }
    Some(part)
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

/// A surface that emits light as well.
pub(crate) struct LightSurface {
    pub part: MaterialPart,
    /// Another material that `part` refers to by this name, once for each.
    pub others: Vec<MaterialPart>,
}

/// A material that emits; what it reflects stays as far as it can.
///
/// - `names`: names for up to two further materials.
pub(crate) fn emissive(
    part: Option<&MaterialPart>,
    radiance: ColorValue,
    is_two_sided: bool,
    names: [String; 2],
) -> LightSurface {
    let plain = |part| LightSurface { part, others: Vec::new() };
    if is_two_sided {
        let black = || principled(ColorValue::grey(0.0));
        let reflects = part.and_then(with_layers);
        let is_black = reflects.is_none();
        let mut layered = reflects.unwrap_or_else(black);
        if let MaterialPart::Principled { emission, specular, .. } = &mut layered {
            *emission = radiance;
            if is_black {
                *specular = 0.0.into();
            }
        }
        return plain(layered);
    }
    let emitter = |radiance| MaterialPart::Emissive { radiance };
    match (part, &radiance) {
        (Some(MaterialPart::Diffuse { albedo: ColorValue::Rgb(albedo) }), ColorValue::Rgb(light))
            if *albedo != Vec3::ZERO && albedo.max_element() < 1.0 =>
        {
            // A share of a brighter emitter, and the rest of a brighter surface: the same emission and reflection.
            let diffuse = albedo.max_element();
            let weight = ScalarValue::Number(1.0 - diffuse);
            let others = vec![
                MaterialPart::Diffuse { albedo: ColorValue::Rgb((*albedo / diffuse).min(Vec3::ONE)) },
                emitter(ColorValue::Rgb(*light / (1.0 - diffuse))),
            ];
            let [a, b] = names;
            LightSurface { part: MaterialPart::blend(weight, a, b), others }
        }
        _ => plain(emitter(radiance)),
    }
}
