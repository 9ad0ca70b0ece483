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
use firstlight_files::relative::path_to_text;
use firstlight_files::warnings::Warnings;
use firstlight_files::whole_file::{write_new, write_whole};
use firstlight_files::write_error::WriteError;
use firstlight_format::scene_format::SceneFormat;
use std::path::Path;

/// Writes a scene in the format of another renderer, with a folder of meshes and images beside it. Returns what it
/// cannot say.
///
/// - `overwrite`: whether an existing scene of this name is replaced, with the files that it has of the same names.
///
/// # Errors
/// If a file cannot be written.
pub fn export(scene: &WholeScene, format: SceneFormat, path: &Path, overwrite: bool) -> Result<Warnings, WriteError> {
    if !overwrite && path.exists() {
        return Err(WriteError::Exists(path.to_path_buf()));
    }
    let mut folder = Folder::beside(path, overwrite);
    let mut warnings = scene.losses.clone();
    let text = match format {
        SceneFormat::Pbrt => {
            let image = path.file_stem().map(|stem| path_to_text(stem.as_ref())).unwrap_or_default() + ".exr";
            pbrt::text(scene, &mut folder, &mut warnings, &image)?
        }
        SceneFormat::Mitsuba => mitsuba::text(scene, &mut folder, &mut warnings)?,
    };
    if overwrite {
        write_whole(path, text.as_bytes())?
    } else {
        write_new(path, text.as_bytes())?
    }
    Ok(warnings)
}
