//! The camera entity: where it looks from, how wide, and through which lens.

use bevy_ecs::prelude::Component;
use glam::DVec3;

/// Where the camera stands and looks. `forward` and `up` are unit and perpendicular.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(Projection, Lens)]
pub struct View {
    /// Metres.
    pub eye: DVec3,
    pub forward: DVec3,
    pub up: DVec3,
    /// Metres along `forward` to the point that orbiting turns about.
    pub pivot_distance: f64,
}

/// How wide the camera sees.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Vertical field of view, degrees, between 0 and 180.
    pub vfov_deg: f64,
}

/// What is sharp and how fast sharpness fades.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Metres.
    pub radius: f64,
    /// Metres along the view axis to the focal plane.
    pub focus_distance: f64,
    /// When false, all is sharp, as through a pinhole.
    pub enabled: bool,
    /// Straight edges of the aperture; below 3 it is round.
    pub blades: u32,
    pub blade_rotation_deg: f64,
}

impl Default for View {
    fn default() -> Self {
        Self { eye: DVec3::new(0.0, 0.0, 5.0), forward: DVec3::NEG_Z, up: DVec3::Y, pivot_distance: 5.0 }
    }
}

impl Default for Projection {
    fn default() -> Self {
        Self { vfov_deg: 40.0 }
    }
}

impl Default for Lens {
    fn default() -> Self {
        Self { radius: 0.0, focus_distance: 5.0, enabled: false, blades: 0, blade_rotation_deg: 0.0 }
    }
}
