//! Output of commands: results on standard output, remarks on standard error. Closed pipes and full disks cause no
//! panic.

use super::failure::Failure;
pub use firstlight::console::{Bar, Message, inform, lines, prints_to_terminal, remark};

/// Writes a binary result to standard output.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    firstlight::console::print_bytes(bytes)
        .map_err(|error| Failure::Failed(format!("cannot write to standard output: {error}")))
}

/// Prints part of a command's result.
pub fn print(message: impl Message) -> Result<(), Failure> {
    firstlight::console::print(message)
        .map_err(|error| Failure::Failed(format!("cannot write to standard output: {error}")))
}
