//! Models of any format.

use crate::error::ModelError;
use crate::gltf::baked::load_gltf_with;
use crate::model::imported::{ImportedModel, ModelOptions};
use crate::obj::load_obj_with;
use crate::ply::load_ply_with;
use crate::stl::load_stl_with;
use firstlight_format::model_format::ModelFormat;
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
