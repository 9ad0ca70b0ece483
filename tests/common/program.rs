//! The program from outside: command lines in a folder, and what comes of them.
#![allow(dead_code, reason = "each test file uses its own part")]

use assert_cmd::Command;
use std::path::Path;
use std::time::Duration;

/// How a command ended, and what it wrote.
#[derive(Debug)]
pub struct Outcome {
    pub status: Option<i32>,
    /// Standard output.
    pub bytes: Vec<u8>,
    /// Standard error.
    pub err: String,
}

impl Outcome {
    /// What it wrote before five minutes had passed; a command that waits for something has no status after that.
    pub fn of(command: &mut Command) -> Self {
        let output = command.timeout(Duration::from_secs(300)).output().unwrap();
        let err = String::from_utf8(output.stderr).expect("what is printed is UTF-8");
        Self { status: output.status.code(), bytes: output.stdout, err }
    }

    pub fn out(&self) -> &str {
        std::str::from_utf8(&self.bytes).expect("what is printed is UTF-8")
    }

    /// The last line of the standard output.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(self.out().lines().last().expect("a line of JSON")).unwrap()
    }
}

/// The program in a folder, without a display, with settings and a cache of its own there.
pub fn program(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("firstlight").unwrap();
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET", "RUST_LOG"] {
        command.env_remove(variable);
    }
    command
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder.join(".home"))
        .env("XDG_CACHE_HOME", folder.join(".home"));
    command
}

/// Runs a line of words.
pub fn run(folder: &Path, line: &str) -> Outcome {
    Outcome::of(program(folder).args(line.split_whitespace()))
}

/// Runs a line that must succeed.
#[track_caller]
pub fn does(folder: &Path, line: &str) -> Outcome {
    let outcome = run(folder, line);
    assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.err);
    outcome
}

/// Runs a line that must end with this status, and returns what it says.
#[track_caller]
pub fn fails(folder: &Path, line: &str, status: i32) -> String {
    let outcome = run(folder, line);
    assert_eq!(outcome.status, Some(status), "{line}: {}", outcome.err);
    outcome.err
}
