//! What commands say: results on standard output, remarks on standard error. Neither can bring a command down.

use super::failure::Failure;
pub use firstlight::console::{Bar, Message, lines, remark};

/// Prints a part of a command's result.
pub fn print(message: impl Message) -> Result<(), Failure> {
    firstlight::console::print(message)
        .map_err(|error| Failure::Failed(format!("standard output cannot be written: {error}")))
}
