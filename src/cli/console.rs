//! What commands say: results on standard output, remarks on standard error. Neither can bring a command down.

use super::Failure;
use std::fmt::Display;
use std::io::{ErrorKind, Write};

/// Prints a line of a command's result.
///
/// Whoever closed the pipe (`| head`) has read enough, which is no failure.
pub fn print(text: impl Display) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::Failed(format!("standard output cannot be written: {error}")))
        }
        _ => Ok(()),
    }
}

/// Prints a line beside the result.
pub fn remark(text: impl Display) {
    // Nobody listens, and there is nobody left to tell.
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
