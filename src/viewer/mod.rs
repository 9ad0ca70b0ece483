//! The window: winit for events, pixels for the picture, egui for what is written over it.
//!
//! It turns keys and mouse into commands for a [`crate::frame::Session`] and shows the pictures that come back; it
//! knows nothing of how they are made, and never waits for them. Without this room (feature `viewer` off) the library
//! and the command line need no display code at all.
//!
//! | file | about |
//! |---|---|
//! | `app` | the event loop: what happens when |
//! | `presenter` | picture and overlays onto the window; the only place that knows the graphics device |
//! | [`keys`] | the one table of keys and gestures |
//! | `input` | keys and mouse to commands, independent of the frame rate |
//! | `panel` | every setting and figure, answered with commands |
//! | `handles` | what is selected: its box and its handles |
//! | `story` | why a pixel looks as it does: paths and a table |
//! | `brush` | the rectangle that gets all samples |
//! | `change` | what simplifying a mesh does to the picture |
//! | `reaction` | how long a person waits |
//! | `overlay`, `status`, `toasts`, `camera_text` | what is written over the picture |
//! | `saver` | pictures to disk, on the side |
//! | `dialog` | a file chosen in a dialog of the desktop |
//! | `question` | what is asked before edits are lost |
//! | [`display`] | is there a display at all |

mod app;
mod camera_text;
mod change;
mod dialog;
pub mod display;
mod handles;
mod input;
pub mod keys;
mod overlay;
mod panel;
mod presenter;
mod question;
mod reaction;
mod region_tool;
mod saver;
mod status;
mod story;
mod toasts;

pub use app::{ViewerError, ViewerOptions, run};
