use firstlight_files::input_file::ReadError;
use firstlight_files::write_error::WriteError;
use firstlight_mesh::MeshError;
use std::path::PathBuf;

/// Why an OBJ file could not be loaded.
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
    /// The file has no faces, or none that can be used.
    #[error("{}: has no faces (lines starting with `f`){reason}", path.display())]
    NoFaces {
        /// The OBJ file.
        path: PathBuf,
        /// What it has instead, and what to do.
        reason: String,
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
