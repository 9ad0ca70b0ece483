//! Why a file is not written. Every message names the file, and what to do about it where something can be done.

use super::error::SceneError;
use super::image_metadata::MetadataError;
use super::input_file::may_pass;
use crate::render::NoRoom;
use std::error::Error;
use std::io::{self, ErrorKind};
use std::path::PathBuf;

/// Why a file is not written; one that was there before is as it was.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The path ends in a separator, which only the path of a folder may.
    #[error("{}: is the name of a folder: expected a file name", .0.display())]
    FolderName(PathBuf),
    /// The path is that of a folder.
    #[error("{}: is a folder: expected a file name", .0.display())]
    Folder(PathBuf),
    /// The path leads to a pipe, a socket or a device.
    #[error("{}: is not a regular file and is not replaced: choose another name", .0.display())]
    NotRegular(PathBuf),
    /// The file is there and may not be written.
    #[error("{}: is read-only and is not replaced: choose another name", .0.display())]
    ReadOnly(PathBuf),
    /// The path is that of a symbolic link that leads nowhere.
    #[error("{}: cannot be written: the symbolic link is broken", .0.display())]
    BrokenLink(PathBuf),
    /// Another process writes the file.
    #[error("{}: is being written by another process: wait for it to end, or choose another name", .0.display())]
    Busy(PathBuf),
    /// The file is a film, and films are not to be replaced.
    #[error("{}: is a film whose samples would be lost: choose another name, or use --overwrite", .0.display())]
    Film(PathBuf),
    /// The file is a film whose samples the new one does not have.
    #[error("{}: a film {film} would be lost: choose another name, or use --overwrite", path.display())]
    OtherFilm {
        /// The file.
        path: PathBuf,
        /// What is different about the film, as words that follow "a film".
        film: String,
    },
    /// The file is there and is not a recording.
    #[error("{}: exists and is not a recording: choose another name", .0.display())]
    NotRecording(PathBuf),
    /// The name asks for a format that images are not written in.
    #[error("{}: unsupported output format .{extension}: use .png or .exr", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What its name ends in, lower case.
        extension: String,
    },
    /// The name asks for no format.
    #[error("{}: missing file extension: use .png or .exr", .0.display())]
    NoExtension(PathBuf),
    /// No number is free for another file of this name.
    #[error("{}: all numbers are in use: move some of the pictures", .0.display())]
    NoFreeName(PathBuf),
    /// The error of the film cannot be written before it can be estimated.
    #[error("{}: the error is unknown until every pixel has two samples", .0.display())]
    ErrorUnknown(PathBuf),
    /// The folder of the file cannot be made.
    #[error("{}: cannot create the folder: {source}", folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// No file can be made in the folder.
    #[error("{}: cannot be written: {reason}", path.display())]
    Begin {
        /// The file.
        path: PathBuf,
        /// What is in the way.
        reason: String,
        /// What the system says.
        source: io::Error,
    },
    /// The file was begun and could not be completed.
    #[error("{}: cannot be written: {}", path.display(), reason(&**source))]
    Failed {
        /// The file.
        path: PathBuf,
        /// What the system, the encoder or the lack of memory says.
        source: Box<dyn Error + Send + Sync>,
    },
    /// There is no memory for the file.
    #[error(transparent)]
    Memory(#[from] NoRoom),
    /// The image cannot be encoded.
    #[error("{0}")]
    Encode(#[source] Box<dyn Error + Send + Sync>),
    /// The metadata of a film is not what this program writes.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
    /// The scene holds what no scene file may say.
    #[error("{}: cannot be saved: {source}", path.display())]
    Scene {
        /// The scene file.
        path: PathBuf,
        /// What it may not say.
        source: SceneError,
    },
    /// The scene would read back as another one.
    #[error("{}: cannot be saved: the saved scene would differ; this is a bug in firstlight", .0.display())]
    WouldDiffer(PathBuf),
    /// A mesh beside the scene file is not written.
    #[error("{0}")]
    Mesh(#[source] Box<dyn Error + Send + Sync>),
}

impl WriteError {
    /// Whether the same may succeed later, or on another machine: another process has the file, a disk is full or cannot be
    /// reached, or there is no memory.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Busy(_) | Self::Memory(_) => true,
            Self::Begin { source, .. } | Self::NoFolder { source, .. } => may_pass(source.kind()),
            Self::Failed { source, .. } => {
                let is_memory = source.downcast_ref::<NoRoom>().is_some();
                is_memory || io_kind(&**source).is_some_and(may_pass)
            }
            _ => false,
        }
    }
}

impl From<WriteError> for String {
    fn from(error: WriteError) -> Self {
        error.to_string()
    }
}

/// What the system says. Libraries wrap it in words of their own.
fn io_kind(error: &(dyn Error + 'static)) -> Option<ErrorKind> {
    let mut cause = Some(error);
    let kind = std::iter::from_fn(|| {
        let this = cause?;
        cause = this.source();
        Some(this.downcast_ref::<io::Error>().map(io::Error::kind))
    });
    kind.flatten().next()
}

/// What a failure to write says to people.
fn reason(error: &(dyn Error + 'static)) -> String {
    match io_kind(error) {
        Some(ErrorKind::StorageFull) => "the disk is full".to_owned(),
        Some(ErrorKind::QuotaExceeded) => "the disk quota is exceeded".to_owned(),
        Some(ErrorKind::FileTooLarge) => "the file would exceed the size limit".to_owned(),
        _ => error.to_string(),
    }
}
