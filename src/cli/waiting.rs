//! Reports of long work: a line every few seconds, on a terminal or not.

use crate::cli::console::inform;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Reports the current stage until it is dropped.
pub struct Waiting {
    stages: Option<Sender<String>>,
    teller: Option<JoinHandle<()>>,
}

impl Waiting {
    /// Time between two lines; shorter stages are not reported.
    const EVERY: Duration = Duration::from_secs(5);

    pub fn new(stage: impl Into<String>) -> Self {
        Self::telling(stage, Self::EVERY, inform)
    }

    fn telling(stage: impl Into<String>, every: Duration, tell: impl Fn(String) + Send + 'static) -> Self {
        let (stages, news) = mpsc::channel();
        let start = Instant::now();
        let (mut stage, mut next) = (stage.into(), start + every);
        let work = move || {
            loop {
                match news.recv_timeout(next.saturating_duration_since(Instant::now())) {
                    Ok(new) => stage = new,
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => {
                        tell(format!("{:.0} s: {stage}", start.elapsed().as_secs_f64()));
                        next += every;
                    }
                }
            }
        };
        // If no thread can be started, nothing is reported, but the work is done.
        let teller = std::thread::Builder::new().name("waiting".to_owned()).spawn(work).ok();
        Self { stages: Some(stages), teller }
    }

    /// Sets the current stage.
    pub fn next(&self, stage: impl Into<String>) {
        if let Some(stages) = &self.stages {
            // Fails if there is no thread.
            let _ = stages.send(stage.into());
        }
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.stages = None;
        if let Some(teller) = self.teller.take() {
            // It can only fail by a panic, which has been reported.
            let _ = teller.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lasts_is_told_again_and_again_and_then_no_more() {
        let (sender, lines) = mpsc::channel();
        let waiting = Waiting::telling("reading", Duration::from_millis(5), move |line| {
            // Fails after the end of the test.
            let _ = sender.send(line);
        });
        let heard = |what: &str| (0..1000).any(|_| lines.recv().expect("it tells on").ends_with(what));
        assert!(heard("s: reading") && heard("s: reading"));
        waiting.next("writing");
        assert!(heard("s: writing"));
        drop(waiting);
        assert!(lines.iter().all(|line| line.ends_with("s: writing")), "and ends");
    }
}
