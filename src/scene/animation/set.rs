//! Setting of animated values in cameras, placements, lights and materials.

use super::property::{CameraProperty, LightProperty, MaterialProperty, ObjectProperty};
use crate::render::{self, Param, Params};
use crate::scene::file::CameraPart;
use crate::scene::light::LightKind;
use crate::scene::placement::{Linear, Placement};
use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::{Component, Entity, World};
use glam::DVec3;

/// Replaces a component by another value; one that is equal is not touched.
pub(super) fn put<T: Component<Mutability = Mutable> + PartialEq>(world: &mut World, entity: Entity, value: T) {
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

impl MaterialProperty {
    /// Sets the value; `None` if materials of this kind do not have the property.
    pub fn set<P: Params>(self, material: &mut render::Material<P>, value: DVec3) -> Option<()> {
        let (number, color) = (value.x as f32, value.as_vec3());
        let (_, param) = material.params_mut().into_iter().find(|(name, _)| *name == self.name())?;
        match param {
            Param::Reflectance(old) | Param::Radiance(old) | Param::Factor(old) => *old = color.into(),
            Param::Share(old) => *old = number.into(),
            Param::ConstantShare(old)
            | Param::Number(old)
            | Param::Ior(old)
            | Param::Exponent(old)
            | Param::Dispersion(old)
            | Param::Thickness(old) => *old = number,
            Param::Cutoff(old) => *old = Some(number),
            Param::Absorption(old) => *old = color.into(),
            Param::Map(_) | Param::Flag(_) | Param::Part(_) => return None,
        }
        Some(())
    }

    /// The properties of materials of this kind.
    pub fn of<P: Params>(material: &render::Material<P>) -> impl Iterator<Item = Self> {
        let names: Vec<&str> = material.params().into_iter().map(|(name, _)| name).collect();
        Self::ALL.iter().copied().filter(move |property| names.contains(&property.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::property::Quantity;
    use super::*;
    use crate::render::{InSnapshot, MaterialKind};
    use glam::Vec3;

    #[test]
    fn every_number_and_colour_of_every_material_can_change_in_time() {
        let kinds = MaterialKind::PLAIN
            .into_iter()
            .filter_map(|kind| render::Material::<InSnapshot>::of_kind(kind, Vec3::splat(0.5).into()));
        let blend = render::Material::Blend { weight: 0.5.into(), a: 0, b: 1 };
        let mut met = Vec::new();
        for mut material in kinds.chain([blend]) {
            let names: Vec<(&str, bool)> = (material.params().into_iter())
                .map(|(name, param)| (name, !matches!(param, Param::Map(_) | Param::Flag(_) | Param::Part(_))))
                .collect();
            for (name, is_quantity) in names {
                let property = MaterialProperty::ALL.iter().find(|property| property.name() == name);
                assert_eq!(property.is_some(), is_quantity, "{name}");
                let Some(property) = property else { continue };
                let is_color = material.params().into_iter().any(|(other, param)| {
                    other == name
                        && matches!(
                            param,
                            Param::Reflectance(_) | Param::Radiance(_) | Param::Factor(_) | Param::Absorption(_)
                        )
                });
                assert_eq!(property.quantity() == Quantity::Color, is_color, "{name}");
                assert!(property.set(&mut material, DVec3::splat(0.25)).is_some(), "{name}");
                met.push(*property);
            }
        }
        assert!(MaterialProperty::ALL.iter().all(|property| met.contains(property)));
    }
}
