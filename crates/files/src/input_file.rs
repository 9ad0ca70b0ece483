//! The only way in which the program reads files: regular files, with a maximum length by kind, a deadline, and
//! cancellation.
//!
//! Pipes, devices, sockets and folders are rejected without waiting: a pipe could block, and a device may be endless.
//! `tests/source/gates.rs` enforces that there is no other way. Start reading at [`InputFile::open`].

use crate::limits::Limits;
use std::fs::{File, Metadata};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;
use std::time::{Duration, Instant};

/// The purpose of a file, which determines its maximum length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// The text of a scene.
    Scene,
    /// A model (OBJ, PLY, STL).
    Model,
    /// A material library (MTL).
    Library,
    /// A texture, an environment image, or a reference image.
    Image,
    /// A film to resume.
    Film,
    /// A recording of the commands of a session.
    Recording,
    /// Settings and other small files of the program.
    Settings,
}

/// Why a file could not be read. The text follows the path.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// An error of the operating system.
    #[error("cannot be read: {}", plain_io(.0))]
    Io(#[source] io::Error),
    /// The path is a folder.
    #[error("cannot be read: it is a folder")]
    Folder,
    /// The path is what the text says: a pipe, a socket or a device.
    #[error("cannot be read: it is not a regular file, but {0}")]
    NotRegular(&'static str),
    /// The file is longer than files of its kind may be.
    #[error("is larger than {limit} bytes, the limit for {}: {}", kind.plural(), Limits::advice())]
    TooLong {
        /// The purpose of the file.
        kind: FileKind,
        /// The limit in bytes.
        limit: u64,
    },
    /// A compressed file stands for more bytes than one of its length may.
    #[error("is compressed, and stands for more than {limit} bytes, which no scene of its length does")]
    Unpacks {
        /// The limit in bytes.
        limit: u64,
    },
    /// The file must be text and is not UTF-8.
    #[error("cannot be read: line {line} is not UTF-8 text")]
    NotText {
        /// The first invalid line, counted from 1.
        line: usize,
    },
    /// The file stands for one in Git Large File Storage that was not downloaded.
    #[error("is a Git LFS pointer, not the file itself: run `git lfs pull`")]
    LfsPointer,
    /// Reading took longer than the deadline.
    #[error("cannot be read: reading took longer than {} s", DEADLINE.as_secs())]
    TooSlow,
    /// The caller's `stop` returned true.
    #[error("reading was cancelled")]
    Stopped,
}

impl ReadError {
    /// Whether the error may be temporary, or specific to this machine.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Io(error) => may_pass(error.kind()),
            Self::TooSlow => true,
            _ => false,
        }
    }
}

/// Whether an I/O error may be temporary: a missing file, a missing folder or missing rights are not.
pub(crate) fn may_pass(kind: ErrorKind) -> bool {
    !matches!(
        kind,
        ErrorKind::NotFound
            | ErrorKind::PermissionDenied
            | ErrorKind::AlreadyExists
            | ErrorKind::NotADirectory
            | ErrorKind::IsADirectory
            | ErrorKind::ReadOnlyFilesystem
            | ErrorKind::InvalidInput
            | ErrorKind::InvalidFilename
            | ErrorKind::InvalidData
            | ErrorKind::UnexpectedEof
            | ErrorKind::FileTooLarge
            | ErrorKind::Unsupported
    )
}

/// Longer reads mean a hanging file system or device.
const DEADLINE: Duration = Duration::from_secs(600);

/// First bytes of Git LFS pointers of all versions of their specification.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Bytes between two checks of the deadline and of `stop`.
const PORTION: usize = 1 << 20;

/// A regular file, open for reading, that gives no more than its limit.
pub struct InputFile<'a> {
    file: File,
    kind: FileKind,
    limit: u64,
    /// At the time of opening; bytes.
    length: u64,
    position: u64,
    until: Instant,
    stop: Option<&'a dyn Fn() -> bool>,
}

impl FileKind {
    /// Maximum length in bytes.
    pub fn limit(self, limits: &Limits) -> u64 {
        match self {
            Self::Scene => limits.scene_bytes,
            Self::Model => limits.model_bytes,
            Self::Library => limits.library_bytes,
            Self::Image => limits.picture_bytes(),
            Self::Film => limits.film_bytes(),
            Self::Recording => limits.recording_bytes,
            Self::Settings => limits.settings_bytes,
        }
    }

    fn plural(self) -> &'static str {
        match self {
            Self::Scene => "scenes",
            Self::Model => "models",
            Self::Library => "material libraries",
            Self::Image => "images",
            Self::Film => "films",
            Self::Recording => "recordings",
            Self::Settings => "settings",
        }
    }
}

impl InputFile<'static> {
    /// Opens a file of this kind within the limits of this process; never blocks.
    ///
    /// # Errors
    /// If it does not exist, is not a regular file, or is too long.
    pub fn open(path: &Path, kind: FileKind) -> Result<Self, ReadError> {
        Self::open_within(path, kind, kind.limit(&Limits::of_this_process()))
    }

    /// Like [`Self::open`], with the given limit in bytes.
    ///
    /// # Errors
    /// Like [`Self::open`].
    pub fn open_within(path: &Path, kind: FileKind, limit: u64) -> Result<Self, ReadError> {
        // Checked by name before opening, since opening some devices has side effects; and again afterwards, since the
        // file may have been replaced.
        check_regular(&std::fs::metadata(path).map_err(ReadError::Io)?)?;
        let mut options = std::fs::OpenOptions::new();
        options.read(true);
        #[cfg(unix)]
        {
            use rustix::fs::OFlags;
            use std::os::unix::fs::OpenOptionsExt;
            // If it has become a pipe, opening does not wait for a writer.
            options.custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32);
        }
        let mut file = options.open(path).map_err(ReadError::Io)?;
        let info = file.metadata().map_err(ReadError::Io)?;
        check_regular(&info)?;
        let length = info.len();
        if length > limit {
            return Err(ReadError::TooLong { kind, limit });
        }
        // Pointers are short, so that other files are not read twice.
        if (1..1024).contains(&length) {
            let mut start = Vec::new();
            (&mut file).take(LFS_POINTER.len() as u64).read_to_end(&mut start).map_err(ReadError::Io)?;
            file.rewind().map_err(ReadError::Io)?;
            if start == LFS_POINTER {
                return Err(ReadError::LfsPointer);
            }
        }
        Ok(Self { file, kind, limit, length, position: 0, until: Instant::now() + DEADLINE, stop: None })
    }
}

impl<'a> InputFile<'a> {
    /// Calls `stop` once per megabyte; if it returns true, reading fails.
    pub fn stopping(self, stop: &'a dyn Fn() -> bool) -> InputFile<'a> {
        InputFile { stop: Some(stop), ..self }
    }

    /// Its length at the time of opening, bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// The whole contents.
    ///
    /// # Errors
    /// If reading fails, the file is too long, or `stop` returned true.
    pub fn bytes(mut self) -> Result<Vec<u8>, ReadError> {
        // The reported length can be wrong; reading determines the real one.
        let mut bytes = Vec::with_capacity(self.length.min(64 << 20) as usize);
        self.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// The whole contents as text, without a byte order mark.
    ///
    /// # Errors
    /// Like [`Self::bytes`], and if it is not UTF-8.
    pub fn text(self) -> Result<String, ReadError> {
        let text = String::from_utf8(self.bytes()?).map_err(|error| {
            let good = error.utf8_error().valid_up_to();
            let line = 1 + error.as_bytes()[..good].iter().filter(|&&byte| byte == b'\n').count();
            ReadError::NotText { line }
        })?;
        Ok(match text.strip_prefix(BYTE_ORDER_MARK) {
            Some(rest) => rest.to_owned(),
            None => text,
        })
    }

    fn next(&mut self, bytes: &mut [u8]) -> Result<usize, ReadError> {
        if self.stop.is_some_and(|stop| stop()) {
            return Err(ReadError::Stopped);
        }
        if Instant::now() >= self.until {
            return Err(ReadError::TooSlow);
        }
        // One byte more than the limit shows whether it has grown beyond it.
        let room = usize::try_from(self.limit.saturating_sub(self.position).saturating_add(1)).unwrap_or(usize::MAX);
        let portion = bytes.len().min(room).min(PORTION);
        let n = self.file.read(&mut bytes[..portion]).map_err(ReadError::Io)?;
        self.position += n as u64;
        if self.position > self.limit {
            return Err(ReadError::TooLong { kind: self.kind, limit: self.limit });
        }
        Ok(n)
    }
}

/// Some editors put it in front of UTF-8 text.
pub const BYTE_ORDER_MARK: char = '\u{feff}';

fn check_regular(info: &Metadata) -> Result<(), ReadError> {
    if info.is_dir() {
        return Err(ReadError::Folder);
    }
    if info.is_file() {
        return Ok(());
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = info.file_type();
        if kind.is_fifo() {
            return Err(ReadError::NotRegular("a pipe"));
        }
        if kind.is_socket() {
            return Err(ReadError::NotRegular("a socket"));
        }
    }
    Err(ReadError::NotRegular("a device"))
}

impl Read for InputFile<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.next(bytes).map_err(|error| match error {
            ReadError::Io(error) => error,
            other => io::Error::other(other),
        })
    }
}

impl Seek for InputFile<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = self.file.seek(to)?;
        Ok(self.position)
    }
}

impl From<io::Error> for ReadError {
    /// Returns the original error of [`InputFile`] if it was passed through a reader.
    fn from(error: io::Error) -> Self {
        match error.downcast::<Self>() {
            Ok(own) => own,
            Err(error) => Self::Io(error),
        }
    }
}

/// An I/O error in plain words.
pub fn plain_io(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
        io::ErrorKind::InvalidData => "it is not UTF-8 text".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::io::Write;

    fn says(result: Result<impl Sized, ReadError>) -> String {
        result.err().expect("an error").to_string()
    }

    #[test]
    fn what_is_no_regular_file_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        assert!(says(InputFile::open(folder.path(), FileKind::Scene)).contains("it is a folder"));
        assert!(says(InputFile::open(&folder.path().join("none"), FileKind::Scene)).contains("no such file"));
        #[cfg(unix)]
        {
            assert!(says(InputFile::open(Path::new("/dev/zero"), FileKind::Scene)).contains("but a device"));
            let socket = folder.path().join("socket");
            let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
            assert!(says(InputFile::open(&socket, FileKind::Scene)).contains("but a socket"));
            let link = folder.path().join("link");
            std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
            assert!(says(InputFile::open(&link, FileKind::Scene)).contains("but a device"));
        }
        #[cfg(target_os = "linux")]
        {
            let pipe = folder.path().join("pipe");
            rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR).unwrap();
            assert!(says(InputFile::open(&pipe, FileKind::Scene)).contains("but a pipe"));
        }
    }

    #[test]
    fn no_more_than_the_limit_is_read_also_of_a_file_that_grows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, [7; 100]).unwrap();
        let open = |limit| InputFile::open_within(&path, FileKind::Model, limit);
        assert_eq!(open(100).unwrap().bytes().unwrap(), [7; 100]);
        let error = says(open(99));
        assert!(error.contains("99 bytes, the limit for models") && error.contains(Limits::VARIABLE), "{error}");
        let opened = open(100).unwrap();
        std::fs::OpenOptions::new().append(true).open(&path).unwrap().write_all(&[7]).unwrap();
        assert!(matches!(opened.bytes(), Err(ReadError::TooLong { .. })));
        // Decoders seek in both directions.
        let mut opened = open(101).unwrap();
        for _ in 0..3 {
            opened.seek(SeekFrom::Start(0)).unwrap();
            assert_eq!(opened.read_to_end(&mut Vec::new()).unwrap(), 101);
        }
    }

    #[test]
    fn pointers_of_git_lfs_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 12\n").unwrap();
        assert!(says(InputFile::open(&path, FileKind::Model)).contains("run `git lfs pull`"));
        std::fs::write(&path, "version https://git-lfs.git").unwrap();
        assert_eq!(InputFile::open(&path, FileKind::Model).unwrap().bytes().unwrap().len(), 27);
    }

    #[test]
    fn reading_stops_between_portions() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long");
        std::fs::write(&path, vec![b' '; 5 * PORTION]).unwrap();
        let asked = Cell::new(0);
        let stop = || {
            asked.set(asked.get() + 1);
            asked.get() > 2
        };
        let result = InputFile::open(&path, FileKind::Scene).unwrap().stopping(&stop).bytes();
        assert!(matches!(result, Err(ReadError::Stopped)));
        assert_eq!(asked.get(), 3);
    }

    #[test]
    fn text_has_no_byte_order_mark_and_bad_bytes_are_placed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "\u{feff}one\u{feff}").unwrap();
        assert_eq!(InputFile::open(&path, FileKind::Scene).unwrap().text().unwrap(), "one\u{feff}");
        std::fs::write(&path, b"one\ntwo\n\xff").unwrap();
        assert!(says(InputFile::open(&path, FileKind::Scene).unwrap().text()).contains("line 3 is not UTF-8"));
    }
}
