//! The paths in a scene file.

use crate::parts::ObjectPart;
use crate::scene_file::SceneFile;
use crate::sources::{BUILTIN_IMAGE, EnvironmentSource, TextureSource};
use firstlight_files::relative::{absolute, relative_path, text_to_path};
use std::path::Path;

/// Makes all paths in `file` that are relative to the folder `from` relative to `to`.
pub fn move_paths(file: &mut SceneFile, from: &Path, to: &Path) {
    let here = Path::new(".");
    let or_here = |folder: &Path| if folder.as_os_str().is_empty() { here.to_path_buf() } else { folder.to_path_buf() };
    let (from, to) = (or_here(from), or_here(to));
    let same = absolute(&from) == absolute(&to);
    let moved = |path: &mut String| {
        // Relative paths stay unchanged if the folder is the same.
        if !(path.is_empty() || same && Path::new(path.as_str()).is_relative()) {
            *path = relative_path(&to, &from.join(text_to_path(path)));
        }
    };
    each_path(file, moved);
}

/// Calls `change` for each path in a scene file.
pub fn each_path(file: &mut SceneFile, mut change: impl FnMut(&mut String)) {
    for object in &mut file.objects {
        if let ObjectPart::Mesh { source, .. } = object {
            source.file_mut().into_iter().for_each(&mut change);
        }
    }
    for (_, texture) in &mut file.textures.0 {
        if let TextureSource::Image { file, .. } = texture
            && !file.starts_with(BUILTIN_IMAGE)
        {
            change(file);
        }
    }
    if let EnvironmentSource::Image { file, .. } = &mut file.environment {
        change(file);
    }
    if let Some(model) = &mut file.animation.model {
        change(&mut model.file);
    }
}
