//! Files that appear whole or not at all: written under a temporary name in the same folder, then renamed.

use std::fmt::Display;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file that is being written, and has not taken its name yet. Dropped, it leaves nothing behind.
pub struct WholeFile {
    out: BufWriter<NamedTempFile>,
    path: PathBuf,
}

/// Finds out whether a file can be written here, without leaving anything behind.
///
/// # Errors
/// A sentence that names the path, and what is in the way.
pub fn check_writable(path: &Path) -> Result<(), String> {
    if path.is_dir() {
        return Err(format!("{}: is a folder: name a file", path.display()));
    }
    WholeFile::begin(path).map(drop)
}

/// Writes a whole file; one that was there stays until the new one is complete.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let mut file = WholeFile::begin(path)?;
    file.write_all(bytes).map_err(|error| unwritable(path, &error))?;
    file.finish()
}

impl WholeFile {
    /// # Errors
    /// As [`check_writable`].
    pub fn begin(path: &Path) -> Result<Self, String> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".firstlight-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file: the user's mask decides.
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder).map_err(|error| {
            // The library's own words name the temporary file, which nobody asked for.
            let reason = match error.kind() {
                _ if folder.exists() && !folder.is_dir() => format!("{} is not a folder", folder.display()),
                ErrorKind::NotFound if !folder.is_dir() => format!("there is no folder {}", folder.display()),
                ErrorKind::StorageFull => "the disk is full".to_owned(),
                ErrorKind::ReadOnlyFilesystem => format!("{} lies on a read-only disk", folder.display()),
                // Some folders that the system makes up answer `not found` to whoever wants to write.
                _ => format!("the folder {} takes no new files", folder.display()),
            };
            unwritable(path, &reason)
        })?;
        Ok(Self { out: BufWriter::with_capacity(1 << 16, file), path: path.to_path_buf() })
    }

    /// Takes the place of whatever had the name.
    pub fn finish(self) -> Result<(), String> {
        let path = self.path.clone();
        self.complete()?.persist(&path).map(drop).map_err(|error| unwritable(&path, &error.error))
    }

    /// Takes the first of `names` that is free: never over a file that is there, even one that another program makes
    /// at the same moment. Answers with the name; `None` when all are taken.
    pub fn finish_new(self, names: impl Iterator<Item = PathBuf>) -> Result<Option<PathBuf>, String> {
        let mut file = self.complete()?;
        for path in names {
            file = match file.persist_noclobber(&path) {
                Ok(_) => return Ok(Some(path)),
                Err(error) if error.error.kind() == ErrorKind::AlreadyExists => error.file,
                Err(error) => return Err(unwritable(&path, &error.error)),
            };
        }
        Ok(None)
    }

    fn complete(self) -> Result<NamedTempFile, String> {
        let path = self.path;
        let file = self.out.into_inner().map_err(|error| unwritable(&path, error.error()))?;
        file.as_file().sync_all().map_err(|error| unwritable(&path, &error))?;
        Ok(file)
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// What every failure to write a file says.
pub fn unwritable(path: &Path, reason: &dyn Display) -> String {
    format!("{}: cannot be written: {reason}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_whole_and_a_dropped_one_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, b"old").unwrap();
        let mut file = WholeFile::begin(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        write_whole(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn what_is_in_the_way_is_named_and_the_temporary_name_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("plain");
        std::fs::write(&plain, "").unwrap();
        for (path, expected) in [
            (folder.path().join("gone/a.txt"), "there is no folder"),
            (plain.join("a.txt"), "is not a folder"),
            (folder.path().to_path_buf(), "is a folder: name a file"),
        ] {
            let error = check_writable(&path).unwrap_err();
            assert!(error.contains(expected) && !error.contains(".firstlight"), "{error}");
        }
        #[cfg(target_os = "linux")]
        {
            let error = check_writable(Path::new("/proc/a.txt")).unwrap_err();
            assert!(error.contains("/proc takes no new files"), "{error}");
        }
    }
}
