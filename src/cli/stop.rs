//! Handling of Ctrl+C (and, on Unix, of termination signals). A command works on its own thread: while there is nothing
//! to save, that thread is abandoned, whatever it is doing, and the program ends at once; after [`Stop::attend`], the
//! command finishes and saves its results. A second Ctrl+C ends the program at once, except for parts that an engine
//! runs.
//!
//! Code that runs before there is anything to save, such as third-party parsers, therefore need not support
//! cancellation.

use crate::cli::failure::Failure;
use firstlight::console::{Bar, clear_line};
use firstlight::scene::whole_file;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex, PoisonError};

/// Exit status of a program stopped by Ctrl+C, as in shells.
pub const STOPPED: u8 = 130;

/// Stack size in bytes: deeply nested scene files need as much as the main thread has.
const STACK: usize = 16 << 20;

/// Whether a stop was requested.
#[derive(Clone, Default)]
pub struct Stop(Arc<StopState>);

#[derive(Default)]
struct StopState {
    asked: AtomicBool,
    attended: AtomicBool,
    /// Whether an engine runs the command, which tries again after a stop.
    is_part: AtomicBool,
    left: Mutex<Left>,
}

/// State to clean up when a command is abandoned.
#[derive(Default)]
struct Left {
    /// What has been saved, as part of a sentence.
    saved: Option<String>,
    undo: Vec<Box<dyn FnOnce() + Send>>,
}

impl Stop {
    /// Runs `work`, and returns early if Ctrl+C is pressed while there is nothing to save; may be called only once.
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
                    // Engines send several signals before they kill, and a film may be half written.
                    return;
                }
                std::process::exit(i32::from(STOPPED));
            }
            // Fails if the main thread no longer waits.
            let _ = sender.send(News::Stop);
        });
        if let Err(error) = taken_over {
            // Ctrl+C then ends the program at once, as by default.
            tracing::warn!("Ctrl+C will not save anything: {error}");
        }
        let of_work = stop.clone();
        let body = move || {
            let result = work(&of_work);
            // Fails if the main thread no longer waits.
            let _ = done.send(News::Done(result));
        };
        let worker = std::thread::Builder::new().name("command".to_owned()).stack_size(STACK).spawn(body);
        let worker = worker.map_err(|error| Failure::Failed(format!("cannot start a thread: {error}")))?;
        while !worker.is_finished() {
            match news.recv_timeout(std::time::Duration::from_millis(200)) {
                Ok(News::Done(result)) => return result,
                Ok(News::Stop) if !stop.0.attended.load(Ordering::SeqCst) => return Err(stop.leave()),
                // A command that attends checks the flag itself; a panic sends no message.
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

    /// Declares the command to be a part of a larger job: an engine that stops it tries it again.
    pub fn is_of_part(&self) {
        self.0.is_part.store(true, Ordering::SeqCst);
    }

    /// Whether the command will be tried again after a stop; not on a terminal, where the user has pressed Ctrl+C.
    pub fn is_tried_again(&self) -> bool {
        self.0.is_part.load(Ordering::SeqCst) && !Bar::is_watched()
    }

    /// The failure of a stopped command.
    pub fn failure(&self, message: String) -> Failure {
        if self.is_tried_again() { Failure::Retry(message) } else { Failure::Stopped(message) }
    }

    /// From here on, the command checks [`is_asked`](Self::is_asked) and saves its results when it returns true.
    pub fn attend(&self) {
        self.0.attended.store(true, Ordering::SeqCst);
    }

    /// From here on, there is nothing to save until the next [`attend`](Self::attend): the command may be abandoned.
    pub fn rest(&self) {
        self.0.attended.store(false, Ordering::SeqCst);
    }

    /// Declares what has been saved for good, such as `a.obj is saved`.
    pub fn has_saved(&self, what: impl Into<String>) {
        self.left().saved = Some(what.into());
    }

    /// Registers clean-up work for when the command is abandoned.
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
        // Removes a progress bar.
        clear_line();
        self.failure(saved.map_or("stopped: nothing was saved".to_owned(), |saved| format!("stopped: {saved}")))
    }
}
