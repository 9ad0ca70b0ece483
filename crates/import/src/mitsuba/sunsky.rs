//! The sun and the sky of Mitsuba: a clear sky.

use crate::mitsuba::converter::Converter;
use crate::mitsuba::graph::Node;
use crate::mitsuba::spectrum::Use;
use firstlight_format::error::SceneError;
use firstlight_format::sources::EnvironmentSource;
use firstlight_format::value::Rgb;
use glam::{DMat4, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Plugins that are a clear sky; the last two are of version 0.x.
pub(crate) const SKIES: [&str; 3] = ["sunsky", "sky", "sun"];

/// Whether the zenith of a sky is at +Y, as in version 0.x, and not at +Z.
fn is_y_up(sky: Node) -> bool {
    sky.object().is_old || sky.plugin() != "sunsky"
}

impl Converter<'_> {
    pub(crate) fn clear_sky(&mut self, node: Node) -> Result<(), SceneError> {
        node.ignore(&["complex_sun", "stretch", "resolution"]);
        let to_world = node.transform("to_world")?;
        let direction = match node.vector("sun_direction")? {
            Some(direction) => direction,
            None => {
                let at = sun_at(node)?;
                // There, the north is at -Z.
                to_world.transform_vector3(if is_y_up(node) { DVec3::new(-at.y, at.z, at.x) } else { at })
            }
        };
        let to_sun = self.world.transform_vector3(direction).try_normalize();
        let to_sun = to_sun.ok_or_else(|| node.error("`sun_direction` needs a length"))?;
        let factor = |name: &str| Ok::<_, SceneError>(node.float_or(name, 1.0)?.clamp(0.0, 1e6));
        let (mut sun, mut sky, scale) = (factor("sun_scale")?, factor("sky_scale")?, factor("scale")?);
        match node.plugin() {
            "sky" => sun = 0.0,
            "sun" => sky = 0.0,
            _ => {}
        }
        let elevation = to_sun.y.clamp(-1.0, 1.0).asin().to_degrees();
        if elevation < 0.0 {
            self.tell(node, "the sun is below the horizon: the sky is that of sunrise, without the sun");
            sun = 0.0;
        }
        let wanted = node.float_or("turbidity", 3.0)?;
        let turbidity = wanted.clamp(1.0, 10.0);
        if turbidity != wanted {
            self.tell(node, &format!("a turbidity beyond 1 to 10 is not modelled: it is {turbidity}"));
        }
        let albedo = self.constant_color(node, "albedo", 0.3, Use::Reflectance)?;
        self.file.environment = EnvironmentSource::Sky {
            elevation: elevation.max(0.0),
            azimuth: to_sun.x.atan2(-to_sun.z).to_degrees(),
            turbidity,
            ground: Rgb(albedo),
            sun,
            sky,
            sun_size: node.float_or("sun_aperture", 0.5358)?.clamp(0.1, 20.0),
            below: false,
            scale: Rgb(Vec3::splat(scale as f32)),
        };
        Ok(())
    }
}

/// From directions of the world of a scene to those in which its sky has the zenith at +Y.
pub(crate) fn upright(sky: Node) -> Result<DMat4, SceneError> {
    let pole = if is_y_up(sky) { DVec3::Y } else { DVec3::Z };
    let pole = sky.transform("to_world")?.transform_vector3(pole).try_normalize();
    Ok(pole.map_or(DMat4::IDENTITY, |pole| DMat4::from_quat(glam::DQuat::from_rotation_arc(pole, DVec3::Y))))
}

/// The direction of the sun at a place and a time, with the zenith at +Z and the north at +X.
///
/// Source: Blanco-Muriel et al. 2001, "Computing the solar vector", as Mitsuba has it.
fn sun_at(node: Node) -> Result<DVec3, SceneError> {
    let [latitude, longitude] = [node.float_or("latitude", 35.6894)?, node.float_or("longitude", 139.6917)?];
    let whole = |name: &str, usual: f64| Ok::<_, SceneError>(node.float_or(name, usual)?.clamp(-1e6, 1e6) as i64);
    let (year, month, day) = (whole("year", 2010.0)?, whole("month", 7.0)?, whole("day", 10.0)?);
    let minutes = node.float_or("minute", 0.0)? + node.float_or("second", 0.0)? / 60.0;
    let hours = node.float_or("hour", 15.0)? - node.float_or("timezone", 9.0)? + minutes / 60.0;
    let leap = (month - 14) / 12;
    let julian_day = (1461 * (year + 4800 + leap)) / 4 + (367 * (month - 2 - 12 * leap)) / 12
        - (3 * ((year + 4900 + leap) / 100)) / 4
        + day
        - 32075;
    let days = julian_day as f64 - 0.5 + hours / 24.0 - 2_451_545.0;
    // Ecliptic coordinates.
    let omega = 2.1429 - 0.001_039_459_4 * days;
    let anomaly = 6.240_06 + 0.017_201_969_9 * days;
    let longitude_of_sun =
        4.895_063 + 0.017_202_791_698 * days + 0.033_416_07 * anomaly.sin() + 0.000_348_94 * (2.0 * anomaly).sin()
            - 0.000_113_4
            - 0.000_020_3 * omega.sin();
    let obliquity = 0.409_092_8 - 6.214e-9 * days + 0.000_039_6 * omega.cos();
    // Celestial coordinates.
    let ascension = (obliquity.cos() * longitude_of_sun.sin()).atan2(longitude_of_sun.cos()).rem_euclid(TAU);
    let declination = (obliquity.sin() * longitude_of_sun.sin()).asin();
    // Local coordinates.
    let sidereal = 6.697_424_324_2 + 0.065_709_828_3 * days + hours;
    let hour_angle = (15.0 * sidereal + longitude).to_radians() - ascension;
    let (sin, cos) = latitude.to_radians().sin_cos();
    let zenith = (cos * hour_angle.cos() * declination.cos() + declination.sin() * sin).acos();
    let azimuth = (-hour_angle.sin()).atan2(declination.tan() * cos - sin * hour_angle.cos()) - PI;
    /// Radius of the Earth over its distance from the sun.
    const PARALLAX: f64 = 6371.01 / 149_597_890.0;
    let zenith = zenith + PARALLAX * zenith.sin();
    Ok(DVec3::new(zenith.sin() * azimuth.cos(), zenith.sin() * azimuth.sin(), zenith.cos()))
}
