//! Recordings: the commands of a session as a text file, frame by frame, which can be replayed without a window.
//!
//! The first line has the scene, the image size and the seed; each further line is one event (RON), written at once, so
//! that the file is complete up to the moment at which the program ended for any reason. Commands depend on no clock
//! and sums on no order, so a replay gives the same image, bit for bit, with any number of threads; times are stored
//! for information only.

use crate::files::whole_file::is_foreign;
use crate::frame::command::Command;
use crate::frame::core::status::MessageKind;
use crate::frame::input::CommandQueue;
use crate::frame::state::resources::{Clock, CurrentScene, SceneGeneration};
use crate::scene::{FileKind, InputFile, ModelChoice, ReadError, WriteError, check_film_size};
use bevy_ecs::prelude::{Res, ResMut, Resource};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Format version; increased by incompatible changes.
pub(super) const FORMAT: u32 = 1;

/// The first line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RecordingHeader {
    pub(super) format: u32,
    /// Program name and version.
    pub(super) program: String,
    pub(super) scene: SceneWord,
    /// An image in place of the scene's own environment, by its path relative to the recording.
    #[serde(default)]
    pub(super) environment: Option<String>,
    /// What of the model is opened.
    #[serde(default)]
    pub(super) choice: ModelChoice,
    /// Up axis, `y` or `z`, if given.
    #[serde(default)]
    pub(super) up: Option<char>,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) seed: u32,
}

/// A built-in scene, or a file by its path relative to the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum SceneWord {
    Builtin(String),
    File(String),
}

/// Any other line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum RecordedLine {
    /// Frame, time in seconds, and command.
    Do(u64, f64, Command),
    /// A requested scene was opened in this frame: frame, its number, and its fingerprint.
    Opened(u64, u64, String),
    /// Frame and samples per pixel at the end of the session.
    End(u64, u32),
}

/// Records the commands of a session.
#[derive(Resource, Default)]
pub struct Recorder {
    pub(super) out: Option<(File, PathBuf)>,
    pub(super) frame: u64,
    pub(super) adopted: u64,
    /// Why it stopped before the end.
    pub(super) trouble: Option<String>,
}

impl Recorder {
    pub(super) fn write(&mut self, line: &impl Serialize) {
        let Some((file, path)) = &mut self.out else { return };
        // Serialising plain data cannot fail.
        let text = ron::to_string(line).expect("a line is plain data") + "\n";
        if let Err(error) = file.write_all(text.as_bytes()) {
            self.trouble = Some(format!("{}: recording stopped: {error}", path.display()));
            self.out = None;
        }
    }

    /// Records that a scene was opened in the present frame, if one was: after the commands of the frame.
    pub(super) fn note_opened(&mut self, adopted: &SceneGeneration, current: Option<&CurrentScene>) {
        if self.out.is_none() || adopted.0 <= self.adopted {
            return;
        }
        self.adopted = adopted.0;
        let print = current.map_or_else(String::new, |current| current.0.content_fingerprint().to_string());
        self.write(&RecordedLine::Opened(self.frame, adopted.0, print));
    }
}

/// Records the commands of this frame; runs before they are executed.
///
/// Reads the queue of commands, [`SceneGeneration`], [`Clock`]; writes [`Recorder`].
pub fn record(
    queue: Res<CommandQueue>,
    adopted: Res<SceneGeneration>,
    clock: Res<Clock>,
    current: Option<Res<CurrentScene>>,
    mut recorder: ResMut<Recorder>,
    mut status: ResMut<crate::frame::core::status::Status>,
) {
    if recorder.out.is_none() {
        return;
    }
    recorder.note_opened(&adopted, current.as_deref());
    recorder.frame += 1;
    for command in &queue.0 {
        let line = RecordedLine::Do(recorder.frame, clock.0.as_secs_f64(), command.clone());
        recorder.write(&line);
    }
    if let Some(trouble) = &recorder.trouble {
        status.say(clock.0, MessageKind::Error, trouble.clone());
    }
}

/// Checks that a recording may be written here: to a new file, an empty one, or an older recording. Any other file
/// could be a part of the scene that is about to be read.
///
/// # Errors
/// If there is another file.
pub fn check_recordable(path: &Path) -> Result<(), WriteError> {
    let is_header = |line: &str| ron::from_str::<RecordingHeader>(line).is_ok();
    match is_foreign(path, |text| text.lines().next().is_some_and(is_header)) {
        true => Err(WriteError::NotRecording(path.to_path_buf())),
        false => Ok(()),
    }
}

pub(super) fn read(path: &Path, stop: &dyn Fn() -> bool) -> Result<(RecordingHeader, Vec<RecordedLine>), String> {
    /// Maximum line length in bytes; the longest line that is written has the views of all bookmarks.
    const LONGEST_LINE: usize = 1 << 20;
    let failed = |reason: String| format!("{}: {reason}", path.display());
    let file = InputFile::open(path, FileKind::Recording).map_err(|error| failed(error.to_string()))?;
    let bytes = file.stopping(stop).bytes().map_err(|error| failed(error.to_string()))?;
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
    let no_recording = || failed("is not a recording: recordings are written by --record FILE".to_owned());
    let mut lines = bytes.split(|&byte| byte == b'\n').enumerate();
    let is_bearable = |line: &&[u8]| line.len() <= LONGEST_LINE;
    let (_, first) = lines.next().ok_or_else(no_recording)?;
    let first = Some(first).filter(is_bearable).and_then(|line| str::from_utf8(line).ok()).ok_or_else(no_recording)?;
    let header: RecordingHeader = ron::from_str(first).map_err(|error| match first.starts_with("(format:") {
        true => failed(format!("the first line cannot be parsed: {error}")),
        false => no_recording(),
    })?;
    if header.format > FORMAT {
        return Err(failed(format!(
            "was written by {}, in a format that this version does not support",
            header.program
        )));
    }
    let RecordingHeader { width, height, up, .. } = header;
    // A window without a size yet sets it by a command.
    check_film_size(width.max(1), height.max(1)).map_err(|bad| format!("{}:1: {bad}", path.display()))?;
    if let Some(up) = up.filter(|up| !matches!(up, 'y' | 'z')) {
        return Err(format!("{}:1: `up` is {up:?}, but must be 'y' or 'z'", path.display()));
    }
    let mut events = Vec::new();
    let mut lines = lines.peekable();
    while let Some((i, line)) = lines.next() {
        if stop() {
            return Err(failed(ReadError::Stopped.to_string()));
        }
        // After the last line end there is an incomplete line, or nothing.
        let is_last = lines.peek().is_none();
        let at = |reason: &dyn std::fmt::Display| format!("{}:{}: {reason}", path.display(), i + 1);
        let understood = match str::from_utf8(line) {
            _ if !is_bearable(&line) => {
                return Err(at(&format!("the line is longer than {LONGEST_LINE} bytes")));
            }
            Ok(text) => match ron::from_str(text) {
                // A complete line with an invalid command is an error anywhere.
                Ok(RecordedLine::Do(_, _, command)) if command.check().is_err() => {
                    return Err(at(&command.check().map_or_else(|bad| bad.to_string(), |()| String::new())));
                }
                understood => understood.map_err(|error| at(&format!("cannot be parsed: {error}"))),
            },
            Err(_) => Err(at(&"is not UTF-8 text")),
        };
        match understood {
            Ok(line) => events.push(line),
            // The program ended while it wrote this line.
            Err(_) if is_last => {}
            Err(error) => return Err(error),
        }
    }
    Ok((header, events))
}
