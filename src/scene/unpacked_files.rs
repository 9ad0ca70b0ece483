//! A scene of an archive that is saved elsewhere takes copies of its files along: where they are unpacked they may be
//! deleted at any time.

use crate::files::archive_cache::unpacked_folder;
use crate::files::input_file::{FileKind, InputFile};
use crate::files::new_folder::NewFolder;
use crate::files::relative::{absolute, path_to_text, text_to_path};
use crate::files::whole_file::{Replace, WholeFile, unwritable};
use crate::files::write_error::WriteError;
use crate::format::paths::each_path;
use crate::format::scene_file::SceneFile;
use std::ffi::OsStr;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Copies of archives beside a scene file.
#[derive(Default)]
pub(super) struct Copies {
    /// A remark for each.
    pub notes: Vec<String>,
    /// Those that do not have their names yet.
    begun: Vec<(NewFolder, PathBuf)>,
}

impl Copies {
    /// Gives the copies their names, then calls `write` for the scene; without a scene there are no copies.
    pub fn finish(self, write: impl FnOnce() -> Result<(), WriteError>) -> Result<(), WriteError> {
        let mut finished = Vec::new();
        let finish = |(copy, path): (NewFolder, PathBuf)| copy.finish(OsStr::new("")).map(|()| finished.push(path));
        let result = self.begun.into_iter().try_for_each(finish).and_then(|()| write());
        if result.is_err() {
            finished.iter().for_each(|path| drop(std::fs::remove_dir_all(path)));
        }
        result
    }
}

/// Copies the archives that a scene file in `folder` refers to into folders beside it, and refers to the copies.
///
/// - `stem`: name of the scene file without its extension.
pub(super) fn keep_unpacked(file: &mut SceneFile, folder: &Path, stem: &str) -> Result<Copies, WriteError> {
    if unpacked_folder(&folder.join("scene")).is_some() {
        return Ok(Copies::default());
    }
    let mut begun = Vec::new();
    let mut copies: Vec<(PathBuf, String)> = Vec::new();
    let mut failed = None;
    each_path(file, |path| {
        let place = folder.join(text_to_path(path));
        let Some(root) = unpacked_folder(&place).filter(|_| !path.is_empty() && failed.is_none()) else { return };
        let known = copies.iter().find(|(of, _)| *of == root).map(|(_, name)| name.clone());
        let name = match known.map_or_else(|| copy(&root, folder, stem, &mut begun), Ok) {
            Ok(name) => name,
            Err(error) => return failed = Some(error),
        };
        if let Ok(inside) = absolute(&place).strip_prefix(&root) {
            *path = format!("{name}/{}", path_to_text(inside).replace('\\', "/"));
        }
        if !copies.iter().any(|(of, _)| *of == root) {
            copies.push((root, name));
        }
    });
    match failed {
        Some(error) => Err(error),
        None => {
            let note = |(_, name)| format!("the files of the archive are in {name}");
            Ok(Copies { notes: copies.into_iter().map(note).collect(), begun })
        }
    }
}

/// Copies a folder to one beside the scene, which is added to `begun`; one that has the same files already is used.
/// Returns its name.
fn copy(root: &Path, folder: &Path, stem: &str, begun: &mut Vec<(NewFolder, PathBuf)>) -> Result<String, WriteError> {
    let files = files_below(root).map_err(|source| unwritable(root, source))?;
    let mut names = (1..=u32::MAX).map(|number| match number {
        1 => format!("{stem}-files"),
        _ => format!("{stem}-files-{number}"),
    });
    let usable = |name: &String| {
        let copy = folder.join(text_to_path(name));
        let is_begun = begun.iter().any(|(_, path)| *path == copy);
        !is_begun && (!copy.exists() || files.iter().all(|file| has_same_bytes(&root.join(file), &copy.join(file))))
    };
    let name = names.find(usable).ok_or_else(|| WriteError::NoFreeName(folder.join(stem)))?;
    let copy = folder.join(text_to_path(&name));
    if copy.exists() {
        return Ok(name);
    }
    let new = NewFolder::begin(&copy)?;
    let copy_one = |file: &PathBuf| {
        let (from, to) = (root.join(file), new.part().join(file));
        let mut input = InputFile::open_within(&from, FileKind::Film, u64::MAX).map_err(|e| unwritable(&to, e))?;
        let mut output = WholeFile::begin(&to, Replace::AllButFilms)?;
        io::copy(&mut input, &mut output).map_err(|error| unwritable(&to, error))?;
        output.finish()
    };
    files.iter().try_for_each(copy_one).map_err(|error| new.error(error))?;
    begun.push((new, copy));
    Ok(name)
}

/// All that a scene may refer to below a folder, relative to it.
fn files_below(root: &Path) -> io::Result<Vec<PathBuf>> {
    let (mut found, mut folders) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root.join(&folder))? {
            let entry = entry?;
            let (kind, path) = (entry.file_type()?, folder.join(entry.file_name()));
            if kind.is_dir() {
                folders.push(path);
            } else if kind.is_file() && path != Path::new("SHA256SUMS") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn has_same_bytes(a: &Path, b: &Path) -> bool {
    let open = |path: &Path| InputFile::open_within(path, FileKind::Film, u64::MAX).ok();
    let (Some(a), Some(b)) = (open(a), open(b)) else { return false };
    a.length() == b.length()
        && io::BufReader::new(a).bytes().map(Result::ok).eq(io::BufReader::new(b).bytes().map(Result::ok))
}
