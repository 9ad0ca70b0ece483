//! Ctrl+C (and, on Unix, being told to end): the first time the work in hand is finished off and saved, the second
//! time the program ends at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The exit status of a program that was stopped by Ctrl+C, as shells count it.
pub const STOPPED: u8 = 130;

/// Whether somebody wants to stop.
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Takes over Ctrl+C from now on; call it once.
    pub fn on_interrupt() -> Self {
        let asked = Arc::new(AtomicBool::new(false));
        let flag = asked.clone();
        let taken_over = ctrlc::set_handler(move || {
            if flag.swap(true, Ordering::SeqCst) {
                std::process::exit(i32::from(STOPPED));
            }
        });
        if let Err(error) = taken_over {
            // Ctrl+C then ends the program at once, as it would any other.
            tracing::warn!("Ctrl+C will save nothing: {error}");
        }
        Self(asked)
    }

    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
