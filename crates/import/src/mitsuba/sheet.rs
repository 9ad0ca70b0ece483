//! Sheets that scatter light diffusely to both sides, as `save` writes `translucent`: Mitsuba has no BSDF for them.

use crate::mitsuba::converter::{Converter, Surface};
use crate::mitsuba::graph::{Node, Value};
use crate::mitsuba::spectrum::Use;
use firstlight_format::error::SceneError;
use firstlight_format::value::ColorValue;
use firstlight_render::Material;
use glam::Vec3;

/// What gives a `principledthin` other light than that which it transmits diffusely.
const OTHER_LIGHT: [&str; 4] = ["spec_trans", "spec_tint", "flatness", "sheen"];

/// Parameters of highlights, which one of index 1 has not, and of sheen.
const WITHOUT_EFFECT: [&str; 3] = ["roughness", "anisotropic", "sheen_tint"];

impl Converter<'_> {
    /// A blend of a surface that only reflects diffusely with one that only transmits diffusely; `None` for others.
    ///
    /// Their colours may be above 1: together with their shares they are at most 1.
    pub(crate) fn sheet(&mut self, node: Node) -> Result<Option<Surface>, SceneError> {
        let number = |node: Node, name: &str| match node.value(name) {
            Some(Value::Float(number)) => Some(*number),
            _ => None,
        };
        let [sides, thin] = node.children("bsdf")?[..] else { return Ok(None) };
        let (Some(weight), "twosided", "principledthin") = (number(node, "weight"), sides.plugin(), thin.plugin())
        else {
            return Ok(None);
        };
        let [diffuse] = sides.children("bsdf")?[..] else { return Ok(None) };
        let only_transmits = number(thin, "eta") == Some(1.0)
            && number(thin, "diff_trans") == Some(2.0)
            && !OTHER_LIGHT.iter().any(|name| thin.has(name));
        if diffuse.plugin() != "diffuse" || !only_transmits || !(0.0..=1.0).contains(&weight) {
            return Ok(None);
        }
        thin.ignore(&WITHOUT_EFFECT);
        let mut part = |node: Node, name: &str, share: f64| -> Result<ColorValue, SceneError> {
            Ok(match self.color(node, name, 0.5, Use::Factor)? {
                ColorValue::Rgb(rgb) => {
                    let color = share as f32 * rgb;
                    // `save` divides by the share: two roundings.
                    if color.max_element() > 1.0 + 2.0 * f32::EPSILON {
                        self.tell(node, &format!("`{name}` with its share of the blend is above 1: it is 1"));
                    }
                    ColorValue::Rgb(color.min(Vec3::ONE))
                }
                ColorValue::Texture(name) => {
                    ColorValue::Texture(self.tinted(&name, Vec3::splat(share as f32)).unwrap_or(name))
                }
            })
        };
        let reflectance = part(diffuse, "reflectance", 1.0 - weight)?;
        let transmittance = part(thin, "base_color", weight)?;
        Ok(Some(Surface::two_sided(Material::Translucent { reflectance, transmittance })))
    }
}
