//! The camera as written: its checks, and its conversion to components and back, and to the camera of the renderer.

use crate::bad_value::BadValue;
use crate::bounds;
use crate::bounds::{check_point, check_size, number, triple};
use crate::defaults::{default_up, is_default};
use crate::units::{lens_radius_of, radians};
use crate::view::{Lens, Projection, View, check_direction, check_not_parallel, same_point, unit_direction};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Degrees. Below this, all camera rays of an image are equal in `f32`.
pub const LEAST_VFOV_DEG: f64 = 1e-6;

/// Tolerance for the length of an axis and for the cosine between two axes. Camera moves are exact to rounding.
const AXIS_SLACK: f64 = 1e-3;

/// Metres. At this distance from the axis, `f32` resolves 6 cm, and the error of such rays is larger still: they would
/// have to be tested against whole meshes.
const MOST_LENS_RADIUS: f64 = 1e6;

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
pub fn camera(part: &CameraPart) -> (View, Projection, Lens) {
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
pub fn unit(vector: DVec3) -> DVec3 {
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

/// The camera of the renderer, relative to `origin` in the world, metres.
pub fn render_camera(view: &View, projection: &Projection, lens: &Lens, origin: DVec3) -> firstlight_render::Camera {
    firstlight_render::Camera {
        eye: (view.eye - origin).as_vec3(),
        right: view.forward.cross(view.up).as_vec3(),
        up: view.up.as_vec3(),
        forward: view.forward.as_vec3(),
        tan_half_vfov: (0.5 * projection.vfov_deg).to_radians().tan() as f32,
        orthographic: projection.orthographic_height.map(|height| (0.5 * height) as f32),
        lens_radius: if lens.enabled { lens.radius as f32 } else { 0.0 },
        focus_distance: lens.focus_distance as f32,
        blades: lens.blades,
        blade_rotation: radians(lens.blade_rotation_deg),
    }
}

impl CameraPart {
    /// The components that it describes.
    ///
    /// # Errors
    /// All problems, in the order of its fields.
    pub fn components(&self) -> Result<(View, Projection, Lens), Vec<BadValue>> {
        let mut problems = Vec::new();
        let mut note = |result: Result<(), BadValue>| problems.extend(result.err());
        note(check_point("eye", self.eye));
        let up = check_direction("up", self.up);
        let view = match (self.look_at, self.forward) {
            (Some(look_at), None) => {
                note(check_point("look_at", look_at));
                let offset = look_at - self.eye;
                if offset.is_finite() && !offset.abs().cmpge(DVec3::splat(bounds::MIN_SIZE)).any() {
                    note(Err(same_point()));
                    None
                } else {
                    unit_direction(offset)
                }
            }
            (None, Some(forward)) => {
                let forward = check_direction("forward", forward);
                note(forward.clone().map(drop));
                forward.ok()
            }
            (None, None) => {
                let problem = "the camera has no direction: set `look_at` (a point) or `forward` (a direction)";
                note(Err(BadValue::unfit("camera", problem)));
                None
            }
            (Some(_), Some(_)) => {
                let problem = "`look_at` and `forward` exclude each other: set one of them";
                note(Err(BadValue::unfit("forward", problem)));
                None
            }
        };
        match (view, &up) {
            (Some(view), Ok(up)) => note(check_not_parallel(view, *up)),
            (_, Err(bad)) => note(Err(bad.clone())),
            (None, Ok(_)) => {}
        }
        if let Some(distance) = self.pivot_distance {
            if self.look_at.is_some() {
                let problem = "`pivot_distance` needs `forward`: with `look_at` it is already defined";
                note(Err(BadValue::unfit("pivot_distance", problem)));
            } else {
                note(check_size("pivot_distance", distance));
            }
        }
        let projection = Projection::perspective(self.vfov).check();
        let is_open = projection.is_ok();
        note(projection);
        note(self.orthographic_height.map_or(Ok(()), check_height));
        match (self.lens_radius, self.f_stop) {
            (Some(_), Some(_)) => {
                let problem = "`lens_radius` and `f_stop` exclude each other: set one of them";
                note(Err(BadValue::unfit("f_stop", problem)));
            }
            (Some(radius), None) => note(check_lens_radius("lens_radius", radius)),
            (None, Some(stop)) if !(stop > 0.0) => {
                note(Err(BadValue::out_of_range("f_stop", number(stop), "be positive")));
            }
            (None, Some(stop)) if is_open => {
                let radius = lens_radius_of(self.vfov, stop);
                note(check_lens_radius("f_stop", radius).map_err(|_| {
                    let opens =
                        format!("`f_stop` is {}, which gives a lens radius of {} m", number(stop), number(radius));
                    BadValue::unfit("f_stop", format!("{opens}: use at most {MOST_LENS_RADIUS:e} m"))
                }));
            }
            (None, _) => {}
        }
        if let Some(distance) = self.focus_distance {
            note(check_focus(distance));
        }
        note(check_angle("blade_rotation", self.blade_rotation));
        if problems.is_empty() { Ok(camera(self)) } else { Err(problems) }
    }
}

fn check_angle(field: &'static str, angle_deg: f64) -> Result<(), BadValue> {
    let good = angle_deg.is_finite();
    if good { Ok(()) } else { Err(BadValue::out_of_range(field, number(angle_deg), "be a finite number of degrees")) }
}

fn check_height(height: f64) -> Result<(), BadValue> {
    check_size("orthographic_height", height)
}

fn check_lens_radius(field: &'static str, radius: f64) -> Result<(), BadValue> {
    if (0.0..=MOST_LENS_RADIUS).contains(&radius) {
        return Ok(());
    }
    let rule = format!("be 0 or positive, and at most {MOST_LENS_RADIUS:e} m");
    Err(BadValue::out_of_range(field, number(radius), rule))
}

fn check_focus(distance: f64) -> Result<(), BadValue> {
    if distance >= bounds::MIN_SIZE {
        return Ok(());
    }
    let rule = format!("be positive, at least {:e} m; inf is allowed", bounds::MIN_SIZE);
    Err(BadValue::out_of_range("focus_distance", number(distance), rule))
}

impl View {
    /// # Errors
    /// If a coordinate is out of range, or the axes are not of unit length and perpendicular.
    pub fn check(&self) -> Result<(), BadValue> {
        check_point("eye", self.eye)?;
        for (field, axis) in [("forward", self.forward), ("up", self.up)] {
            check_direction(field, axis)?;
            if (axis.length() - 1.0).abs() > AXIS_SLACK {
                return Err(BadValue::out_of_range(field, triple(axis), "have length 1"));
            }
        }
        if self.forward.dot(self.up).abs() > AXIS_SLACK {
            return Err(BadValue::unfit("up", "`up` is not perpendicular to `forward`"));
        }
        check_size("pivot_distance", self.pivot_distance)
    }
}

impl Projection {
    /// # Errors
    /// If the field of view or the height is out of range.
    pub fn check(&self) -> Result<(), BadValue> {
        if (LEAST_VFOV_DEG..180.0).contains(&self.vfov_deg) {
            return self.orthographic_height.map_or(Ok(()), check_height);
        }
        let rule = format!("lie above 0 and below 180 degrees (at least {LEAST_VFOV_DEG:e})");
        Err(BadValue::out_of_range("vfov", number(self.vfov_deg), rule))
    }
}

impl Lens {
    /// # Errors
    /// If a value is out of range.
    pub fn check(&self) -> Result<(), BadValue> {
        check_lens_radius("lens_radius", self.radius)?;
        check_focus(self.focus_distance)?;
        check_angle("blade_rotation", self.blade_rotation_deg)
    }
}

fn default_vfov() -> f64 {
    40.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> CameraPart {
        CameraPart::looking_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO)
    }

    #[test]
    fn directions_of_any_length_are_directions() {
        let plain = good().components().unwrap();
        for length in [1e300, 1e160, 1.0, 1e-160, 1e-300, f64::MAX, f64::MIN_POSITIVE] {
            assert_eq!(CameraPart { up: DVec3::Y * length, ..good() }.components().unwrap(), plain, "{length:e}");
            let forward = CameraPart { look_at: None, forward: Some(DVec3::NEG_Z * length), ..good() };
            let (view, ..) = forward.components().unwrap();
            assert_eq!((view.forward, view.up), (plain.0.forward, plain.0.up), "{length:e}");
        }
        let slanted = CameraPart { up: DVec3::new(1e300, 1e300, -1e300), ..good() };
        let (view, ..) = slanted.components().unwrap();
        assert!((view.up - DVec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-15, "{view:?}");
        view.check().unwrap();
    }

    #[test]
    fn only_what_is_parallel_is_called_so() {
        for (tilt, is_parallel) in [(0.0, true), (1e-8, true), (2e-8, false), (1e-6, false)] {
            let part = CameraPart { up: DVec3::new(0.0, tilt * 1e300, 1e300), ..good() };
            let found = part.components();
            assert_eq!(found.is_err(), is_parallel, "{tilt}: {found:?}");
            if let Err(problems) = found {
                assert!(problems[0].to_string().contains("parallel") && problems[0].to_string().contains("1.5e-8"));
            }
        }
        // Too far away is the only problem.
        let far = CameraPart { look_at: Some(DVec3::NEG_Z * 1e300), ..good() };
        let problems = far.components().unwrap_err();
        assert!(problems.len() == 1 && problems[0].to_string().contains("(0, 0, -1e300), but must be finite"));
    }

    #[test]
    fn angles_of_many_turns_are_reduced_exactly() {
        assert_eq!(radians(360.0 * 1e6 + 90.0), radians(90.0));
        assert_eq!(radians(-30.0), (-30f64).to_radians() as f32);
        for angle in [1e300, -1e300, f64::MAX] {
            let part = CameraPart { blade_rotation: angle, blades: 6, lens_radius: Some(0.1), ..good() };
            assert!(part.components().is_ok() && radians(angle).abs() <= std::f32::consts::TAU);
        }
        assert!(CameraPart { blade_rotation: f64::INFINITY, ..good() }.components().is_err());
    }

    #[test]
    fn what_a_part_gives_passes_the_checks_of_its_components() {
        assert!(CameraPart { lens_radius: Some(1e7), ..good() }.components().is_err());
        let lenses = [None, Some(0.0), Some(0.3), Some(1e6)];
        for (lens_radius, vfov) in lenses.into_iter().flat_map(|lens| [1e-6, 0.1, 40.0, 179.99].map(|v| (lens, v))) {
            let (view, projection, lens) = CameraPart { lens_radius, vfov, ..good() }.components().unwrap();
            assert_eq!((view.check(), projection.check(), lens.check()), (Ok(()), Ok(()), Ok(())));
        }
    }
}
