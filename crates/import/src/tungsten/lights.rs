//! Lights: radiance of primitives, points, and what is infinitely far away.

use crate::tungsten::converter::{Converter, Reads};
use crate::tungsten::fields::Fields;
use firstlight_format::bounds;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::sources::{EnvironmentSource, TextureSource};
use firstlight_format::value::{ColorValue, Rgb};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

impl Converter<'_> {
    /// What a primitive emits; `None` if it is no light.
    ///
    /// - `per_power`: radiance of a power of 1.
    pub(crate) fn radiance(&mut self, of: &Fields, per_power: f64) -> Option<ColorValue> {
        let name = ["power", "emission"].into_iter().find(|name| of.get(name).is_some())?;
        let color = self.color(of, name, 0.0, Reads::Light);
        let color = if name == "power" { self.scaled(&color, per_power as f32) } else { color };
        (color != ColorValue::grey(0.0)).then_some(color)
    }

    /// Likewise, of something that has no texture of ours.
    fn constant_radiance(&mut self, of: &Fields, per_power: f64) -> Vec3 {
        match self.radiance(of, per_power) {
            None => Vec3::ZERO,
            Some(ColorValue::Rgb(rgb)) => rgb,
            Some(ColorValue::Texture(_)) => {
                of.tell("an image is not modelled here: the light is white");
                Vec3::ONE
            }
        }
    }

    pub(crate) fn point(&mut self, of: &Fields, world: &DAffine3) {
        if !(world.translation.abs().max_element() <= bounds::MAX_COORDINATE) {
            of.tell("it is too far away, and is left out");
            return;
        }
        let intensity = Rgb(self.constant_radiance(of, 1.0 / (4.0 * PI)));
        let (name, position) = (Some(of.name().to_owned()), world.translation);
        self.file.lights.push(LightPart::Point { name, hidden: false, position, intensity, radius: 0.0 });
    }

    fn set_environment(&mut self, of: &Fields, environment: EnvironmentSource) {
        if self.file.environment != EnvironmentSource::Black {
            of.tell("a second environment is not modelled: it takes the place of the one before it");
        }
        self.file.environment = environment;
    }

    pub(crate) fn environment(&mut self, of: &Fields, world: &DAffine3) {
        let environment = match self.radiance(of, 1.0 / (4.0 * PI)) {
            None => return,
            Some(ColorValue::Rgb(rgb)) => EnvironmentSource::Constant(Rgb(rgb)),
            Some(ColorValue::Texture(name)) => match self.file.textures.0.shift_remove(&name) {
                Some(TextureSource::Image { file, tint, .. }) => {
                    // The centre of its image is at +X, that of ours at −Z.
                    let local = DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X);
                    let turned = DMat3::from_cols_array_2d(
                        &[0, 1, 2].map(|i| world.matrix3.col(i).try_normalize().unwrap_or(DVec3::AXES[i]).into()),
                    );
                    let rows = (local * turned.transpose()).transpose().to_cols_array_2d();
                    let mut image = EnvironmentSource::image(file);
                    if let EnvironmentSource::Image { scale, axes, .. } = &mut image {
                        (*scale, *axes) = (tint, Some(rows));
                    }
                    image
                }
                _ => {
                    of.tell("only images are modelled as environments: it is grey");
                    EnvironmentSource::Constant(Rgb(Vec3::splat(0.5)))
                }
            },
        };
        self.set_environment(of, environment);
    }

    pub(crate) fn sky(&mut self, of: &Fields, world: &DAffine3) {
        let to_sun = world.matrix3.y_axis.try_normalize().unwrap_or(DVec3::Y);
        let kelvin = of.number("temperature").unwrap_or(USUAL_TEMPERATURE);
        if kelvin != USUAL_TEMPERATURE {
            of.tell("a sky of another sun (`temperature`) is not modelled: it has the colours of ours");
        }
        of.tell("a skydome is shown as our clear sky: its colours and brightness differ by up to 30 %");
        let turbidity = of.number("turbidity").unwrap_or(3.0).clamp(1.0, 10.0);
        let brightness = of.number("intensity").unwrap_or(2.0).clamp(0.0, 1e6);
        let sky = EnvironmentSource::Sky {
            elevation: to_sun.y.clamp(0.0, 1.0).asin().to_degrees(),
            azimuth: to_sun.x.atan2(-to_sun.z).to_degrees(),
            turbidity,
            ground: Rgb(Vec3::splat(0.2)),
            sun: 0.0,
            sky: 1.0,
            sun_size: 0.5358,
            below: false,
            scale: Rgb(Vec3::splat(brightness as f32)),
        };
        self.set_environment(of, sky);
    }

    /// A disc of directions.
    pub(crate) fn sun(&mut self, of: &Fields, world: &DAffine3) {
        let cos = of.number("cap_angle").unwrap_or(10.0).clamp(0.0, 180.0).to_radians().cos();
        let dome = of.text("skydome").and_then(|name| self.domes.get(name));
        let to_light = dome.unwrap_or(&world.matrix3).y_axis;
        let Some(to_light) = to_light.try_normalize() else { return };
        of.tell("the size of a light of the sky is not modelled: its shadows are sharp");
        // Of a disc that is faced: the integral of the cosine over it.
        let irradiance = self.constant_radiance(of, 1.0 / (TAU * (1.0 - cos).max(1e-12)));
        let irradiance = Rgb(irradiance * (PI * (1.0 - cos * cos)) as f32);
        let (name, transform) = (Some(of.name().to_owned()), TransformPart::default());
        self.file.lights.push(LightPart::Directional {
            name,
            hidden: false,
            direction: -to_light,
            irradiance,
            transform,
        });
    }
}

/// Of the sun of a sky, kelvin.
const USUAL_TEMPERATURE: f64 = 5777.0;
