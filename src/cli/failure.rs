//! Why a command did not do its work.

use firstlight::frame::FilmError;
use firstlight::scene::{FilesError, SceneError, WriteError};

/// Why a command did not do its work; a message of one line, but for [`Failure::Problems`].
pub enum Failure {
    /// The command itself cannot be right.
    Usage(String),
    Failed(String),
    /// It failed for several reasons; each is a message of its own.
    Problems(Vec<String>),
    /// Somebody pressed Ctrl+C; says what was saved.
    Stopped(String),
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
        Self::Failed(error.into())
    }
}

impl From<FilmError> for Failure {
    fn from(error: FilmError) -> Self {
        Self::Failed(error.into())
    }
}
