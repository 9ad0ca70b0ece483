//! The documentation: links lead somewhere, commands run, scenes open, every field and option is described, and lines,
//! pages and words keep to the rules.
//!
//! A block that cannot be run has a comment above it: `<!-- not run: reason -->`. Commands run in a folder per page, in
//! the order of the page, with small images and short times (see [`cheap`]). Start reading at [`Page`].

mod commands;
mod coverage;
mod links;
mod materials;
pub mod page;
mod scenes;
mod words;
