//! The real window, with a hand on its keys and mouse.

#[path = "../desktop/mod.rs"]
mod desktop;

mod guest;
mod mouse;
mod navigation;
mod noise;
#[path = "../common/program.rs"]
mod program;
mod saving;
mod tools;
mod views;
mod window;
