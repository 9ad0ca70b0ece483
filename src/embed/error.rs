//! Errors of opening, rendering and saving.

use crate::frame::PropertyError;
use crate::render::{CameraError, NoRoom, SettingsError};
use crate::scene::{BadValue, SceneError, WriteError};
use thiserror::Error;

/// The reason why a scene or an image cannot be made; the message says what is wrong, where, and what is expected.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene, or a file that it refers to, cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An option, or a value in the world, is out of range.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// The settings of the light model are out of range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// There is not enough memory for an image of that size.
    #[error(transparent)]
    Memory(#[from] NoRoom),
    /// There is no such property, or its value is out of range.
    #[error(transparent)]
    Property(#[from] PropertyError),
    /// The world has no camera.
    #[error("the scene has no camera: add one")]
    NoCamera,
    /// The threads cannot be started.
    #[error("the worker threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
