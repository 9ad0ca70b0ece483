//! Materials from the file of a mesh: fallbacks for missing textures, and whether they are unchanged.

use super::components::{ColorParam, InWorld, ScalarParam, SurfaceTexture};
use super::file::{InFile, MaterialPart};
use super::sources::TextureSource;
use super::value::{ColorValue, ScalarValue};
use crate::render::{Domain, MapParams, Param, Value};
use bevy_ecs::prelude::Entity;
use glam::Vec3;
use std::collections::HashMap;

/// The material with a plain value for each missing texture; a warning has been given for those.
///
/// - `is_there`: whether a texture of this name exists.
pub(super) fn without_lost_textures(part: &MaterialPart, is_there: impl Fn(&str) -> bool) -> MaterialPart {
    let mut part = part.clone();
    let main = part.kind().main_property();
    for (property, param) in part.params_mut() {
        match param {
            Param::Color(color) if matches!(&*color, ColorValue::Texture(name) if !is_there(name)) => {
                *color = match property.default {
                    Some(Value::Color(usual)) if Some(property.name) != main => usual.into(),
                    _ => ColorValue::grey(0.5),
                };
            }
            Param::Scalar(scalar) if matches!(&*scalar, ScalarValue::Texture(name) if !is_there(name)) => {
                *scalar = match property.default {
                    Some(Value::Number(usual)) => usual.into(),
                    _ => ScalarValue::Number(0.5),
                };
            }
            _ => {}
        }
    }
    part
}

/// Whether a material is a light.
pub(super) fn emits(part: &MaterialPart) -> bool {
    let params = part.params();
    params.iter().any(|(property, param)| {
        matches!(param, Param::Color(color) if property.domain == Domain::Radiance
            && **color != ColorValue::Rgb(Vec3::ZERO))
    })
}

/// Names of the textures of a material.
pub(super) fn texture_names(part: &MaterialPart) -> Vec<String> {
    let mut names = Vec::new();
    rename_textures(&mut part.clone(), |name| {
        names.push(name.to_owned());
        name.to_owned()
    });
    names
}

/// Renames the textures of a material.
pub(super) fn rename_textures(part: &mut MaterialPart, mut to: impl FnMut(&str) -> String) {
    for (_, param) in part.params_mut() {
        match param {
            Param::Color(ColorValue::Texture(name)) | Param::Scalar(ScalarValue::Texture(name)) => *name = to(name),
            _ => {}
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Material;

    #[test]
    fn lost_textures_leave_a_surface_that_looks_usual() {
        let texture = || ColorValue::Texture("lost".to_owned());
        let Material::Principled { base_color, .. } = Material::<InFile>::principled(texture()) else { unreachable!() };
        let mut part = Material::<InFile>::principled(base_color);
        if let Material::Principled { normal_map, opacity, emission, metallic, .. } = &mut part {
            (*normal_map, *emission) = (texture(), texture());
            *opacity = ScalarValue::Texture("lost".to_owned());
            *metallic = ScalarValue::Texture("there".to_owned());
        }
        let mut expected = Material::<InFile>::principled(ColorValue::Rgb(glam::Vec3::splat(0.5)));
        if let Material::Principled { metallic, .. } = &mut expected {
            *metallic = ScalarValue::Texture("there".to_owned());
        }
        assert_eq!(without_lost_textures(&part, |name| name == "there"), expected);
        let lost = MaterialPart::Diffuse { albedo: texture() };
        assert_eq!(without_lost_textures(&lost, |_| false), MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) });
    }
}
