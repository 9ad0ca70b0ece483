//! Where the picture is seen from: the three components of a camera entity.
//!
//! [`View`] is the pose, [`Projection`] the field of view, [`Lens`] what is sharp. All are in the scene's own frame
//! (metres, right-handed, Y up) and f64, so that a camera far from the origin moves as smoothly as one at it.
//! How a person moves a view is in `frame::navigation`; what the renderer makes of it is `render::Camera`.

use super::units::LEAST_SINE;
use bevy_ecs::prelude::Component;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The pose of a camera.
///
/// `forward` and `up` are unit and perpendicular; every constructor and every function of `frame::navigation` keeps
/// them so. The pivot is the point on the view axis that orbiting turns about; it is not seen in the picture, so a
/// change of `pivot_distance` alone restarts nothing.
#[derive(Clone, Copy, Debug, PartialEq, Component, Serialize, Deserialize)]
#[require(Projection, Lens)]
pub struct View {
    /// Centre of the lens in the world, metres.
    pub eye: DVec3,
    /// Direction of the view, unit.
    pub forward: DVec3,
    /// What is up in the picture, unit and perpendicular to `forward`.
    pub up: DVec3,
    /// Metres along `forward` from the camera to the pivot; positive and finite.
    pub pivot_distance: f64,
}

/// Why there is no such view.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ViewError {
    /// A vector has a NaN or infinite coordinate.
    #[error("camera: `{name}` is {value}, but all three numbers must be finite")]
    NotFinite {
        /// Name of the argument.
        name: &'static str,
        /// Its value.
        value: DVec3,
    },
    /// The camera and the point that it looks at are the same.
    #[error(
        "camera: `eye` and `look_at` are the same point {eye}; move one of them so that there is a direction to look in"
    )]
    NoDirection {
        /// The point, metres.
        eye: DVec3,
    },
    /// The up vector is zero.
    #[error("camera: `up` is zero; give the direction that is up in the picture, for example (0, 1, 0)")]
    NoUp,
    /// The up vector lies along the direction of the view.
    #[error(
        "camera: `up` {up} lies along the view direction {forward}; choose an `up` that points elsewhere, for example {suggestion}"
    )]
    UpAlongView {
        /// The up vector.
        up: DVec3,
        /// Direction of the view, unit.
        forward: DVec3,
        /// An axis that would do.
        suggestion: DVec3,
    },
}

impl View {
    /// A view from `camera` with `look_at` in the middle of the picture and as the pivot.
    ///
    /// `up` need not be unit, nor perpendicular to the view direction, but must not lie along it.
    ///
    /// # Errors
    /// When a number is not finite, the two points are the same, or `up` is zero or along the view direction.
    pub fn look_at(eye: DVec3, look_at: DVec3, up: DVec3) -> Result<Self, ViewError> {
        for (name, value) in [("eye", eye), ("look_at", look_at), ("up", up)] {
            if !value.is_finite() {
                return Err(ViewError::NotFinite { name, value });
            }
        }
        let towards = look_at - eye;
        // Lengths are taken of a copy scaled to about 1: squaring tiny or huge coordinates would leave the range of f64.
        let (forward, scale) = direction(towards).ok_or(ViewError::NoDirection { eye })?;
        let pivot_distance = (towards / scale).length() * scale;
        if !pivot_distance.is_finite() {
            return Err(ViewError::NotFinite { name: "look_at", value: look_at });
        }
        let (up_dir, _) = direction(up).ok_or(ViewError::NoUp)?;
        if forward.cross(up_dir).length() < LEAST_SINE {
            // The axis least like the view direction, so that the advice cannot fail in turn.
            let suggestion = if forward.y.abs() > forward.z.abs() { DVec3::Z } else { DVec3::Y };
            return Err(ViewError::UpAlongView { up, forward, suggestion });
        }
        Ok(Self { eye, forward, up: up_dir, pivot_distance }.orthonormalized())
    }

    /// Unit, to the right in the picture.
    pub fn right(&self) -> DVec3 {
        self.forward.cross(self.up)
    }

    /// The point that orbiting turns about.
    pub fn pivot(&self) -> DVec3 {
        self.eye + self.forward * self.pivot_distance
    }

    /// The same view with rounding taken out of its axes; `forward` keeps its direction.
    ///
    /// Precondition: `up` is not along `forward`.
    pub fn orthonormalized(self) -> Self {
        let forward = self.forward.normalize();
        let right = forward.cross(self.up).normalize();
        // Twice: where `up` was nearly along `forward`, the first `right` has lost digits, the second has not.
        let up = right.cross(forward).normalize();
        let right = forward.cross(up).normalize();
        Self { forward, up: right.cross(forward), ..self }
    }

    /// Whether no number of it is NaN or infinite.
    pub fn is_finite(&self) -> bool {
        self.eye.is_finite() && self.forward.is_finite() && self.up.is_finite() && self.pivot_distance.is_finite()
    }
}

/// The unit vector along `v`, whatever its length; `None` where it has none or is not finite.
///
/// Where the square of the length is a normal number, the same bits as `normalize`.
pub(crate) fn unit_direction(v: DVec3) -> Option<DVec3> {
    let squared = v.length_squared();
    if squared.is_normal() { Some(v.normalize()) } else { direction(v).map(|(unit, _)| unit) }
}

/// The unit vector along `v` and the largest of its coordinates, or `None` for the zero vector.
fn direction(v: DVec3) -> Option<(DVec3, f64)> {
    let scale = v.abs().max_element();
    // The largest of numbers is not told of one that is none.
    (scale > 0.0 && v.is_finite()).then(|| ((v / scale).normalize(), scale))
}

impl Default for View {
    /// From 5 m in front of the origin, looking at it.
    fn default() -> Self {
        Self { eye: DVec3::new(0.0, 0.0, 5.0), forward: DVec3::NEG_Z, up: DVec3::Y, pivot_distance: 5.0 }
    }
}

/// How much of the scene the picture takes in.
#[derive(Clone, Copy, Debug, PartialEq, Component, Serialize, Deserialize)]
pub struct Projection {
    /// Vertical field of view in perspective, degrees, in `(0, 180)`.
    pub vfov_deg: f64,
    /// Height of what an orthographic camera sees, metres; `None` sees in perspective. Its rays are parallel, and begin in
    /// the plane through the camera that faces along the view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orthographic_height: Option<f64>,
}

impl Projection {
    /// In perspective, with a vertical field of view in degrees.
    pub fn perspective(vfov_deg: f64) -> Self {
        Self { vfov_deg, orthographic_height: None }
    }

    /// Half the height of what the picture takes in at a depth along the view; both metres.
    pub fn half_height(&self, depth: f64) -> f64 {
        self.orthographic_height.map_or_else(|| self.tan_half_vfov() * depth, |height| 0.5 * height)
    }

    /// Tangent of half the vertical field of view in perspective: half the picture's height at distance 1.
    pub fn tan_half_vfov(&self) -> f64 {
        (0.5 * self.vfov_deg).to_radians().tan()
    }
}

impl Default for Projection {
    fn default() -> Self {
        Self::perspective(40.0)
    }
}

/// A thin lens: everything in the plane at `focus_distance` is sharp, the rest blurs with `radius`.
#[derive(Clone, Copy, Debug, PartialEq, Component, Serialize, Deserialize)]
pub struct Lens {
    /// Radius of the aperture, metres, at least 0; 0 is a pinhole.
    pub radius: f64,
    /// Metres along the view axis to the focal *plane*; positive, may be infinite.
    pub focus_distance: f64,
    /// Off: the picture is a pinhole's, and `radius` waits to be switched on again.
    pub enabled: bool,
    /// Straight edges of the aperture; below 3 it is round.
    pub blades: u32,
    /// Counter-clockwise seen from behind the camera.
    pub blade_rotation_deg: f64,
}

impl Lens {
    /// No blur, with the focal plane where it would be when somebody opens the aperture.
    pub fn pinhole(focus_distance: f64) -> Self {
        Self { radius: 0.0, focus_distance, enabled: false, blades: 0, blade_rotation_deg: 0.0 }
    }

    /// A round aperture of `radius`, focused on the plane at `focus_distance`; both metres.
    pub fn thin(radius: f64, focus_distance: f64) -> Self {
        Self { radius, enabled: radius > 0.0, ..Self::pinhole(focus_distance) }
    }

    /// The radius that the picture shows: 0 while depth of field is off.
    pub fn effective_radius(&self) -> f64 {
        if self.enabled { self.radius } else { 0.0 }
    }
}

impl Default for Lens {
    fn default() -> Self {
        Self::pinhole(View::default().pivot_distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_orthonormal(view: &View) {
        assert!((view.forward.length() - 1.0).abs() < 4.0 * f64::EPSILON, "{view:?}");
        assert!((view.up.length() - 1.0).abs() < 4.0 * f64::EPSILON, "{view:?}");
        assert!(view.forward.dot(view.up).abs() < 4.0 * f64::EPSILON, "{view:?}");
    }

    #[test]
    fn look_at_puts_the_target_in_the_middle() {
        for scale in [1e-200, 1e-6, 1.0, 5e6, 1e200] {
            let eye = DVec3::new(1.0, 2.0, 3.0) * scale;
            let target = DVec3::new(-4.0, 0.5, 2.0) * scale;
            let view = View::look_at(eye, target, DVec3::new(0.0, 3.0, 0.1)).unwrap();
            assert_orthonormal(&view);
            assert!((view.pivot() - target).abs().max_element() < 1e-14 * scale, "{view:?}");
            assert!(view.right().dot(DVec3::Y).abs() < 0.1, "up is up in the picture: {view:?}");
            assert!(view.up.y > 0.9);
        }
    }

    #[test]
    fn an_up_that_is_nearly_along_the_view_still_gives_clean_axes() {
        let view = View::look_at(DVec3::ZERO, DVec3::Z, DVec3::new(1e-7, 0.0, 1.0)).unwrap();
        assert_orthonormal(&view);
        assert!(view.up.x > 0.999_999);
    }

    #[test]
    fn degenerate_cameras_are_refused_with_advice() {
        let p = DVec3::new(1.0, 2.0, 3.0);
        let same = View::look_at(p, p, DVec3::Y).unwrap_err().to_string();
        assert!(same.contains("`eye` and `look_at` are the same point"), "{same}");
        for up in [DVec3::Y, DVec3::NEG_Y, DVec3::new(0.0, 1.0, 1e-9)] {
            let along = View::look_at(p, p - DVec3::Y, up).unwrap_err();
            let ViewError::UpAlongView { suggestion, .. } = along else { panic!("{along}") };
            assert!(along.to_string().contains("lies along the view direction"));
            assert!(View::look_at(p, p - DVec3::Y, suggestion).is_ok(), "the advice works");
        }
        assert_eq!(View::look_at(p, DVec3::ZERO, DVec3::ZERO), Err(ViewError::NoUp));
        let nan = View::look_at(DVec3::new(f64::NAN, 0.0, 0.0), p, DVec3::Y).unwrap_err().to_string();
        assert!(nan.contains("`eye`") && nan.contains("finite"), "{nan}");
    }
}
