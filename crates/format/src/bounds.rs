//! Limits of films, lights and settings; those of cameras are in [`crate::camera`]. Each limit is defined once and checked
//! for every source of values: scene files, the metadata of images and films, recordings, settings, the command line, and
//! the library interface.
//!
//! Start reading at [`FilmSize::try_new`] and [`BadValue`].

use crate::bad_value::BadValue;
use crate::film_size::FilmSize;
use crate::numbers::{short, short_color};
use firstlight_render::{Film, RenderSettings};
use glam::{DVec3, Vec3};

/// Maximum number of spheres of one grid.
pub const MAX_GRID_BALLS: u64 = 4_000_000;

/// Maximum number of spheres in all grids together.
pub const MAX_BALLS: u64 = 4 * MAX_GRID_BALLS;

/// Maximum number of objects: one takes about 2,000 bytes to read, and 4,500 to render.
pub const MAX_OBJECTS: usize = 4_000_000;

/// Maximum number of ratios to which one mesh is simplified.
pub const MAX_RATIOS: usize = 256;
/// Maximum number of pixels along one side of a film.
pub const MAX_FILM_SIDE: u32 = 65_536;
/// Maximum number of pixels of a film: it takes 88 bytes per pixel, 22 GiB in all.
pub const MAX_FILM_PIXELS: u64 = 1 << 28;
/// Largest coordinate in metres: beyond it, squared distances leave the range of `f32`.
pub const MAX_COORDINATE: f64 = 1e12;
/// Smallest size in metres: below it, squared sizes leave the range of `f32`.
pub const MIN_SIZE: f64 = 1e-12;

/// Stops of exposure, up or down. Beyond this, every image is black or white.
pub const MOST_STOPS: f32 = 64.0;

/// Limit of all times of an animation, seconds: twelve days.
pub const MOST_SECONDS: f64 = 1e6;

/// Maximum number of keys of an animation.
pub(crate) const MOST_KEYS: usize = 1_000_000;

/// A number for a message: very large and very small ones in scientific notation.
pub fn number(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-5..1e9).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// A vector for a message.
pub(crate) fn triple(DVec3 { x, y, z }: DVec3) -> String {
    format!("({}, {}, {})", number(x), number(y), number(z))
}

pub(crate) fn is_coordinate(point: DVec3) -> bool {
    point.abs().max_element() <= MAX_COORDINATE && point.is_finite()
}

pub(crate) fn is_size(size: f64) -> bool {
    (MIN_SIZE..=MAX_COORDINATE).contains(&size)
}

/// The rule for points, as the end of a sentence that begins with "must".
pub(crate) fn coordinate_rule() -> String {
    format!("be finite and within {:e} m of the origin", MAX_COORDINATE)
}

/// The rule for sizes, as the end of a sentence that begins with "must".
pub(crate) fn size_rule() -> String {
    format!("lie between {:e} and {:e} m", MIN_SIZE, MAX_COORDINATE)
}

pub(crate) fn check_point(field: &'static str, point: DVec3) -> Result<(), BadValue> {
    let good = is_coordinate(point);
    if good { Ok(()) } else { Err(BadValue::out_of_range(field, triple(point), coordinate_rule())) }
}

/// Checks a length, metres.
///
/// # Errors
/// If it is outside of what can be rendered.
pub fn check_size(field: &'static str, size: f64) -> Result<(), BadValue> {
    if is_size(size) { Ok(()) } else { Err(BadValue::out_of_range(field, number(size), size_rule())) }
}

/// Checks a radiance, intensity, irradiance or absorption: finite and not negative.
pub(crate) fn check_light(field: &'static str, light: Vec3) -> Result<(), BadValue> {
    if light.is_finite() && light.cmpge(Vec3::ZERO).all() {
        return Ok(());
    }
    Err(BadValue::out_of_range(field, triple(short_color(light)), "be finite and not negative"))
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

/// Checks an angle that the image of a light fills; degrees, 0 if it follows from others.
pub(crate) fn check_image_angle(field: &'static str, degrees: f64) -> Result<(), BadValue> {
    if degrees == 0.0 || (1e-6..180.0).contains(&degrees) {
        return Ok(());
    }
    Err(BadValue::out_of_range(field, number(degrees), "be 0, or lie between 0.000001 and 180 degrees (180 excluded)"))
}

/// Checks a time of an animation; seconds.
pub fn check_moment(field: &'static str, seconds: f64) -> Result<(), BadValue> {
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
pub fn check_shutter_share(share: f64) -> Result<(), BadValue> {
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

/// Checks an exposure; stops (factors of two).
///
/// # Errors
/// If it is out of range.
pub fn check_stops(stops: f32) -> Result<(), BadValue> {
    if stops.abs() <= MOST_STOPS {
        return Ok(());
    }
    let rule = format!("be a finite number of stops, from -{MOST_STOPS} to {MOST_STOPS}");
    Err(BadValue::out_of_range("exposure", number(short(stops)), rule))
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
        let most = MAX_FILM_SIDE;
        if width > most || height > most || pixels > MAX_FILM_PIXELS {
            let gib = pixels as f64 * Film::BYTES_A_PIXEL as f64 / f64::from(1 << 30);
            let problem = format!(
                "a film of {width} x {height} needs {gib:.1} GiB: use at most {} pixels in total and {most} per side",
                MAX_FILM_PIXELS
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
