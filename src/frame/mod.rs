//! The frame: what happens in which order between an input and a picture, and who does the work.
//!
//! | stage | system | what it does |
//! |---|---|---|
//! | [`Stage::Input`] | `input` | commands become changes of components |
//! | [`Stage::Edit`] | `edit` | scenes that were read beside the picture take their place |
//! | [`Stage::Rebuild`] | `rebuild` | finds what changed, makes that part of the snapshot anew |
//! | [`Stage::Reset`] | `reset` | drops the samples if they are worthless, and says why |
//! | [`Stage::Accumulate`] | `accumulate` | gives the workers their job |
//! | [`Stage::Develop`] | `develop` | tells them how the film is to be developed |
//! | [`Stage::Present`] | `present` | fetches finished pictures |
//!
//! A [`Session`] holds all of it. The workers follow a [`Scheduler`] that knows no threads and no clock.

mod beside;
mod command;
mod film_file;
mod input;
pub mod navigation;
mod offline;
mod picture_file;
mod reset;
mod scheduler;
mod session;
mod status;
mod systems;
mod worker;

pub use command::Command;
pub use film_file::{FilmFile, read_film_file, write_film_file};
pub use offline::{OfflineReport, Progress, Target, render_offline, render_offline_until};
pub use picture_file::{PictureFormat, Print, write_film};
pub use reset::{Change, Changes, Level, compare, compare_settings};
pub use scheduler::{Scheduler, Step, StepReport};
pub use session::{Session, SessionOptions, Stage};
pub use status::{Message, MessageKind, Picture, Status};
pub use systems::{Around, CurrentScene, Found, Paused, PictureSize, StopAt, Threads};
pub use worker::Waker;
