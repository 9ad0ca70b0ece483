//! Textures and colours.
//!
//! Surface coordinates are ours: the top row of an image is at v = 1.

use crate::model::foreign::cut;
use crate::tungsten::converter::{Converter, Reads};
use crate::tungsten::fields::{Fields, vector};
use firstlight_files::printable;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Channel, Encoding, Wrap};
use glam::{DVec2, DVec3, Vec3};
use serde_json::Value;

impl Converter<'_> {
    /// A colour of a thing, constant or textured.
    pub(crate) fn color(&mut self, of: &Fields, name: &str, default: f32, reads: Reads) -> ColorValue {
        of.get(name).map_or(ColorValue::grey(default), |value| self.texture(of, name, value, reads))
    }

    /// A number of a thing, constant or textured.
    pub(crate) fn scalar(&mut self, of: &Fields, name: &str, default: f32, reads: Reads) -> ScalarValue {
        match self.color(of, name, default, reads) {
            ColorValue::Rgb(rgb) => ScalarValue::Number(rgb.x),
            ColorValue::Texture(name) => ScalarValue::Texture(name),
        }
    }

    fn texture(&mut self, of: &Fields, name: &str, value: &Value, reads: Reads) -> ColorValue {
        if let Some(rgb) = vector(value) {
            return ColorValue::Rgb(within(rgb, reads));
        }
        let key = (value.to_string(), reads);
        if let Some(known) = self.textures.get(&key) {
            return known.clone();
        }
        let texture = match value {
            Value::String(file) => self.image(of, file, None, reads),
            value => {
                let fields = Fields::of(Some(value), name, of.source);
                match fields.kind() {
                    "bitmap" => match fields.text("file") {
                        Some(file) => self.image(of, file, Some(&fields), reads),
                        None => told_grey(&fields, "a bitmap has no `file`"),
                    },
                    "constant" => ColorValue::Rgb(within(fields.vector("value").unwrap_or(DVec3::ONE), reads)),
                    "checker" => {
                        let color = |name: &str, default: f64| {
                            Rgb(within(fields.vector(name).unwrap_or(DVec3::splat(default)), reads))
                        };
                        let (a, b) = (color("off_color", 0.2), color("on_color", 0.8));
                        let count = |name: &str| fields.number(name).unwrap_or(20.0).clamp(1.0, 1e6).floor();
                        let squares = DVec2::new(count("res_u"), count("res_v"));
                        let source = TextureSource::Checker { a, b, squares, offset: DVec2::ZERO, rotate: 0.0 };
                        self.add_texture("checker", source)
                    }
                    other => {
                        let other = printable::name(other);
                        told_grey(&fields, &format!("textures of the kind `{other}` are not modelled"))
                    }
                }
            }
        };
        self.textures.insert(key, texture.clone());
        texture
    }

    fn image(&mut self, of: &Fields, file: &str, settings: Option<&Fields>, reads: Reads) -> ColorValue {
        let Some(path) = self.file_of(of, file) else { return ColorValue::grey(0.5) };
        let flag = |name: &str, default: bool| settings.and_then(|it| it.flag(name)).unwrap_or(default);
        let mut source = TextureSource::image(path.clone());
        if let TextureSource::Image { wrap, smooth, encoding, tint, channel, .. } = &mut source {
            *wrap = if flag("clamp", false) { Wrap::Clamp } else { Wrap::Repeat };
            *smooth = flag("interpolate", true);
            *encoding = if flag("gamma_correct", true) { Encoding::Auto } else { Encoding::Linear };
            let scale = settings.and_then(|it| it.number("scale")).unwrap_or(1.0).clamp(0.0, 1e6);
            *tint = Rgb(Vec3::splat(scale as f32));
            let is_number = matches!(reads, Reads::Number | Reads::Opacity);
            let [has_alpha, has_colours] = if is_number { self.channels_of(&path) } else { [false; 2] };
            if reads == Reads::Opacity && has_alpha {
                *channel = Some(Channel::A);
            } else if has_colours {
                *channel = Some(Channel::G);
                let file = printable::name(file);
                of.tell(format!("the mean of the channels of `{file}` is not modelled: it is the green one"));
            }
        }
        self.add_texture(file, source)
    }

    /// Whether an image has an alpha channel, and whether it is not grey; each is read once.
    fn channels_of(&mut self, path: &str) -> [bool; 2] {
        let (folder, images) = (self.folder, self.light_images);
        let read = || [images.has_alpha(folder, path), images.has_colours(folder, path)];
        *self.channels.entry(path.to_owned()).or_insert_with(read)
    }

    pub(crate) fn add_texture(&mut self, wanted: &str, source: TextureSource) -> ColorValue {
        let name = self.texture_names.free(cut(wanted));
        self.file.textures.0.insert(name.clone(), source);
        ColorValue::Texture(name)
    }
}

fn told_grey(of: &Fields, why: &str) -> ColorValue {
    of.tell(format!("{why}: grey is shown"));
    ColorValue::grey(0.5)
}

/// Within what a scene file may have.
fn within(rgb: DVec3, reads: Reads) -> Vec3 {
    let most = if reads == Reads::Light { 1e30 } else { 1.0 };
    rgb.clamp(DVec3::ZERO, DVec3::splat(most)).as_vec3()
}
