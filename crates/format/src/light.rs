//! Lights that are not objects: conversion between scene file and world, and validation.

use crate::bad_value::BadValue;
use crate::bounds::{check_cone, check_image_angle, check_light, check_light_radius};
use crate::parts::{LightPart, TransformPart, default_outer_angle};
use crate::placement::Placement;
use crate::value::Rgb;
use crate::view::unit_direction;
use firstlight_render::Falloff;
use glam::{DVec2, DVec3, Vec3};

/// Emits uniformly in all directions; rendered as an emissive sphere, or as a point if its radius is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
#[cfg_attr(feature = "ecs", require(Placement))]
pub struct PointLight {
    /// Radiant intensity, W·sr⁻¹.
    pub intensity: Vec3,
    /// Metres. With 0 it is a point: its shadows are hard, and rays cannot hit it.
    pub radius: f64,
}

/// Emits from a point into a cone; rays cannot hit it.
///
/// Between the two angles its intensity falls off from `intensity` to 0, see [`Falloff`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
#[cfg_attr(feature = "ecs", require(Placement))]
pub struct SpotLight {
    /// Radiant intensity within the inner cone, W·sr⁻¹.
    pub intensity: Vec3,
    /// Axis of the cone, away from its apex, in object space: its [`Placement`] rotates it. Any length but 0.
    pub direction: DVec3,
    /// Degrees from the axis, 0 to the outer angle; the intensity falls off from here on.
    pub inner_angle_deg: f64,
    /// Degrees from the axis, above 0 and at most 90; no light beyond.
    pub outer_angle_deg: f64,
    /// How the intensity falls off between the two.
    pub falloff: Falloff,
    /// How it projects an image.
    pub image: ImageFrame,
}

impl Default for SpotLight {
    /// Along −Z of object space, with the cone that scene files have by default.
    fn default() -> Self {
        Self {
            intensity: Vec3::ONE,
            direction: DVec3::NEG_Z,
            inner_angle_deg: 0.0,
            outer_angle_deg: default_outer_angle(),
            falloff: Falloff::default(),
            image: ImageFrame::default(),
        }
    }
}

/// How a spot light projects the image of its texture; without one, the image is white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageFrame {
    /// Upwards in the image, in object space. Any length but 0; any direction if the light shines along it.
    pub up: DVec3,
    /// Degrees, below 180, that the image fills horizontally. 0: by the height and the proportions of the image, or if
    /// both are 0, the image is a square around the cone.
    pub width_deg: f64,
    /// The same vertically.
    pub height_deg: f64,
    /// Whether a wall that faces the light is lit evenly: the intensity is over cos³ of the angle from the axis.
    pub even: bool,
}

impl Default for ImageFrame {
    fn default() -> Self {
        Self { up: DVec3::Y, width_deg: 0.0, height_deg: 0.0, even: false }
    }
}

impl ImageFrame {
    /// Whether it matters without a texture.
    pub fn is_shaped(&self) -> bool {
        self.even || self.width_deg > 0.0 || self.height_deg > 0.0
    }

    /// Tangents of half the angles that the image fills, horizontally and vertically.
    ///
    /// - `outer_angle_deg`: of the cone; `aspect`: width over height of the image.
    pub fn half(&self, outer_angle_deg: f64, aspect: f64) -> DVec2 {
        let tangent = |degrees: f64| (0.5 * degrees.to_radians()).tan();
        let (width, height) = (tangent(self.width_deg), tangent(self.height_deg));
        match (width > 0.0, height > 0.0) {
            (true, true) => DVec2::new(width, height),
            (true, false) => DVec2::new(width, width / aspect),
            (false, true) => DVec2::new(height * aspect, height),
            (false, false) => DVec2::splat(tangent(2.0 * outer_angle_deg)),
        }
    }

    /// Unit vectors in the world to the right and upwards in the image, as seen from a light that shines along
    /// `direction`, which is unit.
    pub fn axes(&self, placement: &Placement, direction: DVec3) -> [DVec3; 2] {
        let up = placement.affine().transform_vector3(self.up);
        let right = direction.cross(up).try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
        [right, right.cross(direction)]
    }
}

/// Emits parallel light from infinitely far away; rays cannot hit it. Like the light of the environment, it is not
/// absorbed by the air.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
#[cfg_attr(feature = "ecs", require(Placement))]
pub struct DirectionalLight {
    /// Irradiance of a surface that faces the light, W·m⁻².
    pub irradiance: Vec3,
    /// Direction of propagation, in object space: its [`Placement`] rotates it. Any length but 0.
    pub direction: DVec3,
}

/// A light that is not an object. Each kind is a component; if an entity has several, the first in this order counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Emits uniformly from a point or a small sphere.
    Point(PointLight),
    /// Emits from a point into a cone.
    Spot(SpotLight),
    /// Emits parallel light from infinitely far away.
    Directional(DirectionalLight),
}

impl LightKind {
    /// The first of the components of an entity.
    pub fn first(
        (point, spot, directional): (Option<&PointLight>, Option<&SpotLight>, Option<&DirectionalLight>),
    ) -> Option<Self> {
        (point.map(|&light| Self::Point(light)))
            .or(spot.map(|&light| Self::Spot(light)))
            .or(directional.map(|&light| Self::Directional(light)))
    }

    /// Names of all kinds, as in [`Self::name`].
    pub const NAMES: [&'static str; 3] = ["point light", "spot light", "directional light"];

    /// Name of the kind of light, for the user interface.
    pub fn name(&self) -> &'static str {
        Self::NAMES[match self {
            Self::Point(_) => 0,
            Self::Spot(_) => 1,
            Self::Directional(_) => 2,
        }]
    }

    /// Whether it emits from one place, and not from infinitely far away.
    pub fn has_position(&self) -> bool {
        !matches!(self, Self::Directional(_))
    }

    /// Inner and outer angle of its cone, degrees, the falloff between them, and how it projects an image; `None` if it
    /// has no cone.
    pub fn cone(&self) -> Option<(f64, f64, Falloff, ImageFrame)> {
        match self {
            Self::Spot(light) => Some((light.inner_angle_deg, light.outer_angle_deg, light.falloff, light.image)),
            Self::Point(_) | Self::Directional(_) => None,
        }
    }

    /// Radiant intensity, W·sr⁻¹; for directional lights the irradiance, W·m⁻².
    pub fn strength(&self) -> Vec3 {
        match self {
            Self::Point(light) => light.intensity,
            Self::Spot(light) => light.intensity,
            Self::Directional(light) => light.irradiance,
        }
    }

    /// The light with another [`Self::strength`].
    #[must_use]
    pub fn with_strength(self, strength: Vec3) -> Self {
        match self {
            Self::Point(light) => Self::Point(PointLight { intensity: strength, ..light }),
            Self::Spot(light) => Self::Spot(SpotLight { intensity: strength, ..light }),
            Self::Directional(light) => Self::Directional(DirectionalLight { irradiance: strength, ..light }),
        }
    }

    /// Radius of the emissive sphere, metres; 0 for delta lights, which rays cannot hit.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Point(light) => light.radius,
            Self::Spot(_) | Self::Directional(_) => 0.0,
        }
    }

    /// Direction of emission, unit vector in the world; `None` for point lights, and if the direction is degenerate.
    pub fn direction(&self, placement: &Placement) -> Option<DVec3> {
        let own = match self {
            Self::Point(_) => return None,
            Self::Spot(light) => light.direction,
            Self::Directional(light) => light.direction,
        };
        unit_direction(placement.affine().transform_vector3(own))
    }

    /// Upwards in the image that a spot light projects, in the world; `None` for other lights.
    pub fn image_up(&self, placement: &Placement) -> Option<DVec3> {
        match self {
            Self::Spot(light) => Some(placement.affine().transform_vector3(light.image.up)),
            Self::Point(_) | Self::Directional(_) => None,
        }
    }

    /// # Errors
    /// If a parameter is out of range, or the direction is degenerate.
    pub fn check(&self, placement: &Placement) -> Result<(), BadValue> {
        match self {
            // Spheres of any radius that is a normal `f32` get the checks of emissive objects.
            Self::Point(light) if light.radius > 0.0 && (light.radius as f32).is_normal() => {}
            Self::Point(light) => check_light("intensity", light.intensity).and(check_light_radius(light.radius))?,
            Self::Spot(light) => {
                check_light("intensity", light.intensity)?;
                check_cone(light.inner_angle_deg, light.outer_angle_deg)?;
                check_image_angle("image_width", light.image.width_deg)?;
                check_image_angle("image_height", light.image.height_deg)?;
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

    /// The light of a scene file and its placement.
    pub fn from_part(part: &LightPart) -> (Self, Placement) {
        match part {
            LightPart::Point { position, intensity, radius, .. } => {
                (Self::Point(PointLight { intensity: intensity.0, radius: *radius }), Placement::at(*position))
            }
            LightPart::Spot {
                position,
                direction,
                intensity,
                inner_angle,
                outer_angle,
                falloff,
                up,
                image_width,
                image_height,
                even,
                transform,
                ..
            } => {
                let light = SpotLight {
                    intensity: intensity.0,
                    direction: *direction,
                    inner_angle_deg: *inner_angle,
                    outer_angle_deg: *outer_angle,
                    falloff: *falloff,
                    image: ImageFrame { up: *up, width_deg: *image_width, height_deg: *image_height, even: *even },
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

    /// The light as in a scene file, without its texture.
    pub fn to_part(self, name: Option<String>, hidden: bool, placement: &Placement) -> LightPart {
        // Lights with a position need no transform if they are not rotated.
        let (position, transform) = match *placement == Placement::at(placement.translation) {
            true => (placement.translation, TransformPart::default()),
            false => (DVec3::ZERO, placement.to_part()),
        };
        match self {
            Self::Point(PointLight { intensity, radius }) => {
                LightPart::Point { name, hidden, position: placement.translation, intensity: Rgb(intensity), radius }
            }
            Self::Spot(SpotLight { intensity, direction, inner_angle_deg, outer_angle_deg, falloff, image }) => {
                LightPart::Spot {
                    name,
                    hidden,
                    position,
                    direction,
                    intensity: Rgb(intensity),
                    inner_angle: inner_angle_deg,
                    outer_angle: outer_angle_deg,
                    falloff,
                    texture: None,
                    up: image.up,
                    image_width: image.width_deg,
                    image_height: image.height_deg,
                    even: image.even,
                    transform,
                }
            }
            Self::Directional(DirectionalLight { irradiance, direction }) => LightPart::Directional {
                name,
                hidden,
                direction,
                irradiance: Rgb(irradiance),
                transform: placement.to_part(),
            },
        }
    }
}
