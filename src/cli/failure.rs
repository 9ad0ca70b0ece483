//! Failures of commands.

use firstlight::frame::FilmError;
use firstlight::render::NoRoom;
use firstlight::scene::{FilesError, SceneError, WriteError};

/// Why a command failed; a message of one line, except for lists.
pub enum Failure {
    /// The command line is wrong.
    Usage(String),
    Failed(String),
    /// The cause may be temporary: a full disk, lack of memory, a file used by another process.
    Passing(String),
    /// Several problems, one message each.
    Problems(Vec<String>),
    /// The input of a part is wrong, so that trying again is useless; one message each.
    Input(Vec<String>),
    /// A part was interrupted or had a temporary problem: the engine should try again.
    Retry(String),
    /// Stopped by Ctrl+C; the message tells what was saved.
    Stopped(String),
}

/// Exit status for failures that may succeed when tried again: `EX_TEMPFAIL` of sysexits.h.
pub const TRY_AGAIN: u8 = 75;

impl Failure {
    /// The failure of a part: caused by its input, unless it is known to be temporary.
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
