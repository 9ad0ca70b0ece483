//! Textures: what of pbrt's graph of textures is one colour, one image or one checkerboard with factors.

use crate::model::foreign::tinted;
use crate::pbrt::params::Params;
use crate::pbrt::spectrum::UnknownSpectrum;
use firstlight_files::printable;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::Rgb;
use firstlight_render::{Encoding, Wrap};
use glam::{DVec2, Vec3};
use std::collections::HashMap;

/// A texture as far as it can be shown.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Texture {
    /// The same everywhere.
    Constant(Vec3),
    /// Factors may be negative, which only heights show.
    Varying(TextureSource),
}

/// The textures of a scene by name; numbers and colours have names of their own.
#[derive(Debug, Default)]
pub(crate) struct Textures {
    numbers: HashMap<String, Texture>,
    colors: HashMap<String, Texture>,
}

/// Parameters of a texture that may be textures.
pub(crate) const TEXTURES: [&str; 6] = ["value", "tex", "scale", "tex1", "tex2", "amount"];

/// What a texture is replaced by that is not modelled.
const GREY: Texture = Texture::Constant(Vec3::splat(0.5));

impl Textures {
    pub(crate) fn get(&self, is_number: bool, name: &str) -> Option<&Texture> {
        if is_number { self.numbers.get(name) } else { self.colors.get(name) }
    }

    /// Defines a texture.
    ///
    /// - `file`: the path of an image in the scene file for its name in pbrt's, `None` if it must not be read;
    ///   `tell`: called with what is not shown.
    pub(crate) fn define(
        &mut self,
        name: &str,
        is_number: bool,
        class: &str,
        params: &Params,
        file: impl Fn(&str) -> Option<String>,
        mut tell: impl FnMut(String),
    ) {
        let texture = self.made(is_number, class, params, file, |what| {
            tell(format!("texture `{}`: {what}", printable::name(name)));
        });
        let all = if is_number { &mut self.numbers } else { &mut self.colors };
        all.insert(name.to_owned(), texture);
    }

    fn made(
        &self,
        is_number: bool,
        class: &str,
        params: &Params,
        file: impl Fn(&str) -> Option<String>,
        mut tell: impl FnMut(String),
    ) -> Texture {
        let part = |name: &str, default: f32| {
            self.parameter(is_number, params, name).unwrap_or(Texture::Constant(Vec3::splat(default)))
        };
        // The factor of a texture is a number, whatever its kind.
        let is_number_of = |name: &str| is_number || ["scale", "amount"].contains(&name);
        for name in TEXTURES {
            unknown_spectrum(params, name).filter(|_| !is_number_of(name)).into_iter().for_each(&mut tell);
            if let Some(texture) =
                params.texture(name).filter(|texture| self.get(is_number_of(name), texture).is_none())
            {
                let (texture, name) = (printable::name(texture), printable::name(name));
                tell(format!("there is no texture `{texture}` for `{name}`: the default is used"));
            }
        }
        match class {
            "constant" => part("value", 1.0),
            "scale" => {
                // Version 3 multiplies two of a kind.
                let is_of_version_3 = params.has("tex1") || params.has("tex2");
                let (tex, scale) = match is_of_version_3 {
                    true => (part("tex1", 1.0), part("tex2", 1.0)),
                    false => (
                        part("tex", 1.0),
                        self.parameter(true, params, "scale").unwrap_or(Texture::Constant(Vec3::ONE)),
                    ),
                };
                product(&tex, &scale).unwrap_or_else(|| {
                    tell("the product of these two textures is not modelled: the first is used".to_owned());
                    tex
                })
            }
            "mix" => {
                let (a, b) = (part("tex1", 0.0), part("tex2", 1.0));
                let amount = self.parameter(true, params, "amount").unwrap_or(GREY);
                match (a, b, amount) {
                    (Texture::Constant(a), Texture::Constant(b), Texture::Constant(amount)) => {
                        Texture::Constant(a.lerp(b, amount.x))
                    }
                    (a, _, Texture::Constant(Vec3 { x: 0.0, .. })) => a,
                    (_, b, Texture::Constant(Vec3 { x: 1.0, .. })) => b,
                    (a, ..) => {
                        tell("a mixture of textures is not modelled: the first is used".to_owned());
                        a
                    }
                }
            }
            "checkerboard" => {
                let (a, b) = (part("tex1", 1.0), part("tex2", 0.0));
                let is_flat = params.count("dimension").is_none_or(|dimension| dimension == 2);
                match (a, b, mapping(params)) {
                    (Texture::Constant(a), Texture::Constant(b), Some((squares, offset))) if is_flat => {
                        let (a, b) = (Rgb(a), Rgb(b));
                        Texture::Varying(TextureSource::Checker { a, b, squares, offset, rotate: 0.0 })
                    }
                    (a, ..) => {
                        tell(
                            "only checkerboards of two colours over u and v are modelled: the first colour is used"
                                .to_owned(),
                        );
                        a
                    }
                }
            }
            "imagemap" => {
                let Some(name) = params.string("filename") else {
                    tell("it has no `filename`: grey is used".to_owned());
                    return GREY;
                };
                let Some((repeat, offset)) = mapping(params) else {
                    tell("only the mapping `uv` is modelled: grey is used".to_owned());
                    return GREY;
                };
                let Some(file) = file(name) else { return GREY };
                let wrap = match params.string("wrap").unwrap_or("repeat") {
                    "repeat" => Wrap::Repeat,
                    "clamp" => Wrap::Clamp,
                    other => {
                        tell(format!("`wrap` `{}` is not modelled: its edge continues", printable::name(other)));
                        Wrap::Clamp
                    }
                };
                // Version 3 has a flag in its place.
                let default = if params.flag("gamma") == Some(false) { "linear" } else { "sRGB" };
                let encoding = match params.string("encoding").unwrap_or(default) {
                    "linear" => Encoding::Linear,
                    "sRGB" => Encoding::Auto,
                    other => {
                        tell(format!("`encoding` `{}` is not modelled: sRGB is used", printable::name(other)));
                        Encoding::Auto
                    }
                };
                let scale = params.number("scale").unwrap_or(1.0) as f32;
                let mut source = TextureSource::image(file);
                if let TextureSource::Image {
                    repeat: r, offset: o, wrap: w, encoding: e, tint, invert, smooth, ..
                } = &mut source
                {
                    (*r, *o, *w, *e) = (repeat, offset, wrap, encoding);
                    (*tint, *invert) = (Rgb(Vec3::splat(scale)), params.flag("invert").unwrap_or(false));
                    *smooth = params.string("filter") != Some("point");
                }
                Texture::Varying(source)
            }
            other => {
                tell(format!("`{}` textures are not modelled: grey is used", printable::name(other)));
                GREY
            }
        }
    }

    /// A parameter that is a number or a colour, or the name of a texture; `None` if it is missing.
    pub(crate) fn parameter(&self, is_number: bool, params: &Params, name: &str) -> Option<Texture> {
        if let Some(texture) = params.texture(name) {
            return self.get(is_number, texture).cloned();
        }
        match is_number {
            true => params.number(name).map(|number| Texture::Constant(Vec3::splat(number as f32))),
            false => params.spectrum(name)?.albedo().ok().map(|color| Texture::Constant(color.as_vec3())),
        }
    }
}

/// That a spectrum is not known, by which the default is used.
pub(crate) fn unknown_spectrum(params: &Params, name: &str) -> Option<String> {
    let UnknownSpectrum(spectrum) = params.spectrum(name)?.albedo().err()?;
    let spectrum = printable::name(&spectrum).into_owned();
    Some(format!("the spectrum `{spectrum}` of `{}` is not known: the default is used", printable::name(name)))
}

/// Factors of u and v and what is added to them; `None` for other mappings. Factors of 0 have no pattern.
fn mapping(params: &Params) -> Option<(DVec2, DVec2)> {
    if !matches!(params.string("mapping"), None | Some("uv")) {
        return None;
    }
    let number = |name: &str, default| params.number(name).unwrap_or(default);
    let scale = DVec2::new(number("uscale", 1.0), number("vscale", 1.0));
    let offset = DVec2::new(number("udelta", 0.0), number("vdelta", 0.0));
    (scale.x != 0.0 && scale.y != 0.0).then_some((scale, offset))
}

/// A texture as a surface shows it: pbrt takes negative values for 0 there.
pub(crate) fn without_negative(mut source: TextureSource) -> TextureSource {
    match &mut source {
        TextureSource::Checker { a, b, .. } => (a.0, b.0) = (a.0.max(Vec3::ZERO), b.0.max(Vec3::ZERO)),
        TextureSource::Image { tint, .. } | TextureSource::VertexColors { tint, .. } => tint.0 = tint.0.max(Vec3::ZERO),
    }
    source
}

/// The product of two textures, if it is one.
pub(crate) fn product(a: &Texture, b: &Texture) -> Option<Texture> {
    match (a, b) {
        (Texture::Constant(a), Texture::Constant(b)) => Some(Texture::Constant(*a * *b)),
        (Texture::Constant(factor), Texture::Varying(source))
        | (Texture::Varying(source), Texture::Constant(factor)) => tinted(source, *factor).map(Texture::Varying),
        _ => None,
    }
}
