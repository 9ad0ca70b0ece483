//! Reading of the properties of a material in the world.

use crate::format::material_property::MaterialProperty;
use crate::format::numbers::{short, short_color};
use crate::render::{Fresnel, Param};
use crate::scene::world::components::{ColorParam, Material, ScalarParam};
use glam::DVec3;

/// The value of a property of a material, a number in all three components; `None` if it has none, or a texture in its
/// place.
pub fn material_value(property: MaterialProperty, material: &Material) -> Option<DVec3> {
    let (_, param) = material.params().into_iter().find(|(known, _)| known.name == property.name())?;
    Some(match param {
        Param::Color(ColorParam::Rgb(rgb)) | Param::Rgb(rgb) => short_color(*rgb),
        Param::Scalar(ScalarParam::Number(number)) | Param::Number(number) => DVec3::splat(short(*number)),
        Param::Cutoff(number) => DVec3::splat(short((*number)?)),
        Param::Flag(on) => DVec3::splat(f64::from(u8::from(*on))),
        Param::Fresnel(fresnel) => DVec3::splat(f64::from(u8::from(*fresnel == Fresnel::Schlick))),
        Param::Color(ColorParam::Texture(_)) | Param::Scalar(ScalarParam::Texture(_)) | Param::Part(_) => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::quantity::Quantity;
    use crate::render::{self, MaterialKind, ValueType};
    use glam::Vec3;

    #[test]
    fn what_is_set_is_read_again_within_the_limits() {
        for kind in MaterialKind::plain() {
            let mut material: Material = render::Material::of_kind(kind, ColorParam::Rgb(Vec3::ONE)).unwrap();
            for property in MaterialProperty::of(&material).collect::<Vec<_>>() {
                let value = DVec3::new(0.3, 0.4, 0.7);
                property.set(&mut material, value).unwrap();
                let expected = match (property.description().value, property.quantity()) {
                    (ValueType::Flag | ValueType::Fresnel, _) => DVec3::ONE,
                    (_, Quantity::Color) => value,
                    _ => DVec3::splat(0.3),
                };
                assert_eq!(material_value(property, &material), Some(expected), "{kind:?} {property:?}");
                property.set(&mut material, DVec3::splat(-7.0)).unwrap();
                let limits = property.description().domain.limits();
                match material_value(property, &material) {
                    Some(value) => assert!(limits.contains(&(value.x as f32)), "{kind:?} {property:?} {value}"),
                    None => assert_eq!(property.description().value, ValueType::Cutoff),
                }
            }
        }
    }
}
