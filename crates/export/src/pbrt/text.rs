//! Text of pbrt: directives with their parameters.

use crate::common::number::number;
use glam::{DAffine3, DVec3, Vec3};

#[derive(Default)]
pub(crate) struct Text {
    pub text: String,
    depth: usize,
}

/// Marks that no quoted word may have.
pub(crate) const MARKS: [char; 2] = ['"', '\\'];

/// A name as pbrt quotes it.
pub(crate) fn quoted(name: &str) -> String {
    let plain = |c: char| if MARKS.contains(&c) || c.is_control() { '_' } else { c };
    format!("\"{}\"", name.chars().map(plain).collect::<String>())
}

pub(crate) fn numbers(list: impl IntoIterator<Item = f64>) -> String {
    list.into_iter().map(number).collect::<Vec<_>>().join(" ")
}

/// Parameters in the order in which they are added.
#[derive(Default)]
pub(crate) struct List(String);

impl List {
    fn add(mut self, kind: &str, name: &str, values: &str) -> Self {
        self.0 += &format!(" \"{kind} {name}\" [ {values} ]");
        self
    }

    pub(crate) fn float(self, name: &str, value: impl Into<f64>) -> Self {
        self.add("float", name, &number(value.into()))
    }

    pub(crate) fn floats(self, name: &str, values: &[f64]) -> Self {
        self.add("float", name, &numbers(values.iter().copied()))
    }

    pub(crate) fn integer(self, name: &str, value: u32) -> Self {
        self.add("integer", name, &value.to_string())
    }

    pub(crate) fn flag(self, name: &str, value: bool) -> Self {
        self.add("bool", name, if value { "true" } else { "false" })
    }

    pub(crate) fn rgb(self, name: &str, rgb: Vec3) -> Self {
        self.add("rgb", name, &numbers(rgb.as_dvec3().to_array()))
    }

    pub(crate) fn points(self, name: &str, points: &[DVec3]) -> Self {
        self.add("point3", name, &numbers(points.iter().flat_map(DVec3::to_array)))
    }

    pub(crate) fn string(self, name: &str, value: &str) -> Self {
        self.add("string", name, &quoted(value))
    }

    pub(crate) fn strings(self, name: &str, values: &[&str]) -> Self {
        self.add("string", name, &values.iter().map(|value| quoted(value)).collect::<Vec<_>>().join(" "))
    }

    pub(crate) fn texture(self, name: &str, texture: &str) -> Self {
        self.add("texture", name, &quoted(texture))
    }
}

impl Text {
    /// A directive with words or numbers.
    pub(crate) fn line(&mut self, text: &str) {
        self.text += &"    ".repeat(self.depth);
        self.text += text;
        self.text.push('\n');
    }

    /// A directive with quoted words and parameters.
    pub(crate) fn directive(&mut self, name: &str, words: &[&str], list: List) {
        let words: String = words.iter().map(|word| format!(" {}", quoted(word))).collect();
        self.line(&format!("{name}{words}{}", list.0));
    }

    pub(crate) fn begin(&mut self, text: &str) {
        self.line(text);
        self.depth += 1;
    }

    pub(crate) fn end(&mut self, text: &str) {
        self.depth -= 1;
        self.line(text);
    }

    /// Multiplies the transform; nothing if that changes nothing.
    pub(crate) fn transform(&mut self, world: &DAffine3) {
        if *world == DAffine3::IDENTITY {
            return;
        }
        let (m, t) = (world.matrix3, world.translation);
        let column = |column: DVec3, last: f64| format!("{} {last}", numbers(column.to_array()));
        let columns = [column(m.x_axis, 0.0), column(m.y_axis, 0.0), column(m.z_axis, 0.0), column(t, 1.0)];
        self.line(&format!("ConcatTransform [ {} ]", columns.join("  ")));
    }
}
