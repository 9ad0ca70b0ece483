//! Sets properties of materials, lights and shapes; those of the environment are in [`crate::frame::edit::sky`], those of the animation in
//! [`crate::frame::edit::keys`].

use crate::format::bounds::check_size;
use crate::frame::edit::place::{about_middle, stay_standing};
use crate::frame::edit::property::Property;
use crate::frame::edit::{keys, sky};
use crate::render::MaterialKind;
use crate::scene::animation::{ObjectProperty, Quantity};
use crate::scene::{ColorParam, LightKind, Material, Placement, PointLight, Shape, SpotLight, SurfaceMaterial};
use crate::scene::{light_of, put_light};
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
    match property {
        Property::Object(property) => {
            let old = *world.get::<Placement>(entity).ok_or_else(wrong)?;
            if property == ObjectProperty::Scale && !(value.min_element() > 0.0) {
                return Err("scale factors must be above 0".to_owned());
            }
            if property.get(&old) == Some(value) {
                return Ok(());
            }
            // As its handles do.
            let old = if property == ObjectProperty::Translate { old } else { about_middle(world, entity, &old) };
            let mut placed = [(entity, property.set(old, value))];
            if property == ObjectProperty::Scale {
                stay_standing(world, &[(entity, old)], &mut placed);
            }
            let [(_, placement)] = placed;
            placement.check()?;
            set_if_different(world, entity, placement);
        }
        Property::SphereRadius => {
            if !matches!(world.get::<Shape>(entity), Some(Shape::Sphere { .. })) {
                return Err(wrong());
            }
            check_size("radius", value.x).map_err(|error| error.to_string())?;
            set_if_different(world, entity, Shape::Sphere { radius: value.x });
        }
        Property::Light(property) => {
            let mut light = light_of(world, entity).ok_or_else(wrong)?;
            let mut placement = world.get::<Placement>(entity).copied().unwrap_or_default();
            if property.info().quantity == Quantity::Direction && value == DVec3::ZERO {
                return Err("a direction must have a length".to_owned());
            }
            let [least, most] = property.info().range;
            let value = value.clamp(DVec3::splat(least), DVec3::splat(most));
            property.set(&mut light, &mut placement, value).ok_or_else(wrong)?;
            put_light(world, entity, limited(light));
            set_if_different(world, entity, placement);
        }
        Property::Material(property) => {
            let mut material = world.get::<SurfaceMaterial>(entity).cloned().ok_or_else(wrong)?;
            property.set(&mut material.0, value).ok_or_else(wrong)?;
            set_if_different(world, entity, material);
        }
        _ => unreachable!("properties of the environment and the animation belong to no entity"),
    }
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

/// The light that a number makes: the inner angle of a cone is at most the outer one, and a radius too small for a
/// sphere makes a point.
fn limited(light: LightKind) -> LightKind {
    match light {
        LightKind::Spot(light) => {
            let inner_angle_deg = light.inner_angle_deg.min(light.outer_angle_deg);
            LightKind::Spot(SpotLight { inner_angle_deg, ..light })
        }
        LightKind::Point(light) if light.radius < 1e-9 => LightKind::Point(PointLight { radius: 0.0, ..light }),
        light => light,
    }
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
