//! Thin-lens camera: from a point on the film and a point on the lens to a ray.

use glam::Vec3;

/// A thin-lens camera in the space of the snapshot. The focal *plane* is perpendicular to `forward`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub eye: Vec3,
    /// Unit and mutually perpendicular; `right × up` points at the viewer, against `forward`.
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_vfov: f32,
    /// Metres; 0 is a pinhole, which samples no lens.
    pub lens_radius: f32,
    /// Metres along `forward` from the eye to the focal plane, positive; may be infinite.
    pub focus_distance: f32,
    /// Straight edges of the aperture; below 3 it is round.
    pub blades: u32,
    /// Radians, counter-clockwise seen from behind the camera.
    pub blade_rotation: f32,
}
