//! Reading of animated values from cameras, placements, lights and materials: the inverse of `set`.

use super::key::KeyValue;
use super::property::{CameraProperty, LightProperty, ObjectProperty, Quantity};
use crate::render::{Fresnel, Param};
use crate::scene::components::{ColorParam, Material, ScalarParam};
use crate::scene::light::LightKind;
use crate::scene::material_property::MaterialProperty;
use crate::scene::placement::{Linear, Placement};
use crate::scene::view::{Lens, Projection, View};
use glam::DVec3;

/// A number in single precision as the shortest decimal number that stands for it: 0.7 rather than 0.699999988.
fn short(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

fn short_color(color: glam::Vec3) -> DVec3 {
    DVec3::from_array(color.to_array().map(short))
}

impl Quantity {
    /// The value of a key: a single number where the quantity allows it and all three are equal.
    pub(super) fn key_value(self, value: DVec3) -> KeyValue {
        let is_even = value.x == value.y && value.y == value.z;
        match self {
            Self::Number => KeyValue::Number(value.x),
            Self::Factors | Self::Color if is_even => KeyValue::Number(value.x),
            _ => KeyValue::Three(value),
        }
    }
}

impl CameraProperty {
    /// The value for a camera with these components; `None` if it has none.
    pub(super) fn get(self, view: &View, projection: &Projection, lens: &Lens) -> Option<DVec3> {
        Some(match self {
            Self::Eye => view.eye,
            Self::LookAt => view.pivot(),
            Self::Forward => view.forward,
            Self::Up => view.up,
            Self::Vfov => DVec3::splat(projection.vfov_deg),
            Self::OrthographicHeight => DVec3::splat(projection.orthographic_height?),
            Self::LensRadius => DVec3::splat(lens.radius),
            Self::FStop => return None,
            Self::FocusDistance => DVec3::splat(lens.focus_distance),
            Self::BladeRotation => DVec3::splat(lens.blade_rotation_deg),
        })
    }
}

impl ObjectProperty {
    /// The value of a placement; `None` for a rotation and a scale that are given as a matrix.
    pub fn get(self, placement: &Placement) -> Option<DVec3> {
        match (self, placement.linear) {
            (Self::Translate, _) => Some(placement.translation),
            (Self::Rotate, Linear::Turned { rotation_deg, .. }) => Some(rotation_deg),
            (Self::Scale, Linear::Turned { scale, .. }) => Some(scale),
            (Self::Rotate | Self::Scale, Linear::Matrix(_)) => None,
        }
    }
}

impl LightProperty {
    /// The value of a light; `None` if lights of this kind do not have the property.
    pub fn get(self, light: &LightKind, placement: &Placement) -> Option<DVec3> {
        Some(match (self, light) {
            (Self::Position, LightKind::Point(_) | LightKind::Spot(_)) => placement.translation,
            (Self::Rotate, LightKind::Spot(_) | LightKind::Directional(_)) => ObjectProperty::Rotate.get(placement)?,
            (Self::Direction, LightKind::Spot(light)) => light.direction,
            (Self::Direction, LightKind::Directional(light)) => light.direction,
            (Self::Intensity, LightKind::Point(light)) => short_color(light.intensity),
            (Self::Intensity, LightKind::Spot(light)) => short_color(light.intensity),
            (Self::Irradiance, LightKind::Directional(light)) => short_color(light.irradiance),
            (Self::Radius, LightKind::Point(light)) => DVec3::splat(light.radius),
            (Self::InnerAngle, LightKind::Spot(light)) => DVec3::splat(light.inner_angle_deg),
            (Self::OuterAngle, LightKind::Spot(light)) => DVec3::splat(light.outer_angle_deg),
            _ => return None,
        })
    }
}

impl MaterialProperty {
    /// The value for a material, a number in all three components; `None` if it has none, or a texture in its place.
    pub fn get(self, material: &Material) -> Option<DVec3> {
        let (_, param) = material.params().into_iter().find(|(property, _)| property.name == self.name())?;
        Some(match param {
            Param::Color(ColorParam::Rgb(rgb)) | Param::Rgb(rgb) => short_color(*rgb),
            Param::Scalar(ScalarParam::Number(number)) | Param::Number(number) => DVec3::splat(short(*number)),
            Param::Cutoff(number) => DVec3::splat(short((*number)?)),
            Param::Flag(on) => DVec3::splat(f64::from(u8::from(*on))),
            Param::Fresnel(fresnel) => DVec3::splat(f64::from(u8::from(*fresnel == Fresnel::Schlick))),
            Param::Color(ColorParam::Texture(_)) | Param::Scalar(ScalarParam::Texture(_)) | Param::Part(_) => {
                return None;
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{self, MaterialKind, ValueType};
    use crate::scene::{DirectionalLight, PointLight, SpotLight};
    use glam::Vec3;

    #[test]
    fn what_is_set_is_read_again() {
        let value = DVec3::new(0.3, 0.4, 0.7);
        let lights = [
            LightKind::Point(PointLight { intensity: Vec3::ONE, radius: 0.0 }),
            LightKind::Spot(SpotLight {
                direction: DVec3::X,
                intensity: Vec3::ONE,
                inner_angle_deg: 10.0,
                outer_angle_deg: 20.0,
            }),
            LightKind::Directional(DirectionalLight { direction: DVec3::X, irradiance: Vec3::ONE }),
        ];
        for mut light in lights {
            let mut placement = Placement::default();
            for property in LightProperty::of(&light.clone()) {
                property.set(&mut light, &mut placement, value).unwrap();
                let wanted = if property.quantity() == Quantity::Number { DVec3::splat(0.3) } else { value };
                assert_eq!(property.get(&light, &placement), Some(wanted), "{property:?}");
            }
        }
        for &property in ObjectProperty::ALL {
            assert_eq!(property.get(&property.set(Placement::default(), value)), Some(value));
        }
    }

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
                assert_eq!(property.get(&material), Some(expected), "{kind:?} {property:?}");
                property.set(&mut material, DVec3::splat(-7.0)).unwrap();
                let limits = property.description().domain.limits();
                match property.get(&material) {
                    Some(value) => assert!(limits.contains(&(value.x as f32)), "{kind:?} {property:?} {value}"),
                    None => assert_eq!(property.description().value, ValueType::Cutoff),
                }
            }
        }
    }

    #[test]
    fn values_are_single_numbers_where_that_says_all() {
        assert_eq!(Quantity::Color.key_value(DVec3::splat(0.5)), KeyValue::Number(0.5));
        assert_eq!(Quantity::Color.key_value(DVec3::X), KeyValue::Three(DVec3::X));
        assert_eq!(Quantity::Position.key_value(DVec3::ONE), KeyValue::Three(DVec3::ONE));
    }
}
