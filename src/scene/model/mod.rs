//! Models of any format: the list of formats, and one function to read them all.
//!
//! A reader (`scene/obj`, `scene/ply`, `scene/stl`, `scene/gltf`) returns an [`ImportedModel`] or an error with its
//! location in the file. This module holds the code that the readers share: triangulation, normals, and the conversion
//! of indexed vertices to a checked mesh. Start reading at [`load_model`].

pub(in crate::scene) mod assemble;
pub(in crate::scene) mod error;
mod format;
pub(in crate::scene) mod imported;
pub(in crate::scene) mod number;
pub(in crate::scene) mod polygon;
pub(in crate::scene) mod reference;

pub use error::{ModelError, ModelProblem, Place};
pub use format::ModelFormat;
pub use imported::{ImportedModel, ModelNormals, ModelOptions};
pub use reference::Outside;

use super::gltf::baked::load_gltf_with;
use super::obj::load_obj_with;
use super::ply::load_ply_with;
use super::stl::load_stl_with;
use std::path::Path;

/// Loads a model of this format.
///
/// # Errors
/// If the file cannot be read, or is not a model with surface area.
pub fn load_model(path: &Path, format: ModelFormat, options: &ModelOptions) -> Result<ImportedModel, ModelError> {
    match format {
        ModelFormat::Obj => Ok(load_obj_with(path, options)?),
        ModelFormat::Ply => load_ply_with(path, options),
        ModelFormat::Stl => load_stl_with(path, options),
        ModelFormat::Gltf => Ok(load_gltf_with(path, options)?),
    }
}
