//! Images as other renderers can use them: without factors, channels and inversion, which they lack.

use crate::common::surface::{Change, Use};
use exr::prelude::{AnyChannel, AnyChannels, Encoding as ExrEncoding, FlatSamples, Image, Layer, LayerAttributes};
use exr::prelude::{WritableImage, f16};
use firstlight_render::{Channel, Encoding, ImageTexture, Texels, Texture, TexturePattern, Wrap};
use glam::{Mat2, Vec2, Vec3};
use std::io::{self, Cursor};

/// An image file of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// As the scene says it.
    pub file: String,
    /// Whether its numbers are used as they are; else integers are sRGB.
    pub is_linear: bool,
}

/// An image that is written again.
pub(crate) struct Baked {
    pixels: ImageTexture,
    pub is_linear: bool,
}

/// Whether the file of a texture shows the same in another renderer.
pub(crate) fn is_plain(texture: &Texture, wanted: &Use, is_number: bool) -> bool {
    let TexturePattern::Image { image, .. } = &texture.pattern else { return false };
    // Others take the mean of channels for a number, or their luminance.
    let is_grey = matches!(image.texels, Texels::U8 { channels: 1, .. } | Texels::U16 { channels: 1, .. });
    let is_right_channel = texture.channel.is_none() || is_grey && texture.channel != Some(Channel::A);
    let is_as_it_is = texture.tint == Vec3::ONE && !texture.invert && wanted.change == Change::Nothing;
    is_as_it_is && is_right_channel && (is_grey || !is_number)
}

/// Whether the numbers of an image file are used as they are.
pub(crate) fn is_linear(texture: &Texture) -> bool {
    matches!(texture.pattern, TexturePattern::Image { encoding: Encoding::Linear, .. })
}

/// What a texture shows at a place of its image, for one use of it.
fn shown(texture: &Texture, image: &ImageTexture, encoding: Encoding, change: Change, i: usize) -> Vec3 {
    let texel = image.texels.texel(i, encoding);
    let chosen = match texture.channel {
        None => texel.truncate(),
        Some(channel) => Vec3::splat(texel[channel as usize]),
    };
    let tinted = chosen * texture.tint;
    change.of(if texture.invert { (Vec3::ONE - tinted).max(Vec3::ZERO) } else { tinted })
}

/// The image of a texture with everything that is applied to it.
pub(crate) fn baked(texture: &Texture, wanted: &Use, is_number: bool) -> Baked {
    let TexturePattern::Image { image, encoding, .. } = &texture.pattern else {
        let one = ImageTexture::from_linear(1, 1, vec![wanted.change.of(texture.mean())]);
        return Baked { pixels: one, is_linear: true };
    };
    let (width, height) = (image.width, image.height);
    let is_kept = texture.tint == Vec3::ONE && !texture.invert && wanted.change == Change::Nothing;
    if is_kept && let Some(texels) = kept(&image.texels, texture.channel, is_number) {
        let is_linear = *encoding == Encoding::Linear || texture.channel == Some(Channel::A);
        return Baked { pixels: ImageTexture { width, height, texels }, is_linear };
    }
    let at = |i: usize| shown(texture, image, *encoding, wanted.change, i);
    let at = |i: usize| if is_number { Vec3::splat(at(i).x) } else { at(i) };
    let pixels = ImageTexture::from_linear(width, height, (0..image.len()).map(at).collect());
    Baked { pixels, is_linear: true }
}

/// The part of a texture that a square with surface coordinates from 0 to 1 shows.
pub(crate) fn over_square(texture: &Texture, change: Change) -> Baked {
    /// Pixels per side of a square of a checker, and the least and the most per side of an image.
    const SQUARE: f32 = 64.0;
    const SIDES: [f32; 2] = [256.0, 4096.0];
    let texels = match &texture.pattern {
        TexturePattern::White => Vec2::ZERO,
        TexturePattern::Checker { .. } => Vec2::splat(SQUARE),
        TexturePattern::Image { image, .. } => Vec2::new(image.width as f32, image.height as f32),
    };
    let matrix = texture.uv_matrix;
    let [width, height] = [matrix.x_axis, matrix.y_axis]
        .map(|axis| (2.0 * (axis * texels).length()).ceil().clamp(SIDES[0], SIDES[1]) as u32);
    let at = |i: u32| {
        let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        change.of(texture.eval(Vec2::new(x / width as f32, 1.0 - y / height as f32)))
    };
    let pixels = ImageTexture::from_linear(width, height, (0..width * height).map(at).collect());
    Baked { pixels, is_linear: true }
}

/// Whether a texture is the same in each square between whole surface coordinates.
pub(crate) fn is_periodic(texture: &Texture) -> bool {
    let axes = [texture.uv_matrix.x_axis, texture.uv_matrix.y_axis];
    let is_whole = axes.iter().all(|axis| *axis == axis.round());
    match &texture.pattern {
        TexturePattern::White => true,
        TexturePattern::Checker { .. } => is_whole && axes.iter().all(|axis| axis.element_sum() % 2.0 == 0.0),
        TexturePattern::Image { wrap, .. } => is_whole && *wrap == [Wrap::Repeat; 2],
    }
}

/// Whether a texture is its image, in each square between whole surface coordinates.
pub(crate) fn is_placed_as_image(texture: &Texture) -> bool {
    matches!(texture.pattern, TexturePattern::Image { .. })
        && (texture.uv_matrix, texture.uv_offset) == (Mat2::IDENTITY, Vec2::ZERO)
}

/// The same integers, or those of one channel; `None` for floating point.
fn kept(texels: &Texels, channel: Option<Channel>, is_number: bool) -> Option<Texels> {
    let channel = channel.or(is_number.then_some(Channel::R));
    fn one<T: Copy>(data: &[T], channels: usize, channel: Option<Channel>, most: T) -> (usize, Vec<T>) {
        let place = match (channel, channels) {
            (None, _) => return (channels, data.to_vec()),
            (Some(Channel::A), 2) => Some(1),
            (Some(Channel::A), 1 | 3) => None,
            (Some(_), 1 | 2) => Some(0),
            (Some(channel), _) => Some(channel as usize),
        };
        (1, data.chunks_exact(channels).map(|pixel| place.map_or(most, |place| pixel[place])).collect())
    }
    match texels {
        Texels::U8 { channels, data } => {
            let (channels, data) = one(data, *channels, channel, u8::MAX);
            Some(Texels::U8 { channels, data })
        }
        Texels::U16 { channels, data } => {
            let (channels, data) = one(data, *channels, channel, u16::MAX);
            Some(Texels::U16 { channels, data })
        }
        Texels::F32(_) => None,
    }
}

impl Baked {
    /// Extension and bytes of its file: PNG for integers, else EXR.
    pub(crate) fn bytes(&self) -> io::Result<(&'static str, Vec<u8>)> {
        let (width, height) = (self.pixels.width, self.pixels.height);
        match &self.pixels.texels {
            Texels::U8 { channels, data } => Ok(("png", png(width, height, *channels, png::BitDepth::Eight, data)?)),
            Texels::U16 { channels, data } => {
                let bytes: Vec<u8> = data.iter().flat_map(|value| value.to_be_bytes()).collect();
                Ok(("png", png(width, height, *channels, png::BitDepth::Sixteen, &bytes)?))
            }
            Texels::F32(colors) => Ok(("exr", exr(width, height, colors)?)),
        }
    }
}

fn png(width: u32, height: u32, channels: usize, depth: png::BitDepth, data: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_depth(depth);
    encoder.set_color(match channels {
        1 => png::ColorType::Grayscale,
        2 => png::ColorType::GrayscaleAlpha,
        3 => png::ColorType::Rgb,
        _ => png::ColorType::Rgba,
    });
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(data).and_then(|()| writer.finish()).map_err(io::Error::other)?;
    Ok(bytes)
}

/// Linear Rec. 709; in half precision where that holds all values to a thousandth.
pub(crate) fn exr(width: u32, height: u32, colors: &[Vec3]) -> io::Result<Vec<u8>> {
    let fits = |value: f32| value == 0.0 || (6.2e-5..6.5e4).contains(&value.abs());
    let is_half = colors.iter().all(|color| color.to_array().into_iter().all(fits));
    let channel = |(c, name): (usize, &str)| {
        let values = colors.iter().map(|color| color[c]);
        let samples = match is_half {
            true => FlatSamples::F16(values.map(f16::from_f32).collect()),
            false => FlatSamples::F32(values.collect()),
        };
        AnyChannel::new(name, samples)
    };
    let channels = ["R", "G", "B"].into_iter().enumerate().map(channel).collect();
    let (size, attributes) = ((width as usize, height as usize), LayerAttributes::named("firstlight"));
    let layer = Layer::new(size, attributes, ExrEncoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut memory = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut memory).map_err(io::Error::other)?;
    Ok(memory.into_inner())
}
