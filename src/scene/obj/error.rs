use crate::mesh::MeshError;
use crate::scene::ReadError;
use std::path::PathBuf;

/// Why an OBJ file could not be loaded: which file, which line, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum ObjError {
    #[error("{}: {source}", path.display())]
    Read { path: PathBuf, source: ReadError },
    /// A whole sentence.
    #[error("{0}")]
    Write(String),
    #[error("{}: has no faces (lines starting with `f`): is it a Wavefront OBJ file?", path.display())]
    NoFaces { path: PathBuf },
    #[error(
        "{}: all {triangles} triangles are degenerate (zero area)",
        path.display()
    )]
    NoArea { path: PathBuf, triangles: usize },
    #[error("{}:{line}: {problem}", path.display())]
    Line { path: PathBuf, line: usize, problem: LineProblem },
    #[error("{}: uses more than 65,536 materials", path.display())]
    TooManyMaterials { path: PathBuf },
    #[error("{}: {source}", path.display())]
    Mesh { path: PathBuf, source: MeshError },
}

/// What is wrong with one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineProblem {
    #[error("`{text}` is not a face corner; expected v, v/vt, v//vn or v/vt/vn with whole numbers")]
    FaceCorner { text: String },
    #[error("the face has {corners} corners, but needs at least 3")]
    FewCorners { corners: usize },
    #[error("the face uses {what} {index}, but the file has {count}")]
    OutOfRange { what: &'static str, index: i64, count: usize },
    #[error("the face uses {what} 0, but indices start at 1 (or at -1, counting backwards)")]
    IndexZero { what: &'static str },
    #[error("expected {expected} numbers after `{keyword}`")]
    Numbers { keyword: String, expected: usize },
    #[error("`{text}` is not a finite number")]
    NotFinite { text: String },
}
