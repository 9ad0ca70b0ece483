//! The program, as it is called from a command line.

#[path = "../common/mod.rs"]
mod common;

mod cli;
mod cli_simplify;
mod denoising;
mod explain;
mod faults;
mod foreign;
mod frames;
mod lights;
mod motion_blur;
mod pack;
mod parts;
#[path = "../common/program.rs"]
mod program;
mod reopening;
mod report;
mod said;
mod submit;
mod terminal;
mod usage;
mod warnings;
