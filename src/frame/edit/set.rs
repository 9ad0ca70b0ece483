//! The numbers and colours of materials, lights and shapes, one at a time; those of the sky are in [`super::sky`].

use super::property::{MaterialKind, Property};
use super::sky;
use crate::render::Fresnel;
use crate::scene::{ColorParam, Linear, Material, Placement, PointLight, ScalarParam, Shape};
use bevy_ecs::prelude::{Entity, World};
use glam::{DVec3, Vec3};

/// The colour of a material, if it has one.
pub fn paint_of(material: &Material) -> Option<&ColorParam> {
    match material {
        Material::Diffuse { albedo: paint }
        | Material::Mirror { reflectance: paint }
        | Material::Metal { reflectance: paint, .. }
        | Material::Phong { diffuse: paint, .. }
        | Material::Emissive { radiance: paint } => Some(paint),
        Material::Glass { .. } | Material::Blend { .. } => None,
    }
}

pub(super) fn paint_mut(material: &mut Material) -> Option<&mut ColorParam> {
    match material {
        Material::Diffuse { albedo: paint }
        | Material::Mirror { reflectance: paint }
        | Material::Metal { reflectance: paint, .. }
        | Material::Phong { diffuse: paint, .. }
        | Material::Emissive { radiance: paint } => Some(paint),
        Material::Glass { .. } | Material::Blend { .. } => None,
    }
}

/// Sets one property; the sky needs no entity.
pub fn set(world: &mut World, entity: Option<Entity>, property: Property, value: DVec3) -> Result<(), String> {
    // Many of them end in single precision.
    if !value.as_vec3().is_finite() {
        return Err(format!("a number must be finite, and at most {:e}", f32::MAX));
    }
    if property.is_of_sky() {
        return sky::set(world, property, value);
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
    if property == Property::Radius && !(value.x > 0.0) {
        return Err("a radius must be above 0".to_owned());
    }
    if let (Some(Shape::Sphere { .. }), Property::Radius) = (world.get::<Shape>(entity), property) {
        set_if_different(world, entity, Shape::Sphere { radius: value.x });
        return Ok(());
    }
    if let Some(&light) = world.get::<PointLight>(entity) {
        let light = match property {
            Property::Radius => PointLight { radius: value.x, ..light },
            Property::Intensity => PointLight { intensity: value.max(DVec3::ZERO).as_vec3(), ..light },
            _ => return Err(wrong()),
        };
        set_if_different(world, entity, light);
        return Ok(());
    }
    let mut material = world.get::<Material>(entity).cloned().ok_or_else(wrong)?;
    set_in_material(&mut material, property, value).ok_or_else(wrong)?;
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

/// `None` where the property is not of a placement. What is given as a matrix keeps its linear part.
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

fn set_in_material(material: &mut Material, property: Property, value: DVec3) -> Option<()> {
    let number = value.x as f32;
    let share = number.clamp(0.0, 1.0);
    match (property, material) {
        (Property::Color, Material::Emissive { radiance }) => {
            *radiance = ColorParam::Rgb(value.max(DVec3::ZERO).as_vec3());
        }
        (Property::Color, material) => {
            *paint_mut(material)? = ColorParam::Rgb(value.clamp(DVec3::ZERO, DVec3::ONE).as_vec3());
        }
        (Property::Alpha, Material::Metal { alpha, .. }) => *alpha = ScalarParam::Number(number.clamp(1e-3, 1.0)),
        (Property::Schlick, Material::Metal { fresnel, .. }) => {
            *fresnel = if number == 0.0 { Fresnel::Constant } else { Fresnel::Schlick };
        }
        (Property::Ior, Material::Glass { ior, .. } | Material::Phong { ior, .. }) => *ior = number.clamp(0.1, 10.0),
        (Property::Absorption, Material::Glass { absorption, .. } | Material::Phong { absorption, .. }) => {
            *absorption = value.max(DVec3::ZERO).as_vec3();
        }
        (Property::Ambient, Material::Phong { ambient, .. }) => *ambient = share,
        (Property::Specular, Material::Phong { specular, .. }) => *specular = ScalarParam::Number(share),
        (Property::Shininess, Material::Phong { shininess, .. }) => *shininess = number.clamp(1.0, 1e5),
        (Property::Transparency, Material::Phong { transparency, .. }) => *transparency = share,
        (Property::Weight, Material::Blend { weight, .. }) => *weight = ScalarParam::Number(share),
        _ => return None,
    }
    Some(())
}

/// Keeps the colour, where both have one.
pub fn set_kind(world: &mut World, entity: Entity, kind: MaterialKind) -> Result<(), String> {
    let old = world.get::<Material>(entity).ok_or("not a material")?;
    if MaterialKind::of(old) == Some(kind) {
        return Ok(());
    }
    let was_light = matches!(old, Material::Emissive { .. });
    let paint = paint_of(old).cloned().unwrap_or(ColorParam::Rgb(Vec3::splat(0.7)));
    // A light is brighter than white, and a surface is not.
    let color = match paint {
        ColorParam::Rgb(rgb) if was_light => ColorParam::Rgb(rgb / rgb.max_element().max(1.0)),
        ColorParam::Rgb(rgb) if kind == MaterialKind::Emissive => ColorParam::Rgb(rgb * 5.0),
        paint => paint,
    };
    world.entity_mut(entity).insert(match kind {
        MaterialKind::Diffuse => Material::Diffuse { albedo: color },
        MaterialKind::Mirror => Material::Mirror { reflectance: color },
        MaterialKind::Metal => Material::Metal {
            alpha: ScalarParam::Number(0.04),
            reflectance: color,
            fresnel: Fresnel::Schlick,
            compensate: true,
        },
        MaterialKind::Glass => Material::Glass { ior: 1.5, absorption: Vec3::ZERO },
        MaterialKind::Phong => Material::Phong {
            diffuse: color,
            ambient: 1.0,
            specular: ScalarParam::Number(0.2),
            shininess: 50.0,
            transparency: 0.0,
            ior: 1.5,
            absorption: Vec3::ZERO,
        },
        MaterialKind::Emissive => Material::Emissive { radiance: color },
    });
    Ok(())
}
