//! The header of a PLY file: encoding, elements and their properties.

use crate::error::ply::PlyProblem;
use firstlight_files::printable;
use firstlight_files::relative::bytes_to_text;
use std::collections::HashSet;

/// Encoding of the data after the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Numeric type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// A property of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Property {
    pub name: String,
    /// Type of the length if it is a list.
    pub length: Option<Number>,
    /// Type of the value, or of the values of the list.
    pub number: Number,
}

/// An element: rows with the same properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Byte offset of the first element.
    pub body: usize,
    /// Number of lines of the header.
    pub lines: usize,
    /// Image files that comments name, as MeshLab writes them.
    pub textures: Vec<String>,
    /// The first line with an unknown keyword, and the number of such lines.
    pub unknown: Option<(String, usize)>,
}

/// Longer headers are rejected: they could list elements endlessly.
const MAX_BYTES: usize = 1 << 20;

impl Number {
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The maximum of a colour channel of this type.
    pub fn white(self) -> f64 {
        match self {
            Self::I16 | Self::U16 => 65535.0,
            Self::F32 | Self::F64 => 1.0,
            _ => 255.0,
        }
    }

    fn parse(word: &str) -> Result<Self, PlyProblem> {
        Ok(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return Err(PlyProblem::Type { text: printable::name(word).to_string() }),
        })
    }
}

impl Element {
    /// Minimum number of bytes of a row.
    pub fn least_bytes(&self, encoding: Encoding) -> usize {
        let of = |property: &Property| match encoding {
            // A digit and a separator.
            Encoding::Ascii => 2,
            _ => property.length.unwrap_or(property.number).bytes(),
        };
        self.properties.iter().map(of).sum()
    }

    /// Index of the first property with one of these names.
    pub fn property(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|property| names.iter().any(|name| property.name.eq_ignore_ascii_case(name)))
    }
}

impl Header {
    /// Parses the lines up to `end_header`; an error has the number of its line, from 1.
    pub fn parse(bytes: &[u8]) -> Result<Self, (usize, PlyProblem)> {
        let head = &bytes[..bytes.len().min(MAX_BYTES)];
        let rest = head.strip_prefix(b"ply").ok_or((1, PlyProblem::NotPly))?;
        let rest = rest.trim_ascii_start().len();
        let first_line = &head[..head.len() - rest];
        // The first line determines the kind of line ending, since the data after the header may begin with any byte.
        let end = match (first_line.contains(&b'\n'), first_line.contains(&b'\r')) {
            (true, _) => b'\n',
            (false, true) => b'\r',
            (false, false) => return Err((1, PlyProblem::NotPly)),
        };
        let (mut encoding, mut elements, mut at, mut lines) = (None, Vec::<Element>::new(), 0, 0);
        let (mut textures, mut unknown_lines, mut names) = (Vec::new(), None, HashSet::new());
        while let Some(length) = head[at..].iter().position(|&byte| byte == end) {
            let line = bytes_to_text(&head[at..at + length]);
            at += length + 1;
            lines += 1;
            let located = |problem| (lines, problem);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let unknown = |expected| {
                let text = printable::name(line.trim()).to_string();
                located(PlyProblem::HeaderLine { text, expected })
            };
            match words[..] {
                ["ply"] if lines == 1 => {}
                ["comment", "TextureFile", _, ..] => {
                    // Names may contain spaces.
                    let name = line.split_once("TextureFile").map_or("", |(_, name)| name.trim());
                    textures.push(name.to_owned());
                }
                [] | ["comment" | "obj_info", ..] => {}
                ["format", kind, "1.0"] if encoding.is_none() => {
                    encoding = Some(match kind {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        _ => return Err(located(PlyProblem::Format)),
                    });
                }
                ["format", ..] => return Err(located(PlyProblem::Format)),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| unknown("`element NAME COUNT` with a whole number"))?;
                    if !names.insert(name.to_owned()) {
                        let name = printable::name(name).to_string();
                        return Err(located(PlyProblem::Twice { name }));
                    }
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", ref declared @ ..] => {
                    let (length, number, name) = match *declared {
                        ["list", length, number, name] => (Some(length), number, name),
                        [number, name] if number != "list" => (None, number, name),
                        _ => return Err(unknown("`property TYPE NAME` or `property list TYPE TYPE NAME`")),
                    };
                    let length = length.map(Number::parse).transpose().map_err(located)?;
                    let number = Number::parse(number).map_err(located)?;
                    let element = elements.last_mut().ok_or_else(|| unknown("an element before its properties"))?;
                    element.properties.push(Property { name: name.to_owned(), length, number });
                }
                ["end_header"] => {
                    let encoding = encoding.ok_or(located(PlyProblem::Format))?;
                    return Ok(Self { encoding, elements, body: at, lines, textures, unknown: unknown_lines });
                }
                ["element", ..] => return Err(unknown("`element NAME COUNT` with a whole number")),
                // Comments that lack their keyword or go on in a second line.
                _ => {
                    let text = || (printable::name(line.trim()).to_string(), 0);
                    unknown_lines.get_or_insert_with(text).1 += 1;
                }
            }
        }
        Err((lines + 1, PlyProblem::EndlessHeader { limit: head.len() }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_line_ends_lead_to_the_same_header() {
        let text = "ply\nformat binary_big_endian 1.0\ncomment a b\nelement vertex 7\nproperty float x\nobj_info\n\
                    element face 2\nproperty list uchar int vertex_indices\nend_header\n\n";
        let header = Header::parse(text.as_bytes()).unwrap();
        assert_eq!((header.body, header.lines, header.encoding), (text.len() - 1, 9, Encoding::BigEndian));
        assert_eq!(header.elements[1].properties[0].length, Some(Number::U8));
        for end in ["\r\n", "\r"] {
            let other = Header::parse(text.replace('\n', end).as_bytes()).unwrap();
            assert_eq!((&other.elements, other.lines), (&header.elements, 9));
            assert_eq!(other.body, text.replace('\n', end).len() - end.len());
        }
    }

    #[test]
    fn textures_are_named_by_comments_and_other_text_is_passed() {
        let text = "ply\r\nformat ascii 1.0\r\nCreated by a program\r\ncomment TextureFile  my image 1.png \r\n\
                    comment texturefile no\r\ncomment TextureFile b.jpg\r\ncomment TextureFile\r\nelement vertex 1\r\n\
                    source: a\r\nend_header\r\n";
        let header = Header::parse(text.as_bytes()).unwrap();
        assert_eq!(header.textures, ["my image 1.png", "b.jpg"]);
        assert_eq!((header.unknown, header.elements.len()), (Some(("Created by a program".to_owned(), 2)), 1));
    }

    #[test]
    fn bad_headers_are_named_by_their_line() {
        let of = |text: &str| Header::parse(text.as_bytes()).unwrap_err();
        assert_eq!(of("plyx\n"), (1, PlyProblem::NotPly));
        assert_eq!(of("ply\nformat ascii 2.0\n"), (2, PlyProblem::Format));
        assert_eq!(of("ply\nend_header\n"), (2, PlyProblem::Format));
        let text = "quad".to_owned();
        assert_eq!(of("ply\nformat ascii 1.0\nelement v 1\nproperty quad x\n"), (4, PlyProblem::Type { text }));
        for line in ["element v -1", "element v 99999999999999999999", "property float x", "element v"] {
            let (number, problem) = of(&format!("ply\nformat ascii 1.0\n{line}\n"));
            assert!(number == 3 && matches!(problem, PlyProblem::HeaderLine { .. }), "{line}: {problem}");
        }
        assert!(matches!(of("ply\nelement a 1\nelement a 1\n"), (3, PlyProblem::Twice { .. })));
        assert!(matches!(of("ply\nformat ascii 1.0\n"), (3, PlyProblem::EndlessHeader { .. })));
        assert!(matches!(of(&format!("ply\n{}", "comment\n".repeat(1 << 18))), (_, PlyProblem::EndlessHeader { .. })));
    }
}
