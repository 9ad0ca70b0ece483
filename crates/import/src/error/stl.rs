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
    /// It is too short for one triangle, or a text.
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
    /// No facet is left without those that have a coordinate that is NaN or infinite, or too few vertices.
    #[error("none of the {facets} facets has three vertices with finite coordinates")]
    NotFinite {
        /// Number of facets.
        facets: usize,
    },
    /// There are more triangle corners than 32-bit indices allow.
    #[error("has more triangles than 32-bit indices can name the corners of")]
    TooMany,
}
