//! Mitsuba 3: scenes in XML with meshes in files of their own (OBJ, PLY, `.serialized`).
//!
//! The text becomes a graph of plugins with typed parameters ([`read`]), which the parts of a scene file are made of:
//! [`camera`], [`shape`], [`bsdf`], [`texture`], [`emitter`], put together in [`scene`]. What is not modelled is told,
//! with its place. Colours are those of Mitsuba's RGB variants. Start reading at [`read_scene`].
//!
//! Source: <https://mitsuba.readthedocs.io>

pub(crate) mod backs;
mod bsdf;
pub(crate) mod camera;
mod converter;
pub(crate) mod emitter;
pub(crate) mod graph;
mod lenient;
pub(crate) mod meshes;
mod older;
mod parameters;
pub(crate) mod read;
pub(crate) mod scene;
pub(crate) mod serialized;
pub(crate) mod shape;
mod sheet;
pub(crate) mod spectrum;
mod sunsky;
#[cfg(test)]
mod tests;
pub(crate) mod texture;
pub(crate) mod transform;
pub(crate) mod words;

use crate::mitsuba::converter::Converter;
use crate::mitsuba::scene::Converted;
use crate::model::foreign::{ForeignOptions, ForeignScene};
use firstlight_files::reference::References;
use firstlight_files::relative::path_to_text;
use firstlight_files::warnings::Warnings;
use firstlight_format::error::SceneError;
use std::collections::HashSet;
use std::path::Path;

/// Reads a scene with its meshes.
///
/// # Errors
/// If a file is not XML, or has an element or a value that no scene may have; with file, line and column.
pub(crate) fn read_scene(path: &Path, options: &ForeignOptions) -> Result<ForeignScene, SceneError> {
    let mut warnings = Warnings::default();
    let graph = read::read_graph(path, &options.defines, options.allow_outside, &mut warnings)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let name = path.file_name().map(|name| path_to_text(name.as_ref())).unwrap_or_default();
    let references = References::of(path, options.allow_outside);
    let Converted { file, parts, part_files, warnings: of_parts } =
        Converter::new(&graph, references, folder, name, options).convert()?;
    warnings.append(&of_parts);
    let of_text = graph.files.iter().map(|file| (file.path.clone(), file.stamp));
    let mut known = HashSet::new();
    let files =
        of_text.chain(graph.other_files.iter().cloned()).filter(|(path, _)| known.insert(path.clone())).collect();
    Ok(ForeignScene { file, parts, part_files, warnings, files })
}
