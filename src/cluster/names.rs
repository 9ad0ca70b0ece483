//! ArchiveNames of files in a package: which of them keep their places, and which lie outside of the folder that was opened.
//!
//! A place is told twice: as it is named, which decides the name in the package, and where it really lies behind symbolic
//! links, which decides whether it is outside.

use crate::scene::{ReadFiles, path_to_text, text_to_path};
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

/// A path that cannot be a name in a package.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be packed: its name is not UTF-8", .0.display())]
pub struct NotUtf8(PathBuf);

/// The folder of what has no place in a package.
pub(super) const OUTSIDE: &str = "outside";

/// Whether a name in an archive is one for every system, and stays in its folder: parts between `/` that have no
/// control character, `\\` or `:`.
pub(super) fn is_portable(name: &str) -> bool {
    let is_part = |part: &str| !matches!(part, "" | "." | "..");
    name.split('/').all(is_part) && !name.contains(['\\', ':']) && !name.contains(char::is_control)
}

/// A line of a list of checksums, as `sha256sum` writes it: with `\\` before a name in which something is escaped.
pub(super) fn checksum_line(sum: &str, name: &str) -> String {
    let escaped = name.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r");
    let mark = if escaped == name { "" } else { "\\" };
    format!("{mark}{sum}  {escaped}\n")
}

/// Where a file lies, from the root of the system, without `.` and `..`; links in it are not followed, so that what is
/// named relative to it is found.
pub(super) fn place(path: &Path) -> PathBuf {
    place_behind_link(path).unwrap_or_else(|| as_named(path))
}

/// Where a file lies whose path has a `..` behind a symbolic link, and so leads elsewhere than its text says.
pub(super) fn place_behind_link(path: &Path) -> Option<PathBuf> {
    match (as_named(path).canonicalize(), path.canonicalize()) {
        (Ok(a), Ok(b)) if a != b => Some(b),
        _ => None,
    }
}

/// The absolute path without `.` and `..`, by its text.
fn as_named(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut place = PathBuf::new();
    for part in absolute.components() {
        match part {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            part => place.push(part),
        }
    }
    place
}

/// Whether a name goes into a folder and back: a package need not have that folder.
pub(super) fn turns_back(name: &str) -> bool {
    let path = text_to_path(name);
    let is_back = |part: &Component| *part == Component::ParentDir;
    path.components().skip_while(is_back).any(|part| is_back(&part))
}

/// The innermost folder that all files are below.
pub(super) fn common_folder<'a>(places: impl Iterator<Item = &'a PathBuf>) -> PathBuf {
    let mut common: Option<PathBuf> = None;
    for place in places {
        let folder = place.parent().unwrap_or(place);
        common = Some(match common {
            None => folder.to_path_buf(),
            Some(common) => {
                common.components().zip(folder.components()).take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
            }
        });
    }
    common.unwrap_or_default()
}

/// Where a name in `folder` leads in a package; `None` out of it.
pub(super) fn place_in(folder: &Path, name: &str) -> Option<String> {
    let mut place = PathBuf::new();
    for part in folder.join(text_to_path(name)).components() {
        match part {
            Component::Normal(part) => place.push(part),
            Component::CurDir => {}
            Component::ParentDir if place.pop() => {}
            _ => return None,
        }
    }
    Some(path_to_text(&place))
}

/// A folder, as it is named and where it really lies.
#[derive(Clone)]
struct Folder {
    place: PathBuf,
    real: PathBuf,
}

impl Folder {
    fn new(place: PathBuf) -> Self {
        Self { real: real(&place), place }
    }

    /// Whether a place is below, by its name and really.
    fn has(&self, place: &Path) -> bool {
        place.starts_with(&self.place) && real(place).starts_with(&self.real)
    }
}

/// Where a place is behind symbolic links.
fn real(place: &Path) -> PathBuf {
    place.canonicalize().unwrap_or_else(|_| place.to_path_buf())
}

/// ArchiveNames of files in a package.
pub(super) struct ArchiveNames {
    /// The folder of what is opened; `None`: it is in none.
    home: Option<Folder>,
    /// What lies below keeps its place; `None`: nothing does.
    base: Option<Folder>,
    /// Whether all files keep their places, since nothing that names them is rewritten.
    is_fixed: bool,
    /// Folders elsewhere, with their names.
    folders: HashMap<PathBuf, String>,
    /// The number of the last such name.
    last: usize,
    /// Numbers that files of the base have already, as an unpacked package does.
    taken: Vec<PathBuf>,
    /// Files that are not below the home, with their names in the package.
    pub outside: Vec<(PathBuf, String)>,
}

impl ArchiveNames {
    /// - `home`, `base`: as they are named.
    pub fn new(home: Option<PathBuf>, base: Option<PathBuf>, is_fixed: bool, reads: &[ReadFiles]) -> Self {
        let all = reads.iter().flat_map(|read| &read.files).map(|path| place(path));
        let taken = all.filter_map(|place| Some(place.strip_prefix(base.as_ref()?).ok()?.to_path_buf()));
        let taken = taken.filter(|name| name.starts_with(OUTSIDE)).collect();
        let [home, base] = [home, base].map(|folder| folder.map(Folder::new));
        Self { home, base, is_fixed, folders: HashMap::new(), last: 0, taken, outside: Vec::new() }
    }

    /// The name of a file that keeps its place below the base.
    ///
    /// # Errors
    /// When it is not UTF-8.
    pub fn keep(&mut self, path: &Path) -> Result<String, NotUtf8> {
        let place = place(path);
        let below = self.base.as_ref().and_then(|base| place.strip_prefix(&base.place).ok());
        let name = text_of(below.unwrap_or_else(|| Path::new(place.file_name().unwrap_or_default())), &place)?;
        self.tell(path, &place, &name);
        Ok(name)
    }

    /// The name of the file that is opened.
    ///
    /// # Errors
    /// When it is not UTF-8.
    pub fn opened(&self, path: &Path) -> Result<String, NotUtf8> {
        text_of(Path::new(path.file_name().unwrap_or_default()), path)
    }

    /// ArchiveNames for a file and those that it names, which stay in their places relative to each other.
    ///
    /// # Errors
    /// When one is not UTF-8.
    pub fn of(&mut self, paths: &[PathBuf]) -> Result<Vec<String>, NotUtf8> {
        let places: Vec<PathBuf> = paths.iter().map(|path| place(path)).collect();
        let keeps = |base: &Folder| match self.is_fixed {
            true => places.iter().all(|place| place.starts_with(&base.place)),
            false => places.iter().all(|place| base.has(place)),
        };
        if self.base.as_ref().is_some_and(keeps) {
            return paths.iter().map(|path| self.keep(path)).collect();
        }
        let root = common_folder(places.iter());
        let folder = match self.folders.get(&root) {
            Some(folder) => folder.clone(),
            None => {
                let folder = loop {
                    self.last += 1;
                    let folder = format!("{OUTSIDE}/{}", self.last);
                    if !self.taken.iter().any(|name| name.starts_with(&folder)) {
                        break folder;
                    }
                };
                self.folders.insert(root.clone(), folder.clone());
                folder
            }
        };
        let mut names = Vec::new();
        for (path, place) in paths.iter().zip(&places) {
            let name = format!("{folder}/{}", text_of(place.strip_prefix(&root).unwrap_or(place), place)?);
            self.tell(path, place, &name);
            names.push(name);
        }
        Ok(names)
    }

    /// Notes a file that is not in the home; one behind a link with the file that the link leads to.
    fn tell(&mut self, path: &Path, place: &Path, name: &str) {
        let home = self.home.as_ref();
        if home.is_some_and(|home| home.has(place)) || self.outside.iter().any(|(_, known)| known == name) {
            return;
        }
        let is_link = home.is_some_and(|home| place.starts_with(&home.place));
        let path = if is_link { real(place) } else { path.to_path_buf() };
        self.outside.push((path, name.to_owned()));
    }
}

fn text_of(name: &Path, place: &Path) -> Result<String, NotUtf8> {
    name.to_str().map(|_| path_to_text(name)).ok_or_else(|| NotUtf8(place.to_path_buf()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_have_one_name_and_one_folder_above_them() {
        assert_eq!(place(Path::new("/a/b/../c/./d")), Path::new("/a/c/d"));
        let places = ["/a/b/c.ron", "/a/d/e.obj", "/a/b/f/g.png"].map(PathBuf::from);
        assert_eq!(common_folder(places.iter()), Path::new("/a"));
        assert_eq!(common_folder(places[..1].iter()), Path::new("/a/b"));
        assert_eq!(place_in(Path::new("a"), "../b/./c"), Some("b/c".to_owned()));
        for (name, turns) in
            [("a.png", false), ("../../b/a.png", false), ("./a", false), ("b/../a", true), ("../b/../a", true)]
        {
            assert_eq!(turns_back(name), turns, "{name}");
        }
        assert_eq!((place_in(Path::new("a"), "../../b"), place_in(Path::new("a"), "/b")), (None, None));
    }

    #[test]
    fn names_are_portable_and_escaped_as_sha256sum_does() {
        for name in ["s.ron", "maps/a b.png", "日本語/..a", "$(x)"] {
            assert!(is_portable(name), "{name}");
            assert_eq!(checksum_line("0", name), format!("0  {name}\n"));
        }
        for name in ["", "/a", "a/", "a//b", "./a", "a/../b", "a\nb", "a\rb", "C:a", "a\\b", "\0", "a\u{1b}b"] {
            assert!(!is_portable(name), "{name:?}");
        }
        assert_eq!(checksum_line("0", "a\nb\r\\c"), "\\0  a\\nb\\r\\\\c\n");
    }
}
