//! Textures of materials in files: their names, and fallbacks for missing ones.

use crate::parts::MaterialPart;
use crate::value::{ColorValue, ScalarValue};
use firstlight_render::{Domain, Param, Value};
use glam::Vec3;

/// The material with a plain value for each missing texture; a warning has been given for those. The colour of the
/// surface, or what a black one emits, is the factor of the texture, where it has one.
///
/// - `lost`: the factor of a texture of this name that is missing, white for none; `None` if it is there.
pub fn without_lost_textures(part: &MaterialPart, lost: impl Fn(&str) -> Option<Vec3>) -> MaterialPart {
    let mut part = part.clone();
    let main = part.kind().main_property();
    let is_black = part.params().iter().any(|(property, param)| {
        Some(property.name) == main && matches!(param, Param::Color(color) if **color == ColorValue::Rgb(Vec3::ZERO))
    });
    for (property, param) in part.params_mut() {
        match param {
            Param::Color(color) => {
                let ColorValue::Texture(name) = &*color else { continue };
                let Some(factor) = lost(name) else { continue };
                let is_seen = Some(property.name) == main || is_black && property.domain == Domain::Radiance;
                *color = match property.default {
                    Some(Value::Color(usual)) if !is_seen => usual.into(),
                    _ if factor == Vec3::ONE => ColorValue::grey(0.5),
                    _ => ColorValue::Rgb(factor),
                };
            }
            Param::Scalar(scalar) => {
                if matches!(&*scalar, ScalarValue::Texture(name) if lost(name).is_some()) {
                    *scalar = match property.default {
                        Some(Value::Number(usual)) => usual.into(),
                        _ => ScalarValue::Number(0.5),
                    };
                }
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
        let factor = |factor: Vec3| move |name: &str| (name == "lost").then_some(factor);
        assert_eq!(without_lost_textures(&part, factor(Vec3::ONE)), expected);
        let lost = MaterialPart::Diffuse { albedo: texture() };
        let shown = |color: Vec3| MaterialPart::Diffuse { albedo: ColorValue::Rgb(color) };
        assert_eq!(without_lost_textures(&lost, factor(Vec3::ONE)), shown(Vec3::splat(0.5)));
        let orange = Vec3::new(1.0, 0.5, 0.1);
        assert_eq!(without_lost_textures(&lost, factor(orange)), shown(orange));
        // A surface that only emits its colour would be black.
        let mut unlit = Material::<InFile>::principled(ColorValue::Rgb(Vec3::ZERO));
        let mut expected = unlit.clone();
        if let Material::Principled { emission, .. } = &mut unlit {
            *emission = texture();
        }
        if let Material::Principled { emission, .. } = &mut expected {
            *emission = ColorValue::Rgb(orange);
        }
        assert_eq!(without_lost_textures(&unlit, factor(orange)), expected);
    }
}
