//! Environment: its colours, their common strength, and the rotation of its image.

use crate::format::property::SkyProperty;
use crate::format::sources::EnvironmentLayout;
use crate::format::units::radians;
use crate::frame::edit::property::Property;
use crate::import::sky::clear_sky;
use crate::render::{Environment, ImageTexture};
use crate::scene::{EnvironmentSource, GRADIENT, Rgb, SceneEnvironment, environment_part, sky_light};
use bevy_ecs::prelude::World;
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// The brightest channel of the environment's colours, or the factor of its image.
pub fn strength(light: &Environment) -> f32 {
    match light {
        Environment::Black => 0.0,
        Environment::Constant(radiance) => radiance.max_element(),
        Environment::Gradient { zenith, horizon, ground } => zenith.max(*horizon).max(*ground).max_element(),
        Environment::Image { scale, .. } => scale.max_element(),
    }
}

/// Sets one property of the environment.
pub fn set(world: &mut World, property: Property, value: DVec3) -> Result<(), String> {
    let sky = world.get_resource::<SceneEnvironment>().cloned().unwrap_or_default();
    if is_clear(&sky) && property == Property::Ground || matches!(property, Property::ClearSky(_)) {
        return set_clear(world, sky, property, value);
    }
    let light = match property {
        Property::SkyStrength => with_strength(&sky.light, (value.x as f32).max(0.0)),
        Property::SkyRotation => turned(&sky.light, radians(value.x)),
        _ => with_color(&sky.light, property, value.max(DVec3::ZERO).as_vec3()),
    };
    let light = light.ok_or_else(|| format!("this environment has no {property:?}"))?;
    let angle_deg = (property == Property::SkyRotation).then_some(value.x);
    let changed = SceneEnvironment { part: environment_part(&light, &sky.part, angle_deg), light, air: sky.air };
    if changed != sky {
        world.insert_resource(changed);
    }
    Ok(())
}

/// Lights the scene by an image; what absorbs light outside stays.
pub fn set_image(world: &mut World, file: String, image: Arc<ImageTexture>) {
    let air = world.get_resource::<SceneEnvironment>().cloned().unwrap_or_default().air;
    let layout = EnvironmentLayout::default();
    let part = EnvironmentSource::Image { file, scale: Rgb(Vec3::ONE), rotate: 0.0, layout, axes: None };
    let light = Environment::Image { image, scale: Vec3::ONE, rotation: 0.0 };
    world.insert_resource(SceneEnvironment { part, light, air });
}

/// Sets a property of a clear sky.
fn set_clear(world: &mut World, sky: SceneEnvironment, property: Property, value: DVec3) -> Result<(), String> {
    let mut part = match &sky.part {
        clear @ EnvironmentSource::Sky { .. } => clear.clone(),
        _ => EnvironmentSource::clear_sky(),
    };
    match (property, &mut part) {
        (Property::ClearSky(property), part) => {
            let [least, most] = property.info().range;
            property.place(part).into_iter().for_each(|place| *place = value.x.clamp(least, most));
        }
        (_, EnvironmentSource::Sky { ground, .. }) => *ground = Rgb(value.clamp(DVec3::ZERO, DVec3::ONE).as_vec3()),
        _ => {}
    }
    if part == sky.part {
        return Ok(());
    }
    let image = match &sky.light {
        Environment::Image { image, .. } if property == Property::ClearSky(SkyProperty::Azimuth) && is_clear(&sky) => {
            image.clone()
        }
        _ => Arc::new(clear_sky(&part).ok_or("there is no such sky")?),
    };
    world.insert_resource(SceneEnvironment { light: sky_light(&part, image), part, air: sky.air });
    Ok(())
}

fn is_clear(sky: &SceneEnvironment) -> bool {
    matches!(sky.part, EnvironmentSource::Sky { .. })
}

fn with_color(sky: &Environment, property: Property, value: Vec3) -> Option<Environment> {
    match (property, sky) {
        // In place of whatever there was.
        (Property::Sky, _) => Some(Environment::Constant(value)),
        (Property::Zenith, &Environment::Gradient { horizon, ground, .. }) => {
            Some(Environment::Gradient { zenith: value, horizon, ground })
        }
        // In place of whatever there was, too.
        (Property::Zenith, _) => {
            let [_, horizon, ground] = GRADIENT;
            Some(Environment::Gradient { zenith: value, horizon, ground })
        }
        (Property::Horizon, &Environment::Gradient { zenith, ground, .. }) => {
            Some(Environment::Gradient { zenith, horizon: value, ground })
        }
        (Property::Ground, &Environment::Gradient { zenith, horizon, .. }) => {
            Some(Environment::Gradient { zenith, horizon, ground: value })
        }
        _ => None,
    }
}

/// Scales an environment to this strength; black becomes grey.
fn with_strength(sky: &Environment, wanted: f32) -> Option<Environment> {
    let old = strength(sky);
    let scaled = |color: Vec3| if old > 0.0 { color * (wanted / old) } else { Vec3::splat(wanted) };
    Some(match sky {
        Environment::Black => Environment::Constant(Vec3::splat(wanted)),
        Environment::Constant(radiance) => Environment::Constant(scaled(*radiance)),
        Environment::Gradient { zenith, horizon, ground } => {
            Environment::Gradient { zenith: scaled(*zenith), horizon: scaled(*horizon), ground: scaled(*ground) }
        }
        Environment::Image { image, scale, rotation } => {
            Environment::Image { image: image.clone(), scale: scaled(*scale), rotation: *rotation }
        }
    })
}

fn turned(sky: &Environment, angle: f32) -> Option<Environment> {
    let Environment::Image { image, scale, .. } = sky else { return None };
    Some(Environment::Image { image: image.clone(), scale: *scale, rotation: angle })
}
