//! Text in XML: elements with their attributes, indented.

use crate::common::number::number;
use glam::{DAffine3, DVec3, Vec3};

#[derive(Default)]
pub(crate) struct Xml {
    pub text: String,
    pub n_elements: usize,
    open: Vec<String>,
}

impl Xml {
    fn begin(&mut self, tag: &str, attributes: &[(&str, &str)]) {
        self.n_elements += 1;
        self.text += &"    ".repeat(self.open.len());
        self.text.push('<');
        self.text += tag;
        for (name, value) in attributes.iter().filter(|(_, value)| !value.is_empty()) {
            self.text += &format!(" {name}=\"{}\"", escaped(value));
        }
    }

    /// An element with others inside, until [`Self::close`]. Attributes without a value are left out.
    pub(crate) fn open(&mut self, tag: &str, attributes: &[(&str, &str)]) {
        self.begin(tag, attributes);
        self.text += ">\n";
        self.open.push(tag.to_owned());
    }

    pub(crate) fn close(&mut self) {
        let tag = self.open.pop().expect("what is closed was opened");
        self.text += &format!("{}</{tag}>\n", "    ".repeat(self.open.len()));
    }

    pub(crate) fn leaf(&mut self, tag: &str, attributes: &[(&str, &str)]) {
        self.begin(tag, attributes);
        self.text += "/>\n";
    }

    /// A parameter of a plugin.
    pub(crate) fn value(&mut self, tag: &str, name: &str, value: &str) {
        self.leaf(tag, &[("name", name), ("value", value)]);
    }

    pub(crate) fn float(&mut self, name: &str, value: impl Into<f64>) {
        self.value("float", name, &number(value.into()));
    }

    pub(crate) fn rgb(&mut self, name: &str, Vec3 { x, y, z }: Vec3) {
        let [x, y, z] = [x, y, z].map(|channel| number(channel.into()));
        self.value("rgb", name, &format!("{x} {y} {z}"));
    }

    pub(crate) fn vector(&mut self, tag: &str, name: &str, DVec3 { x, y, z }: DVec3) {
        self.leaf(tag, &[("name", name), ("x", &number(x)), ("y", &number(y)), ("z", &number(z))]);
    }

    /// A transform as a matrix; none if it changes nothing.
    pub(crate) fn transform(&mut self, name: &str, world: &DAffine3) {
        if *world == DAffine3::IDENTITY {
            return;
        }
        let rows = world.matrix3.transpose();
        let row = |i: usize| {
            let row: DVec3 = rows.col(i);
            [row.x, row.y, row.z, world.translation[i]].map(number).join(" ")
        };
        let matrix = format!("{}  {}  {}  0 0 0 1", row(0), row(1), row(2));
        self.open("transform", &[("name", name)]);
        self.leaf("matrix", &[("value", &matrix)]);
        self.close();
    }
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            // XML has none of them.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('_'),
            c => out.push(c),
        }
    }
    out
}
