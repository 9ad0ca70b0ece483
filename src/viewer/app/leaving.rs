//! State of closing the window and of edits that were not saved.

use crate::frame::{Command, LeftBehind, Recovery, Waker};
use crate::viewer::question::{Prompt, PromptAnswer};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Instant;

pub(super) struct Leaving {
    /// The window is to be closed.
    pub wanted: bool,
    /// The question that is shown.
    pub question: Option<Prompt>,
    /// The answer given by a button of the question.
    pub answer: Option<PromptAnswer>,
    /// What follows once the scene is saved: a command that opens another scene, or closing the window.
    pub saving: Option<Option<Command>>,
    /// Closed without saving, as requested by the user.
    pub discarded: bool,
    pub recovery: Recovery,
    /// Edits of earlier windows that are still to be asked about.
    pub left_behind: VecDeque<LeftBehind>,
    /// Revision of the session when edits were last checked.
    pub seen: u64,
    /// It has been said that an image is being rendered.
    pub is_warned: bool,
    /// When unsaved edits are to be stored.
    pub keep_at: Option<Instant>,
    pub restored: Receiver<Result<PathBuf, String>>,
    pub sender: Sender<Result<PathBuf, String>>,
    pub waker: Waker,
}

impl Leaving {
    pub fn new(recovery: Recovery, waker: Waker) -> Self {
        let (sender, restored) = channel();
        let left_behind = recovery.left_behind().into();
        Self {
            wanted: false,
            question: None,
            answer: None,
            saving: None,
            discarded: false,
            recovery,
            left_behind,
            seen: 0,
            is_warned: false,
            keep_at: None,
            restored,
            sender,
            waker,
        }
    }

    /// When edits are to be stored.
    pub fn wake_at(&self) -> Option<Instant> {
        self.keep_at
    }

    /// Restores edits of an earlier window on a separate thread.
    pub fn restore(&self, left: LeftBehind, path: PathBuf) -> Result<(), String> {
        let (sender, waker) = (self.sender.clone(), self.waker.clone());
        let work = move || {
            // If the window is gone, they are offered again.
            let _ = sender.send(left.restore(&path).map(|()| path));
            waker();
        };
        let spawned = std::thread::Builder::new().name("restore".to_owned()).spawn(work);
        spawned.map(drop).map_err(|error| format!("nothing can be restored: cannot start a thread: {error}"))
    }
}
