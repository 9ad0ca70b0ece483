//! Lights that are no objects, of whatever kind: between scene file and world, and what they must be.

use super::bad_value::BadValue;
use super::bounds::{check_cone, check_light, check_light_radius};
use super::components::{DirectionalLight, PointLight, SpotLight};
use super::file::{LightPart, TransformPart};
use super::placement::Placement;
use super::value::Rgb;
use super::view::unit_direction;
use bevy_ecs::prelude::{Entity, World};
use glam::{DVec3, Vec3};

/// A light that is no object. Each kind is a component of its own; an entity that has several is the first of these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Shines evenly from a point or a small sphere.
    Point(PointLight),
    /// Shines from a point into a cone.
    Spot(SpotLight),
    /// Shines from infinitely far away, parallel.
    Directional(DirectionalLight),
}

impl LightKind {
    /// The light that an entity is; `None` for what is none.
    pub fn of(world: &World, entity: Entity) -> Option<Self> {
        Self::first(world.get(entity), world.get(entity), world.get(entity))
    }

    /// What counts of the components of one entity.
    pub(super) fn first(
        point: Option<&PointLight>,
        spot: Option<&SpotLight>,
        directional: Option<&DirectionalLight>,
    ) -> Option<Self> {
        (point.map(|&light| Self::Point(light)))
            .or(spot.map(|&light| Self::Spot(light)))
            .or(directional.map(|&light| Self::Directional(light)))
    }

    /// Makes an entity this light and no other. What is so already is not touched.
    pub fn put(this: Option<Self>, world: &mut World, entity: Entity) {
        if Self::of(world, entity) == this {
            return;
        }
        let Ok(mut entity) = world.get_entity_mut(entity) else { return };
        entity.remove::<(PointLight, SpotLight, DirectionalLight)>();
        match this {
            Some(Self::Point(light)) => drop(entity.insert(light)),
            Some(Self::Spot(light)) => drop(entity.insert(light)),
            Some(Self::Directional(light)) => drop(entity.insert(light)),
            None => {}
        }
    }

    /// What people call it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point(_) => "point light",
            Self::Spot(_) => "spot light",
            Self::Directional(_) => "directional light",
        }
    }

    /// Radiant intensity, W·sr⁻¹, or for a directional light its irradiance, W·m⁻².
    pub fn strength(&self) -> Vec3 {
        match self {
            Self::Point(light) => light.intensity,
            Self::Spot(light) => light.intensity,
            Self::Directional(light) => light.irradiance,
        }
    }

    /// The same light with another [`Self::strength`].
    #[must_use]
    pub fn with_strength(self, strength: Vec3) -> Self {
        match self {
            Self::Point(light) => Self::Point(PointLight { intensity: strength, ..light }),
            Self::Spot(light) => Self::Spot(SpotLight { intensity: strength, ..light }),
            Self::Directional(light) => Self::Directional(DirectionalLight { irradiance: strength, ..light }),
        }
    }

    /// Radius of the sphere that it is to the renderer, metres; 0 for what rays cannot hit.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Point(light) => light.radius,
            Self::Spot(_) | Self::Directional(_) => 0.0,
        }
    }

    /// Where it shines, unit, in the world; `None` for a light that shines everywhere, and where there is no direction.
    pub fn direction(&self, placement: &Placement) -> Option<DVec3> {
        let own = match self {
            Self::Point(_) => return None,
            Self::Spot(light) => light.direction,
            Self::Directional(light) => light.direction,
        };
        unit_direction(placement.affine().transform_vector3(own))
    }

    /// # Errors
    /// When nothing can shine like this.
    pub fn check(&self, placement: &Placement) -> Result<(), BadValue> {
        match self {
            // A sphere may be of any size that `f32` knows, and has the checks of all that emits.
            Self::Point(light) if light.radius > 0.0 && (light.radius as f32).is_normal() => {}
            Self::Point(light) => check_light("intensity", light.intensity).and(check_light_radius(light.radius))?,
            Self::Spot(light) => {
                check_light("intensity", light.intensity)?;
                check_cone(light.inner_angle_deg, light.outer_angle_deg)?;
            }
            Self::Directional(light) => check_light("irradiance", light.irradiance)?,
        }
        if !matches!(self, Self::Point(_)) && self.direction(placement).is_none() {
            return Err(BadValue::unfit("direction", "`direction` must be finite and have a length"));
        }
        if !placement.translation.as_vec3().is_finite() {
            return Err(BadValue::unfit("position", "`position` must be finite"));
        }
        Ok(())
    }

    /// The light and the place that a scene file means.
    pub(super) fn from_part(part: &LightPart) -> (Self, Placement) {
        match part {
            LightPart::Point { position, intensity, radius, .. } => {
                (Self::Point(PointLight { intensity: intensity.0, radius: *radius }), Placement::at(*position))
            }
            LightPart::Spot { position, direction, intensity, inner_angle, outer_angle, transform, .. } => {
                let light = SpotLight {
                    intensity: intensity.0,
                    direction: *direction,
                    inner_angle_deg: *inner_angle,
                    outer_angle_deg: *outer_angle,
                };
                let placement = Placement::from_part(transform);
                let translation = placement.affine().transform_point3(*position);
                (Self::Spot(light), Placement { translation, ..placement })
            }
            LightPart::Directional { direction, irradiance, transform, .. } => {
                let light = DirectionalLight { irradiance: irradiance.0, direction: *direction };
                (Self::Directional(light), Placement::from_part(transform))
            }
        }
    }

    /// How a scene file says it.
    pub(super) fn to_part(self, name: Option<String>, placement: &Placement) -> LightPart {
        // A point of its own says where a light is that is not turned.
        let (position, transform) = match *placement == Placement::at(placement.translation) {
            true => (placement.translation, TransformPart::default()),
            false => (DVec3::ZERO, placement.to_part()),
        };
        match self {
            Self::Point(PointLight { intensity, radius }) => {
                LightPart::Point { name, position: placement.translation, intensity: Rgb(intensity), radius }
            }
            Self::Spot(SpotLight { intensity, direction, inner_angle_deg, outer_angle_deg }) => LightPart::Spot {
                name,
                position,
                direction,
                intensity: Rgb(intensity),
                inner_angle: inner_angle_deg,
                outer_angle: outer_angle_deg,
                transform,
            },
            Self::Directional(DirectionalLight { irradiance, direction }) => {
                LightPart::Directional { name, direction, irradiance: Rgb(irradiance), transform: placement.to_part() }
            }
        }
    }
}
