//! Emitters that are no shapes: environment, points, spots, directions.

use crate::mitsuba::converter::{Converter, Reads};
use crate::mitsuba::graph::Node;
use crate::mitsuba::read::find_file;
use crate::mitsuba::spectrum::Use;
use crate::model::projection::{projection, stretched};
use firstlight_files::printable;
use firstlight_format::error::SceneError;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::sources::{EnvironmentLayout, EnvironmentSource};
use firstlight_format::value::{ColorValue, Rgb};
use firstlight_render::Falloff;
use glam::{DMat3, DMat4, DVec3, Vec3};
use std::f32::consts::PI;

impl Converter<'_> {
    /// Adds an emitter to the scene.
    pub(crate) fn emitter(&mut self, node: Node) -> Result<(), SceneError> {
        // Without a shape it is a definition that shapes refer to.
        if node.plugin() == "area" {
            return Ok(());
        }
        node.ignore(&["sampling_weight"]);
        if matches!(node.plugin(), "constant" | "envmap" | "sunsky" | "sky" | "sun") {
            if self.has_environment {
                self.tell(node, "a second environment is not modelled: it takes the place of the one before it");
            }
            self.has_environment = true;
        }
        let name = Some(self.names.free(node.called()));
        match node.plugin() {
            "constant" => {
                let radiance = self.constant_color(node, "radiance", 1.0, Use::Emission)?;
                self.file.environment = EnvironmentSource::Constant(Rgb(radiance));
            }
            "envmap" => self.environment_image(node)?,
            "sunsky" | "sky" | "sun" => self.clear_sky(node)?,
            "point" => {
                let matrix = self.world * node.transform("to_world")?;
                let position = match node.vector("position")? {
                    Some(position) => self.world.transform_point3(position),
                    None => matrix.transform_point3(DVec3::ZERO),
                };
                let intensity = Rgb(self.constant_color(node, "intensity", 1.0, Use::Emission)?);
                self.file.lights.push(LightPart::Point { name, hidden: false, position, intensity, radius: 0.0 });
            }
            "spot" => {
                let matrix = self.world * node.transform("to_world")?;
                let outer = node.float_or("cutoff_angle", 20.0)?;
                let inner = node.float_or("beam_width", 0.75 * outer)?;
                let direction = matrix.transform_vector3(DVec3::Z);
                if !(outer > 0.0 && inner >= 0.0) || direction.try_normalize().is_none() {
                    return Err(node.error("a spot light needs a direction, and a cutoff_angle above 0"));
                }
                let mut intensity = self.constant_color(node, "intensity", 1.0, Use::Emission)?;
                // Its u increases along X, to the left, and its v along Y.
                let reads = if is_mirrored(&matrix) { Reads::Color } else { Reads::Mirrored };
                let texture = match node.child("texture")? {
                    Some(texture) => self.texture(texture, Use::Factor, reads)?,
                    None => ColorValue::grey(1.0),
                };
                let texture = match texture {
                    ColorValue::Rgb(rgb) => {
                        intensity *= rgb;
                        None
                    }
                    ColorValue::Texture(texture) => Some(texture),
                };
                let (position, transform) = (matrix.transform_point3(DVec3::ZERO), TransformPart::default());
                let outer_angle = outer.clamp(1e-3, 90.0);
                let inner_angle = inner.clamp(0.0, outer_angle);
                self.file.lights.push(LightPart::Spot {
                    name,
                    hidden: false,
                    position,
                    direction,
                    intensity: Rgb(intensity),
                    inner_angle,
                    outer_angle,
                    falloff: Falloff::Linear,
                    texture,
                    up: up_of(&matrix),
                    image_width: 0.0,
                    image_height: 0.0,
                    even: false,
                    transform,
                });
            }
            "projector" => self.projector(node, name)?,
            "directional" => {
                let matrix = self.world * node.transform("to_world")?;
                let direction = match node.vector("direction")? {
                    Some(direction) => self.world.transform_vector3(direction),
                    None => matrix.transform_vector3(DVec3::Z),
                };
                if direction.try_normalize().is_none() {
                    return Err(node.error("a directional light needs a direction"));
                }
                let irradiance = Rgb(self.constant_color(node, "irradiance", 1.0, Use::Emission)?);
                let transform = TransformPart::default();
                self.file.lights.push(LightPart::Directional { name, hidden: false, direction, irradiance, transform });
            }
            plugin => {
                let plugin = printable::name(plugin).into_owned();
                self.tell(node, &format!("emitters of type {plugin} are not modelled: this light is left out"));
                node.skip();
            }
        }
        Ok(())
    }

    fn projector(&mut self, node: Node, name: Option<String>) -> Result<(), SceneError> {
        let matrix = self.world * node.transform("to_world")?;
        let direction = matrix.transform_vector3(DVec3::Z);
        if direction.try_normalize().is_none() {
            return Err(node.error("a projector needs a direction"));
        }
        // Its u increases against X, to the right, and its v against Y.
        let reads = if is_mirrored(&matrix) { Reads::Turned } else { Reads::UpsideDown };
        let irradiance = match (node.value("irradiance"), node.child("irradiance")?) {
            (None, Some(texture)) => self.texture(texture, Use::Emission, reads)?,
            _ => ColorValue::Rgb(self.constant_color(node, "irradiance", 1.0, Use::Emission)?),
        };
        let scale = PI * node.float_or("scale", 1.0)?.max(0.0) as f32;
        let (intensity, texture, aspect) = match irradiance {
            ColorValue::Rgb(rgb) => (rgb * scale, None, 1.0),
            ColorValue::Texture(texture) => {
                let source = self.file.textures.get(&texture);
                let image = source.and_then(|source| self.light_images.of(self.folder, source));
                (Vec3::splat(scale), Some(texture), image.map_or(1.0, |image| image.aspect))
            }
        };
        let half = (0.5 * self.horizontal_field(node, aspect)?.to_radians()).tan();
        let mut light = projection(stretched(&DMat3::from_mat4(matrix), [half, half / aspect]));
        if let LightPart::Spot {
            name: a, position: b, direction: c, intensity: d, texture: e, up: f, even: g, ..
        } = &mut light
        {
            (*a, *b, *c, *d) = (name, matrix.transform_point3(DVec3::ZERO), direction, Rgb(intensity));
            (*e, *f, *g) = (texture, up_of(&matrix), true);
        }
        self.file.lights.push(light);
        Ok(())
    }

    fn environment_image(&mut self, node: Node) -> Result<(), SceneError> {
        let name = node.text("filename")?.ok_or_else(|| node.error("an envmap needs a `filename`"))?;
        node.ignore(&["to_world", "mis_compensation", "gamma", "cache"]);
        let scale = node.float_or("scale", 1.0)?.max(0.0) as f32;
        match find_file(&self.references, &self.graph.folders, name) {
            Ok(path) => {
                // Its centre is at +Z; ours at −Z.
                let mut image = EnvironmentSource::image(self.file_path(&path));
                if let EnvironmentSource::Image { scale: factor, rotate, layout, axes, .. } = &mut image {
                    (*factor, *rotate, *layout) = (Rgb(Vec3::splat(scale)), 180.0, EnvironmentLayout::Interpolated);
                    // Our world has its axes, up to a reflection.
                    if is_mirrored(&node.transform("to_world")?) != is_mirrored(&self.world) {
                        *axes = Some([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
                    }
                }
                self.file.environment = image;
            }
            Err(why) => {
                self.tell(node, &format!("{why}; the environment is grey"));
                self.file.environment = EnvironmentSource::Constant(Rgb(Vec3::splat(0.5 * scale)));
            }
        }
        Ok(())
    }
}

fn is_mirrored(matrix: &DMat4) -> bool {
    matrix.determinant() < 0.0
}

/// The direction of +Y; any if it has no length.
fn up_of(matrix: &DMat4) -> DVec3 {
    matrix.transform_vector3(DVec3::Y).try_normalize().unwrap_or(DVec3::Y)
}
