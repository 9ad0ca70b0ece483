//! Detects changes of files since they were read.

use std::path::Path;
use std::time::SystemTime;

/// Modification time and length in bytes; `None` if the file does not exist.
pub type Stamp = Option<(SystemTime, u64)>;

/// The current stamp of a file.
pub fn stamp(path: &Path) -> Stamp {
    let info = std::fs::metadata(path).ok()?;
    Some((info.modified().ok()?, info.len()))
}
