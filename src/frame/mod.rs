//! The frame: what happens in which order between an input and a picture, and who does the work.

mod command;
pub mod navigation;
mod offline;
mod picture_file;

pub use command::Command;
pub use offline::{OfflineReport, Progress, Target, render_offline};
pub use picture_file::{PictureFormat, check_writable, write_film};
