//! Files of any kind: bounded reading, whole-file writing, safe paths, limits, and text that is safe to print.
//!
//! Knows no scene. Start reading at [`input_file`] and [`whole_file`].

pub mod archive_cache;
pub mod gzip;
pub mod hash;
pub mod input_file;
pub mod limits;
pub mod new_folder;
pub mod outputs;
pub mod printable;
pub mod reference;
pub mod relative;
pub mod stamp;
pub mod warnings;
pub mod whole_file;
pub mod write_error;
