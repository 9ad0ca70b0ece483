//! Why a model could not be loaded: which file, which place in it, what was expected.

use crate::mesh::MeshError;
use crate::scene::gltf::error::GltfError;
use crate::scene::input_file::ReadError;
use crate::scene::obj::ObjError;
use crate::scene::ply::PlyProblem;
use crate::scene::stl::StlProblem;
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
        /// Where in it.
        place: Place,
        /// What is wrong there.
        #[source]
        problem: ModelProblem,
    },
}

impl ModelError {
    pub(in crate::scene) fn of(path: &Path, place: Place, problem: impl Into<ModelProblem>) -> Self {
        Self::File { path: path.to_owned(), place, problem: problem.into() }
    }
}

/// A place in a file. Shown, it follows the name of the file.
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

/// What is wrong with a PLY or STL file.
#[derive(Debug, thiserror::Error)]
pub enum ModelProblem {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// What only PLY files can have.
    #[error(transparent)]
    Ply(#[from] PlyProblem),
    /// What only STL files can have.
    #[error(transparent)]
    Stl(#[from] StlProblem),
    /// Every triangle has zero area.
    #[error("all {triangles} triangles are degenerate (zero area)")]
    NoArea {
        /// Number of its triangles.
        triangles: usize,
    },
    /// The triangles are no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
