//! Scenes of other renderers, of any format.
//!
//! What a format adds is a folder with a reader that returns a [`ForeignScene`], a line here and a line in
//! [`SceneFormat`].

use crate::mitsuba;
use crate::model::foreign::{ForeignOptions, ForeignScene};
use crate::pbrt;
use crate::tungsten;
use firstlight_format::error::SceneError;
use firstlight_format::scene_format::SceneFormat;
use firstlight_format::sources::EnvironmentSource;
use std::path::Path;

/// Reads a scene of another renderer with the files that it includes; meshes in files of their own are not read, nor
/// images but those of lights.
///
/// # Errors
/// If the text is not of its format, or names a file that it must not; with file, line and column.
pub(crate) fn read_scene(path: &Path, options: &ForeignOptions) -> Result<ForeignScene, SceneError> {
    let format = SceneFormat::of(path).ok_or_else(|| {
        SceneError::in_file(path, format!("is no scene: expected one of {}", SceneFormat::extensions()))
    })?;
    let scene = match format {
        SceneFormat::Pbrt => pbrt::read(path, options)?,
        SceneFormat::Mitsuba => mitsuba::read_scene(path, options)?,
        SceneFormat::Tungsten => tungsten::read(path, options)?,
    };
    check_any(path, &scene)?;
    scene.file.check().map_err(|error| SceneError::in_file(path, error.to_string()))?;
    Ok(scene)
}

/// An error if nothing is described that can be seen, or if all of it is left out: an environment alone would look as
/// if that were the scene.
fn check_any(path: &Path, scene: &ForeignScene) -> Result<(), SceneError> {
    let first = scene.warnings.iter().find(|warning| warning.contains("left out"));
    let is_environment = scene.file.environment != EnvironmentSource::Black && first.is_none();
    if !scene.file.objects.is_empty() || is_environment {
        return Ok(());
    }
    // Of another format, perhaps.
    let first = first.or_else(|| scene.warnings.iter().find(|warning| warning.contains(">` is not known")));
    let first = first.map_or_else(String::new, |first| format!(": {}", &**first));
    Err(SceneError::in_file(path, format!("has no shape that can be shown{first}")))
}
