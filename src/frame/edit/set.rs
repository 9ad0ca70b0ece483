//! Sets properties of materials, lights and shapes; those of the environment are in [`super::sky`], those of the animation in
//! [`super::keys`].

use super::property::Property;
use super::{keys, sky};
use crate::render::MaterialKind;
use crate::scene::{
    ColorParam, DirectionalLight, LightKind, Linear, Material, Placement, PointLight, Shape, SpotLight, SurfaceMaterial,
};
use bevy_ecs::prelude::{Entity, World};
use glam::{DVec3, Vec3};

/// Sets one property; the environment and the animation need no entity.
pub fn set(world: &mut World, entity: Option<Entity>, property: Property, value: DVec3) -> Result<(), String> {
    // Many properties are stored in single precision.
    if !value.as_vec3().is_finite() {
        return Err(format!("a number must be finite, and at most {:e}", f32::MAX));
    }
    if property.is_of_sky() {
        return sky::set(world, property, value);
    }
    if property.is_of_animation() {
        return keys::set_property(world, property, value.x);
    }
    let entity = entity.filter(|&entity| world.get_entity(entity).is_ok());
    let entity = entity.ok_or("the object no longer exists")?;
    let wrong = || format!("this object has no {property:?}");
    if let Some(placement) = world.get::<Placement>(entity).copied()
        && let Some(placement) = with_placement(placement, property, value)
    {
        set_if_different(world, entity, placement);
        return Ok(());
    }
    let light = LightKind::of(world, entity);
    let may_be_none = matches!(light, Some(LightKind::Point(_))) && value.x == 0.0;
    if property == Property::Radius && !(value.x > 0.0 || may_be_none) {
        return Err("a radius must be above 0".to_owned());
    }
    if let (Some(Shape::Sphere { .. }), Property::Radius) = (world.get::<Shape>(entity), property) {
        set_if_different(world, entity, Shape::Sphere { radius: value.x });
        return Ok(());
    }
    if let Some(light) = light {
        LightKind::put(Some(with_property(light, property, value).ok_or_else(wrong)?), world, entity);
        return Ok(());
    }
    let Property::Material(property) = property else { return Err(wrong()) };
    let mut material = world.get::<SurfaceMaterial>(entity).cloned().ok_or_else(wrong)?;
    property.set(&mut material.0, value).ok_or_else(wrong)?;
    set_if_different(world, entity, material);
    Ok(())
}

pub(super) fn set_if_different<T: bevy_ecs::component::Component + PartialEq>(
    world: &mut World,
    entity: Entity,
    value: T,
) {
    if world.get::<T>(entity) != Some(&value) {
        world.entity_mut(entity).insert(value);
    }
}

/// Returns the changed placement; `None` if the property does not belong to a placement. A placement given as a matrix
/// keeps its linear part.
fn with_placement(placement: Placement, property: Property, value: DVec3) -> Option<Placement> {
    let Placement { translation, linear } = placement;
    Some(match (property, linear) {
        (Property::Translation, linear) => Placement { translation: value, linear },
        (Property::Rotation, Linear::Turned { scale, .. }) => {
            Placement { translation, linear: Linear::Turned { rotation_deg: value, scale } }
        }
        (Property::Scale, Linear::Turned { rotation_deg, .. }) if value.min_element() > 0.0 => {
            Placement { translation, linear: Linear::Turned { rotation_deg, scale: value } }
        }
        (Property::Rotation | Property::Scale, _) => placement,
        _ => return None,
    })
}

/// Returns the changed light; `None` if it does not have the property, or its direction would be zero.
fn with_property(light: LightKind, property: Property, value: DVec3) -> Option<LightKind> {
    /// Smallest cone in degrees; a narrower one has no power in `f32`.
    const LEAST_CONE_DEG: f64 = 0.1;
    Some(match (light, property) {
        (LightKind::Point(_) | LightKind::Spot(_), Property::Intensity)
        | (LightKind::Directional(_), Property::Irradiance) => light.with_strength(value.max(DVec3::ZERO).as_vec3()),
        (LightKind::Point(light), Property::Radius) => LightKind::Point(PointLight { radius: value.x, ..light }),
        (LightKind::Spot(light), Property::Direction) if value != DVec3::ZERO => {
            LightKind::Spot(SpotLight { direction: value, ..light })
        }
        (LightKind::Directional(light), Property::Direction) if value != DVec3::ZERO => {
            LightKind::Directional(DirectionalLight { direction: value, ..light })
        }
        (LightKind::Spot(light), Property::InnerAngle) => {
            LightKind::Spot(SpotLight { inner_angle_deg: value.x.clamp(0.0, light.outer_angle_deg), ..light })
        }
        (LightKind::Spot(light), Property::OuterAngle) => {
            let outer_angle_deg = value.x.clamp(LEAST_CONE_DEG, 90.0);
            let inner_angle_deg = light.inner_angle_deg.min(outer_angle_deg);
            LightKind::Spot(SpotLight { inner_angle_deg, outer_angle_deg, ..light })
        }
        _ => return None,
    })
}

/// Changes the kind of a material, keeping the colour if both have one.
pub fn set_kind(world: &mut World, entity: Entity, kind: MaterialKind) -> Result<(), String> {
    let old = SurfaceMaterial::of(world, entity).ok_or("not a material")?;
    if old.kind() == kind {
        return Ok(());
    }
    let was_light = old.kind() == MaterialKind::Emissive;
    let color = old.color().cloned().unwrap_or(ColorParam::Rgb(Vec3::splat(0.7)));
    // Lights may be brighter than white, surfaces may not.
    let color = match color {
        ColorParam::Rgb(rgb) if was_light => ColorParam::Rgb(rgb / rgb.max_element().max(1.0)),
        ColorParam::Rgb(rgb) if kind == MaterialKind::Emissive => ColorParam::Rgb(rgb * 5.0),
        color => color,
    };
    let new = Material::of_kind(kind, color).ok_or("a blend is made of two materials")?;
    world.entity_mut(entity).insert(SurfaceMaterial(new));
    Ok(())
}
