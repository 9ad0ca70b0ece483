//! Tungsten: scenes in JSON with meshes in files of their own (`.wo3`, OBJ).
//!
//! [`fields`] reads values by name and tells of those of another kind; [`camera`], [`surfaces`], [`textures`],
//! [`primitives`] and [`lights`] make the parts of a scene file, with meshes of [`meshes`], put together in
//! [`converter`]. Nothing refuses a scene but text that is none: what is not modelled is told. Lengths are metres.
//! Start reading at [`read`].
//!
//! Source of what a field means: <https://github.com/tunabrain/tungsten>

mod camera;
mod converter;
mod fields;
mod lights;
mod meshes;
mod primitives;
mod surfaces;
mod textures;
mod transforms;

use crate::model::foreign::{ForeignOptions, ForeignScene, MAX_OBJECTS};
use crate::tungsten::converter::Converter;
use crate::tungsten::fields::Source;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::limits::Limits;
use firstlight_files::stamp::stamp;
use firstlight_format::error::SceneError;
use serde_json::Value;
use std::cell::RefCell;
use std::path::Path;

/// A value takes up to a hundred times the memory of its text.
const SCENE_BYTES_PER_BYTE: u64 = 16;

/// Reads a scene with its meshes.
///
/// # Errors
/// If the file is not JSON, with line and column, or no scene.
pub(crate) fn read(path: &Path, options: &ForeignOptions) -> Result<ForeignScene, SceneError> {
    let before = stamp(path);
    let limit = Limits::of_this_process().scene_bytes / SCENE_BYTES_PER_BYTE;
    let text = InputFile::open_within(path, FileKind::Scene, limit).and_then(InputFile::text);
    let text = text.map_err(|error| SceneError::in_file(path, error.to_string()))?;
    let root: Value = serde_json::from_str(&text).map_err(|error| {
        let message = error.to_string();
        let message = message.rsplit_once(" at line ").map_or(&*message, |(message, _)| message);
        SceneError::at(path, (error.line(), error.column()), format!("is not JSON: {message}"))
    })?;
    let Some(primitives) = root.get("primitives").and_then(Value::as_array) else {
        return Err(SceneError::in_file(path, "is no scene of Tungsten: it has no list of `primitives`"));
    };
    if primitives.len() > MAX_OBJECTS {
        return Err(SceneError::in_file(path, format!("has more than {MAX_OBJECTS} primitives")));
    }
    let source = Source { path, told: RefCell::default() };
    Converter::new(&root, &source, options).convert(before)
}
