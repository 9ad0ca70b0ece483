//! The whole program.

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the program and returns its exit status; once per process, on the main thread.
///
/// - `words`: its path and its arguments.
#[pyfunction]
pub fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| firstlight::cli::run(words))
}
