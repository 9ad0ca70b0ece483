//! What can go wrong with a scene or an image.

use crate::render::{CameraError, NoRoom, SettingsError};
use crate::scene::{BadValue, SceneError, WriteError};
use thiserror::Error;

/// Why there is no scene or no image; each says what is wrong, where, and what would be right.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene or a file that it points at cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An option or a value of the world is out of range.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// The settings of the light model are out of range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// No picture can be taken with the camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// There is not enough memory for an image of that size.
    #[error(transparent)]
    Memory(#[from] NoRoom),
    /// The world has no camera.
    #[error("the scene has no camera: spawn an entity with a `View`")]
    NoCamera,
    /// The threads cannot be started.
    #[error("the worker threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
