//! The lights of pbrt that are no shapes.

use crate::model::projection::{LightImage, projection, stretched};
use crate::pbrt::params::{Param, Params, Values};
use crate::pbrt::spectrum::{Spectrum, UnknownSpectrum, peak_luminance};
use firstlight_files::printable;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::sources::{EnvironmentLayout, EnvironmentSource, TextureSource};
use firstlight_format::value::Rgb;
use firstlight_render::Falloff;
use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// What a light becomes.
pub(crate) enum Light {
    Part(LightPart),
    /// With the texture that it projects, whose name it lacks.
    Projector(LightPart, TextureSource),
    Environment(EnvironmentSource),
    Nothing,
}

/// The colour of a light by a parameter, white if there is none.
pub(crate) fn color(params: &Params, name: &str, tell: &mut impl FnMut(String)) -> DVec3 {
    let color = params.spectrum(name).map_or(Ok(DVec3::ONE), |spectrum| spectrum.light());
    // Version 3: a temperature, and the factor of a spectrum whose peak is 1.
    let strength = match params.find(name) {
        Some(Param { kind, values: Values::Numbers(numbers), .. }) if kind == "blackbody" => match numbers[..] {
            [kelvins, factor] => factor * peak_luminance(kelvins),
            _ => 1.0,
        },
        _ => 1.0,
    };
    strength
        * color.unwrap_or_else(|UnknownSpectrum(name)| {
            tell(format!("the spectrum `{}` is not known: white light is used", printable::name(&name)));
            DVec3::ONE
        })
}

/// A factor of a light, which version 3 has as a colour.
pub(super) fn factor(params: &Params, name: &str) -> DVec3 {
    match params.find(name).map(|param| param.kind.as_str()) {
        None | Some("float") => DVec3::splat(params.number(name).unwrap_or(1.0)),
        Some(_) => match params.spectrum(name) {
            Some(Spectrum::Rgb(rgb)) => rgb,
            Some(other) => other.light().unwrap_or(DVec3::ONE),
            None => DVec3::ONE,
        },
    }
}

fn rgb(color: DVec3) -> Rgb {
    // What leaves the range of single precision is no light.
    let color = color.as_vec3();
    Rgb(if color.is_finite() { color.max(glam::Vec3::ZERO) } else { glam::Vec3::ZERO })
}

/// A light.
///
/// - `world`: from its space to our world; `image_of`: the image of a texture.
/// - `file`: the path of an image in the scene file for its name in pbrt's, `None` if it must not be read.
/// - `tell`: called with what is not shown.
pub(crate) fn light(
    kind: &str,
    params: &Params,
    world: &DAffine3,
    name: String,
    image_of: impl Fn(&TextureSource) -> Option<Arc<LightImage>>,
    file: impl Fn(&str) -> Option<String>,
    tell: &mut impl FnMut(String),
) -> Light {
    let scale = factor(params, "scale");
    let positive = |name: &str| params.number(name).filter(|value| *value > 0.0);
    let from = params.point("from").unwrap_or(DVec3::ZERO);
    let towards = params.point("to").unwrap_or(DVec3::Z) - from;
    let direction = world.transform_vector3(towards).try_normalize();
    let (name, transform) = (Some(name), TransformPart::default());
    match kind {
        "point" => {
            let power = positive("power").map_or(1.0, |power| power / (4.0 * PI));
            let intensity = rgb(scale * power * color(params, "I", tell));
            Light::Part(LightPart::Point {
                name,
                hidden: false,
                position: world.transform_point3(from),
                intensity,
                radius: 0.0,
            })
        }
        "spot" => {
            let outer = params.number("coneangle").unwrap_or(30.0).clamp(0.01, 90.0);
            let inner = (outer - params.number("conedeltaangle").unwrap_or(5.0)).clamp(0.0, outer);
            let [cos_outer, cos_inner] = [outer, inner].map(|angle| angle.to_radians().cos());
            let cone = 2.0 * PI * (1.0 - cos_inner + 0.5 * (cos_inner - cos_outer));
            let power = positive("power").map_or(1.0, |power| power / cone);
            let intensity = rgb(scale * power * color(params, "I", tell));
            let Some(direction) = direction else { return nowhere(tell) };
            Light::Part(LightPart::Spot {
                name,
                hidden: false,
                position: world.transform_point3(from),
                direction,
                intensity,
                inner_angle: inner,
                outer_angle: outer,
                falloff: Falloff::Smooth,
                texture: None,
                up: DVec3::Y,
                image_width: 0.0,
                image_height: 0.0,
                even: false,
                transform,
            })
        }
        "distant" => {
            let Some(direction) = direction else { return nowhere(tell) };
            let illuminance = positive("illuminance").unwrap_or(1.0);
            let irradiance = rgb(scale * illuminance * color(params, "L", tell));
            Light::Part(LightPart::Directional { name, hidden: false, direction, irradiance, transform })
        }
        "infinite" => {
            if params.has("portal") {
                tell("portals of environments are ignored: the image is the same, with more noise".to_owned());
            }
            // The latter is that of version 3, which maps it by longitude and latitude.
            let of_version_3 = params.string("mapname");
            let Some(image) = params.string("filename").or(of_version_3) else {
                let illuminance = positive("illuminance").map_or(1.0, |illuminance| illuminance / PI);
                return Light::Environment(EnvironmentSource::Constant(rgb(scale
                    * illuminance
                    * color(params, "L", tell))));
            };
            if params.has("illuminance") {
                tell("`illuminance` of an environment image is ignored".to_owned());
            }
            let Some(file) = file(image) else { return Light::Nothing };
            let light_from_world = world.matrix3.inverse();
            let light_from_world = if light_from_world.is_finite() { light_from_world } else { DMat3::IDENTITY };
            let (layout, image_from_light) = match of_version_3 {
                None => (EnvironmentLayout::EqualArea, DMat3::IDENTITY),
                // The pole there is +Z, and u grows from +X to +Y; ours is +Y, with −Z in the middle.
                Some(_) => {
                    let image_from_light = DMat3::from_cols(DVec3::Z, DVec3::NEG_X, DVec3::Y);
                    (EnvironmentLayout::Equirectangular, image_from_light)
                }
            };
            let scale = if of_version_3.is_some() { scale * color(params, "L", tell) } else { scale };
            let rows = (image_from_light * light_from_world).transpose();
            Light::Environment(EnvironmentSource::Image {
                file,
                scale: rgb(scale),
                rotate: 0.0,
                layout,
                axes: Some([rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.to_array())),
            })
        }
        "projection" => {
            let Some(direction) = world.transform_vector3(DVec3::Z).try_normalize() else { return nowhere(tell) };
            let Some(file) = params.string("filename").or(params.string("mapname")).and_then(file) else {
                tell("a `projection` light without an image is left out".to_owned());
                return Light::Nothing;
            };
            let mut source = TextureSource::image(file);
            if let TextureSource::Image { stretch, offset, smooth, .. } = &mut source {
                *smooth = false;
                // Its u increases along X, which is to the left in a right-handed frame.
                if world.matrix3.determinant() > 0.0 {
                    (*stretch, *offset) = (DVec2::new(-1.0, 1.0), DVec2::X);
                }
            }
            let image = image_of(&source);
            let aspect = image.as_ref().map_or(1.0, |image| image.aspect);
            // The field of view is that of the shorter side.
            let half = (0.5 * params.number("fov").unwrap_or(90.0).to_radians()).tan().clamp(1e-6, 1e6);
            let tangents = if aspect > 1.0 { [half * aspect, half] } else { [half, half / aspect] };
            let tangents = stretched(&world.matrix3, tangents);
            let power = positive("power").map_or(1.0, |power| power / image.map_or(1.0, |image| image.flux(tangents)));
            let mut light = projection(tangents);
            if let LightPart::Spot { name: a, position: b, direction: c, intensity: d, up: e, .. } = &mut light {
                let up = world.transform_vector3(DVec3::Y).try_normalize().unwrap_or(DVec3::Y);
                (*a, *b, *c) = (name, world.transform_point3(DVec3::ZERO), direction);
                (*d, *e) = (rgb(scale * power), up);
            }
            Light::Projector(light, source)
        }
        other => {
            tell(format!("lights of the kind `{}` are not modelled", printable::name(other)));
            Light::Nothing
        }
    }
}

fn nowhere(tell: &mut impl FnMut(String)) -> Light {
    tell("a light without a direction is left out".to_owned());
    Light::Nothing
}
