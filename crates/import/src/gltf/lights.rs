//! Lights of `KHR_lights_punctual` and the nodes that have them.
//!
//! Their axis is −z of the node. Photometric units are read as radiometric ones: candela as W·sr⁻¹, lux as W·m⁻².

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::json::shortened;
use glam::Vec3;
use serde_json::Value;

const NAME: &str = "KHR_lights_punctual";

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum GltfLightKind {
    Point,
    /// Angles from the axis, radians.
    Spot {
        inner: f64,
        outer: f64,
    },
    Directional,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GltfLight {
    pub name: Option<String>,
    pub kind: GltfLightKind,
    /// Colour times intensity: W·sr⁻¹; of directional lights, W·m⁻².
    pub intensity: Vec3,
    /// Whether it has a maximum range, which is not physical and is ignored.
    pub has_range: bool,
}

impl Document {
    /// The light of a node, if it has one.
    pub(crate) fn light_of(&self, node: u32) -> Result<Option<GltfLight>, Located> {
        let json = &self.root.nodes[node as usize];
        let Some(number) = json.extensions.get(NAME).and_then(|extension| extension.get("light")) else {
            return Ok(None);
        };
        let here = |problem| (place("nodes", node), problem);
        let list = self.root.extensions.get(NAME).and_then(|extension| extension.get("lights"));
        let list = list.and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let index = number.as_u64().and_then(|number| u32::try_from(number).ok()).unwrap_or(u32::MAX);
        let light = item(list, "lights", index).map_err(here)?;
        let at = || format!("extensions.{NAME}.lights[{index}]");
        let number = |object: &Value, name: &str, default: f64| {
            object.get(name).and_then(Value::as_f64).filter(|value| value.is_finite()).unwrap_or(default)
        };
        let color = light.get("color").and_then(Value::as_array);
        let color: Vec<f64> = color.map_or_else(Vec::new, |list| list.iter().filter_map(Value::as_f64).collect());
        let color = match color[..] {
            [r, g, b] => Vec3::new(r as f32, g as f32, b as f32).max(Vec3::ZERO),
            _ => Vec3::ONE,
        };
        let kind = match light.get("type").and_then(Value::as_str) {
            Some("point") => GltfLightKind::Point,
            Some("directional") => GltfLightKind::Directional,
            Some("spot") => {
                let spot = light.get("spot").unwrap_or(&Value::Null);
                let outer = number(spot, "outerConeAngle", std::f64::consts::FRAC_PI_4);
                let outer = outer.clamp(0.0, std::f64::consts::FRAC_PI_2);
                let inner = number(spot, "innerConeAngle", 0.0).clamp(0.0, outer);
                GltfLightKind::Spot { inner, outer }
            }
            other => {
                let (what, found) = ("type", other.unwrap_or_default().to_owned());
                return Err((at(), GltfProblem::Value { what, found, expected: "point, spot or directional" }));
            }
        };
        let name = light.get("name").and_then(Value::as_str).filter(|name| !name.is_empty());
        let name = name.map(|name| shortened(name).to_owned());
        let intensity = color * number(light, "intensity", 1.0).max(0.0) as f32;
        if !intensity.is_finite() {
            let (what, found) = ("intensity", intensity.to_string());
            return Err((at(), GltfProblem::Value { what, found, expected: "a number of single precision" }));
        }
        Ok(Some(GltfLight { name, kind, intensity, has_range: light.get("range").is_some() }))
    }
}
