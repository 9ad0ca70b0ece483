//! The camera as written.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A thin-lens camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPart {
    /// Centre of the lens, metres.
    pub eye: DVec3,
    /// The point in the centre of the image, which is the pivot of orbiting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at: Option<DVec3>,
    /// Direction of the view, in place of `look_at`. A unit vector is used unchanged, to the last bit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forward: Option<DVec3>,
    /// With `forward`: distance from the camera to the pivot of orbiting, metres; 1 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot_distance: Option<f64>,
    /// Direction that is up in the image; +Y if not given.
    #[serde(default = "default_up")]
    pub up: DVec3,
    /// Vertical field of view of a perspective camera, degrees.
    #[serde(default = "default_vfov")]
    pub vfov: f64,
    /// Visible height of an orthographic camera, metres; a perspective camera if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orthographic_height: Option<f64>,
    /// Radius of the lens in metres; a pinhole if neither this nor `f_stop` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens_radius: Option<f64>,
    /// Focal length over aperture diameter, for a film 24 mm high.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_stop: Option<f64>,
    /// Distance from the camera to the focal plane along the view axis, metres; that of `look_at` if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f64>,
    /// Whether depth of field is on; if not given, it is on if the lens has a radius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_of_field: Option<bool>,
    /// Number of aperture blades; below 3 the aperture is round.
    #[serde(default, skip_serializing_if = "is_default")]
    pub blades: u32,
    /// Rotation of the blades, degrees.
    #[serde(default, skip_serializing_if = "is_default")]
    pub blade_rotation: f64,
}

impl CameraPart {
    /// A pinhole camera that looks at a point, with defaults for everything else.
    pub fn looking_at(eye: DVec3, look_at: DVec3) -> Self {
        Self {
            eye,
            look_at: Some(look_at),
            forward: None,
            pivot_distance: None,
            up: default_up(),
            vfov: default_vfov(),
            orthographic_height: None,
            lens_radius: None,
            f_stop: None,
            focus_distance: None,
            depth_of_field: None,
            blades: 0,
            blade_rotation: 0.0,
        }
    }
}

fn default_up() -> DVec3 {
    DVec3::Y
}

fn default_vfov() -> f64 {
    40.0
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
