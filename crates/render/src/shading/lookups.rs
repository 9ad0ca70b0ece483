//! Texture lookups of one material at one point.

use crate::core::material::{ColorInput, ScalarInput};
use crate::core::texture::{TextureId, TexturePoint};
use crate::prepare::prepared::Prepared;
use glam::{Vec3, Vec4};
use std::cell::Cell;

/// Evaluates inputs at one point. Consecutive inputs that read different channels of the same texels, such as metalness
/// and roughness in glTF, read them once.
pub(crate) struct Lookups<'a> {
    scene: &'a Prepared,
    point: TexturePoint,
    last: Cell<Option<(TextureId, Vec4)>>,
}

impl<'a> Lookups<'a> {
    pub fn new(scene: &'a Prepared, point: TexturePoint) -> Self {
        Self { scene, point, last: Cell::new(None) }
    }

    /// See [`ColorInput::eval`].
    #[inline]
    pub fn color(&self, input: ColorInput) -> Vec3 {
        match input {
            ColorInput::Constant(color) => color,
            ColorInput::Texture(id) => self.texture(id),
        }
    }

    /// See [`ScalarInput::eval`].
    #[inline]
    pub fn scalar(&self, input: ScalarInput) -> f32 {
        match input {
            ScalarInput::Constant(value) => value,
            ScalarInput::Texture(id) => self.texture(id).x,
        }
    }

    fn texture(&self, id: TextureId) -> Vec3 {
        let textures = &self.scene.shading.textures;
        let texture = &textures[id as usize];
        let texel = match self.last.get() {
            Some((last, texel)) if textures[last as usize].has_texels_of(texture) => texel,
            _ => texture.texel(&self.point),
        };
        self.last.set(Some((id, texel)));
        texture.shown(texel)
    }
}
