//! The table of materials, from which the package makes functions, documentation and stubs.

use firstlight::render::{MaterialKind, Property, Value, ValueType};
use firstlight::scene::BUILTIN_SCENES;
use pyo3::prelude::*;
use serde_json::{Value as Json, json};

/// All kinds of materials with their properties, as JSON.
#[pyfunction]
pub fn materials() -> String {
    let kinds = MaterialKind::ALL.iter().map(|kind| {
        let properties: Vec<Json> = kind.properties().iter().map(row).collect();
        json!({ "name": kind.name(), "about": kind.about(), "main": kind.main_property(), "properties": properties })
    });
    Json::from_iter(kinds).to_string()
}

fn row(property: &Property) -> Json {
    let default = property.default.map(|default| match default {
        Value::Number(number) => json!(short(number)),
        Value::Color(rgb) if rgb.min_element() == rgb.max_element() => json!(short(rgb.x)),
        Value::Color(rgb) => json!(rgb.to_array().map(short)),
        Value::Flag(flag) => json!(flag),
        Value::Fresnel(fresnel) => json!(fresnel),
        Value::Nothing => Json::Null,
    });
    let value = match property.value {
        ValueType::Color => "color",
        ValueType::Scalar => "scalar",
        ValueType::Number => "number",
        ValueType::Flag => "flag",
        ValueType::Cutoff => "cutoff",
        ValueType::Rgb => "rgb",
        ValueType::Fresnel => "fresnel",
        ValueType::Part => "material",
    };
    json!({
        "name": property.name,
        "value": value,
        "rule": property.domain.rule(),
        "required": property.default.is_none(),
        "default": default,
        "help": property.help,
    })
}

/// The number with the fewest digits that is this one in single precision.
fn short(number: f32) -> f64 {
    number.to_string().parse().expect("a number")
}

/// Names of the built-in scenes, each with what it shows.
#[pyfunction]
pub fn builtin_scenes() -> Vec<(&'static str, &'static str)> {
    BUILTIN_SCENES.iter().map(|(name, about, _)| (*name, *about)).collect()
}
