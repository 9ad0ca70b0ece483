//! Problems of PLY files.

/// A problem of a PLY file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlyProblem {
    /// The first line is not `ply`.
    #[error("is not a PLY file: its first line is not `ply`")]
    NotPly,
    /// The header does not end within the limit.
    #[error("the header has no line `end_header` within {limit} bytes: the file is truncated or not a PLY file")]
    EndlessHeader {
        /// Maximum length of a header, bytes.
        limit: usize,
    },
    /// The format line is missing, late or invalid.
    #[error("expected `format ascii 1.0`, `format binary_little_endian 1.0` or `format binary_big_endian 1.0`")]
    Format,
    /// A line of the header is invalid.
    #[error("`{text}` is not a line of a PLY header; expected {expected}")]
    HeaderLine {
        /// The line.
        text: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A property has a type that does not exist.
    #[error("`{text}` is not a type; expected char, uchar, short, ushort, int, uint, float or double")]
    Type {
        /// The type, as written.
        text: String,
    },
    /// An element is declared twice.
    #[error("element `{name}` is declared twice")]
    Twice {
        /// Its name.
        name: String,
    },
    /// The file has no faces.
    #[error("has no faces: expected an element `face` or `tristrips` (point clouds are not supported)")]
    NoFaces,
    /// The vertices have no positions.
    #[error("element `vertex` has no properties x, y and z")]
    NoPositions,
    /// The faces have no vertex indices.
    #[error("element `{element}` has no list of whole numbers `vertex_indices` or `vertex_index`")]
    NoIndices {
        /// Its name.
        element: &'static str,
    },
    /// There are more vertices than 32-bit indices allow.
    #[error("the header declares {count} vertices, more than 32-bit indices can name")]
    TooManyVertices {
        /// How many the header declares.
        count: u64,
    },
    /// The file is too short for the number of elements in its header.
    #[error(
        "the header declares {declared} of element `{element}`, but the file has room for {room} at most: it is truncated"
    )]
    NoRoom {
        /// Name of the element.
        element: String,
        /// How many the header declares.
        declared: u64,
        /// Maximum number that fits into the rest of the file.
        room: u64,
    },
    /// The file ends inside an element.
    #[error("the file ends in element `{element}` {row} of {declared}: it is truncated")]
    Truncated {
        /// Name of the element.
        element: String,
        /// Its index, from 0.
        row: u64,
        /// How many the header declares.
        declared: u64,
    },
    /// A line of text has too few values.
    #[error("element `{element}` {row} has a line of {found} numbers, fewer than the properties in the header")]
    Numbers {
        /// Name of the element.
        element: String,
        /// Its index, from 0.
        row: u64,
        /// Number of values in the line.
        found: usize,
    },
    /// A word is not a number.
    #[error("`{text}` is not a number")]
    NotNumber {
        /// The word.
        text: String,
    },
    /// The length of a list is not a non-negative integer.
    #[error("a list of element `{element}` {row} has a length of {length}")]
    Length {
        /// Name of the element.
        element: String,
        /// Its index, from 0.
        row: u64,
        /// The length, as written.
        length: String,
    },
    /// No face is left without those that use a vertex whose position is NaN or infinite.
    #[error("all {faces} faces use a vertex whose position is not finite")]
    NotFinite {
        /// Number of faces.
        faces: usize,
    },
    /// A vertex index of a face is out of range.
    #[error("element `{element}` {row} uses vertex {index}, but the file has {count} (counted from 0)")]
    OutOfRange {
        /// `face` or `tristrips`.
        element: &'static str,
        /// Its index, from 0.
        row: u64,
        /// The index, as written.
        index: String,
        /// Number of vertices.
        count: u64,
    },
}
