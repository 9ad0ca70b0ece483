//! A session without a window: commands in, pictures and changes out.

mod added_models;
mod denoising;
mod driver;
mod edit;
mod framing;
mod keys;
mod lists;
mod living_files;
mod new_things;
mod placing;
#[path = "../common/program.rs"]
mod program;
mod properties;
#[path = "../common/random.rs"]
mod random;
mod reopening;
mod reset;
mod session;
mod visibility;
