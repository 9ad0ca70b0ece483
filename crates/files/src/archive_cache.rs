//! Where archives are unpacked: a cache, whose files may be deleted at any time.

use crate::relative::absolute;
use std::path::{Component, Path, PathBuf};

/// The folder below which each archive has one of its own.
pub fn archive_cache() -> PathBuf {
    of_platform().unwrap_or_else(|| std::env::temp_dir().join("firstlight")).join("packed")
}

fn of_platform() -> Option<PathBuf> {
    directories::ProjectDirs::from("", "", "firstlight").map(|it| it.cache_dir().to_path_buf())
}

/// The folder of the archive that a file was unpacked from; `None` for all other files.
pub fn unpacked_folder(path: &Path) -> Option<PathBuf> {
    let cache = absolute(&archive_cache());
    match absolute(path).strip_prefix(&cache).ok()?.components().next()? {
        Component::Normal(name) => Some(cache.join(name)),
        _ => None,
    }
}
