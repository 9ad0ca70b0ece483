//! Colours that vary over a surface.

use glam::{Mat2, Vec2, Vec3};
use std::sync::Arc;

/// Index into the textures of a snapshot.
pub type TextureId = u32;

/// What happens outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// A pattern and how surface coordinates find their place in it.
///
/// Surface coordinates: `uv` of a mesh or quad (0..1), longitude and latitude of a sphere (0..1, v = 1 at +Y of
/// the object), metres along two axes of an infinite plane.
#[derive(Clone, Debug)]
pub struct Texture {
    pub pattern: TexturePattern,
    /// Applied to surface coordinates first: rotation and scale.
    pub uv_matrix: Mat2,
    /// Added after `uv_matrix`.
    pub uv_offset: Vec2,
}

#[derive(Clone, Debug)]
pub enum TexturePattern {
    /// Squares of side 1 in pattern coordinates; the one at (0, 0)..(1, 1) has colour `a`.
    Checker { a: Vec3, b: Vec3 },
    /// The picture covers 0..1; its top row is at v = 1.
    Image {
        image: Arc<ImageTexture>,
        wrap: Wrap,
        /// Bilinear when true, else the nearest texel.
        smooth: bool,
    },
}

/// A picture in linear Rec. 709, row by row from the top.
#[derive(Debug, PartialEq)]
pub struct ImageTexture {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<Vec3>,
}
