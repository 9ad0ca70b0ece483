//! Scenes as files of other renderers: pbrt-v4 (`.pbrt`) and Mitsuba 3 (`.xml`).
//!
//! A [`WholeScene`] has everything at hand: the scene file, its meshes and its images. `common/surface` takes its
//! materials apart into the plain surfaces that other renderers have, `common/objects` its objects into spheres, squares
//! and meshes; `mitsuba` and `pbrt` write the text, and `common/folder` the meshes (binary PLY) and images beside it.
//! What a format cannot say is told once for each kind. The inverse is `firstlight-import`. Start reading at [`export`].

mod common;
pub(crate) mod mitsuba;
pub(crate) mod pbrt;

pub use common::scene::{WholeScene, WholeTexture};

use crate::common::folder::Folder;
use firstlight_files::printable;
use firstlight_files::relative::{absolute, path_to_text};
use firstlight_files::warnings::Warnings;
use firstlight_files::whole_file::{write_new, write_whole};
use firstlight_files::write_error::WriteError;
use firstlight_format::scene_format::SceneFormat;
use std::path::{Path, PathBuf};

/// What was written.
#[derive(Debug)]
pub struct Exported {
    /// The folder of meshes and images, if there are any.
    pub folder: Option<PathBuf>,
    /// What the format cannot say.
    pub warnings: Warnings,
}

/// A format of scenes that can be written, besides our own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// pbrt, version 4.
    Pbrt,
    /// Mitsuba 3.
    Mitsuba,
}

impl ExportFormat {
    /// All formats.
    pub const ALL: [Self; 2] = [Self::Pbrt, Self::Mitsuba];

    /// File extension, in lower case and without the dot.
    pub fn file_extension(self) -> &'static str {
        match self {
            Self::Pbrt => SceneFormat::Pbrt.file_extension(),
            Self::Mitsuba => SceneFormat::Mitsuba.file_extension(),
        }
    }

    /// The format for the extension of a path, case-insensitive.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        Self::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.file_extension()))
    }
}

/// Writes a scene in the format of another renderer, with a new folder of meshes and images beside it. The scene is
/// written last, so that whatever happens it and its files belong together.
///
/// - `overwrite`: whether an existing scene of this name is replaced. The folder that it had stays.
///
/// # Errors
/// If a file cannot be written.
pub fn export(scene: &WholeScene, format: ExportFormat, path: &Path, overwrite: bool) -> Result<Exported, WriteError> {
    if !overwrite && path.exists() {
        return Err(WriteError::Exists(path.to_path_buf()));
    }
    /// Other processes may take the name of the folder, which the text has as well.
    const ATTEMPTS: u32 = 16;
    let mut attempts = 0;
    let (folder, warnings, text) = loop {
        attempts += 1;
        let mut folder = Folder::beside(path);
        let mut warnings = scene.losses.clone();
        if let Some(target) = elsewhere(path) {
            let [link, target] = [path, &target].map(|path| printable::name(&path_to_text(path)).to_string());
            warnings.push(format!("`{link}` is a link: the scene opens as `{target}`, which has the folder beside it"));
        }
        let text = match format {
            ExportFormat::Pbrt => {
                let image = path.file_stem().map(|stem| path_to_text(stem.as_ref())).unwrap_or_default() + ".exr";
                pbrt::text(scene, &mut folder, &mut warnings, &image)?
            }
            ExportFormat::Mitsuba => mitsuba::text(scene, &mut folder, &mut warnings)?,
        };
        match folder.finish() {
            Err(WriteError::Exists(_)) if attempts < ATTEMPTS => {}
            folder => break (folder?, warnings, text),
        }
    };
    let write = if overwrite { write_whole } else { write_new };
    write(path, text.as_bytes()).inspect_err(|_| {
        // Nothing names its files.
        folder.iter().for_each(|folder| drop(std::fs::remove_dir_all(folder)));
    })?;
    Ok(Exported { folder, warnings })
}

/// Where a scene is written, if that is another folder than its path says.
fn elsewhere(path: &Path) -> Option<PathBuf> {
    let target = absolute(path);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    (target.parent() != Some(&absolute(folder))).then_some(target)
}
