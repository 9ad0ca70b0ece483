//! Paths as a file says them that lies somewhere else.

use std::path::{Component, Path, PathBuf};

/// The path with everything that leads to it, links resolved where it exists.
pub fn absolute(path: &Path) -> PathBuf {
    if let Ok(path) = path.canonicalize() {
        return path;
    }
    // It need not be there yet; its folder is.
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    match (absolute.parent().and_then(|folder| folder.canonicalize().ok()), absolute.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => absolute,
    }
}

/// How to get from `folder` to `path`, with `/` between the parts; the whole path where they share no more than the
/// root.
pub fn relative_path(folder: &Path, path: &Path) -> String {
    let (folder, path) = (absolute(folder), absolute(path));
    let (from, to): (Vec<Component>, Vec<Component>) = (folder.components().collect(), path.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let is_name = |component: &&Component| matches!(component, Component::Normal(_));
    if !from[..shared].iter().any(|component| is_name(&component)) && !from[shared..].is_empty() {
        return path.to_string_lossy().into_owned();
    }
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = to[shared..].iter().map(|component| component.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_one_folder_to_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for name in ["a/b", "c"] {
            std::fs::create_dir_all(root.join(name)).unwrap();
        }
        for (from, to, expected) in [
            ("a", "a/room.ron", "room.ron"),
            ("a", "a/b/room.ron", "b/room.ron"),
            ("a/b", "c/new.ron", "../../c/new.ron"),
            ("", "c/new.ron", "c/new.ron"),
        ] {
            let relative = relative_path(&root.join(from), &root.join(to));
            assert_eq!(relative, expected);
            assert_eq!(absolute(&root.join(from).join(relative)), absolute(&root.join(to)));
        }
        #[cfg(unix)]
        assert_eq!(relative_path(Path::new("/proc"), Path::new("/etc/none")), "/etc/none");
    }
}
