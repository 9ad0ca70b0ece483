//! The desktop's program for folders: shows where something was saved.

use std::path::Path;
use std::process::{Command, Stdio};

/// The program of this system, and what it is asked for a file or a folder.
fn request(path: &Path) -> (&'static str, Vec<std::ffi::OsString>) {
    if cfg!(target_os = "macos") {
        return ("open", vec!["-R".into(), path.into()]);
    }
    if cfg!(windows) {
        let mut select = std::ffi::OsString::from("/select,");
        select.push(path);
        return ("explorer", vec![select]);
    }
    // It opens folders with the file manager, and files with the program that knows them.
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(path) };
    ("xdg-open", vec![folder.into()])
}

/// Shows the folder of a file, or a folder; `path` is absolute.
///
/// # Errors
/// If the desktop has no program for it; the message is for users.
pub fn show(path: &Path) -> Result<(), String> {
    let (program, arguments) = request(path);
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|_| format!("{program} is not installed"))?;
    // It ends by itself; until it is waited for, the system keeps what is left of it.
    let wait = std::thread::Builder::new().name("file manager".to_owned()).spawn(move || drop(child.wait()));
    drop(wait);
    Ok(())
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_shown_in_its_folder_and_a_folder_itself() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().join("room.png"), folder.path().to_owned()] {
            assert_eq!(request(&path), ("xdg-open", vec![folder.path().into()]));
        }
    }
}
