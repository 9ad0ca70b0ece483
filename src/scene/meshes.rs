//! The meshes that a scene names: from OBJ files or made by the program, ready to place.

use super::error::SceneError;
use super::file::{MaterialPart, MeshShadingPart, MeshSourcePart, TexturePart};
use crate::mesh::Mesh;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// What `builtin("…")` may name.
pub const BUILTIN_NAMES: &[&str] = &[];

/// A mesh and the materials that its own file gives its slots.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    pub mesh: Arc<Mesh>,
    /// One a slot; empty when the file has none.
    pub slots: Vec<(String, MaterialPart)>,
    /// Textures that `slots` name.
    pub textures: Vec<(String, TexturePart)>,
    pub warnings: Vec<String>,
}

/// Reads or makes a mesh, then simplifies and shades it as asked.
pub fn load_mesh(
    source: &MeshSourcePart,
    _shading: MeshShadingPart,
    _simplify: Option<f64>,
    folder: &Path,
) -> Result<LoadedMesh, SceneError> {
    match source {
        MeshSourcePart::Obj(file) => Err(SceneError::in_file(folder.join(file), "cannot be read")),
        MeshSourcePart::Builtin(name) => Err(SceneError::new(format!("there is no built-in mesh `{name}`"))),
    }
}

/// What went wrong with a file, in plain words.
pub fn plain_io(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
        io::ErrorKind::InvalidData => "it is not UTF-8 text".to_owned(),
        _ => error.to_string(),
    }
}
