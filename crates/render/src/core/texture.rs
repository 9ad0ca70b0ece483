//! Textures: colours that vary over a surface.

pub use crate::core::image_texture::{Encoding, ImageTexture, Texels};
use firstlight_simd::{Elementary, Real};
use glam::{Mat2, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Index into the textures of a snapshot.
pub type TextureId = u32;

/// Behaviour of an image outside of the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The pattern repeats.
    #[default]
    Repeat,
    /// The pattern repeats, every other copy mirrored.
    Mirror,
    /// The texel at the edge continues.
    Clamp,
}

/// One channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha; 1 if the image has none.
    A,
}

/// A pattern, the mapping from surface coordinates to it, and modifications of its colours.
///
/// Surface coordinates: `uv` of a mesh or quad (0..1), longitude and latitude of a sphere (0..1, v = 1 at +Y of the
/// object), metres along two axes of an infinite plane.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The pattern.
    pub pattern: TexturePattern,
    /// Texture coordinate set of a mesh: 0 for the first, 1 for the second. Other shapes have one set.
    pub uv_set: u8,
    /// Applied to surface coordinates first: rotation and scale.
    pub uv_matrix: Mat2,
    /// Added after `uv_matrix`.
    pub uv_offset: Vec2,
    /// The channel that is used for red, green and blue; `None` for the colour.
    pub channel: Option<Channel>,
    /// Factor of the colours.
    pub tint: Vec3,
    /// Whether the colours, with their factor, are subtracted from 1: glossiness as roughness.
    pub invert: bool,
    /// Whether colours are multiplied by the vertex colours of a mesh.
    pub vertex_colors: bool,
    /// As a normal map: how far white is above black, metres, if these are heights; `None` if they are normals.
    pub relief: Option<f32>,
}

/// A pattern: colours over pattern coordinates.
#[derive(Clone, Debug)]
pub enum TexturePattern {
    /// White: for vertex colours only.
    White,
    /// Squares of side 1 in pattern coordinates; the one at (0, 0)..(1, 1) has colour `a`.
    Checker {
        /// Colour of squares whose integer coordinates have an even sum, linear Rec. 709.
        a: Vec3,
        /// Colour of the others, linear Rec. 709.
        b: Vec3,
    },
    /// An image that covers 0..1; its top row is at v = 1.
    Image {
        /// The image.
        image: Arc<ImageTexture>,
        /// Interpretation of its numbers.
        encoding: Encoding,
        /// Behaviour outside of 0..1, along u and along v.
        wrap: [Wrap; 2],
        /// Bilinear if true, otherwise the nearest texel.
        smooth: bool,
    },
}

/// Texture lookup coordinates of a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturePoint {
    /// First and second surface coordinates.
    pub uv: [Vec2; 2],
    /// Interpolated vertex colour with alpha, linear Rec. 709; white if there is none.
    pub color: Vec4,
}

impl From<Vec2> for TexturePoint {
    fn from(uv: Vec2) -> Self {
        Self { uv: [uv; 2], color: Vec4::ONE }
    }
}

impl TexturePoint {
    /// Interpolates between three corners: `first + x (second − first) + y (third − first)`.
    pub(crate) fn between([a, b, c]: &[Self; 3], Vec2 { x, y }: Vec2) -> Self {
        let w = 1.0 - x - y;
        let uv = std::array::from_fn(|k| w * a.uv[k] + x * b.uv[k] + y * c.uv[k]);
        Self { uv, color: w * a.color + x * b.color + y * c.color }
    }
}

impl Texture {
    /// Creates a texture with unmodified coordinates and colours.
    pub fn new(pattern: TexturePattern) -> Self {
        Self {
            pattern,
            uv_set: 0,
            uv_matrix: Mat2::IDENTITY,
            uv_offset: Vec2::ZERO,
            channel: None,
            tint: Vec3::ONE,
            invert: false,
            vertex_colors: false,
            relief: None,
        }
    }

    /// Evaluates the colour at a point.
    #[inline]
    pub fn eval(&self, point: impl Into<TexturePoint>) -> Vec3 {
        self.shown(self.texel(&point.into()))
    }

    /// What the texture shows at a place, before a channel is chosen and tinted.
    pub(crate) fn texel(&self, point: &TexturePoint) -> Vec4 {
        let uv = point.uv[usize::from(self.uv_set.min(1))];
        let p = Vec2::from(self.pattern_coordinates(uv.to_array()));
        let mut texel = match &self.pattern {
            TexturePattern::White => Vec4::ONE,
            TexturePattern::Checker { a, b } => {
                if is_even_square(p.to_array()) {
                    a.extend(1.0)
                } else {
                    b.extend(1.0)
                }
            }
            TexturePattern::Image { image, encoding, wrap, smooth: false } => image.nearest(p, *wrap, *encoding),
            TexturePattern::Image { image, encoding, wrap, smooth: true } => image.bilinear(p, *wrap, *encoding),
        };
        if self.vertex_colors {
            texel *= point.color;
        }
        texel
    }

    /// Derivatives of the height by the surface coordinates at a place, metres; `None` if these are no heights.
    ///
    /// They are those of the interpolated texels around it: constant along each axis between two.
    pub(crate) fn slope(&self, point: &TexturePoint) -> Option<Vec2> {
        let height = self.relief?;
        let TexturePattern::Image { image, encoding, wrap, .. } = &self.pattern else { return Some(Vec2::ZERO) };
        let uv = point.uv[usize::from(self.uv_set.min(1))];
        let (places, [x, y]) = image.places(self.pattern_coordinates(uv.to_array()).into(), *wrap);
        let [a, b, c, d] = image.texels.texels(places, *encoding).map(|texel| height * self.shown(texel).x);
        // Rows count downwards, v upwards.
        let by_u = ((b - a) * (1.0 - y) + (d - c) * y) * image.width as f32;
        let by_v = ((a - c) * (1.0 - x) + (b - d) * x) * image.height as f32;
        Some(self.uv_matrix.transpose() * Vec2::new(by_u, by_v))
    }

    /// Reads a part of each row of texels that [`Self::texel`] reads, so that they are in the cache afterwards. The
    /// result has no meaning.
    #[inline]
    pub(crate) fn touch(&self, point: &TexturePoint) -> u32 {
        let TexturePattern::Image { image, wrap, .. } = &self.pattern else { return 0 };
        let uv = point.uv[usize::from(self.uv_set.min(1))];
        let ([above, _, below, _], _) = image.places(self.pattern_coordinates(uv.to_array()).into(), *wrap);
        image.texels.bits(above) ^ image.texels.bits(below)
    }

    /// Bytes of its image in memory.
    pub(crate) fn bytes(&self) -> usize {
        if let TexturePattern::Image { image, .. } = &self.pattern { image.bytes() } else { 0 }
    }

    /// Whether [`Self::texel`] is the same for both at every point.
    #[inline]
    pub(crate) fn has_texels_of(&self, other: &Self) -> bool {
        use TexturePattern::Image;
        let is_same_pattern = match (&self.pattern, &other.pattern) {
            (
                Image { image: a, encoding, wrap, smooth },
                Image { image: b, encoding: other_encoding, wrap: other_wrap, smooth: other_smooth },
            ) => Arc::ptr_eq(a, b) && (encoding, wrap, smooth) == (other_encoding, other_wrap, other_smooth),
            _ => false,
        };
        let point = |texture: &Self| (texture.uv_set, texture.uv_matrix, texture.uv_offset, texture.vertex_colors);
        is_same_pattern && point(self) == point(other)
    }

    /// Whether the colours are those of the pattern at the first surface coordinates.
    pub(crate) fn is_plain(&self) -> bool {
        !self.asks_for_more_than_uv() && self.channel.is_none() && self.tint == Vec3::ONE && !self.invert
    }

    /// Whether it needs data that only meshes have: second texture coordinates or vertex colours.
    pub(crate) fn asks_for_more_than_uv(&self) -> bool {
        self.uv_set != 0 || self.vertex_colors
    }

    /// The colour that a texel gives: its channel, tinted, and perhaps inverted.
    #[inline]
    pub(crate) fn shown(&self, texel: Vec4) -> Vec3 {
        let chosen = match self.channel {
            None => texel.truncate(),
            Some(Channel::R) => Vec3::splat(texel.x),
            Some(Channel::G) => Vec3::splat(texel.y),
            Some(Channel::B) => Vec3::splat(texel.z),
            Some(Channel::A) => Vec3::splat(texel.w),
        };
        let tinted = chosen * self.tint;
        if self.invert { (Vec3::ONE - tinted).max(Vec3::ZERO) } else { tinted }
    }

    /// Converts surface coordinates to pattern coordinates.
    #[inline(always)]
    pub(crate) fn pattern_coordinates<R: Real>(&self, [u, v]: [R; 2]) -> [R; 2] {
        let (m, offset) = (self.uv_matrix, self.uv_offset);
        [u * m.x_axis.x + v * m.y_axis.x + offset.x, u * m.x_axis.y + v * m.y_axis.y + offset.y]
    }

    /// Mean colour over the pattern, for the power of lights; vertex colours count as white.
    pub fn mean(&self) -> Vec3 {
        let mean = match &self.pattern {
            TexturePattern::White => Vec4::ONE,
            TexturePattern::Checker { a, b } => (0.5 * (*a + *b)).extend(1.0),
            TexturePattern::Image { image, encoding, .. } => {
                let texels = (0..image.len()).map(|i| image.texels.texel(i, *encoding).as_dvec4());
                (texels.sum::<glam::DVec4>() / image.len().max(1) as f64).as_vec4()
            }
        };
        self.shown(mean)
    }
}

/// Whether a point lies in a square of the first colour of a checker.
#[inline(always)]
pub(crate) fn is_even_square<R: Elementary>([x, y]: [R; 2]) -> R::Mask {
    // Parity of the sum without integers, which distant planes would overflow.
    let half = (x.floor() + y.floor()) * 0.5;
    (half - half.truncated()).is_zero()
}

impl ImageTexture {
    fn nearest(&self, uv: Vec2, wrap: [Wrap; 2], encoding: Encoding) -> Vec4 {
        let (x, y) = (floor(uv.x * self.width as f32), floor((1.0 - uv.y) * self.height as f32));
        let [column, row] = [wrap[0].apply(x, self.width), wrap[1].apply(y, self.height)];
        let [texel] = self.texels.texels([row * self.width as usize + column], encoding);
        texel
    }

    fn bilinear(&self, uv: Vec2, wrap: [Wrap; 2], encoding: Encoding) -> Vec4 {
        let (places, [fx, fy]) = self.places(uv, wrap);
        let [a, b, c, d] = self.texels.texels(places, encoding);
        a.lerp(b, fx).lerp(c.lerp(d, fx), fy)
    }

    /// The four texels around a place, two per row, and how far it is from the first along both axes, 0..=1.
    #[inline(always)]
    fn places(&self, uv: Vec2, wrap: [Wrap; 2]) -> ([usize; 4], [f32; 2]) {
        let (x, y) = (uv.x * self.width as f32 - 0.5, (1.0 - uv.y) * self.height as f32 - 0.5);
        let (left, top) = (floor(x), floor(y));
        let columns = [left, left.saturating_add(1)].map(|x| wrap[0].apply(x, self.width));
        let rows = [top, top.saturating_add(1)].map(|y| wrap[1].apply(y, self.height) * self.width as usize);
        let places = [rows[0] + columns[0], rows[0] + columns[1], rows[1] + columns[0], rows[1] + columns[1]];
        // Limited for places beyond all integers and for those that are no number.
        (places, [x - left as f32, y - top as f32].map(|part| if part > 0.0 { part.min(1.0) } else { 0.0 }))
    }
}

/// The next integer below, at the ends of its range for what lies outside of it. Without SSE 4.1, [`f32::floor`] is a call.
#[inline(always)]
fn floor(x: f32) -> i64 {
    let towards_zero = x as i64;
    towards_zero.saturating_sub(i64::from(x < towards_zero as f32))
}

impl Wrap {
    /// The texel at place `i` of a row or column of `n`.
    #[inline(always)]
    fn apply(self, i: i64, n: u32) -> usize {
        // Most lookups are inside of the image, and a division is slow.
        if (i as u64) < u64::from(n) { i as usize } else { self.outside(i, i64::from(n)) as usize }
    }

    #[inline(never)]
    fn outside(self, i: i64, n: i64) -> i64 {
        match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Clamp => i.clamp(0, n - 1),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checker_alternates_on_both_sides_of_zero() {
        let checker = Texture::new(TexturePattern::Checker { a: Vec3::ONE, b: Vec3::ZERO });
        for x in -3..3 {
            for y in -3..3 {
                let expected = if (x + y) % 2 == 0 { Vec3::ONE } else { Vec3::ZERO };
                assert_eq!(checker.eval(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)), expected, "square {x}, {y}");
            }
        }
    }

    #[test]
    fn top_row_of_a_picture_is_at_v_1_and_wraps() {
        let image = ImageTexture::from_linear(2, 2, vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]);
        let nearest = |u, v, wrap| image.nearest(Vec2::new(u, v), [wrap; 2], Encoding::Auto).truncate();
        for (u, v, expected) in [(0.25, 0.75, Vec3::X), (0.75, 0.75, Vec3::Y), (0.25, 0.25, Vec3::Z)] {
            assert_eq!(nearest(u, v, Wrap::Repeat), expected);
            assert_eq!(nearest(u - 1.0, v + 2.0, Wrap::Repeat), expected);
            let between = image.bilinear(Vec2::new(u, v), [Wrap::Repeat; 2], Encoding::Auto).truncate();
            assert_eq!(between, expected);
        }
        assert_eq!(nearest(1.25, 0.75, Wrap::Mirror), Vec3::Y);
        assert_eq!(nearest(9.0, 9.0, Wrap::Clamp), Vec3::Y);
        let along_u = image.nearest(Vec2::new(1.25, 1.75), [Wrap::Mirror, Wrap::Repeat], Encoding::Auto);
        assert_eq!(along_u.truncate(), Vec3::Y);
    }

    #[test]
    fn channels_tints_and_vertices_change_what_a_texture_shows() {
        let image = Arc::new(ImageTexture {
            width: 1,
            height: 1,
            texels: Texels::U8 { channels: 4, data: vec![255, 51, 0, 102] },
        });
        let pattern =
            TexturePattern::Image { image, encoding: Encoding::Linear, wrap: [Wrap::Repeat; 2], smooth: true };
        let texture = Texture::new(pattern);
        let point = TexturePoint { uv: [Vec2::ZERO; 2], color: Vec4::new(0.5, 1.0, 1.0, 0.5) };
        assert_eq!(texture.eval(point), Vec3::new(1.0, 0.2, 0.0));
        let alpha = Texture { channel: Some(Channel::A), ..texture.clone() };
        assert_eq!(alpha.eval(point), Vec3::splat(0.4));
        assert_eq!(Texture { vertex_colors: true, ..alpha.clone() }.eval(point), Vec3::splat(0.2));
        let inverted = Texture { tint: Vec3::splat(0.5), invert: true, ..alpha.clone() };
        assert_eq!(inverted.eval(point), Vec3::ONE - 0.5 * alpha.eval(point));
        let tinted = Texture { tint: Vec3::new(0.5, 1.0, 2.0), vertex_colors: true, ..texture };
        assert_eq!(tinted.eval(point), Vec3::new(0.25, 0.2, 0.0));
        assert_eq!(tinted.mean(), Vec3::new(0.5, 0.2, 0.0));
    }

    #[test]
    fn slopes_are_differences_of_heights() {
        let grey = |i: u32| Vec3::splat(((i * 37) % 11) as f32 / 11.0);
        let image = Arc::new(ImageTexture::from_linear(5, 3, (0..15).map(grey).collect()));
        let pattern =
            TexturePattern::Image { image, encoding: Encoding::Linear, wrap: [Wrap::Repeat; 2], smooth: true };
        let (uv_matrix, uv_offset) = (Mat2::from_cols_array(&[2.0, 0.5, -1.0, 1.5]), Vec2::new(0.2, 0.7));
        let plain = Texture { uv_matrix, uv_offset, tint: Vec3::splat(0.7), ..Texture::new(pattern) };
        assert_eq!(plain.slope(&Vec2::ZERO.into()), None);
        let relief = Texture { relief: Some(0.02), invert: true, ..plain };
        for i in 0..200 {
            let uv = Vec2::new(0.013 * i as f32, 0.4 - 0.029 * i as f32);
            let step = 1e-3;
            let height = |uv: Vec2| 0.02 * relief.eval(uv).x;
            let [by_u, by_v] =
                [Vec2::X, Vec2::Y].map(|to| (height(uv + step * to) - height(uv - step * to)) / (2.0 * step));
            let found = relief.slope(&uv.into()).unwrap();
            // Between texels the difference quotient spans two slopes.
            let p = relief.pattern_coordinates(uv.to_array());
            let [x, y] = [p[0] * 5.0 - 0.5, (1.0 - p[1]) * 3.0 - 0.5].map(|x| (x - x.floor()).min(x.ceil() - x));
            if x.min(y) > 0.02 {
                assert!((found - Vec2::new(by_u, by_v)).length() < 2e-3, "{uv}: {found} for {by_u} {by_v}");
            }
        }
    }

    #[test]
    fn lookups_are_those_of_single_texels() {
        let bytes =
            |channels: usize| Texels::U8 { channels, data: (0..15 * channels).map(|i| (i * 37) as u8).collect() };
        let words = Texels::U16 { channels: 3, data: (0..45).map(|i| (i * 1499) as u16).collect() };
        let floats = Texels::F32((0..15).map(|i| Vec3::new(i as f32, 0.5, 2.0 * i as f32)).collect());
        for texels in [bytes(1), bytes(2), bytes(3), bytes(4), words, floats] {
            let image = Arc::new(ImageTexture { width: 5, height: 3, texels });
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|u| [u, Wrap::Mirror]) {
                for (encoding, smooth) in [(Encoding::Auto, true), (Encoding::Linear, true), (Encoding::Auto, false)] {
                    let pattern = TexturePattern::Image { image: image.clone(), encoding, wrap, smooth };
                    let texture = Texture::new(pattern);
                    for i in 0..60 {
                        let uv = Vec2::new(-2.0 + 0.07 * i as f32, 1.9 - 0.11 * i as f32);
                        let expected = reference(&image, uv, wrap, encoding, smooth);
                        assert_eq!(texture.texel(&uv.into()), expected, "{uv}, {wrap:?}, {encoding:?}, {smooth}");
                    }
                    for uv in [f32::MAX, f32::MIN, 1e15, f32::INFINITY].map(Vec2::splat) {
                        texture.touch(&uv.into());
                        let texel = texture.texel(&uv.into());
                        assert!(texel.is_finite() && texel.max_element() <= 28.0, "{uv}: {texel}");
                    }
                }
            }
        }
    }

    /// One texel at a time, with remainders wherever it is.
    fn reference(image: &ImageTexture, uv: Vec2, wrap: [Wrap; 2], encoding: Encoding, smooth: bool) -> Vec4 {
        let wrapped = |wrap: Wrap, i: i64, n: u32| match wrap {
            Wrap::Repeat => i.rem_euclid(n.into()),
            Wrap::Clamp => i.clamp(0, i64::from(n) - 1),
            Wrap::Mirror => {
                let n = i64::from(n);
                // Even periods run forwards, odd ones backwards.
                if i.div_euclid(n) % 2 == 0 { i.rem_euclid(n) } else { n - 1 - i.rem_euclid(n) }
            }
        };
        let at = |x: i64, y: i64| {
            let (x, y) = (wrapped(wrap[0], x, image.width), wrapped(wrap[1], y, image.height));
            image.texels.texel((y * i64::from(image.width) + x) as usize, encoding)
        };
        let (x, y) = (uv.x * image.width as f32, (1.0 - uv.y) * image.height as f32);
        if !smooth {
            return at(x.floor() as i64, y.floor() as i64);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        let row = |y| at(x, y).lerp(at(x + 1, y), fx);
        row(y).lerp(row(y + 1), fy)
    }
}
