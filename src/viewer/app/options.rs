//! Options of the window, and why it may not open or may close.

use crate::scene::{ModelChoice, SceneSource, UpAxis};
use crate::viewer::presenter::PresentError;
use std::path::PathBuf;
use thiserror::Error;

/// Options of the window.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    pub source: SceneSource,
    /// Width of the window, logical pixels.
    pub width: u32,
    pub height: u32,
    /// `None` for one thread per processor.
    pub threads: Option<usize>,
    pub seed: u32,
    /// The axis of models that points up; `None` to guess.
    pub up: Option<UpAxis>,
    /// The parts of a glTF model that are shown.
    pub choice: ModelChoice,
    /// An image that replaces the scene's own environment.
    pub environment: Option<PathBuf>,
    /// Folder for saved images.
    pub folder: PathBuf,
    /// File to which the session is recorded.
    pub record: Option<PathBuf>,
    /// Whether to print latency and speed at exit, as one JSON object; rendering then never stops by itself.
    pub print_figures: bool,
}

/// Why the window could not be opened, or closed by itself.
#[derive(Debug, Error)]
pub enum ViewerError {
    #[error(
        "cannot open a window: the display does not respond; check DISPLAY or WAYLAND_DISPLAY, or render without a window: firstlight render SCENE -o out.png"
    )]
    NoDisplay,
    #[error("lost the connection to the display; settings, bookmarks and unsaved changes are kept")]
    DisplayLost,
    #[error("cannot open a window: {0}")]
    NoWindow(winit::error::OsError),
    #[error("the event loop ended unexpectedly: {0}")]
    EventLoop(winit::error::EventLoopError),
    #[error("{0}")]
    Session(String),
    #[error("{0}")]
    Scene(String),
    /// The program was stopped from outside, by Ctrl+C in the terminal or by the system.
    #[error("{0}")]
    Stopped(String),
    #[error(transparent)]
    Present(#[from] PresentError),
}

/// The size that the next window has, where this one has the size `now`: one that was cut down to the monitor, as one
/// with large dots is, and stayed so is no wish of the user.
pub(super) fn size_to_keep(now: (u32, u32), fitted: (u32, u32), wanted: (u32, u32)) -> (u32, u32) {
    // Dots are whole.
    let is_as_fitted = now.0.abs_diff(fitted.0) <= 1 && now.1.abs_diff(fitted.1) <= 1;
    if is_as_fitted { wanted } else { now }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_that_was_cut_down_to_its_monitor_is_as_large_as_before_where_there_is_room() {
        assert_eq!(size_to_keep((784, 435), (784, 436), (1280, 720)), (1280, 720));
        assert_eq!(size_to_keep((600, 400), (784, 436), (1280, 720)), (600, 400), "as the user has made it");
    }
}
