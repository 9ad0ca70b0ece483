//! Files of any kind: bounded reading, whole-file writing, safe paths, limits, and text that is safe to print.
//!
//! Knows no scene. Start reading at [`input_file`] and [`whole_file`].

pub(crate) mod archive_cache;
pub(crate) mod hash;
pub mod input_file;
pub(crate) mod limits;
pub(crate) mod outputs;
pub mod printable;
pub(crate) mod reference;
pub(crate) mod relative;
pub(crate) mod stamp;
pub(crate) mod warnings;
pub mod whole_file;
pub(crate) mod write_error;
