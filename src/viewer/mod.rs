//! The window: winit for events, pixels for the image, egui for overlays.
//!
//! It translates keys and mouse to commands for a [`crate::frame::Session`] and shows the resulting images. It does not
//! depend on how they are rendered, and never waits for them. Without this module (feature `viewer` off) the library
//! and the command line need no display code.
//!
//! | file | about |
//! |---|---|
//! | `app` | the event loop |
//! | `presenter` | drawing of image and overlays; the only file that uses the graphics device |
//! | [`keys`] | the table of keys and gestures |
//! | `input` | translation of keys and mouse to commands, independent of the frame rate |
//! | `panel` | every setting and figure; its results are commands |
//! | `handles`, `grab`, `outlines` | bounds and handles of the selection; keys that move it at once; silhouettes |
//! | `story` | explanation of a pixel: paths and a table |
//! | `region_tool` | the rectangle that gets all samples |
//! | `change` | the effect of mesh simplification on the image |
//! | `reaction` | input latency |
//! | `help` | the list of keys |
//! | `time_line` | the strip of an animation |
//! | `bar`, `menu`, `palette`, `openable` | what can be clicked: buttons, menus, the list of commands, scenes and files |
//! | `thumbnails`, `previews` | small images of recent scenes; spheres of materials |
//! | `overlay`, `status`, `toasts`, `camera_text` | text over the image |
//! | `saver` | saving of images in the background |
//! | `order`, `order_form`, `renders`, `trend` | images and frames that are rendered to files beside the window |
//! | `dialog`, `browser`, `file_manager` | file dialogs, of the desktop or inside the window; the desktop's view of a folder |
//! | `question`, `greeting` | questions before edits are lost; that of the first start |
//! | [`display`] | detection of the display server |

mod app;
mod bar;
mod browser;
mod camera_text;
mod change;
mod dialog;
pub mod display;
mod file_manager;
mod file_preview;
mod form_preview;
mod grab;
mod greeting;
mod handles;
mod help;
mod image_job;
mod input;
pub mod keys;
mod menu;
mod openable;
mod order;
mod order_form;
mod outlines;
mod overlay;
mod palette;
mod panel;
mod presenter;
mod previews;
mod question;
mod reaction;
mod region_tool;
mod renders;
mod saver;
mod status;
mod story;
mod submenu;
mod thumbnails;
mod time_line;
mod toasts;
mod trend;

pub use app::options::{ViewerError, ViewerOptions};
pub use app::run::run;
