//! Images in memory, in the bit depth of their files.

use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// An image, row by row from the top.
#[derive(Debug, PartialEq)]
pub struct ImageTexture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The pixels, `width · height` of them.
    pub texels: Texels,
}

/// Pixels in the bit depth of their file; channels are interleaved.
#[derive(Debug, PartialEq)]
pub enum Texels {
    /// 8 bits per channel; 1 to 4 channels: grey, grey and alpha, RGB, RGBA.
    U8 {
        /// Channels per pixel, 1..=4.
        channels: usize,
        /// All channels of all pixels.
        data: Vec<u8>,
    },
    /// 16 bits per channel, with the same channels.
    U16 {
        /// Channels per pixel, 1..=4.
        channels: usize,
        /// All channels of all pixels.
        data: Vec<u16>,
    },
    /// Linear floating-point RGB; alpha is 1.
    F32(Vec<Vec3>),
}

/// Interpretation of an image's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// Integers are sRGB, floating-point numbers are linear.
    #[default]
    Auto,
    /// Integers are linear as well: for normals, roughness and other data. Alpha always is linear.
    Linear,
}

impl ImageTexture {
    /// Creates an image of `width · height` linear colours.
    pub fn from_linear(width: u32, height: u32, texels: Vec<Vec3>) -> Self {
        Self { width, height, texels: Texels::F32(texels) }
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.texels.len()
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The linear colour of pixel `i`, counted row by row from the top.
    #[inline]
    pub fn linear(&self, i: usize) -> Vec3 {
        self.texels.texel(i, Encoding::Auto).truncate()
    }

    /// Size in memory in bytes.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::U8 { data, .. } => data.len(),
            Texels::U16 { data, .. } => 2 * data.len(),
            Texels::F32(data) => size_of::<Vec3>() * data.len(),
        }
    }
}

impl Texels {
    fn len(&self) -> usize {
        match self {
            Self::U8 { channels, data } => data.len() / channels,
            Self::U16 { channels, data } => data.len() / channels,
            Self::F32(data) => data.len(),
        }
    }

    /// Pixel `i`, linear, with alpha.
    #[inline]
    pub fn texel(&self, i: usize, encoding: Encoding) -> Vec4 {
        let [texel] = self.texels([i], encoding);
        texel
    }

    /// Several pixels, likewise.
    #[inline]
    pub(crate) fn texels<const N: usize>(&self, places: [usize; N], encoding: Encoding) -> [Vec4; N] {
        match self {
            Self::U8 { channels, data } => {
                let alphas = linear_bytes();
                let curve = if encoding == Encoding::Auto { srgb_bytes() } else { alphas };
                let (color, alpha) = (|value: u8| curve[usize::from(value)], |value: u8| alphas[usize::from(value)]);
                places.map(|i| widened(pixel(data, *channels, i), color, alpha))
            }
            Self::U16 { channels, data } => {
                let share = |value: u16| f32::from(value) / 65535.0;
                match encoding {
                    Encoding::Auto => {
                        let curve = srgb_words();
                        places.map(|i| widened(pixel(data, *channels, i), |value| curve[usize::from(value)], share))
                    }
                    Encoding::Linear => places.map(|i| widened(pixel(data, *channels, i), share, share)),
                }
            }
            Self::F32(data) => places.map(|i| data[i].extend(1.0)),
        }
    }

    /// Bits of the first channel of pixel `i`.
    #[inline(always)]
    pub(crate) fn bits(&self, i: usize) -> u32 {
        match self {
            Self::U8 { channels, data } => data[i * channels].into(),
            Self::U16 { channels, data } => data[i * channels].into(),
            Self::F32(data) => data[i].x.to_bits(),
        }
    }
}

#[inline(always)]
fn pixel<T>(data: &[T], channels: usize, i: usize) -> &[T] {
    &data[i * channels..][..channels]
}

/// Expands to RGBA: grey is used for all three colours; alpha is 1 if there is none.
#[inline]
fn widened<T: Copy>(pixel: &[T], color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> Vec4 {
    match *pixel {
        [grey] => Vec3::splat(color(grey)).extend(1.0),
        [grey, a] => Vec3::splat(color(grey)).extend(alpha(a)),
        [r, g, b] => Vec4::new(color(r), color(g), color(b), 1.0),
        [r, g, b, a] => Vec4::new(color(r), color(g), color(b), alpha(a)),
        _ => unreachable!("pixels have 1 to 4 channels"),
    }
}

fn srgb_bytes() -> &'static [f32; 256] {
    static CURVE: OnceLock<[f32; 256]> = OnceLock::new();
    CURVE.get_or_init(|| std::array::from_fn(|value| linear_from_srgb(value as f32 / 255.0)))
}

fn linear_bytes() -> &'static [f32; 256] {
    static CURVE: OnceLock<[f32; 256]> = OnceLock::new();
    CURVE.get_or_init(|| std::array::from_fn(|value| value as f32 / 255.0))
}

fn srgb_words() -> &'static [f32] {
    static CURVE: OnceLock<Vec<f32>> = OnceLock::new();
    CURVE.get_or_init(|| (0..=u16::MAX).map(|value| linear_from_srgb(f32::from(value) / 65535.0)).collect())
}

/// Inverse sRGB transfer function (IEC 61966-2-1).
fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_become_linear_light_and_data_stay_as_they_are() {
        let picture = ImageTexture { width: 1, height: 1, texels: Texels::U8 { channels: 2, data: vec![188, 51] } };
        // Byte 188 is approximately half of the linear range.
        assert!(picture.texels.texel(0, Encoding::Auto).abs_diff_eq(Vec4::new(0.5029, 0.5029, 0.5029, 0.2), 1e-3));
        assert_eq!(picture.texels.texel(0, Encoding::Linear), Vec3::splat(188.0 / 255.0).extend(0.2));
        let deep = Texels::U16 { channels: 4, data: vec![0, 188 * 257, u16::MAX, 13107] };
        let texel = deep.texel(0, Encoding::Auto);
        assert_eq!(texel, Vec4::new(0.0, picture.linear(0).x, 1.0, 0.2), "8 and 16 bits agree");
        assert_eq!(deep.texel(0, Encoding::Linear).y, 188.0 / 255.0);
        assert_eq!((picture.len(), picture.bytes()), (1, 2));
    }
}
