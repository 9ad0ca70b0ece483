//! Materials of the world as in the file of a mesh, to tell whether they are unchanged.

use crate::format::parts::InFile;
use crate::format::sources::TextureSource;
use crate::format::value::{ColorValue, ScalarValue};
use crate::render::MapParams;
use crate::scene::world::components::{ColorParam, InWorld, ScalarParam, SurfaceTexture};
use bevy_ecs::prelude::Entity;
use std::collections::HashMap;

/// Converts a material of the world to texture names, for textures that are unchanged since the mesh file.
pub(super) struct ByTextureName<'a>(pub &'a HashMap<&'a str, &'a TextureSource>);

impl ByTextureName<'_> {
    /// The empty name, which no texture has, stands for a changed one.
    fn name(&self, texture: &SurfaceTexture) -> String {
        let is_same = self.0.get(texture.name.as_str()).is_some_and(|source| **source == texture.part);
        if is_same { texture.name.clone() } else { String::new() }
    }
}

impl MapParams<InWorld, InFile> for ByTextureName<'_> {
    fn color(&mut self, color: &ColorParam) -> ColorValue {
        match color {
            ColorParam::Rgb(rgb) => ColorValue::Rgb(*rgb),
            ColorParam::Texture(texture) => ColorValue::Texture(self.name(texture)),
        }
    }

    fn scalar(&mut self, scalar: &ScalarParam) -> ScalarValue {
        match scalar {
            ScalarParam::Number(value) => ScalarValue::Number(*value),
            ScalarParam::Texture(texture) => ScalarValue::Texture(self.name(texture)),
        }
    }

    /// Mesh files have no blends.
    fn material(&mut self, _: &Entity) -> String {
        String::new()
    }
}
