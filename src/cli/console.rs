//! Output of commands: results on standard output, remarks on standard error. Closed pipes and full disks cause no
//! panic.

use crate::cli::failure::Failure;
use firstlight::console::is_verbose;
pub use firstlight::console::{Bar, Message, inform, lines, prints_to_terminal, remark};
use firstlight::files::write_error::reason;
use firstlight::scene::{Severity, Warning, Warnings};

/// Prints what there is to say about a scene: a line per kind, or all with `--verbose`.
pub fn tell(warnings: &Warnings) {
    let lines = if is_verbose() { warnings.to_vec() } else { warnings.summary() };
    for line in &lines {
        match line.severity {
            Severity::Notice => inform(format_args!("note: {line}")),
            Severity::Warning => remark(format_args!("warning: {line}")),
        }
    }
    let is_warning = |line: &&Warning| line.severity == Severity::Warning;
    let shown = lines.iter().filter(is_warning).count();
    let total = warnings.total() - warnings.iter().filter(|line| !is_warning(line)).count();
    if total > shown {
        inform(match is_verbose() {
            true => format!("{shown} of {total} warnings are listed"),
            false => format!("{total} warnings, which -v lists"),
        });
    }
}

/// Writes a binary result to standard output.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    firstlight::console::print_bytes(bytes)
        .map_err(|error| Failure::Failed(format!("cannot write to standard output: {}", reason(&error))))
}

/// Prints part of a command's result.
pub fn print(message: impl Message) -> Result<(), Failure> {
    firstlight::console::print(message)
        .map_err(|error| Failure::Failed(format!("cannot write to standard output: {}", reason(&error))))
}
