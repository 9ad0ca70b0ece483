//! Errors of model files: which file, which location in it, what was expected.

pub(crate) mod gltf;
pub(crate) mod obj;
pub(crate) mod ply;
pub(crate) mod stl;
pub(crate) mod together;

use crate::error::gltf::GltfError;
use crate::error::obj::ObjError;
use crate::error::ply::PlyProblem;
use crate::error::stl::StlProblem;
use firstlight_files::input_file::ReadError;
use firstlight_mesh::MeshError;
use std::fmt;
use std::path::{Path, PathBuf};

/// Why a model could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// An OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// A glTF file.
    #[error(transparent)]
    Gltf(#[from] Box<GltfError>),
    /// A PLY or STL file.
    #[error("{}{place}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Location in the file.
        place: Place,
        /// The problem there.
        #[source]
        problem: ModelProblem,
    },
}

impl ModelError {
    pub(crate) fn of(path: &Path, place: Place, problem: impl Into<ModelProblem>) -> Self {
        Self::File { path: path.to_owned(), place, problem: problem.into() }
    }
}

/// A location in a file. Displayed, it follows the name of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ": at byte {byte}"),
        }
    }
}

/// A problem of a PLY or STL file.
#[derive(Debug, thiserror::Error)]
pub enum ModelProblem {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Specific to PLY files.
    #[error(transparent)]
    Ply(#[from] PlyProblem),
    /// Specific to STL files.
    #[error(transparent)]
    Stl(#[from] StlProblem),
    /// Every triangle has zero area.
    #[error("all {triangles} triangles are degenerate (zero area)")]
    NoArea {
        /// Number of its triangles.
        triangles: usize,
    },
    /// The triangles do not form a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
