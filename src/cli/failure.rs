//! Why a command did not do its work.

use firstlight::frame::FilmError;
use firstlight::render::NoRoom;
use firstlight::scene::{FilesError, SceneError, WriteError};

/// Why a command did not do its work; a message of one line, but for [`Failure::Problems`].
pub enum Failure {
    /// The command itself cannot be right.
    Usage(String),
    Failed(String),
    /// What is in the way may pass: a disk is full, memory is taken, another process has the file.
    Passing(String),
    /// It failed for several reasons; each is a message of its own.
    Problems(Vec<String>),
    /// What a part was given is wrong, and will be when it is tried again; a message each.
    Input(Vec<String>),
    /// A part was interrupted, or something was in its way that may pass.
    Retry(String),
    /// Somebody pressed Ctrl+C; says what was saved.
    Stopped(String),
}

/// The exit status of what may well succeed when it is tried again: `EX_TEMPFAIL` of sysexits.h.
pub const TRY_AGAIN: u8 = 75;

impl Failure {
    /// Of a part: what failed is the fault of what it was given, unless it is known to pass.
    pub fn of_part(self) -> Self {
        match self {
            Self::Failed(message) => Self::Input(vec![message]),
            Self::Problems(messages) => Self::Input(messages),
            Self::Passing(message) => Self::Retry(format!("error: {message}")),
            other => other,
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Problems(error.problems.iter().map(ToString::to_string).collect())
    }
}

impl From<FilesError> for Failure {
    fn from(error: FilesError) -> Self {
        match error {
            FilesError::Collision(message) => Self::Usage(message),
            FilesError::Unwritable(error) => error.into(),
        }
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        if error.may_pass() { Self::Passing(error.into()) } else { Self::Failed(error.into()) }
    }
}

impl From<FilmError> for Failure {
    fn from(error: FilmError) -> Self {
        if error.may_pass() { Self::Passing(error.into()) } else { Self::Failed(error.into()) }
    }
}

impl From<NoRoom> for Failure {
    fn from(error: NoRoom) -> Self {
        Self::Passing(error.to_string())
    }
}
