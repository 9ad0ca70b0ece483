//! Limits of cameras, films and settings. Each limit is defined once, here, and checked for every source of values:
//! scene files, the metadata of images and films, recordings, settings, the command line, and the library interface.
//!
//! Start reading at [`CameraPart::components`], [`FilmSize::try_new`] and [`BadValue`].

use crate::format::bad_value::BadValue;
use crate::format::camera::CameraPart;
use crate::format::camera::camera;
use crate::format::film_size::FilmSize;
use crate::format::parts::{DisplayPart, SceneFile};
use crate::format::units::{LEAST_SINE, lens_radius_of};
use crate::format::view::{Lens, Projection, View, unit_direction};
use crate::render::{Film, RenderSettings};
use glam::{DVec3, Vec3};

/// Degrees. Below this, all camera rays of an image are equal in `f32`.
pub const LEAST_VFOV_DEG: f64 = 1e-6;

/// Tolerance for the length of an axis and for the cosine between two axes. Camera moves are exact to rounding.
const AXIS_SLACK: f64 = 1e-3;

/// Metres. At this distance from the axis, `f32` resolves 6 cm, and the error of such rays is larger still: they would
/// have to be tested against whole meshes.
const MOST_LENS_RADIUS: f64 = 1e6;

/// Stops of exposure, up or down. Beyond this, every image is black or white.
pub const MOST_STOPS: f32 = 64.0;

/// Limit of all times of an animation, seconds: twelve days.
pub(crate) const MOST_SECONDS: f64 = 1e6;

/// Maximum number of keys of an animation.
pub(crate) const MOST_KEYS: usize = 1_000_000;

/// A number for a message: very large and very small ones in scientific notation.
pub(crate) fn number(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-5..1e9).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// A vector for a message.
pub(crate) fn triple(DVec3 { x, y, z }: DVec3) -> String {
    format!("({}, {}, {})", number(x), number(y), number(z))
}

pub(crate) fn is_coordinate(point: DVec3) -> bool {
    point.abs().max_element() <= SceneFile::MAX_COORDINATE && point.is_finite()
}

pub(crate) fn is_size(size: f64) -> bool {
    (SceneFile::MIN_SIZE..=SceneFile::MAX_COORDINATE).contains(&size)
}

/// The rule for points, as the end of a sentence that begins with "must".
pub(crate) fn coordinate_rule() -> String {
    format!("be finite and within {:e} m of the origin", SceneFile::MAX_COORDINATE)
}

/// The rule for sizes, as the end of a sentence that begins with "must".
pub(crate) fn size_rule() -> String {
    format!("lie between {:e} and {:e} m", SceneFile::MIN_SIZE, SceneFile::MAX_COORDINATE)
}

fn check_point(field: &'static str, point: DVec3) -> Result<(), BadValue> {
    let good = is_coordinate(point);
    if good { Ok(()) } else { Err(BadValue::out_of_range(field, triple(point), coordinate_rule())) }
}

fn check_size(field: &'static str, size: f64) -> Result<(), BadValue> {
    if is_size(size) { Ok(()) } else { Err(BadValue::out_of_range(field, number(size), size_rule())) }
}

/// Checks a radiance, intensity, irradiance or absorption: finite and not negative.
pub(crate) fn check_light(field: &'static str, light: Vec3) -> Result<(), BadValue> {
    if light.is_finite() && light.cmpge(Vec3::ZERO).all() {
        return Ok(());
    }
    let Vec3 { x, y, z } = light;
    Err(BadValue::out_of_range(field, format!("({x}, {y}, {z})"), "be finite and not negative"))
}

/// Checks the radius of a point light; metres.
pub(crate) fn check_light_radius(radius: f64) -> Result<(), BadValue> {
    if radius == 0.0 || is_size(radius) {
        return Ok(());
    }
    Err(BadValue::out_of_range("radius", number(radius), format!("be 0 or {}", size_rule())))
}

/// Checks the cone of a spot light; degrees from its axis.
pub(crate) fn check_cone(inner_deg: f64, outer_deg: f64) -> Result<(), BadValue> {
    if !(outer_deg > 0.0 && outer_deg <= 90.0) {
        return Err(BadValue::out_of_range("outer_angle", number(outer_deg), "lie above 0 and at most at 90 degrees"));
    }
    if !(inner_deg >= 0.0 && inner_deg <= outer_deg) {
        let rule = format!("lie between 0 and `outer_angle`, which is {} degrees", number(outer_deg));
        return Err(BadValue::out_of_range("inner_angle", number(inner_deg), rule));
    }
    Ok(())
}

/// Checks a time of an animation; seconds.
pub(crate) fn check_moment(field: &'static str, seconds: f64) -> Result<(), BadValue> {
    if (0.0..=MOST_SECONDS).contains(&seconds) {
        return Ok(());
    }
    let rule = format!("lie between 0 and {MOST_SECONDS:e} s");
    Err(BadValue::out_of_range(field, number(seconds), rule))
}

/// Checks a duration of an animation; seconds.
pub(crate) fn check_span(field: &'static str, seconds: f64) -> Result<(), BadValue> {
    if seconds > 0.0 && seconds <= MOST_SECONDS {
        return Ok(());
    }
    let rule = format!("lie above 0 and at most at {MOST_SECONDS:e} s");
    Err(BadValue::out_of_range(field, number(seconds), rule))
}

/// Whether there may be so many frames per second.
///
/// # Errors
/// If it is out of range.
pub fn check_fps(fps: f64) -> Result<(), BadValue> {
    let good = (1e-3..=1e4).contains(&fps);
    if good { Ok(()) } else { Err(BadValue::out_of_range("fps", number(fps), "lie between 0.001 and 10000")) }
}

/// Checks an exposure time as a fraction of the frame duration.
pub(crate) fn check_shutter_share(share: f64) -> Result<(), BadValue> {
    if (0.0..=1.0).contains(&share) {
        return Ok(());
    }
    let rule = "lie between 0 and 1: it is a share of the time of a frame (`shutter_seconds` is in seconds)";
    Err(BadValue::out_of_range("shutter", number(share), rule))
}

/// Checks an exposure time; seconds.
pub(crate) fn check_shutter_seconds(seconds: f64) -> Result<(), BadValue> {
    if (0.0..=3600.0).contains(&seconds) {
        return Ok(());
    }
    Err(BadValue::out_of_range("shutter_seconds", number(seconds), "lie between 0 and 3600 s"))
}

/// The unit vector along `vector`, which may have any finite length but 0.
fn check_direction(field: &'static str, vector: DVec3) -> Result<DVec3, BadValue> {
    let unit = unit_direction(vector);
    unit.ok_or_else(|| BadValue::out_of_range(field, triple(vector), "be finite and have a length"))
}

fn check_not_parallel(view: DVec3, up: DVec3) -> Result<(), BadValue> {
    if view.cross(up).length() >= LEAST_SINE {
        return Ok(());
    }
    // What is across most views that go up or down, and up in all others.
    let other = if view.y.abs() > 0.5 { "(0, 0, -1)" } else { "(0, 1, 0)" };
    let message =
        format!("`up` is parallel to the view direction (within {LEAST_SINE:e} rad): set it, such as `up: {other}`");
    Err(BadValue::unfit("up", message))
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
                if offset.is_finite() && !offset.abs().cmpge(DVec3::splat(SceneFile::MIN_SIZE)).any() {
                    let problem = "`eye` and `look_at` are the same point: move one of them";
                    note(Err(BadValue::unfit("look_at", problem)));
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
    if distance >= SceneFile::MIN_SIZE {
        return Ok(());
    }
    let rule = format!("be positive, at least {:e} m; inf is allowed", SceneFile::MIN_SIZE);
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

impl DisplayPart {
    /// # Errors
    /// If the exposure is out of range.
    pub fn check(&self) -> Result<(), BadValue> {
        check_stops(self.exposure)
    }
}

/// Checks an exposure; stops (factors of two).
///
/// # Errors
/// If it is out of range.
pub fn check_stops(stops: f32) -> Result<(), BadValue> {
    if stops.abs() <= MOST_STOPS {
        return Ok(());
    }
    let rule = format!("be a finite number of stops, from -{MOST_STOPS} to {MOST_STOPS}");
    Err(BadValue::out_of_range("exposure", stops, rule))
}

/// Checks the maximum length of paths, in segments; `None`: unlimited.
///
/// # Errors
/// If it is 0.
pub fn check_max_depth(max_depth: Option<u32>) -> Result<(), BadValue> {
    let settings = RenderSettings { max_depth: max_depth.unwrap_or(u32::MAX), ..RenderSettings::default() };
    settings.check().map_err(|error| BadValue::unfit("max_depth", error.to_string()))
}

impl FilmSize {
    /// # Errors
    /// If it has no pixels, or more than a film may have.
    pub fn try_new(width: u32, height: u32) -> Result<Self, BadValue> {
        let pixels = u64::from(width) * u64::from(height);
        if width == 0 || height == 0 {
            let problem = format!("a film of {width} x {height} has no pixels: width and height must be at least 1");
            return Err(BadValue::unfit("film", problem));
        }
        let most = SceneFile::MAX_FILM_SIDE;
        if width > most || height > most || pixels > SceneFile::MAX_FILM_PIXELS {
            let gib = pixels as f64 * Film::BYTES_A_PIXEL as f64 / f64::from(1 << 30);
            let problem = format!(
                "a film of {width} x {height} needs {gib:.1} GiB: use at most {} pixels in total and {most} per side",
                SceneFile::MAX_FILM_PIXELS
            );
            return Err(BadValue::unfit("film", problem));
        }
        Ok(Self { width, height })
    }
}

/// Checks the size of a film; pixels.
///
/// # Errors
/// If it is out of range.
pub fn check_film_size(width: u32, height: u32) -> Result<(), BadValue> {
    FilmSize::try_new(width, height).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::units::radians;

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
