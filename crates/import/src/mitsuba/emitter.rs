//! Emitters that are no shapes: environment, points, spots, directions.

use crate::mitsuba::converter::Converter;
use crate::mitsuba::graph::Node;
use crate::mitsuba::read::find_file;
use crate::mitsuba::spectrum::Use;
use firstlight_files::printable;
use firstlight_format::error::SceneError;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::sources::{EnvironmentLayout, EnvironmentSource};
use firstlight_format::value::Rgb;
use firstlight_render::Falloff;
use glam::{DVec3, Vec3};

impl Converter<'_> {
    /// Adds an emitter to the scene.
    pub(crate) fn emitter(&mut self, node: Node) -> Result<(), SceneError> {
        // Without a shape it is a definition that shapes refer to.
        if node.plugin() == "area" {
            return Ok(());
        }
        node.ignore(&["sampling_weight"]);
        let name = Some(self.names.free(node.called()));
        match node.plugin() {
            "constant" => {
                let radiance = self.constant_color(node, "radiance", 1.0, Use::Emission)?;
                self.file.environment = EnvironmentSource::Constant(Rgb(radiance));
            }
            "envmap" => self.environment_image(node)?,
            "point" => {
                let matrix = self.world * node.transform("to_world")?;
                let position = match node.vector("position")? {
                    Some(position) => self.world.transform_point3(position),
                    None => matrix.transform_point3(DVec3::ZERO),
                };
                let intensity = Rgb(self.constant_color(node, "intensity", 1.0, Use::Emission)?);
                self.file.lights.push(LightPart::Point { name, position, intensity, radius: 0.0 });
            }
            "spot" => {
                let matrix = self.world * node.transform("to_world")?;
                let outer = node.float_or("cutoff_angle", 20.0)?;
                let inner = node.float_or("beam_width", 0.75 * outer)?;
                if node.child("texture")?.is_some() {
                    self.tell(node, "the texture of a spot light is not modelled: it is white");
                }
                let direction = matrix.transform_vector3(DVec3::Z);
                if !(outer > 0.0 && inner >= 0.0) || direction.try_normalize().is_none() {
                    return Err(node.error("a spot light needs a direction, and a cutoff_angle above 0"));
                }
                let intensity = Rgb(self.constant_color(node, "intensity", 1.0, Use::Emission)?);
                let (position, transform) = (matrix.transform_point3(DVec3::ZERO), TransformPart::default());
                let outer_angle = outer.clamp(1e-3, 90.0);
                let inner_angle = inner.clamp(0.0, outer_angle);
                self.file.lights.push(LightPart::Spot {
                    name,
                    position,
                    direction,
                    intensity,
                    inner_angle,
                    outer_angle,
                    falloff: Falloff::Linear,
                    transform,
                });
            }
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
                self.file.lights.push(LightPart::Directional { name, direction, irradiance, transform });
            }
            plugin => {
                let plugin = printable::name(plugin).into_owned();
                self.tell(node, &format!("emitters of type {plugin} are not modelled: this light is left out"));
                node.skip();
            }
        }
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
                if let EnvironmentSource::Image { scale: factor, rotate, layout, .. } = &mut image {
                    (*factor, *rotate, *layout) = (Rgb(Vec3::splat(scale)), 180.0, EnvironmentLayout::Interpolated);
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
