//! Ctrl+C (and, on Unix, being told to end). A command works on a thread of its own: while there is nothing to save it is
//! left behind, wherever it is, and the program ends at once; from [`Stop::attend`] on it finishes off and saves what it
//! has. The second Ctrl+C always ends the program at once.
//!
//! So nothing that a command calls has to ask whether to go on before there is something to save: not the parsers of other
//! people, which cannot.

use super::failure::Failure;
use firstlight::console::{Bar, clear_line};
use firstlight::scene::whole_file;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex, PoisonError};

/// The exit status of a program that was stopped by Ctrl+C, as shells count it.
pub const STOPPED: u8 = 130;

/// Bytes: scene files nest as deep as the first thread of a program allows.
const STACK: usize = 16 << 20;

/// Whether somebody wants to stop.
#[derive(Clone, Default)]
pub struct Stop(Arc<StopState>);

#[derive(Default)]
struct StopState {
    asked: AtomicBool,
    attended: AtomicBool,
    /// It is told to end by an engine that tries it again.
    is_part: AtomicBool,
    left: Mutex<Left>,
}

/// What is there when a command is left behind.
#[derive(Default)]
struct Left {
    /// What is saved, as a sentence has it.
    saved: Option<String>,
    undo: Vec<Box<dyn FnOnce() + Send>>,
}

impl Stop {
    /// Does `work`, and answers for it where Ctrl+C comes while nothing is to be saved; call it once.
    pub fn obeyed_by(work: impl FnOnce(&Self) -> Result<(), Failure> + Send + 'static) -> Result<(), Failure> {
        enum News {
            Stop,
            Done(Result<(), Failure>),
        }
        let stop = Self::default();
        let (sender, news) = mpsc::channel();
        let done: Sender<News> = sender.clone();
        let shared = stop.clone();
        let taken_over = ctrlc::set_handler(move || {
            if shared.0.asked.swap(true, Ordering::SeqCst) {
                if shared.is_tried_again() {
                    // Engines signal more than once before they kill, and a film may be half written.
                    return;
                }
                std::process::exit(i32::from(STOPPED));
            }
            // Nobody waits any more for what is done.
            let _ = sender.send(News::Stop);
        });
        if let Err(error) = taken_over {
            // Ctrl+C then ends the program at once, as it would any other.
            tracing::warn!("Ctrl+C will not save anything: {error}");
        }
        let of_work = stop.clone();
        let body = move || {
            let result = work(&of_work);
            // Whoever has left does not listen.
            let _ = done.send(News::Done(result));
        };
        let worker = std::thread::Builder::new().name("command".to_owned()).stack_size(STACK).spawn(body);
        let worker = worker.map_err(|error| Failure::Failed(format!("cannot start a thread: {error}")))?;
        while !worker.is_finished() {
            match news.recv_timeout(std::time::Duration::from_millis(200)) {
                Ok(News::Done(result)) => return result,
                Ok(News::Stop) if !stop.0.attended.load(Ordering::SeqCst) => return Err(stop.leave()),
                // What attends looks at the flag itself; what panics says nothing here.
                Ok(News::Stop) | Err(_) => {}
            }
        }
        worker.join().unwrap_or_else(|panic| resume_unwind(panic));
        match news.try_iter().find_map(|news| if let News::Done(result) = news { Some(result) } else { None }) {
            Some(result) => result,
            None => Err(stop.leave()),
        }
    }

    pub fn is_asked(&self) -> bool {
        self.0.asked.load(Ordering::Relaxed)
    }

    /// The command is a part of something larger: when an engine stops it, it is to be tried again.
    pub fn is_of_part(&self) {
        self.0.is_part.store(true, Ordering::SeqCst);
    }

    /// Whether a stop means that the command is to be tried again; on a terminal somebody has pressed Ctrl+C.
    pub fn is_tried_again(&self) -> bool {
        self.0.is_part.load(Ordering::SeqCst) && !Bar::is_watched()
    }

    /// What a command that was stopped ends with.
    pub fn failure(&self, message: String) -> Failure {
        if self.is_tried_again() { Failure::Retry(message) } else { Failure::Stopped(message) }
    }

    /// From here on the command looks at [`is_asked`](Self::is_asked), and saves what it has when it is asked.
    pub fn attend(&self) {
        self.0.attended.store(true, Ordering::SeqCst);
    }

    /// From here on there is nothing to save until the command [attends](Self::attend) again: it may be left behind.
    pub fn rest(&self) {
        self.0.attended.store(false, Ordering::SeqCst);
    }

    /// What is there from here on, whatever becomes of the rest: `a.obj is saved`.
    pub fn has_saved(&self, what: impl Into<String>) {
        self.left().saved = Some(what.into());
    }

    /// Done when the command is left behind: what it would have cleaned up itself.
    pub fn undo(&self, work: impl FnOnce() + Send + 'static) {
        self.left().undo.push(Box::new(work));
    }

    fn left(&self) -> std::sync::MutexGuard<'_, Left> {
        self.0.left.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn leave(&self) -> Failure {
        whole_file::give_up();
        let Left { saved, undo } = std::mem::take(&mut *self.left());
        undo.into_iter().for_each(|work| work());
        // A bar may stand there.
        clear_line();
        self.failure(saved.map_or("stopped: nothing was saved".to_owned(), |saved| format!("stopped: {saved}")))
    }
}
