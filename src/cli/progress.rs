//! RenderProgress of rendering: a bar on a terminal, a line every few seconds in a pipe or a log.

use crate::cli::console::Bar;
use crate::cli::waiting::Waiting;

/// Ends when it is dropped.
pub struct RenderProgress {
    bar: Bar,
    lines: Option<Waiting>,
}

impl RenderProgress {
    pub fn new() -> Self {
        Self { bar: Bar::new(1000), lines: (!Bar::is_watched()).then(|| Waiting::new("loading")) }
    }

    /// Shows the current stage, whose duration is unknown.
    pub fn stage(&self, text: String) {
        if let Some(lines) = &self.lines {
            lines.next(text.clone());
        }
        self.bar.set_message(text);
    }

    /// Shows the progress: `share` is the fraction that is done, 0..1.
    pub fn at(&self, share: f64, text: String) {
        let share = share.clamp(0.0, 1.0);
        self.bar.set_position((share * 1000.0) as u64);
        if let Some(lines) = &self.lines {
            lines.next(format!("{:.0} %, {text}", 100.0 * share));
        }
        self.bar.set_message(text);
    }

    /// Prints while the bar is hidden.
    pub fn suspend(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    /// Ends the display.
    pub fn finish(&mut self) {
        self.bar.finish_and_clear();
        self.lines = None;
    }
}

impl Drop for RenderProgress {
    fn drop(&mut self) {
        self.finish();
    }
}
