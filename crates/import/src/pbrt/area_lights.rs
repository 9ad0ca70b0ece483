//! Shapes that emit.

use crate::model::placing::area_of;
use crate::pbrt::build::{Builder, Geometry};
use crate::pbrt::lights::{color, factor};
use crate::pbrt::params::Params;
use crate::pbrt::state::{AreaLight, State};
use firstlight_files::printable;
use firstlight_format::sources::{MeshSource, TextureSource};
use firstlight_format::value::{ColorValue, Rgb};
use glam::Vec3;
use std::f64::consts::PI;

impl Builder<'_> {
    /// What a shape emits, and whether both of its sides do.
    pub(super) fn radiance(
        &mut self,
        light: &AreaLight,
        geometry: &Geometry,
        state: &State,
        shape: &Params,
        kind: &str,
        name: &str,
    ) -> (ColorValue, bool) {
        let AreaLight { params: light, radiance } = light;
        let is_two_sided = light.flag("twosided").unwrap_or(false);
        let mut told = Vec::new();
        let of_light = || color(light, "L", &mut |what| told.push(what)) * factor(light, "scale");
        let mut radiance = *radiance.get_or_init(of_light);
        if let Some(power) = light.number("power").filter(|power| *power > 0.0) {
            let world = state.ctm;
            let (area, n_shapes) = match geometry {
                Geometry::Sphere { radius, .. } => {
                    let scale = world.matrix3.determinant().abs().cbrt();
                    (4.0 * PI * (radius * scale).powi(2), 1)
                }
                Geometry::Mesh { source: MeshSource::Part { shape, .. }, .. } => match self.parts.get(shape) {
                    Some(mesh) => (area_of(mesh, &world).max(f64::MIN_POSITIVE), mesh.triangles.len()),
                    None => (1.0, 1),
                },
                Geometry::Mesh { .. } => (1.0, 1),
            };
            // In pbrt, each triangle and each patch of a mesh is a light of this power.
            let n_lights = match kind {
                "trianglemesh" | "plymesh" | "loopsubdiv" => n_shapes,
                "bilinearmesh" => (shape.numbers("indices").len() / 4).max(1),
                _ => 1,
            };
            let sides = if is_two_sided { 2.0 } else { 1.0 };
            radiance *= power * n_lights as f64 / (PI * area * sides);
        }
        told.extend(light.complaints());
        told.into_iter().for_each(|what| self.tell(format!("`{}`: {what}", printable::name(name))));
        let radiance = radiance.as_vec3();
        let radiance = if radiance.is_finite() { radiance.max(Vec3::ZERO) } else { Vec3::ZERO };
        let value = match light.string("filename").and_then(|image| self.file(image)) {
            Some(file) => {
                let mut source = TextureSource::image(file);
                if let TextureSource::Image { tint, .. } = &mut source {
                    *tint = Rgb(radiance);
                }
                ColorValue::Texture(self.texture_name("light", source))
            }
            None => ColorValue::Rgb(radiance),
        };
        (value, is_two_sided)
    }
}
