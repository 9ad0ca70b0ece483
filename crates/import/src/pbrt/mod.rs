//! pbrt, versions 3 and 4: a scene in text, with PLY files beside it.
//!
//! Words (`tokens`), arguments (`cursor`, `params`) and directives (`directives`) with the graphics state (`state`); what
//! they describe is collected (`build`, `geometry`, `instances`, `area_lights`, `surfaces`) from `shapes`, `materials`, `textures`,
//! `lights` and `spectrum`, and the camera and film before the world are in `view`. What version 3 says otherwise is
//! known by its names: its materials are in `version3`. Lengths are metres. Start reading at [`read`].
//!
//! Source of what a directive means: the description of the format, "pbrt-v4 Input File Format", and Pharr, Jakob and
//! Humphreys 2023, "Physically Based Rendering", fourth edition.

mod area_lights;
mod build;
mod cursor;
mod curves;
mod directives;
mod geometry;
mod instances;
mod lights;
mod material_inputs;
mod materials;
mod named_spectra;
mod params;
mod shapes;
mod spectrum;
mod state;
mod strands;
mod subdivision;
mod surfaces;
#[cfg(test)]
mod tests;
mod textures;
mod tokens;
mod transforms;
mod version3;
mod view;

use crate::model::foreign::{ForeignOptions, ForeignScene};
use crate::pbrt::directives::Reader;
use firstlight_format::error::SceneError;
use firstlight_format::scene_file::SceneFile;
use std::collections::HashMap;
use std::path::Path;

/// Reads a scene with the files that it includes.
///
/// # Errors
/// If the text is not of the format, or includes what it must not; with file, line and column.
pub(crate) fn read(path: &Path, options: &ForeignOptions) -> Result<ForeignScene, SceneError> {
    let (view, mut builder, mut files) = Reader::read(path, options)?.finish()?;
    builder.finish_strands();
    builder.add_missing_uvs();
    builder.keep_used_materials();
    files.extend(builder.files);
    let file = SceneFile {
        film: view.film,
        max_depth: Some(view.max_depth),
        display: view.display,
        environment: builder.environment,
        textures: builder.used_textures.into_iter().collect(),
        materials: builder.materials.into_iter().collect(),
        objects: builder.objects,
        lights: builder.lights,
        ..SceneFile::new(view.camera)
    };
    let (parts, warnings, files) = (builder.parts, builder.warnings, files.into());
    Ok(ForeignScene { file, parts, part_files: HashMap::new(), warnings, files })
}
