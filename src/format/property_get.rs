//! Reading of animated values from cameras, placements and lights: the inverse of `set`.

use crate::format::key::KeyValue;
use crate::format::light::LightKind;
use crate::format::numbers::short_color;
use crate::format::placement::{Linear, Placement};
use crate::format::property::{CameraProperty, LightProperty, ObjectProperty, Quantity};
use crate::format::view::{Lens, Projection, View};
use glam::DVec3;

impl Quantity {
    /// The value of a key: a single number where the quantity allows it and all three are equal.
    pub(crate) fn key_value(self, value: DVec3) -> KeyValue {
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
    pub(crate) fn get(self, view: &View, projection: &Projection, lens: &Lens) -> Option<DVec3> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::light::{DirectionalLight, PointLight, SpotLight};
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
    fn values_are_single_numbers_where_that_says_all() {
        assert_eq!(Quantity::Color.key_value(DVec3::splat(0.5)), KeyValue::Number(0.5));
        assert_eq!(Quantity::Color.key_value(DVec3::X), KeyValue::Three(DVec3::X));
        assert_eq!(Quantity::Position.key_value(DVec3::ONE), KeyValue::Three(DVec3::ONE));
    }
}
