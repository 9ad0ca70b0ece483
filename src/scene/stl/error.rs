//! Problems of STL files.

/// A problem of an STL file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StlProblem {
    /// It does not begin like a text file and is too short for a binary one.
    #[error(
        "is not an STL file: expected text that begins with `solid`, or at least 84 bytes, but the file has {bytes} bytes"
    )]
    NotStl {
        /// Its length, bytes.
        bytes: usize,
    },
    /// Its length does not match its number of triangles.
    #[error(
        "declares {count} triangles, which take {expected} bytes, but the file has {bytes}: it is truncated or not an \
         STL file"
    )]
    Truncated {
        /// The declared number of triangles.
        count: u32,
        /// Bytes that they take, with the header.
        expected: u64,
        /// Its length, bytes.
        bytes: usize,
    },
    /// The file has no triangles.
    #[error("has no triangles")]
    Empty,
    /// A word is not one of those expected.
    #[error("`{text}` found, expected {expected}")]
    Word {
        /// The word.
        text: String,
        /// What was expected.
        expected: &'static str,
    },
    /// The text ends too early.
    #[error("the file ends, expected {expected}: it is truncated")]
    End {
        /// What was expected.
        expected: &'static str,
    },
    /// A facet has fewer than three vertices.
    #[error("the facet has {corners} vertices, but needs at least 3")]
    FewCorners {
        /// Number of its vertices.
        corners: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {corner} of triangle {triangle} has a coordinate that is NaN or infinite (both counted from 0)")]
    NotFinite {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// 0, 1 or 2.
        corner: usize,
    },
    /// There are more triangle corners than 32-bit indices allow.
    #[error("has more triangles than 32-bit indices can name the corners of")]
    TooMany,
}
