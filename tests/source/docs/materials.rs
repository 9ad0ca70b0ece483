//! The reference pages of materials have the rows of their table.

use super::page::{Page, read};
use firstlight::render::{Domain, Fresnel, MaterialKind, Property, Value, ValueType};

/// The row of a property in a reference page.
fn row(property: &Property) -> String {
    let value = match (property.value, property.domain) {
        (ValueType::Color, _) => "colour",
        (ValueType::Scalar, _) => "scalar",
        (ValueType::Rgb, _) => "RGB",
        (ValueType::Flag, _) => "`true`, `false`",
        (ValueType::Fresnel | ValueType::Part, _) => "name",
        (ValueType::Number | ValueType::Cutoff, Domain::Degrees) => "degrees",
        (ValueType::Number | ValueType::Cutoff, _) => "number",
    };
    let default = match property.default {
        None | Some(Value::Nothing) => String::new(),
        Some(Value::Number(number)) => number.to_string(),
        Some(Value::Color(rgb)) if rgb.x == rgb.y && rgb.y == rgb.z => rgb.x.to_string(),
        Some(Value::Color(rgb)) => format!("`({}, {}, {})`", rgb.x, rgb.y, rgb.z),
        Some(Value::Flag(on)) => format!("`{on}`"),
        Some(Value::Fresnel(Fresnel::Constant)) => "`constant`".to_owned(),
        Some(Value::Fresnel(Fresnel::Schlick)) => "`schlick`".to_owned(),
    };
    let range = match (property.domain, property.domain.limits().into_inner()) {
        (Domain::Choice | Domain::Reference, _) => "",
        (_, (0.0, 1.0)) => "0…1",
        (_, (0.0, _)) => "≥ 0",
        (_, (least, _)) if least > 0.0 => "above 0",
        _ => "",
    };
    let cell = |text: &str| if text.is_empty() { " ".to_owned() } else { format!(" {text} ") };
    format!("| `{}` |{}|{}|{}|{}|", property.name, cell(value), cell(&default), cell(range), cell(property.help))
}

#[test]
fn every_property_of_a_material_has_its_row() {
    let mut wrong = String::new();
    for &kind in MaterialKind::ALL {
        let (page, heading) = match kind {
            MaterialKind::Principled => ("docs/scene-principled.md", "# ".to_owned()),
            MaterialKind::Disney => ("docs/scene-disney.md", "# ".to_owned()),
            MaterialKind::Glass | MaterialKind::RoughGlass | MaterialKind::ThinGlass => {
                ("docs/scene-glass.md", format!("### {}\n", kind.name()))
            }
            _ => ("docs/scene-materials.md", format!("### {}\n", kind.name())),
        };
        let Page { text, .. } = read(page);
        let (_, section) = text.split_once(&heading).unwrap_or_else(|| panic!("no heading {heading}"));
        let section = section.split("\n#").next().unwrap_or_default();
        let found: Vec<&str> = section.lines().filter(|line| line.starts_with("| `")).collect();
        let wanted: Vec<String> = kind.properties().iter().map(row).collect();
        if found != wanted {
            wrong += &format!("\nthe rows of {} should be\n{}\n", kind.name(), wanted.join("\n"));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
