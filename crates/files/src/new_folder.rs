//! A folder of files that appears whole or not at all: filled under a temporary name on the same disk, then renamed. If
//! that fails, or the program is stopped, nothing is left of it.

use crate::relative::absolute;
use crate::whole_file::{InProgress, unwritable};
use crate::write_error::WriteError;
use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder that is being filled and does not have its final name yet. If it is dropped, it is removed.
pub struct NewFolder {
    part: TempDir,
    /// The path as given.
    path: PathBuf,
    /// The path with all links resolved.
    target: PathBuf,
    in_progress: InProgress,
    /// Tells other processes that this one fills it; `None` where folders cannot be locked.
    _lock: Option<File>,
}

impl NewFolder {
    /// Begins a folder that is to be at `path`: beside it or, where there is a folder already, which may be all that can
    /// be written, inside it.
    ///
    /// # Errors
    /// If no folder can be made there.
    pub fn begin(path: &Path) -> Result<Self, WriteError> {
        let target = absolute(path);
        let around = if target.is_dir() { &target } else { target.parent().unwrap_or(&target) };
        let no_folder = |source| WriteError::NoFolder { folder: path.to_path_buf(), source };
        std::fs::create_dir_all(around).map_err(no_folder)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As the user has it for new folders: others of a cluster read it.
            builder.permissions(std::fs::Permissions::from_mode(0o777));
        }
        remove_left_over(around);
        let (part, lock) = locked_part(&builder, around).map_err(no_folder)?;
        let in_progress = InProgress::of(part.path());
        in_progress.check().map_err(no_folder)?;
        Ok(Self { part, path: path.to_path_buf(), target, in_progress, _lock: lock })
    }

    /// Where it is until it is finished.
    pub fn part(&self) -> &Path {
        self.part.path()
    }

    /// An error of a file in it, with the name that the file is to have.
    pub fn error(&self, error: WriteError) -> WriteError {
        error.of_moved(self.part(), &self.path)
    }

    /// Gives a file of it the name that the folder was to have, in place of an existing file.
    ///
    /// # Errors
    /// If it cannot be renamed.
    pub fn finish_file(self, name: &OsStr) -> Result<(), WriteError> {
        let file = self.part().join(name);
        let renamed = self.in_progress.check().and_then(|()| std::fs::rename(file, &self.target));
        renamed.map_err(|error| unwritable(&self.path, error))
    }

    /// Gives the folder its name. It may take the place of an empty one; nothing else is replaced.
    ///
    /// - `last`: the entry that shows others that the folder is whole.
    ///
    /// # Errors
    /// If there is something of this name, or the folder cannot be renamed.
    pub fn finish(self, last: &OsStr) -> Result<(), WriteError> {
        let failed = |error: io::Error| match error.kind() {
            ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty => WriteError::Exists(self.path.clone()),
            _ => unwritable(&self.path, error),
        };
        self.in_progress.check().map_err(failed)?;
        let result = if self.part().parent() == Some(&self.target) {
            self.empty_into_target(last)
        } else {
            // No system replaces a folder that has files.
            std::fs::rename(self.part(), &self.target)
        };
        result.map_err(failed)
    }

    /// Moves what is in the folder to the one around it, which has nothing but empty folders.
    fn empty_into_target(&self, last: &OsStr) -> io::Result<()> {
        let mut names: Vec<_> =
            std::fs::read_dir(self.part())?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<_>>()?;
        names.sort_by_key(|name| name == last);
        for name in names {
            let to = self.target.join(&name);
            match std::fs::remove_dir(&to) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(ErrorKind::AlreadyExists.into()),
                // A file that is there by now is not replaced, where the disk has links.
                _ => match std::fs::hard_link(self.part().join(&name), &to) {
                    Err(error) if error.kind() == ErrorKind::AlreadyExists => return Err(error),
                    Ok(()) => {}
                    Err(_) => std::fs::rename(self.part().join(&name), to)?,
                },
            }
        }
        Ok(())
    }
}

const PREFIX: &str = ".firstlight-";
const SUFFIX: &str = ".part";

/// Makes a temporary folder and locks it.
fn locked_part(builder: &tempfile::Builder, around: &Path) -> io::Result<(TempDir, Option<File>)> {
    /// Another process that begins at the same moment may take a new folder for one left over.
    const ATTEMPTS: u32 = 16;
    for _ in 0..ATTEMPTS {
        let part = builder.tempdir_in(around)?;
        match File::open(part.path()).map(|folder| (folder.try_lock(), folder)) {
            Ok((Ok(()), folder)) if part.path().exists() => return Ok((part, Some(folder))),
            Ok((Ok(()) | Err(TryLockError::WouldBlock), _)) => {}
            // Not every system and disk locks folders.
            _ => return Ok((part, None)),
        }
    }
    Err(io::Error::other("other processes remove its temporary folder"))
}

/// Removes the temporary folders of processes that were killed: nobody holds their locks.
fn remove_left_over(around: &Path) {
    let Ok(entries) = std::fs::read_dir(around) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        let is_part = name.starts_with(PREFIX.as_bytes()) && name.ends_with(SUFFIX.as_bytes());
        // Links are none.
        if is_part && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            let lock =
                File::open(entry.path()).and_then(|folder| folder.try_lock().map(|()| folder).map_err(io::Error::from));
            if let Ok(_lock) = lock {
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap().flatten();
        let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    fn filled(path: &Path) -> NewFolder {
        let folder = NewFolder::begin(path).unwrap();
        std::fs::create_dir(folder.part().join("parts")).unwrap();
        std::fs::write(folder.part().join("job.json"), "new").unwrap();
        folder
    }

    #[test]
    fn a_folder_appears_whole_and_a_dropped_one_leaves_nothing() {
        let root = tempfile::tempdir().unwrap();
        let [new, empty] = ["new", "empty"].map(|name| root.path().join(name));
        std::fs::create_dir_all(empty.join("parts")).unwrap();
        drop((filled(&new), filled(&empty)));
        assert_eq!((names(root.path()), names(&empty)), (vec!["empty".to_owned()], vec!["parts".to_owned()]));
        for path in [&new, &empty] {
            filled(path).finish(OsStr::new("job.json")).unwrap();
            assert_eq!(names(path), ["job.json", "parts"]);
        }
        assert_eq!(names(root.path()), ["empty", "new"]);
    }

    #[test]
    fn errors_name_the_files_as_they_are_to_be() {
        let root = tempfile::tempdir().unwrap();
        let new = NewFolder::begin(&root.path().join("job")).unwrap();
        let error = new.error(unwritable(&new.part().join("scene/a.png"), io::Error::from(ErrorKind::StorageFull)));
        let told = format!("{}: cannot be written: the disk is full", root.path().join("job/scene/a.png").display());
        assert_eq!(error.to_string(), told);
    }

    /// Two that were begun at once: the first to finish wins, and the other one changes nothing.
    #[test]
    fn what_is_there_is_not_replaced() {
        for is_there in [false, true] {
            let root = tempfile::tempdir().unwrap();
            let path = root.path().join("job");
            if is_there {
                std::fs::create_dir(&path).unwrap();
            }
            let (first, second) = (filled(&path), filled(&path));
            std::fs::write(first.part().join("job.json"), "first").unwrap();
            std::fs::write(first.part().join("parts/film"), "").unwrap();
            first.finish(OsStr::new("job.json")).unwrap();
            assert!(matches!(second.finish(OsStr::new("job.json")), Err(WriteError::Exists(_))));
            assert_eq!(std::fs::read(path.join("job.json")).unwrap(), b"first");
            assert_eq!(
                (names(&path), names(root.path())),
                (vec!["job.json".into(), "parts".into()], vec!["job".into()])
            );
        }
    }

    /// What a killed process left is removed by the next one; what another one fills is not.
    #[cfg(target_os = "linux")]
    #[test]
    fn the_next_folder_removes_what_was_left() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(root.path().join(".firstlight-killed.part/parts")).unwrap();
        std::fs::write(root.path().join(".firstlight-killed.part/parts/film"), "").unwrap();
        std::os::unix::fs::symlink("elsewhere", root.path().join(".firstlight-link.part")).unwrap();
        let other = filled(&root.path().join("other"));
        filled(&root.path().join("new")).finish(OsStr::new("job.json")).unwrap();
        assert_eq!(names(root.path()).len(), 3);
        other.finish(OsStr::new("job.json")).unwrap();
        assert_eq!(names(root.path()), [".firstlight-link.part", "new", "other"]);
    }
}
