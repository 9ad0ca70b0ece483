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
        /// Why.
        source: ReadError,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// No line describes a face.
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
        /// Number of the line, counted from 1.
        line: usize,
        /// What is wrong with it.
        problem: LineProblem,
    },
    /// The faces use more materials than 16-bit slots can number.
    #[error("{}: uses more than 65,536 materials", path.display())]
    TooManyMaterials {
        /// The OBJ file.
        path: PathBuf,
    },
    /// The triangles are no mesh.
    #[error("{}: {source}", path.display())]
    Mesh {
        /// The OBJ file.
        path: PathBuf,
        /// Why.
        source: MeshError,
    },
}

/// What is wrong with one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineProblem {
    /// A corner of a face has none of the four forms.
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
    /// A face refers to what the file does not have.
    #[error("the face uses {what} {index}, but the file has {count}")]
    OutOfRange {
        /// What the index is of, such as a vertex.
        what: &'static str,
        /// The index, as written.
        index: i64,
        /// How many of them the file has.
        count: usize,
    },
    /// A face has an index of 0.
    #[error("the face uses {what} 0, but indices start at 1 (or at -1, counting backwards)")]
    IndexZero {
        /// What the index is of, such as a vertex.
        what: &'static str,
    },
    /// A line has too few numbers.
    #[error("expected {expected} numbers after `{keyword}`")]
    Numbers {
        /// The word that the line begins with.
        keyword: String,
        /// How many numbers must follow.
        expected: usize,
    },
    /// A number is no number, or NaN or infinite.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// The number, as written.
        text: String,
    },
}
