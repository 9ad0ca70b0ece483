//! What can be wrong with an STL file.

/// What is wrong with an STL file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StlProblem {
    /// It does not begin like text and is too short to be binary.
    #[error(
        "is not an STL file: expected text that begins with `solid`, or at least 84 bytes, but the file has {bytes} bytes"
    )]
    NotStl {
        /// Its length.
        bytes: usize,
    },
    /// It does not have the length that its count of triangles asks for.
    #[error(
        "declares {count} triangles, which take {expected} bytes, but the file has {bytes}: it is truncated or not an \
         STL file"
    )]
    Truncated {
        /// Triangles that it declares.
        count: u32,
        /// Bytes that they take, with the header.
        expected: u64,
        /// Its length.
        bytes: usize,
    },
    /// There is nothing in it.
    #[error("has no triangles")]
    Empty,
    /// A word is none of those that can stand there.
    #[error("`{text}` found, expected {expected}")]
    Word {
        /// The word.
        text: String,
        /// What could stand there.
        expected: &'static str,
    },
    /// The text ends too soon.
    #[error("the file ends, expected {expected}: it is truncated")]
    End {
        /// What could stand there.
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
        /// Number of the triangle.
        triangle: usize,
        /// 0, 1 or 2.
        corner: usize,
    },
    /// There are more corners than 32 bits can number.
    #[error("has more triangles than 32-bit indices can name the corners of")]
    TooMany,
}
