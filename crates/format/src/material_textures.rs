//! Textures of materials in files: their names, and fallbacks for missing ones.

use crate::parts::MaterialPart;
use crate::value::{ColorValue, ScalarValue};
use firstlight_render::{Domain, Param, Value};
use glam::Vec3;

/// The material with a plain value for each missing texture; a warning has been given for those.
///
/// - `is_there`: whether a texture of this name exists.
pub fn without_lost_textures(part: &MaterialPart, is_there: impl Fn(&str) -> bool) -> MaterialPart {
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
pub fn emits(part: &MaterialPart) -> bool {
    let params = part.params();
    params.iter().any(|(property, param)| {
        matches!(param, Param::Color(color) if property.domain == Domain::Radiance
            && **color != ColorValue::Rgb(Vec3::ZERO))
    })
}

/// Names of the textures of a material.
pub fn texture_names(part: &MaterialPart) -> Vec<String> {
    let mut names = Vec::new();
    rename_textures(&mut part.clone(), |name| {
        names.push(name.to_owned());
        name.to_owned()
    });
    names
}

/// Renames the textures of a material.
pub fn rename_textures(part: &mut MaterialPart, mut to: impl FnMut(&str) -> String) {
    for (_, param) in part.params_mut() {
        match param {
            Param::Color(ColorValue::Texture(name)) | Param::Scalar(ScalarValue::Texture(name)) => *name = to(name),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::InFile;
    use firstlight_render::Material;

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
