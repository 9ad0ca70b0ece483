//! Passes over a film, and questions about a picture.

pub(crate) mod caustic_choice;
pub(crate) mod denoised;
pub(crate) mod explain;
pub(crate) mod features;
pub(crate) mod inspect;
pub(crate) mod renderer;
pub(crate) mod threads;
