//! How a file is known to be another than the one that was read.

use std::path::Path;
use std::time::SystemTime;

/// Time of modification and length; `None` when the file is not there.
pub type Stamp = Option<(SystemTime, u64)>;

/// The stamp that a file has now.
pub fn stamp(path: &Path) -> Stamp {
    let info = std::fs::metadata(path).ok()?;
    Some((info.modified().ok()?, info.len()))
}
