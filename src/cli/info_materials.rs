//! The materials of a scene with what differs from their defaults.

use firstlight::printable;
use firstlight::render::{Fresnel, Param, ParamRef};
use firstlight::scene::{ColorParam, InWorld, Material, MaterialInput, ScalarParam, SceneInputs};
use serde_json::{Map, Value, json};

/// One line per material.
pub fn lines(inputs: &SceneInputs) -> Vec<String> {
    let line = |input: &MaterialInput| {
        let properties: Vec<String> = properties(&input.material, inputs)
            .into_iter()
            .map(|(name, value)| match value {
                Value::Array(channels) => {
                    let channels: Vec<String> = channels.iter().map(Value::to_string).collect();
                    format!("{name} ({})", channels.join(", "))
                }
                Value::String(text) => format!("{name} `{}`", printable::name(&text)),
                value => format!("{name} {value}"),
            })
            .collect();
        let what = [vec![input.material.kind().name().to_owned()], properties].concat();
        format!("{}: {}", name_of(input), what.join(", "))
    };
    inputs.materials.iter().map(line).collect()
}

/// A list of objects with name, kind and properties.
pub fn json(inputs: &SceneInputs) -> Value {
    let entry = |input: &MaterialInput| {
        let properties: Map<String, Value> = properties(&input.material, inputs).into_iter().collect();
        json!({ "name": input.name, "kind": input.material.kind().name(), "properties": properties })
    };
    inputs.materials.iter().map(entry).collect()
}

fn name_of(input: &MaterialInput) -> String {
    input.name.as_ref().map_or("a material without name".to_owned(), |name| format!("`{}`", printable::name(name)))
}

/// What differs from the defaults: numbers, colours as three numbers, names of textures and parts.
fn properties(material: &Material, inputs: &SceneInputs) -> Vec<(String, Value)> {
    // A number in single precision is written with its own digits.
    let short = |number: f32| serde_json::from_str(&number.to_string()).unwrap_or(json!(number));
    let rgb = |color: glam::Vec3| Value::Array(color.to_array().map(short).to_vec());
    let value = |param: ParamRef<'_, InWorld>| match param {
        Param::Color(ColorParam::Rgb(color)) | Param::Rgb(color) => rgb(*color),
        Param::Color(ColorParam::Texture(texture)) | Param::Scalar(ScalarParam::Texture(texture)) => {
            json!(texture.name)
        }
        Param::Scalar(ScalarParam::Number(number)) | Param::Number(number) => short(*number),
        Param::Cutoff(number) => number.map_or(Value::Null, short),
        Param::Flag(on) => json!(on),
        Param::Fresnel(Fresnel::Constant) => json!("constant"),
        Param::Fresnel(Fresnel::Schlick) => json!("schlick"),
        Param::Part(entity) => {
            json!(inputs.materials.iter().find(|it| it.entity == *entity).and_then(|it| it.name.clone()))
        }
    };
    material.given().into_iter().map(|(property, param)| (property.name.to_owned(), value(param))).collect()
}
