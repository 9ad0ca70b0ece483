//! placeholder

mod command;
pub mod navigation;

pub use command::Command;
