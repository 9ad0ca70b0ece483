//! The camera as written, and its conversion to components and back.

use crate::format::units::lens_radius_of;
use crate::format::view::{Lens, Projection, View, unit_direction};
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

/// The camera that a scene file describes, unchecked; [`CameraPart::components`] also checks it.
pub(crate) fn camera(part: &CameraPart) -> (View, Projection, Lens) {
    // Scaled so that its square neither overflows nor underflows.
    let wanted = if part.up.length_squared().is_normal() { part.up } else { along(part.up) };
    let level = |forward: DVec3| wanted.reject_from_normalized(forward).normalize();
    let view = match (part.forward, part.look_at) {
        // A saved view is restored exactly: axes that are already orthonormal are not normalised again.
        (Some(forward), _) => {
            let forward = unit(forward);
            let square = is_unit(part.up) && forward.dot(part.up).abs() <= ROUNDING;
            let up = if square { part.up } else { level(forward) };
            View { eye: part.eye, forward, up, pivot_distance: part.pivot_distance.unwrap_or(1.0) }
        }
        (None, look_at) => {
            let offset = look_at.unwrap_or(part.eye + DVec3::NEG_Z) - part.eye;
            let forward = along(offset);
            View { eye: part.eye, forward, up: level(forward), pivot_distance: offset.length() }
        }
    };
    let radius = part.f_stop.map(|stop| lens_radius_of(part.vfov, stop)).or(part.lens_radius).unwrap_or(0.0);
    let lens = Lens {
        radius,
        focus_distance: part.focus_distance.unwrap_or(view.pivot_distance),
        enabled: part.depth_of_field.unwrap_or(radius > 0.0),
        blades: part.blades,
        blade_rotation_deg: part.blade_rotation,
    };
    (view, Projection { vfov_deg: part.vfov, orthographic_height: part.orthographic_height }, lens)
}

/// Tolerance for lengths of 1 and right angles.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

fn is_unit(vector: DVec3) -> bool {
    (vector.length_squared() - 1.0).abs() <= ROUNDING
}

/// The vector scaled to length 1; exactly itself if it already has that length.
pub(crate) fn unit(vector: DVec3) -> DVec3 {
    if is_unit(vector) { vector } else { along(vector) }
}

/// The vector scaled to length 1; NaN if it has no direction, like `normalize`.
fn along(vector: DVec3) -> DVec3 {
    unit_direction(vector).unwrap_or(DVec3::NAN)
}

/// The camera of a scene file that gives exactly these components: `written` if it still does, else with the point that
/// it looks at if that gives the same bits, else with its direction.
pub fn camera_part(view: &View, projection: &Projection, lens: &Lens, written: Option<&CameraPart>) -> CameraPart {
    let same = |part: &CameraPart| camera(part) == (*view, *projection, *lens);
    if let Some(part) = written.filter(|part| same(part)) {
        return part.clone();
    }
    let at = CameraPart {
        up: view.up,
        vfov: projection.vfov_deg,
        orthographic_height: projection.orthographic_height,
        lens_radius: (lens.radius != 0.0).then_some(lens.radius),
        focus_distance: Some(lens.focus_distance),
        depth_of_field: (lens.enabled != (lens.radius > 0.0)).then_some(lens.enabled),
        blades: lens.blades,
        blade_rotation: lens.blade_rotation_deg,
        ..CameraPart::looking_at(view.eye, view.pivot())
    };
    let upright = CameraPart { up: DVec3::Y, ..at.clone() };
    let directed = CameraPart {
        look_at: None,
        forward: Some(view.forward),
        pivot_distance: Some(view.pivot_distance),
        ..at.clone()
    };
    [upright, at].into_iter().find(same).unwrap_or(directed)
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
