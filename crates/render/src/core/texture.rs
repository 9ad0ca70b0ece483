//! Colours that vary over a surface.

use firstlight_simd::{Elementary, Real};
use glam::{Mat2, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Index into the textures of a snapshot.
pub type TextureId = u32;

/// What happens outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The pattern repeats.
    #[default]
    Repeat,
    /// The pattern repeats, mirrored every other time.
    Mirror,
    /// The texel at the edge continues.
    Clamp,
}

/// A pattern and how surface coordinates find their place in it.
///
/// Surface coordinates: `uv` of a mesh or quad (0..1), longitude and latitude of a sphere (0..1, v = 1 at +Y of
/// the object), metres along two axes of an infinite plane.
#[derive(Clone, Debug)]
pub struct Texture {
    /// What the texture shows.
    pub pattern: TexturePattern,
    /// Applied to surface coordinates first: rotation and scale.
    pub uv_matrix: Mat2,
    /// Added after `uv_matrix`.
    pub uv_offset: Vec2,
}

/// Colours over pattern coordinates.
#[derive(Clone, Debug)]
pub enum TexturePattern {
    /// Squares of side 1 in pattern coordinates; the one at (0, 0)..(1, 1) has colour `a`.
    Checker {
        /// Colour of squares whose whole coordinates have an even sum, linear Rec. 709.
        a: Vec3,
        /// Colour of the others, linear Rec. 709.
        b: Vec3,
    },
    /// The picture covers 0..1; its top row is at v = 1.
    Image {
        /// The picture.
        image: Arc<ImageTexture>,
        /// What the texture shows outside 0..1.
        wrap: Wrap,
        /// Bilinear when true, else the nearest texel.
        smooth: bool,
    },
}

/// A picture in linear Rec. 709, row by row from the top.
#[derive(Debug, PartialEq)]
pub struct ImageTexture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// One texel per pixel, `width · height` of them.
    pub texels: Vec<Vec3>,
}

impl Texture {
    /// The colour at a surface coordinate.
    #[inline]
    pub fn eval(&self, uv: Vec2) -> Vec3 {
        let p = Vec2::from(self.pattern_coordinates(uv.to_array()));
        match &self.pattern {
            TexturePattern::Checker { a, b } => {
                if is_even_square(p.to_array()) {
                    *a
                } else {
                    *b
                }
            }
            TexturePattern::Image { image, wrap, smooth: false } => image.nearest(p, *wrap),
            TexturePattern::Image { image, wrap, smooth: true } => image.bilinear(p, *wrap),
        }
    }

    /// Surface coordinates as the pattern counts them.
    #[inline(always)]
    pub(crate) fn pattern_coordinates<R: Real>(&self, [u, v]: [R; 2]) -> [R; 2] {
        let (m, offset) = (self.uv_matrix, self.uv_offset);
        [u * m.x_axis.x + v * m.y_axis.x + offset.x, u * m.x_axis.y + v * m.y_axis.y + offset.y]
    }

    /// The mean colour over the pattern, for the power of lights.
    pub fn mean(&self) -> Vec3 {
        match &self.pattern {
            TexturePattern::Checker { a, b } => 0.5 * (*a + *b),
            TexturePattern::Image { image, .. } => {
                let sum: glam::DVec3 = image.texels.iter().map(|t| t.as_dvec3()).sum();
                (sum / image.texels.len().max(1) as f64).as_vec3()
            }
        }
    }
}

/// Whether a point lies in a square of the first colour of a checker.
#[inline(always)]
pub(crate) fn is_even_square<R: Elementary>([x, y]: [R; 2]) -> R::Mask {
    // Parity of the sum without integers, which far planes would overflow.
    let half = (x.floor() + y.floor()) * 0.5;
    (half - half.truncated()).is_zero()
}

impl ImageTexture {
    fn texel(&self, x: i64, y: i64, wrap: Wrap) -> Vec3 {
        let x = wrap.apply(x, i64::from(self.width));
        let y = wrap.apply(y, i64::from(self.height));
        self.texels[(y * i64::from(self.width) + x) as usize]
    }

    fn nearest(&self, uv: Vec2, wrap: Wrap) -> Vec3 {
        let (x, y) = (uv.x * self.width as f32, (1.0 - uv.y) * self.height as f32);
        self.texel(x.floor() as i64, y.floor() as i64, wrap)
    }

    fn bilinear(&self, uv: Vec2, wrap: Wrap) -> Vec3 {
        let (x, y) = (uv.x * self.width as f32 - 0.5, (1.0 - uv.y) * self.height as f32 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        let row = |y| self.texel(x, y, wrap).lerp(self.texel(x + 1, y, wrap), fx);
        row(y).lerp(row(y + 1), fy)
    }
}

impl Wrap {
    fn apply(self, i: i64, n: i64) -> i64 {
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

    fn checker() -> Texture {
        let pattern = TexturePattern::Checker { a: Vec3::ONE, b: Vec3::ZERO };
        Texture { pattern, uv_matrix: Mat2::IDENTITY, uv_offset: Vec2::ZERO }
    }

    #[test]
    fn checker_alternates_on_both_sides_of_zero() {
        for x in -3..3 {
            for y in -3..3 {
                let expected = if (x + y) % 2 == 0 { Vec3::ONE } else { Vec3::ZERO };
                assert_eq!(checker().eval(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)), expected, "square {x}, {y}");
            }
        }
    }

    #[test]
    fn top_row_of_a_picture_is_at_v_1_and_wraps() {
        let texels = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
        let image = ImageTexture { width: 2, height: 2, texels };
        for (u, v, expected) in [(0.25, 0.75, Vec3::X), (0.75, 0.75, Vec3::Y), (0.25, 0.25, Vec3::Z)] {
            assert_eq!(image.nearest(Vec2::new(u, v), Wrap::Repeat), expected);
            assert_eq!(image.nearest(Vec2::new(u - 1.0, v + 2.0), Wrap::Repeat), expected);
            assert_eq!(image.bilinear(Vec2::new(u, v), Wrap::Repeat), expected);
        }
        assert_eq!(image.nearest(Vec2::new(1.25, 0.75), Wrap::Mirror), Vec3::Y);
        assert_eq!(image.nearest(Vec2::new(9.0, 9.0), Wrap::Clamp), Vec3::Y);
    }
}
