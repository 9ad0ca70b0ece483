//! Edits that were not saved, and what is asked of them.

use crate::frame::{Command, LeftBehind, Recovery, Waker};
use crate::viewer::question::{Answer, Question};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Instant;

pub(super) struct Leaving {
    /// Somebody wants to close the window.
    pub wanted: bool,
    /// What is being asked.
    pub question: Option<Question>,
    /// What a button of it said.
    pub answer: Option<Answer>,
    /// What is done once the scene is saved: another is opened, or the window closes.
    pub saving: Option<Option<Command>>,
    /// Closed without saving, as the person wants it.
    pub discarded: bool,
    pub recovery: Recovery,
    /// Still to be asked about.
    pub left_behind: VecDeque<LeftBehind>,
    /// Edits that were seen, that are to be kept, and that have been kept, by the session's count.
    pub seen: u64,
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
            keep_at: None,
            restored,
            sender,
            waker,
        }
    }

    /// When edits are to be kept.
    pub fn wake_at(&self) -> Option<Instant> {
        self.keep_at
    }

    /// Takes back what was left behind, on a thread of its own.
    pub fn restore(&self, left: LeftBehind, path: PathBuf) -> Result<(), String> {
        let (sender, waker) = (self.sender.clone(), self.waker.clone());
        let work = move || {
            // The window may be gone, and then it is offered again.
            let _ = sender.send(left.restore(&path).map(|()| path));
            waker();
        };
        let spawned = std::thread::Builder::new().name("restore".to_owned()).spawn(work);
        spawned.map(drop).map_err(|error| format!("nothing can be restored: cannot start a thread: {error}"))
    }
}
