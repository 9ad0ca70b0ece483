//! Conversion between the camera of a scene file and its components.

use crate::format::camera::CameraPart;
use crate::format::units::lens_radius_of;
use crate::format::view::{Lens, Projection, View, unit_direction};
use glam::DVec3;

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
