//! Errors of writing files. Every message names the file, and the remedy if there is one.

use crate::input_file::may_pass;
use std::error::Error;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Why a file was not written; an existing file is unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The path ends in a separator, as for folders.
    #[error("{}: is the name of a folder: expected a file name", .0.display())]
    FolderName(PathBuf),
    /// The path is a folder.
    #[error("{}: is a folder: expected a file name", .0.display())]
    Folder(PathBuf),
    /// The path is a pipe, a socket or a device.
    #[error("{}: is not a regular file and is not replaced: choose another name", .0.display())]
    NotRegular(PathBuf),
    /// The file exists and is read-only.
    #[error("{}: is read-only and is not replaced: choose another name", .0.display())]
    ReadOnly(PathBuf),
    /// The path is a broken symbolic link.
    #[error("{}: cannot be written: the symbolic link is broken", .0.display())]
    BrokenLink(PathBuf),
    /// Another process is writing the file.
    #[error("{}: is being written by another process: wait for it to end, or choose another name", .0.display())]
    Busy(PathBuf),
    /// The file is a film, and films may not be replaced.
    #[error("{}: is a film whose samples would be lost: choose another name, or use --overwrite", .0.display())]
    Film(PathBuf),
    /// The file is a film with samples that the new one does not have.
    #[error("{}: a film {film} would be lost: choose another name, or use --overwrite", path.display())]
    OtherFilm {
        /// The file.
        path: PathBuf,
        /// How the film differs; the text follows "a film".
        film: String,
    },
    /// The file exists, and was not to be replaced.
    #[error("{}: already exists: replace it with --overwrite, or choose another name", .0.display())]
    Exists(PathBuf),
    /// The file exists and is not a recording.
    #[error("{}: exists and is not a recording: choose another name", .0.display())]
    NotRecording(PathBuf),
    /// The file exists, and firstlight has not written it.
    #[error("{}: exists and was not written by firstlight: choose another folder", .0.display())]
    NotOwn(PathBuf),
    /// The extension is not that of a supported format.
    #[error("{}: unsupported output format .{extension}: use .png, .jpg or .exr", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The extension, lower case.
        extension: String,
    },
    /// The name has no extension.
    #[error("{}: missing file extension: use .png, .jpg or .exr", .0.display())]
    NoExtension(PathBuf),
    /// All numbers for new files of this name are used.
    #[error("{}: all numbers are in use: move some of the images", .0.display())]
    NoFreeName(PathBuf),
    /// The error image cannot be written before the error can be estimated.
    #[error("{}: the error is unknown until every pixel has two samples", .0.display())]
    ErrorUnknown(PathBuf),
    /// The folder of the file cannot be created.
    #[error("{}: cannot create the folder: {source}", folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// No file can be created in the folder.
    #[error("{}: cannot be written: {reason}", path.display())]
    Begin {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file was started and could not be completed.
    #[error("{}: cannot be written: {}", path.display(), reason(&**source))]
    Failed {
        /// The file.
        path: PathBuf,
        /// Error of the operating system or the encoder, or lack of memory.
        source: Box<dyn Error + Send + Sync>,
    },
    /// There is not enough memory to write the file.
    #[error(transparent)]
    Memory(io::Error),
    /// The image cannot be encoded.
    #[error("{0}")]
    Encode(#[source] Box<dyn Error + Send + Sync>),
    /// The metadata of a film is invalid.
    #[error("{0}")]
    Metadata(#[source] Box<dyn Error + Send + Sync>),
    /// The scene holds values that scene files must not have.
    #[error("{}: cannot be saved: {source}", path.display())]
    Scene {
        /// The scene file.
        path: PathBuf,
        /// The invalid values.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The saved scene would read back differently.
    #[error("{}: cannot be saved: the saved scene would differ; this is a bug in firstlight", .0.display())]
    WouldDiffer(PathBuf),
    /// A mesh beside the scene file cannot be written.
    #[error("{0}")]
    Mesh(#[source] Box<dyn Error + Send + Sync>),
}

impl WriteError {
    /// Whether the error may be temporary, or specific to this machine: the file is in use, the disk is full or
    /// unreachable, or memory is short.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Busy(_) | Self::Memory(_) => true,
            Self::Begin { source, .. } | Self::NoFolder { source, .. } => may_pass(source.kind()),
            Self::Failed { source, .. } => io_kind(&**source).is_some_and(may_pass),
            _ => false,
        }
    }
}

impl WriteError {
    /// The same error of a file below `from`, which the user knows as one below `to`.
    pub(crate) fn of_moved(mut self, from: &Path, to: &Path) -> Self {
        if let Self::FolderName(path)
        | Self::Folder(path)
        | Self::NotRegular(path)
        | Self::ReadOnly(path)
        | Self::BrokenLink(path)
        | Self::Busy(path)
        | Self::NoFolder { folder: path, .. }
        | Self::Begin { path, .. }
        | Self::Failed { path, .. } = &mut self
            && let Ok(below) = path.strip_prefix(from)
        {
            *path = to.join(below);
        }
        self
    }
}

impl From<WriteError> for String {
    fn from(error: WriteError) -> Self {
        error.to_string()
    }
}

/// The kind of I/O error, which libraries may have wrapped.
fn io_kind(error: &(dyn Error + 'static)) -> Option<ErrorKind> {
    let mut cause = Some(error);
    let kind = std::iter::from_fn(|| {
        let this = cause?;
        cause = this.source();
        let of_png = match this.downcast_ref::<png::EncodingError>() {
            // It does not name its cause.
            Some(png::EncodingError::IoError(error)) => Some(error.kind()),
            _ => None,
        };
        Some(this.downcast_ref::<io::Error>().map(io::Error::kind).or(of_png))
    });
    kind.flatten().next()
}

/// The message for a failure to write.
pub fn reason(error: &(dyn Error + 'static)) -> String {
    match io_kind(error) {
        Some(ErrorKind::StorageFull) => "the disk is full".to_owned(),
        Some(ErrorKind::QuotaExceeded) => "the disk quota is exceeded".to_owned(),
        Some(ErrorKind::FileTooLarge) => "the file would exceed the size limit".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_told_in_the_same_words_by_all_encoders() {
        let full = || io::Error::from(ErrorKind::StorageFull);
        let errors: [Box<dyn Error + Send + Sync>; 2] =
            [Box::new(full()), Box::new(png::EncodingError::IoError(full()))];
        for error in errors {
            assert_eq!(reason(&*error), "the disk is full", "{error:?}");
        }
    }
}
