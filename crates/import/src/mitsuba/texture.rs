//! Textures and colours of plugins: bitmaps, checkerboards, mesh attributes, spectra.
//!
//! Surface coordinates keep Mitsuba's: the top row of an image is at v = 0. Ours has it at v = 1, so that images are
//! turned over after `to_uv`.

use crate::mitsuba::converter::{Converter, Reads};
use crate::mitsuba::graph::{Node, Spectrum, Value};
use crate::mitsuba::read::find_file;
use crate::mitsuba::spectrum::{Use, blackbody, sampled};
use crate::mitsuba::words::numbers;
use firstlight_files::printable;
use firstlight_files::relative::path_to_text;
use firstlight_format::error::SceneError;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Channel, Encoding, Wrap};
use glam::{DMat2, DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Depth of textures in textures.
const MAX_DEPTH: u32 = 16;

impl Converter<'_> {
    /// A colour of a plugin, constant or textured.
    pub(crate) fn color(&mut self, node: Node, name: &str, default: f64, of: Use) -> Result<ColorValue, SceneError> {
        match self.given_color(node, name, of)? {
            Some(color) => Ok(color),
            None => Ok(ColorValue::grey(default as f32)),
        }
    }

    /// `None` if the plugin has no such colour.
    pub(crate) fn given_color(&mut self, node: Node, name: &str, of: Use) -> Result<Option<ColorValue>, SceneError> {
        if let Some(value) = node.value(name) {
            let rgb =
                constant(value, of).ok_or_else(|| node.error(format!("`{name}` must be a colour or a texture")))?;
            return Ok(Some(ColorValue::Rgb(limited(rgb, of))));
        }
        let Some(texture) = node.child(name)? else { return Ok(None) };
        self.texture(texture, of, Reads::Color).map(Some)
    }

    /// A colour that ours cannot texture: the mean of a texture, which is told.
    pub(crate) fn constant_color(&mut self, node: Node, name: &str, default: f64, of: Use) -> Result<Vec3, SceneError> {
        Ok(match self.color(node, name, default, of)? {
            ColorValue::Rgb(rgb) => rgb,
            ColorValue::Texture(texture) => {
                self.tell(node, &format!("a texture of {name} is not modelled: it is constant"));
                match self.file.textures.get(&texture) {
                    Some(TextureSource::Checker { a, b, .. }) => 0.5 * (a.0 + b.0),
                    _ => Vec3::splat(default as f32),
                }
            }
        })
    }

    /// A number of a plugin, constant or textured.
    pub(crate) fn scalar(&mut self, node: Node, name: &str, default: f64) -> Result<ScalarValue, SceneError> {
        let of = Use::Factor;
        if let Some(value) = node.value(name) {
            let rgb =
                constant(value, of).ok_or_else(|| node.error(format!("`{name}` must be a number or a texture")))?;
            return Ok(ScalarValue::Number(luminance(rgb) as f32));
        }
        let Some(texture) = node.child(name)? else { return Ok(ScalarValue::Number(default as f32)) };
        Ok(match self.texture(texture, of, Reads::Number)? {
            ColorValue::Rgb(rgb) => ScalarValue::Number(luminance(rgb.as_dvec3()) as f32),
            ColorValue::Texture(name) => ScalarValue::Texture(name),
        })
    }

    /// A number that ours cannot texture.
    pub(crate) fn constant_scalar(&mut self, node: Node, name: &str, default: f64) -> Result<f64, SceneError> {
        Ok(match self.scalar(node, name, default)? {
            ScalarValue::Number(number) => f64::from(number),
            ScalarValue::Texture(texture) => {
                self.tell(node, &format!("a texture of {name} is not modelled: it is constant"));
                match self.file.textures.get(&texture) {
                    Some(TextureSource::Checker { a, b, .. }) => f64::from(0.5 * (a.0.x + b.0.x)),
                    _ => default,
                }
            }
        })
    }

    pub(crate) fn texture(&mut self, node: Node, of: Use, reads: Reads) -> Result<ColorValue, SceneError> {
        if let Some(known) = self.textures.get(&(node.index, reads)) {
            return Ok(ColorValue::Texture(known.clone()));
        }
        if self.texture_depth > MAX_DEPTH {
            return Err(node.error("textures are nested too deep, or contain themselves"));
        }
        if let Some((inner, factor)) = self.scaled(node)? {
            let factor = limited(factor, Use::Factor);
            self.texture_depth += 1;
            let inner = self.texture(inner, of, reads)?;
            self.texture_depth -= 1;
            return Ok(match inner {
                ColorValue::Rgb(rgb) => ColorValue::Rgb(limited((rgb * factor).as_dvec3(), of)),
                ColorValue::Texture(name) => {
                    let name = self.tinted(&name, factor).unwrap_or(name);
                    self.textures.insert((node.index, reads), name.clone());
                    ColorValue::Texture(name)
                }
            });
        }
        let mut read_attribute = None;
        let source = match node.plugin() {
            "bitmap" => match self.bitmap(node, reads)? {
                Some(image) => image,
                None => return Ok(ColorValue::grey(0.5)),
            },
            "checkerboard" => self.checkerboard(node, of, reads)?,
            "mesh_attribute" => {
                let missing = || node.error("the `name` of a mesh_attribute begins with `vertex_` or `face_`");
                let attribute = node.text("name")?.ok_or_else(missing)?;
                if !["vertex_", "face_"].iter().any(|prefix| attribute.starts_with(prefix)) {
                    return Err(missing());
                }
                let tint = Rgb(Vec3::splat(node.float_or("scale", 1.0)? as f32));
                read_attribute = Some(attribute.to_owned());
                TextureSource::VertexColors { channel: None, tint }
            }
            plugin => {
                let Some(rgb) = self.spectrum_plugin(node, of)? else {
                    let plugin = printable::name(plugin);
                    self.tell(node, &format!("textures of type {plugin} are not modelled: it is grey"));
                    return Ok(ColorValue::grey(0.5));
                };
                return Ok(ColorValue::Rgb(limited(rgb, of)));
            }
        };
        let wanted = match node.object().id {
            Some(_) => node.called().to_owned(),
            None => format!("{} {}", node.plugin(), node.index),
        };
        let name = self.names.free(&wanted);
        if reads == Reads::Number && matches!(source, TextureSource::Image { channel: None, .. }) {
            self.numbers.push((name.clone(), node.index));
        }
        self.file.textures.0.insert(name.clone(), source);
        self.attributes.extend(read_attribute.map(|attribute| (name.clone(), attribute)));
        self.textures.insert((node.index, reads), name.clone());
        Ok(ColorValue::Texture(name))
    }

    /// The texture inside of a `scale` of version 0.x, and its factor; `None` for other plugins.
    pub(crate) fn scaled<'b>(&self, node: Node<'b>) -> Result<Option<(Node<'b>, DVec3)>, SceneError> {
        if node.plugin() != "scale" {
            return Ok(None);
        }
        let inner = node.children("texture")?.first().copied();
        let inner = inner.ok_or_else(|| node.error("a scale contains a texture"))?;
        let factor = node.value("scale").map_or(Some(DVec3::ONE), |value| constant(value, Use::Factor));
        Ok(Some((inner, factor.ok_or_else(|| node.error("`scale` must be a number or a colour"))?)))
    }

    /// A plugin that is a constant colour; `None` if it is another one.
    fn spectrum_plugin(&mut self, node: Node, of: Use) -> Result<Option<DVec3>, SceneError> {
        let scale = node.float_or("scale", 1.0)?;
        Ok(match node.plugin() {
            "srgb" | "rgb" | "uniform" | "spectrum" | "rawconstant" | "d65" => {
                let given = ["color", "value"].into_iter().find_map(|name| node.value(name));
                let daylight = node.plugin() == "d65";
                let is_unbounded = node.boolean_or("unbounded", false)?;
                let rgb = given.map_or(Some(DVec3::ONE), |value| match value {
                    Value::Spectrum(spectrum @ Spectrum::Uniform(_)) if daylight => Some(spectrum.rgb(Use::Factor)),
                    Value::Float(number) if node.plugin() == "uniform" && of == Use::Emission => {
                        Some(Spectrum::Uniform(*number).rgb(of))
                    }
                    value => constant(value, of),
                });
                let rgb = rgb.ok_or_else(|| node.error("its colour must be one"))? * scale;
                if is_unbounded && of == Use::Reflectance && rgb.max_element() > 1.0 {
                    self.tell(node, "a reflectance above 1 is not modelled: it is 1");
                }
                Some(rgb)
            }
            "blackbody" => {
                let kelvin = node.float_or("temperature", 5000.0)?;
                Some(blackbody(kelvin).rgb(of) * scale)
            }
            "irregular" | "regular" => {
                let list = |name: &str| match node.value(name) {
                    Some(Value::Text(text)) => numbers(text),
                    _ => None,
                };
                let spectrum = match (node.value("value"), list("wavelengths"), list("values")) {
                    (Some(Value::Spectrum(spectrum)), ..) => Some(spectrum.clone()),
                    (_, Some(wavelengths), Some(values)) if wavelengths.len() == values.len() => {
                        sampled(wavelengths.into_iter().zip(values).collect()).ok()
                    }
                    (_, None, Some(values)) if values.len() >= 2 => {
                        let from = node.float_or("wavelength_min", 360.0)?;
                        let to = node.float_or("wavelength_max", 830.0)?;
                        let step = (to - from) / (values.len() - 1) as f64;
                        let samples = values.into_iter().enumerate().map(|(i, v)| (from + i as f64 * step, v));
                        sampled(samples.collect()).ok()
                    }
                    _ => None,
                };
                let spectrum = spectrum.ok_or_else(|| node.error("its wavelengths and values do not match"))?;
                Some(spectrum.rgb(of) * scale)
            }
            _ => None,
        })
    }

    /// `None` for an image that must not be read, which is told.
    fn bitmap(&mut self, node: Node, reads: Reads) -> Result<Option<TextureSource>, SceneError> {
        let name = node.text("filename")?.ok_or_else(|| node.error("a bitmap needs a `filename`"))?;
        node.ignore(&["format", "accel", "max_anisotropy", "cache"]);
        let file = match find_file(&self.references, &self.graph.folders, name) {
            Ok(path) => self.file_path(&path),
            Err(why) => match self.references.resolve(self.folder, name) {
                // It is not there, which is told when it is looked for.
                Ok(missing) => path_to_text(&missing.path),
                Err(_) => {
                    self.tell(node, &format!("{why}; the texture is grey"));
                    node.skip();
                    return Ok(None);
                }
            },
        };
        let wrap = match node.text("wrap_mode")? {
            None | Some("repeat") => Wrap::Repeat,
            Some("mirror") => Wrap::Mirror,
            Some("clamp") => Wrap::Clamp,
            // Of version 0.x.
            Some("zero" | "one") => {
                self.tell(node, "black and white around an image are not modelled: its edge continues");
                Wrap::Clamp
            }
            Some(other) => {
                let other = printable::name(other);
                return Err(node.error(format!("`wrap_mode` must be repeat, mirror or clamp, not {other}")));
            }
        };
        let smooth = node.text("filter_type")? != Some("nearest");
        // The last two are of version 0.x, where a gamma of 0 is that of the file, and −1 sRGB.
        let (is_raw, gamma, channel) = (node.boolean_or("raw", false)?, node.float("gamma")?, node.text("channel")?);
        let is_linear = is_raw || gamma == Some(1.0);
        if !is_linear && gamma.is_some_and(|gamma| gamma > 0.0) {
            self.tell(node, "a gamma other than 1 is not modelled: the image is read as sRGB");
        }
        let encoding = if is_linear { Encoding::Linear } else { Encoding::Auto };
        let channel = match channel {
            Some("r") => Some(Channel::R),
            Some("g") => Some(Channel::G),
            Some("b") => Some(Channel::B),
            Some("a") => Some(Channel::A),
            None => None,
            Some(_) => {
                self.tell(node, "a channel other than r, g, b and a is not modelled: the whole image is read");
                None
            }
        };
        let (matrix, offset) = self.uv_transform(node, reads)?;
        // Over the middle of the image: its top is at v = 1.
        let flip = DMat2::from_diagonal(DVec2::new(1.0, -1.0));
        let placed = Placed::of(flip * matrix, DVec2::new(offset.x, 1.0 - offset.y));
        let Placed { stretch, repeat, offset, rotate } = placed.unwrap_or_else(|| {
            self.tell(node, "a sheared or flat texture transform is not modelled: it is left out");
            Placed::of(flip, DVec2::Y).expect("it is no shear")
        });
        let mut image = TextureSource::image(file);
        if let TextureSource::Image {
            stretch: a,
            repeat: b,
            offset: c,
            rotate: d,
            wrap: e,
            smooth: f,
            encoding: g,
            channel: h,
            ..
        } = &mut image
        {
            (*a, *b, *c, *d) = (stretch, repeat, offset, rotate);
            (*e, *f, *g, *h) = (wrap, smooth, encoding, channel);
        }
        Ok(Some(image))
    }

    /// Has the images of numbers that have colours read by their green channel, and tells it: in Mitsuba such a number
    /// is the luminance, of which most is green.
    pub(crate) fn settle_numbers(&mut self) {
        let mut numbers = std::mem::take(&mut self.numbers);
        numbers.sort_by_key(|(_, node)| *node);
        let file_of = |name: &str| match self.file.textures.get(name) {
            Some(TextureSource::Image { file, .. }) => Some(file.clone()),
            _ => None,
        };
        let files: BTreeSet<String> = numbers.iter().filter_map(|(name, _)| file_of(name)).collect();
        let files: Vec<String> = files.into_iter().collect();
        let (folder, images) = (self.folder, self.light_images);
        let is_coloured = |file: &&String| images.has_colours(folder, file);
        let coloured: BTreeSet<String> = files.par_iter().filter(is_coloured).cloned().collect();
        for (name, index) in numbers {
            if let Some(TextureSource::Image { file, channel, .. }) = self.file.textures.0.get_mut(&name)
                && coloured.contains(file)
            {
                *channel = Some(Channel::G);
                let node = Node { graph: self.graph, index };
                self.tell(node, "the luminance of a colour image is not modelled as a number: it is the green channel");
            }
        }
    }

    fn checkerboard(&mut self, node: Node, of: Use, reads: Reads) -> Result<TextureSource, SceneError> {
        self.texture_depth += 1;
        let mut color = |name: &str, default: f64| self.constant_color(node, name, default, of).map(Rgb);
        let (mut a, mut b) = (color("color0", 0.4)?, color("color1", 0.2)?);
        self.texture_depth -= 1;
        if reads == Reads::Number {
            std::mem::swap(&mut a, &mut b);
        }
        let (matrix, offset) = self.uv_transform(node, reads)?;
        // Its squares have sides of 1/2.
        let placed = Placed::of(2.0 * matrix, 2.0 * offset)
            // Numbers of single precision are a little off.
            .filter(|placed| placed.stretch.abs_diff_eq(DVec2::ONE, 1e-6));
        let Placed { repeat: squares, offset, rotate, .. } = placed.unwrap_or_else(|| {
            self.tell(node, "a sheared or flat texture transform is not modelled: it is left out");
            Placed::of(2.0 * DMat2::IDENTITY, DVec2::ZERO).expect("it is no shear")
        });
        Ok(TextureSource::Checker { a, b, squares, offset, rotate })
    }

    fn uv_transform(&self, node: Node, reads: Reads) -> Result<(DMat2, DVec2), SceneError> {
        let m = node.transform("to_uv")?;
        let matrix = DMat2::from_cols(m.x_axis.truncate().truncate(), m.y_axis.truncate().truncate());
        let (signs, shift) = reads.coordinates();
        Ok((matrix * signs, m.w_axis.truncate().truncate() + matrix * shift))
    }
}

/// A texture transform as a scene file says it: stretch, then rotate, then repeat, then shift.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placed {
    stretch: DVec2,
    repeat: DVec2,
    offset: DVec2,
    /// Degrees.
    rotate: f64,
}

impl Placed {
    /// `None` if it is none: a shear, or a matrix without an inverse.
    fn of(matrix: DMat2, offset: DVec2) -> Option<Self> {
        let [[a, c], [b, d]] = matrix.to_cols_array_2d();
        if b == 0.0 && c == 0.0 && a != 0.0 && d != 0.0 {
            return Some(Self { stretch: DVec2::ONE, repeat: DVec2::new(a, d), offset, rotate: 0.0 });
        }
        // Rows diag(r) · R(θ) · diag(s): a = r₀ s₀ cos, b = −r₀ s₁ sin, c = r₁ s₀ sin, d = r₁ s₁ cos.
        if a == 0.0 && d == 0.0 && b != 0.0 && c != 0.0 {
            return Some(Self { stretch: DVec2::ONE, repeat: DVec2::new(-b, c), offset, rotate: 90.0 });
        }
        // Of both directions the one in which nothing is mirrored.
        let tangent = (-(b * c) / (a * d)).sqrt().copysign(c * d);
        if !tangent.is_normal() {
            return None;
        }
        let (sin, cos) = tangent.atan().sin_cos();
        let repeat = DVec2::new(a / cos, c / sin);
        let stretch = DVec2::new(1.0, d / (repeat.y * cos));
        // A rotation with factors of one size is said by repeats alone.
        let stretch = if (stretch.y - 1.0).abs() < 1e-12 { DVec2::ONE } else { stretch };
        Some(Self { stretch, repeat, offset, rotate: tangent.atan().to_degrees() })
    }
}

/// The colour of a parameter that is one.
pub(crate) fn constant(value: &Value, of: Use) -> Option<DVec3> {
    match value {
        Value::Float(number) => Some(DVec3::splat(*number)),
        Value::Integer(number) => Some(DVec3::splat(*number as f64)),
        Value::Rgb(rgb) | Value::Vector(rgb) => Some(*rgb),
        Value::Spectrum(spectrum) => Some(spectrum.rgb(of)),
        Value::Boolean(_) | Value::Text(_) | Value::Transform(_) => None,
    }
}

/// Within what a scene file may have.
fn limited(rgb: DVec3, of: Use) -> Vec3 {
    let most = if of == Use::Reflectance { 1.0 } else { f64::from(f32::MAX) };
    rgb.clamp(DVec3::ZERO, DVec3::splat(most)).as_vec3()
}

/// Rec. 709.
pub(crate) fn luminance(rgb: DVec3) -> f64 {
    if rgb.x == rgb.y && rgb.y == rgb.z { rgb.x } else { rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_of_textures_are_taken_apart() {
        for (matrix, is_placed) in [
            (DMat2::from_diagonal(DVec2::new(2.0, -3.0)), true),
            (DMat2::from_angle(0.3), true),
            (DMat2::from_angle(2.8), true),
            (DMat2::from_cols_array(&[0.0, 2.0, -1.0, 0.0]), true),
            (DMat2::from_diagonal(DVec2::new(2.0, 5.0)) * DMat2::from_angle(-0.7), true),
            (DMat2::from_angle(-0.7) * DMat2::from_diagonal(DVec2::new(2.0, 5.0)), true),
            (DMat2::from_cols_array(&[1.0, 0.0, 1.0, 1.0]), false),
            (DMat2::ZERO, false),
        ] {
            let placed = Placed::of(matrix, DVec2::ZERO);
            assert_eq!(placed.is_some(), is_placed, "{matrix}");
            let Some(Placed { stretch, repeat, rotate, .. }) = placed else { continue };
            assert!(stretch.min_element() > 0.0, "{matrix}: {stretch}");
            let rotation = DMat2::from_angle(rotate.to_radians());
            let again = DMat2::from_diagonal(repeat) * rotation * DMat2::from_diagonal(stretch);
            assert!(again.abs_diff_eq(matrix, 1e-12), "{matrix}: {placed:?}");
        }
    }
}
