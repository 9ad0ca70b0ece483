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

use crate::pbrt::params::Params;
use crate::pbrt::spectrum::{Spectrum, UnknownSpectrum, conductor_index, normal_reflectance};
use crate::pbrt::textures::{Texture, product};
use firstlight_files::printable;
use firstlight_format::parts::{InFile, MaterialPart};
use firstlight_format::sources::TextureSource;
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
    /// The map of normals of a material of ours with its factor, if it has one, and the name of the same without it.
    fn without_normals(&mut self, name: String) -> (Option<(ColorValue, f32)>, String);
    /// Adds a material that another one refers to; returns its name.
    fn add(&mut self, part: MaterialPart) -> String;
    /// Something about this material that is not shown.
    fn tell(&mut self, what: &str);
}

/// A GGX width where both directions have their own: their geometric mean.
fn alpha(scope: &mut impl MaterialScope, params: &Params, prefix: &str) -> Texture {
    let (u, v) = alphas(scope, params, prefix);
    match (u, v) {
        (Texture::Constant(u), Some(v)) => {
            scope.tell("its highlights are of the same width in all directions");
            Texture::Constant((u * v).powf(0.5))
        }
        (alpha, _) => alpha,
    }
}

/// The widths α along u and v; `None` for the second if it is the first.
fn alphas(scope: &mut impl MaterialScope, params: &Params, prefix: &str) -> (Texture, Option<f32>) {
    let name = |end: &str| format!("{prefix}{end}");
    let both = scope.number(params, &name("roughness"));
    let u = scope.number(params, &name("uroughness")).or(both.clone());
    let v = scope.number(params, &name("vroughness")).or(both);
    let is_remapped = params.flag("remaproughness").unwrap_or(true);
    // pbrt, version 4: α is the square root of the roughness.
    let width = |roughness: f32| if is_remapped { roughness.max(0.0).sqrt() } else { roughness.max(0.0) };
    let value = match (u, v) {
        (Some(Texture::Constant(u)), Some(Texture::Constant(v))) if u.x != v.x => {
            let [u, v] = [u.x, v.x].map(|roughness| width(roughness).min(1.0));
            // Below this, pbrt takes a surface for smooth.
            if u.max(v) >= 1e-3 {
                return (Texture::Constant(Vec3::splat(u)), Some(v.max(1e-4)));
            }
            Texture::Constant(Vec3::ZERO)
        }
        (Some(texture @ Texture::Varying(_)), _) | (_, Some(texture @ Texture::Varying(_))) => {
            if is_remapped {
                scope.tell("its texture of roughness is used as it is, without the square root");
            }
            texture
        }
        (Some(Texture::Constant(one)), _) | (None, Some(Texture::Constant(one))) => {
            Texture::Constant(Vec3::splat(width(one.x)))
        }
        (None, None) => Texture::Constant(Vec3::ZERO),
    };
    let value = match value {
        Texture::Constant(alpha) if alpha.x < 1e-3 => Texture::Constant(Vec3::ZERO),
        Texture::Constant(alpha) => Texture::Constant(alpha.min(Vec3::ONE)),
        texture => texture,
    };
    (value, None)
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
    let is_spectrum = params.find(name).is_some_and(|param| matches!(&*param.kind, "spectrum" | "rgb"));
    let spectrum = if is_spectrum { params.spectrum(name) } else { None };
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

/// What makes a conductor.
enum Conductor {
    /// Index of refraction and extinction coefficient, per channel.
    Index { eta: DVec3, k: DVec3 },
    /// A texture of its reflectance at normal incidence.
    Reflectance(ColorValue),
}

impl Conductor {
    /// Its colour at normal incidence.
    fn color(self) -> ColorValue {
        match self {
            Self::Index { eta, k } => {
                let channel = |i: usize| normal_reflectance(eta[i], k[i]) as f32;
                ColorValue::Rgb(Vec3::new(channel(0), channel(1), channel(2)))
            }
            Self::Reflectance(value) => value,
        }
    }
}

fn conductor(scope: &mut impl MaterialScope, params: &Params, prefix: &str) -> Conductor {
    if params.has("reflectance") {
        return match color(scope, params, "reflectance", 1.0) {
            // An index of 1, as in pbrt.
            ColorValue::Rgb(reflectance) => {
                let r = reflectance.as_dvec3().min(DVec3::splat(0.9999));
                Conductor::Index { eta: DVec3::ONE, k: 2.0 * (r / (1.0 - r)).map(f64::sqrt) }
            }
            texture => Conductor::Reflectance(texture),
        };
    }
    let name = |end: &str| format!("{prefix}{end}");
    if params.texture(&name("eta")).is_some() || params.texture(&name("k")).is_some() {
        scope.tell("textures of `eta` and `k` are not modelled: copper is used");
    }
    let part = |end: &str| params.spectrum(&name(end)).unwrap_or_else(|| Spectrum::Named(format!("metal-Cu-{end}")));
    match conductor_index(&part("eta"), &part("k")) {
        Ok((eta, k)) => Conductor::Index { eta, k },
        Err(UnknownSpectrum(name)) => {
            scope.tell(&format!("the spectrum `{}` is not known: a grey metal is used", printable::name(&name)));
            Conductor::Reflectance(ColorValue::grey(0.7))
        }
    }
}

pub(crate) fn principled(base_color: ColorValue) -> MaterialPart {
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
            let diffuse = color(scope, params, "reflectance", 0.5);
            let width = alpha(scope, params, "");
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
            let (width, across) = alphas(scope, params, "");
            let alpha = scope.scalar_value(width);
            match conductor(scope, params, "") {
                Conductor::Index { eta, k } => {
                    let (eta, k, reflectance) = (Rgb(eta.as_vec3()), Rgb(k.as_vec3()), ColorValue::grey(1.0));
                    let (alpha_v, beckmann, compensate) = (across.unwrap_or(0.0).into(), false, false);
                    MaterialPart::Conductor { alpha, alpha_v, beckmann, eta, k, reflectance, compensate }
                }
                Conductor::Reflectance(reflectance) => {
                    if across.is_some() {
                        scope.tell("its highlights are of the same width in all directions");
                    }
                    MaterialPart::Metal { alpha, reflectance, fresnel: Fresnel::Schlick, compensate: false }
                }
            }
        }
        "coatedconductor" => {
            let mut part = principled(conductor(scope, params, "conductor.").color());
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
                    MaterialPart::RoughGlass { alpha, ior, absorption, dispersion, compensate: false, beckmann: false }
                }
            }
        }
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
            let amount = scope.number(params, "amount").unwrap_or(Texture::Constant(Vec3::splat(0.5)));
            let parts: Vec<String> =
                params.strings("materials").iter().take(2).filter_map(|name| scope.material(name)).collect();
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
        other => {
            scope.tell(&format!("materials of the kind `{}` are not modelled: grey is shown", printable::name(other)));
            MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) }
        }
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
    match scope.number(params, "displacement")? {
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
