//! Sets a property of what has a name, as scripts do: by the names of scene files, and only to values that these may
//! have. The window limits values instead.

use crate::format::camera::camera_part;
use crate::format::material_property::check_value;
use crate::format::property::PropertyInfo;
use crate::format::quantity::Quantity;
use crate::frame::edit::property::Property;
use crate::frame::edit::set::set;
use crate::scene::animation::{CameraProperty, LightProperty, ObjectProperty};
use crate::scene::{BadValue, Lens, MaterialProperty, Projection, Shape, SurfaceMaterial, View, light_of, suggestion};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;
use thiserror::Error;

/// Why a property cannot be set.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PropertyError {
    /// Nothing has this name.
    #[error("nothing is named `{name}`{hint}")]
    NoSuchName {
        /// The name.
        name: String,
        /// The most similar name, as a question in brackets.
        hint: String,
    },
    /// What has this name has no such property.
    #[error("`{name}` has no property `{property}`{hint}")]
    NoSuchProperty {
        /// The name.
        name: String,
        /// The property.
        property: String,
        /// The most similar property, as a question in brackets.
        hint: String,
    },
    /// The value is out of range.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// Another reason, as a phrase.
    #[error("{0}")]
    Refused(String),
}

/// Sets a property of the material, the object, the light or the camera of a name; a number is in all three components.
///
/// # Errors
/// If nothing has this name, it has no such property, or the value is out of range.
pub fn set_by_name(world: &mut World, name: &str, property: &str, value: DVec3) -> Result<(), PropertyError> {
    let all: Vec<(Entity, String)> =
        world.query::<(Entity, &Name)>().iter(world).map(|(entity, name)| (entity, name.to_string())).collect();
    let named: Vec<Entity> = all.iter().filter(|(_, known)| known == name).map(|(entity, _)| *entity).collect();
    if named.is_empty() {
        let hint = suggestion(name, all.iter().map(|(_, name)| name.as_str()));
        return Err(PropertyError::NoSuchName { name: name.to_owned(), hint });
    }
    let mut known = Vec::new();
    for entity in named {
        // A material and an object may have the same name, and few properties.
        for candidate in properties_of(world, entity) {
            if candidate.name() == property {
                return set_one(world, entity, candidate, value);
            }
            known.push(candidate.name());
        }
    }
    let hint = suggestion(property, known);
    Err(PropertyError::NoSuchProperty { name: name.to_owned(), property: property.to_owned(), hint })
}

/// A property of an entity.
#[derive(Clone, Copy)]
enum Named {
    Material(MaterialProperty),
    Radius,
    Object(ObjectProperty),
    Light(LightProperty),
    Camera(CameraProperty),
}

impl Named {
    fn name(self) -> &'static str {
        match self {
            Self::Material(property) => property.name(),
            Self::Radius => "radius",
            Self::Object(property) => property.name(),
            Self::Light(property) => property.name(),
            Self::Camera(property) => property.name(),
        }
    }
}

fn properties_of(world: &World, entity: Entity) -> Vec<Named> {
    let mut found = Vec::new();
    if let Some(material) = SurfaceMaterial::of(world, entity) {
        found.extend(MaterialProperty::of(material).map(Named::Material));
    }
    if let Some(shape) = world.get::<Shape>(entity) {
        found.extend(matches!(shape, Shape::Sphere { .. }).then_some(Named::Radius));
        found.extend(ObjectProperty::ALL.iter().copied().map(Named::Object));
    }
    if let Some(light) = light_of(world, entity) {
        found.extend(LightProperty::of(&light).map(Named::Light));
    }
    if world.get::<View>(entity).is_some() {
        found.extend(CameraProperty::ALL.iter().copied().map(Named::Camera));
    }
    found
}

fn set_one(world: &mut World, entity: Entity, property: Named, value: DVec3) -> Result<(), PropertyError> {
    let property = match property {
        Named::Material(property) => {
            let channels = value.as_vec3().to_array();
            let n = if property.quantity() == Quantity::Color { 3 } else { 1 };
            check_value(property.description(), &channels[..n])?;
            Property::Material(property)
        }
        Named::Radius => Property::SphereRadius,
        Named::Object(property) => {
            check_range(property.info(), value)?;
            Property::Object(property)
        }
        Named::Light(property) => {
            check_range(property.info(), value)?;
            Property::Light(property)
        }
        Named::Camera(property) => return set_camera(world, entity, property, value),
    };
    set(world, Some(entity), property, value).map_err(PropertyError::Refused)
}

fn check_range(info: &PropertyInfo, value: DVec3) -> Result<(), PropertyError> {
    let [least, most] = info.range;
    let numbers = if info.quantity == Quantity::Number { &value.to_array()[..1] } else { &value.to_array()[..] };
    if numbers.iter().all(|number| number.is_finite() && (least..=most).contains(number)) {
        return Ok(());
    }
    let value = match numbers {
        [number] => number.to_string(),
        _ => format!("({}, {}, {})", value.x, value.y, value.z),
    };
    let allowed = match [least, most].map(f64::is_finite) {
        [true, true] => format!("lie between {least} and {most}"),
        [true, false] => format!("be finite and at least {least}"),
        _ => "be finite".to_owned(),
    };
    Err(BadValue::OutOfRange { field: info.name, value, allowed }.into())
}

/// Sets a field of the camera, checked as in a scene file. A camera that moves keeps its direction, or, if it was
/// given by the point that it looks at, that point.
fn set_camera(world: &mut World, entity: Entity, property: CameraProperty, value: DVec3) -> Result<(), PropertyError> {
    let (view, projection, lens) =
        (world.get::<View>(entity), world.get::<Projection>(entity), world.get::<Lens>(entity));
    let (Some(view), Some(projection), Some(lens)) = (view, projection, lens) else {
        return Err(PropertyError::Refused("the camera is not complete".to_owned()));
    };
    let mut part = camera_part(view, projection, lens, None);
    match property {
        CameraProperty::LookAt => (part.forward, part.pivot_distance) = (None, None),
        CameraProperty::Forward => (part.look_at, part.pivot_distance) = (None, Some(view.pivot_distance)),
        CameraProperty::FStop => part.lens_radius = None,
        CameraProperty::LensRadius => part.depth_of_field = None,
        _ => {}
    }
    property.set(&mut part, value);
    let components = part.components().map_err(|mut problems| problems.remove(0))?;
    world.entity_mut(entity).insert(components);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, SceneSource, load};

    fn world() -> World {
        let scene = load(&SceneSource::parse("cornell-balls").unwrap(), &LoadOptions::default()).unwrap();
        let mut world = World::new();
        scene.spawn(&mut world);
        world
    }

    fn message(name: &str, property: &str, value: f64) -> String {
        set_by_name(&mut world(), name, property, DVec3::splat(value)).unwrap_err().to_string()
    }

    #[test]
    fn values_are_those_of_scene_files() {
        assert_eq!(set_by_name(&mut world(), "glass", "ior", DVec3::splat(1.4)), Ok(()));
        assert_eq!(message("glas", "ior", 1.4), "nothing is named `glas` (did you mean `glass`?)");
        assert!(message("glass", "iro", 1.4).starts_with("`glass` has no property `iro` (did you mean `ior`?)"));
        assert_eq!(message("glass", "ior", -1.0), "`ior` is -1, but must be finite and positive: 1.5 is glass");
        let wrong = message("camera", "vfov", 400.0);
        assert!(wrong.starts_with("`vfov` is 400, but must"), "{wrong}");
    }

    #[test]
    fn a_camera_looks_where_it_is_told() {
        let mut world = world();
        let aim = DVec3::new(0.25, 0.5, -0.125);
        set_by_name(&mut world, "camera", "look_at", aim).unwrap();
        let view = world.query::<&View>().single(&world).unwrap();
        assert!((view.pivot() - aim).length() < 1e-12, "{view:?}");
    }
}
