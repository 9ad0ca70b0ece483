//! The expected form of the fields of a scene file, with examples, for error messages.

use crate::property::{CameraProperty, LightProperty, ObjectProperty};
use crate::quantity::Quantity;
use firstlight_render::{MaterialKind, ValueType};
use std::borrow::Cow;

/// The innermost field at a position in a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldAt<'a> {
    pub name: &'a str,
    /// The enclosing field; empty at the top level.
    pub parent: &'a str,
    /// Byte offset of its value.
    pub start: usize,
    /// The text of its value, up to the comma or bracket that ends it.
    pub value: &'a str,
}

impl FieldAt<'_> {
    /// The expected form and an example; `None` for unknown fields.
    pub fn expectation(&self) -> Option<(&'static str, Cow<'static, str>)> {
        let in_transform = self.parent == "transform";
        let (what, example) = match self.name {
            "center" | "point" | "corner" | "first" => ("a point in round brackets", "(0, 1, 4)"),
            "normal" | "edge_u" | "edge_v" => ("a vector in round brackets", "(0, 1, 0)"),
            "rotate" if in_transform => ("three angles in degrees, about x, y and z", "(0, 30, 0)"),
            "scale" if in_transform => ("a factor, or one for each axis in round brackets", "(1, 2, 1)"),
            "matrix" => ("three rows of four numbers", "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0))"),
            "rotate" => ("an angle in degrees", "30"),
            "radius" | "pivot_distance" | "relief" => ("a length in metres", "0.5"),
            "simplify" | "exposure" => ("a number", "1.5"),
            "width" | "height" | "max_depth" | "blades" => ("a whole number", "8"),
            "depth_of_field" | "smooth" | "invert" => ("true or false", "true"),
            "stretch" | "repeat" | "offset" | "squares" => ("two numbers in round brackets", "(2, 2)"),
            "vertices" => ("three points", "((0, 0, 0), (1, 0, 0), (0, 1, 0))"),
            "centers" => ("a list of points", "[(0, 0, 0), (1, 0, 0)]"),
            "radii" => ("one radius for all, or one for each", "all(0.5)"),
            "steps" => ("a list of counts and vectors", "[(9, (1, 0, 0))]"),
            "camera" => ("a camera in round brackets", "(eye: (0, 1, 4), look_at: (0, 0, 0))"),
            "film" => ("the size of the image in round brackets", "(width: 640, height: 360)"),
            "display" => ("settings in round brackets", "(exposure: 0.5, tone_curve: filmic)"),
            "transform" => ("a transform in round brackets", "(translate: (0, 1, 0))"),
            "filter" => ("one of box, tent, gaussian, blackman_harris and mitchell", "blackman_harris"),
            "integrator" => ("path or phong", "path"),
            "tone_curve" => ("one of linear, neutral and filmic", "filmic"),
            "shading" => ("the shading of a mesh", "flat"),
            "texture_coordinates" => ("file or box", "box"),
            "source" => ("a mesh with its kind", "obj(\"model.obj\")"),
            "environment" => {
                let quoted = self.value.trim_end().strip_prefix('"').and_then(|value| value.strip_suffix('"'));
                let file = quoted.filter(|file| !file.is_empty() && !file.contains('"')).unwrap_or("sky.hdr");
                return Some(("a kind of environment", Cow::Owned(format!("image(file: \"{file}\")"))));
            }
            "material" | "name" | "file" | "a" | "b" if self.is_word() => {
                return Some(("text in quotes", Cow::Owned(format!("\"{}\"", self.value.trim_end()))));
            }
            "material" => ("the name of a material in quotes", "\"red\""),
            "name" => ("a name in quotes", "\"table\""),
            "file" => ("a path in quotes", "\"image.png\""),
            "materials" if self.parent.is_empty() => {
                ("materials with their names in curly brackets", "{ \"red\": diffuse(albedo: (0.8, 0.2, 0.1)) }")
            }
            "materials" => ("a list of names in quotes", "[\"red\", \"blue\"]"),
            "textures" => ("textures with their names in curly brackets", "{ \"tiles\": checker(a: 0.7, b: 0.1) }"),
            "cameras" => {
                ("cameras with their names in curly brackets", "{ \"top\": (eye: (0, 9, 0), look_at: (0, 0, 0)) }")
            }
            "objects" => ("a list of objects in square brackets", "[sphere(radius: 1, material: \"red\")]"),
            "lights" => ("a list of lights in square brackets", "[point(position: (0, 3, 0), intensity: 50)]"),
            _ if self.parent == "materials" => ("a material with its kind", "diffuse(albedo: 0.5)"),
            _ if self.parent == "textures" => ("a texture with its kind", "image(file: \"tiles.png\")"),
            "zenith" | "horizon" | "ground" | "air" | "tint" | "scale" => COLOR,
            name => of_animated(name).or_else(|| self.of_material(name))?,
        };
        Some((what, Cow::Borrowed(example)))
    }

    /// The form of a property of a material.
    fn of_material(&self, name: &str) -> Option<(&'static str, &'static str)> {
        let mut all = MaterialKind::ALL.iter().flat_map(|kind| kind.properties());
        Some(match all.find(|property| property.name == name)?.value {
            ValueType::Color if self.is_word() => ("a colour, or the name of a texture in quotes", "\"tiles\""),
            ValueType::Color | ValueType::Rgb => COLOR,
            ValueType::Scalar if self.is_word() => ("a number, or the name of a texture in quotes", "\"tiles\""),
            ValueType::Scalar | ValueType::Cutoff => ("a number", "0.5"),
            ValueType::Number => ("a number", "1.5"),
            ValueType::Flag => ("true or false", "true"),
            ValueType::Fresnel => ("constant or schlick", "schlick"),
            ValueType::Part => ("the name of a material in quotes", "\"red\""),
        })
    }

    /// Whether a position is inside the brackets of a tagged value such as `constant(…)`.
    pub fn is_within_kind(&self, offset: usize) -> bool {
        let word = self.value.bytes().take_while(|byte| is_word(*byte)).count();
        word > 0 && self.value[word..].starts_with('(') && offset > self.start + word
    }

    /// The value, shortened for messages.
    pub fn quoted(&self) -> String {
        const MOST: usize = 40;
        let line = self.value.lines().next().unwrap_or_default().trim_end();
        let short: String = line.chars().take(MOST).collect();
        if short.len() < line.len() { format!("{short}…") } else { short }
    }

    /// Whether the value is an unquoted name.
    fn is_word(&self) -> bool {
        let value = self.value.trim_end();
        value.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && value.chars().all(|c| c.is_alphanumeric() || "_- .".contains(c))
    }
}

const COLOR: (&str, &str) = ("a number, or red, green and blue", "(0.8, 0.2, 0.1)");

/// The form of a property of a camera, a light or a transform.
fn of_animated(name: &str) -> Option<(&'static str, &'static str)> {
    let of_camera = CameraProperty::ALL.iter().map(|property| property.info());
    let of_light = LightProperty::ALL.iter().map(|property| property.info());
    let of_object = ObjectProperty::ALL.iter().map(|property| property.info());
    let info = of_camera.chain(of_light).chain(of_object).find(|info| info.name == name)?;
    Some(match (info.quantity, info.unit) {
        (Quantity::Position, _) => ("a point in round brackets", "(0, 1, 4)"),
        (Quantity::Direction, _) => ("a vector in round brackets", "(0, 1, 0)"),
        (Quantity::Rotation, _) => ("three angles in degrees, about x, y and z", "(0, 30, 0)"),
        (Quantity::Factors, _) => ("a factor, or one for each axis in round brackets", "(1, 2, 1)"),
        (Quantity::Color, _) => COLOR,
        (Quantity::Number, "°") => ("an angle in degrees", "30"),
        (Quantity::Number, " m") => ("a length in metres", "0.5"),
        (Quantity::Number, _) => ("a number", "1.5"),
    })
}

/// The innermost field whose value begins at or before `offset`.
pub fn field_at(text: &str, offset: usize) -> Option<FieldAt<'_>> {
    /// An open bracket, with its current field.
    #[derive(Clone, Copy, Default)]
    struct Open<'a>(Option<(&'a str, usize)>);

    let bytes = text.as_bytes();
    let (mut stack, mut at): (Vec<Open>, usize) = (Vec::new(), 0);
    while at < offset.min(text.len()) {
        match bytes[at] {
            b'(' | b'[' | b'{' => {
                stack.push(Open::default());
                at += 1;
            }
            b')' | b']' | b'}' => {
                stack.pop();
                at += 1;
            }
            b',' => {
                if let Some(open) = stack.last_mut() {
                    open.0 = None;
                }
                at += 1;
            }
            b'"' => {
                let end = end_of_string(text, at);
                at = named(text, at + 1, end.saturating_sub(1), end, &mut |field| set(&mut stack, field));
            }
            b'/' if text[at..].starts_with("//") => at += text[at..].find('\n').unwrap_or(text.len() - at),
            b'/' if text[at..].starts_with("/*") => at += text[at..].find("*/").map_or(text.len() - at, |end| end + 2),
            byte if is_word(byte) => {
                let end = at + bytes[at..].iter().take_while(|byte| is_word(**byte)).count();
                at = named(text, at, end, end, &mut |field| set(&mut stack, field));
            }
            _ => at += 1,
        }
    }
    fn set<'a>(stack: &mut [Open<'a>], field: (&'a str, usize)) {
        if let Some(open) = stack.last_mut() {
            open.0 = Some(field);
        }
    }
    let mut fields = stack.iter().rev().filter_map(|open| open.0);
    let (name, start) = fields.next()?;
    let parent = fields.next().map_or("", |(name, _)| name);
    Some(FieldAt { name, parent, start, value: value_at(text, start) })
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.' | b'+') || !byte.is_ascii()
}

/// Reports the word as a field if a colon follows it. Returns the position at which the scan continues.
///
/// - `from`, `to`: byte range of the word without quotes; `end`: position after its quotes.
fn named<'a>(text: &'a str, from: usize, to: usize, end: usize, found: &mut dyn FnMut((&'a str, usize))) -> usize {
    let rest = &text[end.min(text.len())..];
    let Some(value) = rest.trim_start().strip_prefix(':') else { return end.min(text.len()) };
    let start = text.len() - value.trim_start().len();
    found((text.get(from..to).unwrap_or_default(), start));
    text.len() - value.len()
}

/// Position after the closing quote of the string that begins at `at`.
fn end_of_string(text: &str, at: usize) -> usize {
    let mut escaped = false;
    let end = text.bytes().enumerate().skip(at + 1).find(|&(_, byte)| {
        let ends = byte == b'"' && !escaped;
        escaped = byte == b'\\' && !escaped;
        ends
    });
    end.map_or(text.len(), |(end, _)| end + 1)
}

/// The value that begins at `start`, up to its comma or closing bracket.
fn value_at(text: &str, start: usize) -> &str {
    let (mut depth, mut at) = (0, start);
    while let Some(byte) = text.as_bytes().get(at) {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' if depth == 0 => break,
            b')' | b']' | b'}' => depth -= 1,
            b',' if depth == 0 => break,
            b'"' => at = end_of_string(text, at) - 1,
            _ => {}
        }
        at += 1;
    }
    &text[start.min(text.len())..at.min(text.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_field_is_found() {
        let text = "( // eye: 1\n camera: (eye: [0, 1, 4], up: (0, 1, 0)),\n materials: { \"re:d\": diffuse(albedo: 1) },\n objects: [mesh(transform: (rotate: 30))])";
        let at = |part: &str| field_at(text, text.find(part).unwrap()).unwrap();
        let found = at("[0, 1");
        assert_eq!((found.name, found.parent, found.value), ("eye", "camera", "[0, 1, 4]"));
        assert_eq!(at("1, 4]").name, "eye", "elements of a list belong to its field");
        assert_eq!(at("diffuse").name, "re:d");
        assert_eq!((at("diffuse").parent, at("1) }").name), ("materials", "albedo"));
        let found = at("30))");
        assert_eq!((found.name, found.parent, found.value), ("rotate", "transform", "30"));
        assert_eq!(field_at("eye: 3", 5), None, "outside of all brackets");
        for (text, offset) in [("(a: \"", 5), ("(a", 2), ("(\"", 2), ("(a: \u{e4}", 6), ("", 9)] {
            let _ = field_at(text, offset);
        }
    }
}
