//! What materials of pbrt are made of: colours, widths of highlights, indices of refraction, metals and glass.

use crate::pbrt::params::Params;
use crate::pbrt::spectrum::{Spectrum, UnknownSpectrum, conductor_index, normal_reflectance};
use crate::pbrt::textures::Texture;
use firstlight_files::printable;
use firstlight_format::parts::MaterialPart;
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

/// What a roughness means.
pub(super) struct Widths {
    /// Where none is given.
    pub default: f32,
    /// The width α of a roughness, unless `remaproughness` is off.
    pub of_roughness: fn(f32) -> f32,
}

/// A GGX width where both directions have their own: their geometric mean.
pub(super) fn alpha(scope: &mut impl MaterialScope, params: &Params, prefix: &str, widths: &Widths) -> Texture {
    let (u, v) = alphas(scope, params, prefix, widths);
    match (u, v) {
        (Texture::Constant(u), Some(v)) => {
            scope.tell("its highlights are of the same width in all directions");
            Texture::Constant((u * v).powf(0.5))
        }
        (alpha, _) => alpha,
    }
}

/// The widths α along u and v; `None` for the second if it is the first.
pub(super) fn alphas(
    scope: &mut impl MaterialScope,
    params: &Params,
    prefix: &str,
    widths: &Widths,
) -> (Texture, Option<f32>) {
    let name = |end: &str| format!("{prefix}{end}");
    let both = scope.number(params, &name("roughness"));
    let u = scope.number(params, &name("uroughness")).or(both.clone());
    let v = scope.number(params, &name("vroughness")).or(both);
    let is_remapped = params.flag("remaproughness").unwrap_or(true);
    let remapped = |roughness: f32| (widths.of_roughness)(roughness.max(0.0));
    let width = |roughness: f32| if is_remapped { remapped(roughness) } else { roughness.max(0.0) };
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
        (None, None) => Texture::Constant(Vec3::splat(width(widths.default))),
    };
    let value = match value {
        Texture::Constant(alpha) if alpha.x < 1e-3 => Texture::Constant(Vec3::ZERO),
        Texture::Constant(alpha) => Texture::Constant(alpha.min(Vec3::ONE)),
        texture => texture,
    };
    (value, None)
}

/// The roughness of `principled` for a GGX width.
pub(super) fn roughness(scope: &mut impl MaterialScope, alpha: Texture) -> ScalarValue {
    match alpha {
        Texture::Constant(alpha) => ScalarValue::Number(alpha.x.sqrt()),
        texture => {
            scope.tell("its texture of roughness is used as it is, without a square root");
            scope.scalar_value(texture)
        }
    }
}

pub(super) fn color(scope: &mut impl MaterialScope, params: &Params, name: &str, default: f32) -> ColorValue {
    let value = scope.color(params, name).unwrap_or(Texture::Constant(Vec3::splat(default)));
    match value {
        Texture::Constant(color) => ColorValue::Rgb(color.clamp(Vec3::ZERO, Vec3::ONE)),
        texture => scope.color_value(texture),
    }
}

/// Index of refraction and dispersion.
pub(super) fn ior(scope: &mut impl MaterialScope, params: &Params, name: &str) -> (f32, f32) {
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
pub(super) enum Conductor {
    /// Index of refraction and extinction coefficient, per channel.
    Index { eta: DVec3, k: DVec3 },
    /// A texture of its reflectance at normal incidence.
    Reflectance(ColorValue),
}

impl Conductor {
    /// Its colour at normal incidence.
    pub fn color(self) -> ColorValue {
        match self {
            Self::Index { eta, k } => {
                let channel = |i: usize| normal_reflectance(eta[i], k[i]) as f32;
                ColorValue::Rgb(Vec3::new(channel(0), channel(1), channel(2)))
            }
            Self::Reflectance(value) => value,
        }
    }
}

pub(super) fn conductor(scope: &mut impl MaterialScope, params: &Params, prefix: &str) -> Conductor {
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

/// A metal whose roughness is among the parameters.
pub(super) fn of_conductor(
    scope: &mut impl MaterialScope,
    params: &Params,
    conductor: Conductor,
    widths: &Widths,
) -> MaterialPart {
    let (width, across) = alphas(scope, params, "", widths);
    let alpha = scope.scalar_value(width);
    match conductor {
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

/// Glass, smooth or rough.
///
/// - `index`: the parameter with its index of refraction; `absorption`: of the medium inside, per metre.
pub(super) fn dielectric(
    scope: &mut impl MaterialScope,
    params: &Params,
    index: &str,
    absorption: Vec3,
    widths: &Widths,
) -> MaterialPart {
    let (ior, dispersion) = ior(scope, params, index);
    let absorption = Rgb(absorption);
    match alpha(scope, params, "", widths) {
        Texture::Constant(Vec3::ZERO) => MaterialPart::Glass { ior, absorption, dispersion },
        width => {
            let alpha = scope.scalar_value(width);
            MaterialPart::RoughGlass { alpha, ior, absorption, dispersion, compensate: false, beckmann: false }
        }
    }
}

pub(crate) fn principled(base_color: ColorValue) -> MaterialPart {
    MaterialPart::principled(base_color)
}
