//! Setting of animated values in cameras, placements and lights.

use crate::format::camera::CameraPart;
use crate::format::light::LightKind;
use crate::format::placement::{Linear, Placement};
use crate::format::property::{CameraProperty, LightProperty, ObjectProperty};
use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::{Component, Entity, World};
use glam::DVec3;

/// Replaces a component by another value; one that is equal is not touched.
pub(crate) fn put<T: Component<Mutability = Mutable> + PartialEq>(world: &mut World, entity: Entity, value: T) {
    if let Some(mut old) = world.get_mut::<T>(entity)
        && *old != value
    {
        *old = value;
    }
}

impl CameraProperty {
    /// Sets this field.
    pub fn set(self, camera: &mut CameraPart, value: DVec3) {
        match self {
            Self::Eye => camera.eye = value,
            Self::LookAt => camera.look_at = Some(value),
            Self::Forward => camera.forward = Some(value),
            Self::Up => camera.up = value,
            Self::Vfov => camera.vfov = value.x,
            Self::OrthographicHeight => camera.orthographic_height = Some(value.x),
            Self::LensRadius => camera.lens_radius = Some(value.x),
            Self::FStop => camera.f_stop = Some(value.x),
            Self::FocusDistance => camera.focus_distance = Some(value.x),
            Self::BladeRotation => camera.blade_rotation = value.x,
        }
    }
}

impl ObjectProperty {
    /// The placement with this value changed. If its linear part is a matrix, that part is kept.
    #[must_use]
    pub fn set(self, placement: Placement, value: DVec3) -> Placement {
        let Placement { translation, linear } = placement;
        match (self, linear) {
            (Self::Translate, linear) => Placement { translation: value, linear },
            (Self::Rotate, Linear::Turned { scale, .. }) => {
                Placement { translation, linear: Linear::Turned { rotation_deg: value, scale } }
            }
            (Self::Scale, Linear::Turned { rotation_deg, .. }) => {
                Placement { translation, linear: Linear::Turned { rotation_deg, scale: value } }
            }
            (Self::Rotate | Self::Scale, Linear::Matrix(_)) => placement,
        }
    }
}

impl LightProperty {
    /// Sets the value; `None` if lights of this kind do not have the property.
    pub fn set(self, light: &mut LightKind, placement: &mut Placement, value: DVec3) -> Option<()> {
        match (self, light) {
            (Self::Position, LightKind::Point(_) | LightKind::Spot(_)) => placement.translation = value,
            (Self::Rotate, LightKind::Spot(_) | LightKind::Directional(_)) => {
                *placement = ObjectProperty::Rotate.set(*placement, value);
            }
            (Self::Direction, LightKind::Spot(light)) => light.direction = value,
            (Self::Direction, LightKind::Directional(light)) => light.direction = value,
            (Self::Intensity, LightKind::Point(light)) => light.intensity = value.as_vec3(),
            (Self::Intensity, LightKind::Spot(light)) => light.intensity = value.as_vec3(),
            (Self::Irradiance, LightKind::Directional(light)) => light.irradiance = value.as_vec3(),
            (Self::Radius, LightKind::Point(light)) => light.radius = value.x,
            (Self::InnerAngle, LightKind::Spot(light)) => light.inner_angle_deg = value.x,
            (Self::OuterAngle, LightKind::Spot(light)) => light.outer_angle_deg = value.x,
            _ => return None,
        }
        Some(())
    }

    /// The properties of lights of this kind.
    pub fn of(light: &LightKind) -> impl Iterator<Item = Self> {
        let mut light = *light;
        let has = move |property: &Self| property.set(&mut light, &mut Placement::default(), DVec3::ONE).is_some();
        Self::ALL.iter().copied().filter(has)
    }
}
