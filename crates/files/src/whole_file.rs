//! Atomic writing of files: under a temporary name in the same folder, then renamed. The program writes all of its
//! files in this way.
//!
//! - A symbolic link is followed and kept; its target is replaced.
//! - Missing folders of the path are created.
//! - Files that are not regular or are read-only are rejected; so are films, unless [`Replace`] allows them.
//! - The temporary file is locked while it is written. One left by a killed process is not, and the next writer of the
//!   same output reuses it.
//! - A claimed file ([`WholeFile::claim`]) has one writer at a time, from the claim to the end of writing.

use crate::hash::Fingerprint;
use crate::input_file::{FileKind, InputFile};
use crate::relative::absolute;
use crate::write_error::WriteError;
use std::collections::BTreeSet;
use std::error::Error;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::{NamedTempFile, TempPath};

/// The attribute that marks an EXR image as a film.
pub const FILM_KEY: &str = "firstlight.film";

/// Which existing files an output may replace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Replace {
    /// Any file but a film, whose samples took long to compute and exist nowhere else.
    #[default]
    AllButFilms,
    /// Any file, including films.
    Anything,
}

/// A file that is being written and does not have its final name yet. If it is dropped, the temporary file is removed.
pub struct WholeFile {
    out: BufWriter<File>,
    part: TempPath,
    /// The path as given.
    path: PathBuf,
    /// The path with all links resolved.
    target: PathBuf,
    in_progress: InProgress,
}

/// The temporary files and folders of this process, and whether the program is about to exit without finishing them.
static PARTS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
static GIVEN_UP: AtomicBool = AtomicBool::new(false);

fn parts() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    PARTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registers a temporary file or folder in `PARTS` during its lifetime.
pub(crate) struct InProgress(PathBuf);

impl InProgress {
    pub(crate) fn of(part: &Path) -> Self {
        parts().insert(part.to_path_buf());
        Self(part.to_path_buf())
    }

    pub(crate) fn check(&self) -> io::Result<()> {
        check_in_time()
    }
}

impl Drop for InProgress {
    fn drop(&mut self) {
        parts().remove(&self.0);
    }
}

fn check_in_time() -> io::Result<()> {
    if GIVEN_UP.load(Ordering::SeqCst) { Err(io::Error::other("the program is shutting down")) } else { Ok(()) }
}

/// Nothing is begun when the temporary files are being removed.
fn in_time(path: &Path) -> Result<(), WriteError> {
    check_in_time().map_err(|error| unwritable(path, error))
}

/// For exiting while other threads write: nothing is renamed any more, and all temporary files and folders are removed.
pub fn give_up() {
    GIVEN_UP.store(true, Ordering::SeqCst);
    for part in std::mem::take(&mut *parts()) {
        // What has just been renamed is complete.
        let _ = std::fs::remove_file(&part).or_else(|_| std::fs::remove_dir_all(part));
    }
}

/// Checks whether a file can be written, without leaving anything behind.
///
/// # Errors
/// If the file cannot be written or may not be replaced.
pub fn check_writable(path: &Path, replace: Replace) -> Result<(), WriteError> {
    let target = absolute(path);
    let missing: Vec<&Path> = target.ancestors().skip(1).take_while(|folder| !folder.exists()).collect();
    let result = WholeFile::begin(path, replace).map(drop);
    // Those that another process has used meanwhile are not empty, and stay.
    missing.iter().for_each(|folder| drop(std::fs::remove_dir(folder)));
    result
}

/// Like [`check_writable`], but checks only the file itself if it exists, not its folder.
///
/// # Errors
/// If it may not be replaced.
pub fn check_replaceable(path: &Path, replace: Replace) -> Result<(), WriteError> {
    check_target(path, &absolute(path), replace)
}

/// Writes a file atomically; an existing one stays until the new one is complete. Films are not replaced.
///
/// # Errors
/// If it cannot be written or replaced.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut file = WholeFile::begin(path, Replace::AllButFilms)?;
    file.write_all(bytes).map_err(|error| unwritable(path, error))?;
    file.finish()
}

/// Like [`write_whole`], but replaces nothing, even what another process writes at the same time.
///
/// # Errors
/// If it cannot be written, or there is a file already.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut file = WholeFile::begin(path, Replace::AllButFilms)?;
    file.write_all(bytes).map_err(|error| unwritable(path, error))?;
    let target = file.target.clone();
    file.finish_new(std::iter::once(target))?.map(drop).ok_or_else(|| WriteError::Exists(path.to_path_buf()))
}

/// Lets a pipe be opened without another end.
fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt;
        options.custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32);
    }
    options
}

/// Opens a file that only serves to be locked, and creates it where it is missing; never blocks.
///
/// # Errors
/// If it cannot be opened, or is not a regular file: opening a pipe would wait for a reader.
pub fn lock_file(path: &Path) -> io::Result<File> {
    let file = without_waiting(OpenOptions::new().create(true).truncate(false).write(true)).open(path)?;
    let is_regular = file.metadata()?.is_file();
    if is_regular { Ok(file) } else { Err(io::Error::other("is not a regular file")) }
}

/// Whether a file is marked as a film, complete or damaged.
pub fn is_film(path: &Path) -> bool {
    /// The attribute follows soon after those of every EXR image.
    const LOOKED_AT: u64 = 1 << 16;
    let mut start = Vec::new();
    let read = InputFile::open_within(path, FileKind::Film, u64::MAX)
        .map_err(std::io::Error::other)
        .and_then(|file| file.take(LOOKED_AT).read_to_end(&mut start));
    let name = [FILM_KEY.as_bytes(), b"\0"].concat();
    read.is_ok() && start.starts_with(&[0x76, 0x2f, 0x31, 0x01]) && start.windows(name.len()).any(|part| part == name)
}

/// Whether there is a file with other contents than those that are about to be replaced. An empty one has none.
///
/// - `is_own`: whether a text that begins like this may be replaced.
pub fn is_foreign(path: &Path, is_own: impl Fn(&str) -> bool) -> bool {
    /// What the program writes says so soon.
    const LOOKED_AT: u64 = 1 << 16;
    let Ok(info) = std::fs::metadata(path) else { return false };
    // Paths that are not files are rejected by the writer.
    if !info.is_file() || info.len() == 0 {
        return false;
    }
    let mut start = Vec::new();
    let read = InputFile::open_within(path, FileKind::Settings, u64::MAX)
        .map_err(io::Error::other)
        .and_then(|file| file.take(LOOKED_AT).read_to_end(&mut start));
    read.is_err() || !is_own(&String::from_utf8_lossy(&start))
}

/// Checks that a file of a fixed name is missing, or one that the program wrote; see [`is_foreign`].
///
/// # Errors
/// If it is another file.
pub fn check_own(path: &Path, is_own: impl Fn(&str) -> bool) -> Result<(), WriteError> {
    if is_foreign(path, is_own) { Err(WriteError::NotOwn(path.to_path_buf())) } else { Ok(()) }
}

/// Whether a path ends in `/` or `/.`: comparisons of paths ignore that, the operating system does not.
fn is_named_as_folder(path: &Path) -> bool {
    let name = path.as_os_str().as_encoded_bytes();
    let is_separator = |byte: &u8| std::path::is_separator(char::from(*byte));
    match name {
        [.., last] if is_separator(last) => true,
        [.., before, b'.'] => is_separator(before),
        _ => false,
    }
}

impl WholeFile {
    /// Starts writing a file.
    ///
    /// # Errors
    /// Like [`check_writable`].
    pub fn begin(path: &Path, replace: Replace) -> Result<Self, WriteError> {
        let target = absolute(path);
        check_target(path, &target, replace)?;
        in_time(path)?;
        // It may be claimed.
        let claimed = part_name(&target, None);
        if let Ok(file) = without_waiting(OpenOptions::new().read(true)).open(&claimed) {
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(busy(path)),
                // Left by a killed process.
                Ok(()) if is_at(&file, &claimed) => drop(std::fs::remove_file(&claimed)),
                _ => {}
            }
        }
        /// Maximum number of processes that write one output at the same time.
        const WRITERS: u32 = 64;
        let mut begun = (0..WRITERS).map(|number| open_part(&target, Some(number)));
        match begun.find(|part| !matches!(part, Ok(None))) {
            Some(Ok(Some(part))) => {
                remove_left_over(&target, WRITERS - begun.len() as u32, WRITERS);
                Ok(Self::new(part, path, target))
            }
            Some(Err(error)) => Err(cannot_begin(path, &target, error)),
            _ => Err(busy(path)),
        }
    }

    /// Like [`Self::begin`], exclusively: no other process can write the file until this is finished or dropped.
    ///
    /// # Errors
    /// Like [`check_writable`], and if another process has claimed the file.
    pub fn claim(path: &Path, replace: Replace) -> Result<Self, WriteError> {
        let target = absolute(path);
        check_target(path, &target, replace)?;
        in_time(path)?;
        match open_part(&target, None) {
            Ok(Some(part)) => Ok(Self::new(part, path, target)),
            Ok(None) => Err(busy(path)),
            Err(error) => Err(cannot_begin(path, &target, error)),
        }
    }

    fn new(part: NamedTempFile, path: &Path, target: PathBuf) -> Self {
        // Without the temporary name, since messages give the path of the caller.
        let (file, part) = part.into_parts();
        let in_progress = InProgress::of(&part);
        Self { out: BufWriter::with_capacity(1 << 16, file), part, path: path.to_path_buf(), target, in_progress }
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Renames the file, replacing an existing one.
    ///
    /// # Errors
    /// If it cannot be completed.
    pub fn finish(self) -> Result<(), WriteError> {
        self.finish_open().map(drop)
    }

    /// Like [`Self::finish`], for a file that is written further: it stays locked, so that no other process can write
    /// it.
    ///
    /// # Errors
    /// If it cannot be completed.
    pub fn finish_open(self) -> Result<File, WriteError> {
        let (path, target) = (self.path.clone(), self.target.clone());
        let (file, part) = self.complete()?;
        if let Ok(old) = std::fs::metadata(&target) {
            // Not all file systems support permissions; the file is complete without them.
            let _ = file.set_permissions(old.permissions());
        }
        part.persist(&target).map_err(|error| unwritable(&path, error.error))?;
        Ok(file)
    }

    /// Gives the file the first unused name of `names`; never replaces a file, even one created by another program at
    /// the same time. Returns the name; `None` if all are used.
    ///
    /// # Errors
    /// If it cannot be completed.
    pub fn finish_new(self, names: impl Iterator<Item = PathBuf>) -> Result<Option<PathBuf>, WriteError> {
        let (_file, mut part) = self.complete()?;
        for path in names {
            part = match part.persist_noclobber(&path) {
                Ok(_) => return Ok(Some(path)),
                Err(error) if error.error.kind() == ErrorKind::AlreadyExists => error.path,
                Err(error) => return Err(unwritable(&path, error.error)),
            };
        }
        Ok(None)
    }

    fn complete(self) -> Result<(File, TempPath), WriteError> {
        let Self { out, part, path, in_progress, .. } = self;
        let file = out.into_inner().map_err(|error| unwritable(&path, error.into_error()))?;
        file.sync_all().and_then(|()| in_progress.check()).map_err(|error| unwritable(&path, error))?;
        Ok((file, part))
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.in_progress.check()?;
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// The error for a file that could not be completed.
pub fn unwritable(path: &Path, reason: impl Error + Send + Sync + 'static) -> WriteError {
    WriteError::Failed { path: path.to_path_buf(), source: Box::new(reason) }
}

fn busy(path: &Path) -> WriteError {
    WriteError::Busy(path.to_path_buf())
}

/// Checks whether the existing file may be replaced.
fn check_target(path: &Path, target: &Path, replace: Replace) -> Result<(), WriteError> {
    if is_named_as_folder(path) {
        return Err(WriteError::FolderName(path.to_path_buf()));
    }
    // All valid links have been followed.
    if target.is_symlink() {
        return Err(WriteError::BrokenLink(path.to_path_buf()));
    }
    let Ok(info) = std::fs::metadata(target) else { return Ok(()) };
    if info.is_dir() {
        return Err(WriteError::Folder(path.to_path_buf()));
    }
    if !info.is_file() {
        return Err(WriteError::NotRegular(path.to_path_buf()));
    }
    let read_only = || WriteError::ReadOnly(path.to_path_buf());
    if info.permissions().readonly() {
        return Err(read_only());
    }
    // Opened only to check the permissions; nothing is written.
    match without_waiting(OpenOptions::new().write(true)).open(target) {
        Ok(file) if matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) => return Err(busy(path)),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => return Err(read_only()),
        _ => {}
    }
    if replace == Replace::AllButFilms && is_film(target) {
        return Err(WriteError::Film(path.to_path_buf()));
    }
    Ok(())
}

/// Temporary name for `target`: that of a claim, or that of the writer with this number.
fn part_name(target: &Path, number: Option<u32>) -> PathBuf {
    let name = target.file_name().unwrap_or_default().as_encoded_bytes();
    let hash = Fingerprint::of(name).0 as u64;
    let number = number.map_or_else(String::new, |number| format!("-{number}"));
    target.with_file_name(format!(".firstlight-{hash:016x}{number}.part"))
}

/// Whether the file has further hard links.
fn has_other_names(file: &File) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        file.metadata().is_ok_and(|info| info.nlink() > 1)
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        false
    }
}

/// Creates or reuses the temporary file of that name, empty and locked; `None` if another process uses it.
fn open_part(target: &Path, number: Option<u32>) -> io::Result<Option<NamedTempFile>> {
    let name = part_name(target, number);
    let folder = name.parent().unwrap_or(Path::new(".")).to_path_buf();
    let new_file = || {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        #[cfg(unix)]
        {
            use std::os::unix::fs::OpenOptionsExt;
            // As for any new file: restricted by the umask of the user.
            options.mode(0o666);
        }
        options
    };
    /// The file may disappear between opening and locking if its owner finishes.
    const ATTEMPTS: u32 = 100;
    for _ in 0..ATTEMPTS {
        // A symbolic link planted here would lead elsewhere.
        if std::fs::symlink_metadata(&name).is_ok_and(|info| !info.is_file()) {
            return Ok(None);
        }
        let file = match new_file().open(&name) {
            Ok(file) => file,
            // Another user's, in a shared folder.
            Err(error) if error.kind() == ErrorKind::PermissionDenied && name.exists() => return Ok(None),
            Err(error) if error.kind() == ErrorKind::NotFound && !folder.exists() => {
                std::fs::create_dir_all(&folder)?;
                continue;
            }
            Err(error) => return Err(error),
        };
        match file.try_lock() {
            // A file elsewhere that has this name too, as an archive can plant it: it only loses the name.
            Ok(()) if is_at(&file, &name) && has_other_names(&file) => std::fs::remove_file(&name)?,
            Ok(()) if is_at(&file, &name) => {
                file.set_len(0)?;
                let mut file = Some(file);
                let taken = || io::Error::from(ErrorKind::AlreadyExists);
                let mut builder = tempfile::Builder::new();
                builder.prefix(name.file_name().unwrap_or_default()).rand_bytes(0);
                return builder.make_in(folder, |_| file.take().ok_or_else(taken)).map(Some);
            }
            // It was renamed or removed in the meantime.
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            // Some file systems have no locks: uses a random name instead.
            Err(TryLockError::Error(_)) => {
                drop(file);
                let _ = std::fs::remove_file(&name);
                let mut builder = tempfile::Builder::new();
                builder.prefix(".firstlight-").suffix(".part");
                return builder.make_in(folder, |path| new_file().create_new(true).open(path)).map(Some);
            }
        }
    }
    Ok(None)
}

/// Removes the temporary files that killed writers of the same output left, from this number on.
fn remove_left_over(target: &Path, from: u32, to: u32) {
    for number in from..to {
        let name = part_name(target, Some(number));
        let Ok(file) = without_waiting(OpenOptions::new().read(true)).open(&name) else { return };
        if file.try_lock().is_ok() && is_at(&file, &name) {
            // Without permission to remove it, it stays.
            let _ = std::fs::remove_file(&name);
        }
    }
}

/// Whether the name still refers to the opened file.
fn is_at(file: &File, name: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let (opened, named) = (file.metadata(), std::fs::symlink_metadata(name));
        matches!((opened, named), (Ok(a), Ok(b)) if (a.dev(), a.ino()) == (b.dev(), b.ino()))
    }
    #[cfg(not(unix))]
    {
        // There, an open file keeps its name.
        let _ = file;
        name.exists()
    }
}

fn cannot_begin(path: &Path, target: &Path, error: io::Error) -> WriteError {
    // The path as given, not with resolved links.
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let lies_in = target.parent().unwrap_or(folder);
    let reason = match error.kind() {
        _ if folder.exists() && !folder.is_dir() => format!("{} is not a folder", folder.display()),
        _ if !lies_in.is_dir() => format!("the folder {} cannot be created", folder.display()),
        ErrorKind::StorageFull => "the disk is full".to_owned(),
        ErrorKind::ReadOnlyFilesystem => format!("{} is on a read-only file system", folder.display()),
        // Some virtual folders report `not found` for writing.
        _ => format!("no permission to create files in {}", folder.display()),
    };
    WriteError::Begin { path: path.to_path_buf(), reason, source: error }
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

    /// As an archive plants it: the temporary name is known, and another file has it as well.
    #[cfg(unix)]
    #[test]
    fn a_file_that_has_the_temporary_name_too_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let (target, other) = (folder.path().join("a.exr"), folder.path().join("other"));
        std::fs::write(&other, "mine").unwrap();
        for number in [None, Some(0)] {
            let _ = std::fs::remove_file(&target);
            std::fs::hard_link(&other, part_name(&target, number)).unwrap();
            let mut file = match number {
                None => WholeFile::claim(&target, Replace::Anything).unwrap(),
                Some(_) => WholeFile::begin(&target, Replace::Anything).unwrap(),
            };
            file.write_all(b"new").unwrap();
            file.finish().unwrap();
            assert_eq!(std::fs::read(&other).unwrap(), b"mine");
            assert_eq!(std::fs::read(&target).unwrap(), b"new");
        }
    }

    #[test]
    fn a_file_appears_whole_and_a_dropped_one_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, b"old").unwrap();
        let mut file = WholeFile::begin(&path, Replace::AllButFilms).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.txt"]);
        write_whole(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_new_file_replaces_nothing_even_what_came_meanwhile() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/a.txt");
        let late = WholeFile::begin(&path, Replace::AllButFilms).unwrap();
        write_new(&path, b"first").unwrap();
        assert!(matches!(write_new(&path, b"second"), Err(WriteError::Exists(_))));
        assert_eq!(late.finish_new(std::iter::once(path.clone())).unwrap(), None);
        assert_eq!(
            (std::fs::read(&path).unwrap(), names(path.parent().unwrap())),
            (b"first".to_vec(), vec!["a.txt".to_owned()])
        );
    }

    #[test]
    fn what_a_killed_writer_left_is_removed_and_what_a_living_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let [first, second, claimed] = [Some(0), Some(1), None].map(|number| part_name(&path, number));
        for left in [&first, &second, &claimed] {
            std::fs::write(left, "a half").unwrap();
        }
        write_whole(&path, b"whole").unwrap();
        assert_eq!(
            (names(folder.path()), std::fs::read(&path).unwrap()),
            (vec!["a.txt".to_owned()], b"whole".to_vec())
        );
        // Two concurrent writers: each has its own temporary file, and the last to finish wins.
        let mut living = WholeFile::begin(&path, Replace::AllButFilms).unwrap();
        living.write_all(b"living").unwrap();
        write_whole(&path, b"quicker").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"quicker");
        living.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"living");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_claimed_file_has_one_writer_until_it_is_done() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut claim = WholeFile::claim(&path, Replace::AllButFilms).unwrap();
        let beside = folder.path().join("../").join(folder.path().file_name().unwrap()).join("a.exr");
        for refused in [WholeFile::claim(&beside, Replace::Anything), WholeFile::begin(&beside, Replace::Anything)] {
            assert!(
                refused.err().is_some_and(|error| error.to_string().contains("is being written by another process"))
            );
        }
        claim.write_all(b"mine").unwrap();
        claim.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"mine");
        // A file that is written further stays claimed under its final name.
        let open = WholeFile::claim(&path, Replace::Anything).unwrap().finish_open().unwrap();
        assert!(write_whole(&path, b"yours").unwrap_err().to_string().contains("is being written"));
        drop(open);
        write_whole(&path, b"yours").unwrap();
        assert_eq!(names(folder.path()), ["a.exr"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_kept_and_read_only_files_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir(root.join("far")).unwrap();
        symlink("far/b.txt", root.join("a.txt")).unwrap();
        // First a target that does not exist yet, then an existing one.
        for text in ["one", "two"] {
            write_whole(&root.join("a.txt"), text.as_bytes()).unwrap();
            assert_eq!(std::fs::read_to_string(root.join("far/b.txt")).unwrap(), text);
            assert_eq!(std::fs::read_link(root.join("a.txt")).unwrap(), Path::new("far/b.txt"));
        }
        let mode =
            |mode: u32| std::fs::set_permissions(root.join("far/b.txt"), PermissionsExt::from_mode(mode)).unwrap();
        mode(0o640);
        write_whole(&root.join("a.txt"), b"three").unwrap();
        assert_eq!(std::fs::metadata(root.join("far/b.txt")).unwrap().permissions().mode() & 0o777, 0o640);
        mode(0o444);
        assert!(write_whole(&root.join("a.txt"), b"four").unwrap_err().to_string().contains("a.txt: is read-only"));
        assert_eq!(std::fs::read(root.join("far/b.txt")).unwrap(), b"three");
        symlink("/dev/null", root.join("null")).unwrap();
        assert!(write_whole(&root.join("null"), b"").unwrap_err().to_string().contains("is not a regular file"));
        symlink("round", root.join("round")).unwrap();
        assert!(write_whole(&root.join("round"), b"").is_err());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_pipe_in_place_of_a_lock_or_a_left_over_file_is_not_waited_for() {
        use rustix::fs::{CWD, Mode, mkfifoat};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let claimed = part_name(&path, None);
        let left_over = part_name(&path, Some(1));
        for pipe in [&folder.path().join("lock"), &claimed, &left_over] {
            mkfifoat(CWD, pipe, Mode::RUSR | Mode::WUSR).unwrap();
        }
        assert!(lock_file(&folder.path().join("lock")).is_err());
        write_whole(&path, b"text").unwrap();
        assert!(lock_file(&folder.path().join("new")).unwrap().try_lock().is_ok());
    }

    #[test]
    fn what_is_in_the_way_is_named_and_the_temporary_name_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("plain");
        std::fs::write(&plain, "").unwrap();
        for (path, expected) in [
            (plain.join("a.txt"), "is not a folder"),
            (folder.path().to_path_buf(), "is a folder: expected a file name"),
        ] {
            let error = check_writable(&path, Replace::AllButFilms).unwrap_err().to_string();
            assert!(error.contains(expected) && !error.contains(".firstlight"), "{error}");
        }
        #[cfg(target_os = "linux")]
        {
            let error = check_writable(Path::new("/proc/a.txt"), Replace::AllButFilms).unwrap_err().to_string();
            assert!(error.contains("no permission to create files in /proc"), "{error}");
        }
        // Missing folders are created, but not for a check.
        let new = folder.path().join("new/deep/a.txt");
        check_writable(&new, Replace::AllButFilms).unwrap();
        assert!(!folder.path().join("new").exists());
        write_whole(&new, b"text").unwrap();
        assert_eq!(std::fs::read(&new).unwrap(), b"text");
        // However deeply a library has wrapped it.
        #[derive(Debug, thiserror::Error)]
        #[error("wrapped")]
        struct Wrapped(#[source] io::Error);
        let full = Wrapped(io::Error::from(ErrorKind::StorageFull));
        assert_eq!(unwritable(Path::new("a.png"), full).to_string(), "a.png: cannot be written: the disk is full");
    }
}
