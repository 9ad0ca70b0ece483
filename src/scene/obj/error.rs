use crate::mesh::MeshError;
use crate::scene::{ReadError, WriteError};
use std::path::PathBuf;

/// Why an OBJ file could not be loaded: which file, which line, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum ObjError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The OBJ file.
        path: PathBuf,
        /// The reason.
        source: ReadError,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The file has no faces.
    #[error("{}: has no faces (lines starting with `f`): is it a Wavefront OBJ file?", path.display())]
    NoFaces {
        /// The OBJ file.
        path: PathBuf,
    },
    /// Every triangle has zero area.
    #[error(
        "{}: all {triangles} triangles are degenerate (zero area)",
        path.display()
    )]
    NoArea {
        /// The OBJ file.
        path: PathBuf,
        /// Number of its triangles.
        triangles: usize,
    },
    /// A line has the wrong form.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// The OBJ file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// The problem in it.
        problem: LineProblem,
    },
    /// The faces use more materials than 16-bit slots allow.
    #[error("{}: uses more than 65,536 materials", path.display())]
    TooManyMaterials {
        /// The OBJ file.
        path: PathBuf,
    },
    /// The triangles do not form a valid mesh.
    #[error("{}: {source}", path.display())]
    Mesh {
        /// The OBJ file.
        path: PathBuf,
        /// The reason.
        source: MeshError,
    },
}

/// The problem in a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineProblem {
    /// A face corner has invalid syntax.
    #[error("`{text}` is not a face corner; expected v, v/vt, v//vn or v/vt/vn with whole numbers")]
    FaceCorner {
        /// The corner, as written.
        text: String,
    },
    /// A face has fewer than three corners.
    #[error("the face has {corners} corners, but needs at least 3")]
    FewCorners {
        /// Number of its corners.
        corners: usize,
    },
    /// An index of a face is out of range.
    #[error("the face uses {what} {index}, but the file has {count}")]
    OutOfRange {
        /// What it is an index of, such as a vertex.
        what: &'static str,
        /// The index, as written.
        index: i64,
        /// How many the file has.
        count: usize,
    },
    /// A face has an index of 0.
    #[error("the face uses {what} 0, but indices start at 1 (or at -1, counting backwards)")]
    IndexZero {
        /// What it is an index of, such as a vertex.
        what: &'static str,
    },
    /// A line has too few numbers.
    #[error("expected {expected} numbers after `{keyword}`")]
    Numbers {
        /// The first word of the line.
        keyword: String,
        /// The required number.
        expected: usize,
    },
    /// A word is not a number, or is NaN or infinite.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// The word, as written.
        text: String,
    },
}
