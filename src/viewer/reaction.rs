//! Input latency: from an input that changes the image to the first new pixels on the window.

use crate::frame::LatencyHistogram;
use std::collections::VecDeque;
use std::time::Instant;

#[derive(Clone, Debug, Default)]
pub struct Reaction {
    /// Time of the first input that has not reached the session yet.
    input: Option<Instant>,
    /// Inputs that wait for the image of a generation.
    waiting: VecDeque<(u64, Instant)>,
    waits: LatencyHistogram,
}

impl Reaction {
    /// Records an input that may change the image.
    pub fn asked(&mut self, now: Instant) {
        self.input.get_or_insert(now);
    }

    /// Records that the session has executed the input; `generation` is that of the image that will show it, if there
    /// is one.
    pub fn carried_out(&mut self, generation: Option<u64>) {
        if let (Some(input), Some(generation)) = (self.input.take(), generation) {
            self.waiting.push_back((generation, input));
        }
    }

    /// Records that an image of `generation` is on the window.
    pub fn shown(&mut self, generation: u64, now: Instant) {
        while let Some((_, input)) = self.waiting.pop_front_if(|(wanted, _)| *wanted <= generation) {
            let wait = now.saturating_duration_since(input);
            tracing::trace!("answered after {:.1} ms", wait.as_secs_f64() * 1e3);
            self.waits.add(wait);
        }
    }

    /// Latencies of the latest inputs.
    pub fn waits(&self) -> &LatencyHistogram {
        &self.waits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn waits_are_from_the_first_input_to_the_first_picture_that_has_seen_it() {
        let (mut reaction, start) = (Reaction::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        reaction.asked(at(0));
        reaction.asked(at(5));
        reaction.carried_out(Some(7));
        reaction.shown(6, at(10));
        assert_eq!(reaction.waits.quantile(0.5), None, "that picture was of before");
        // A newer image also answers an older input.
        reaction.asked(at(12));
        reaction.carried_out(Some(8));
        reaction.shown(8, at(20));
        assert_eq!(
            (reaction.waits.len(), reaction.waits.quantile(0.0), reaction.waits.quantile(0.99)),
            (2, Some(Duration::from_millis(8)), Some(Duration::from_millis(20)))
        );
        // An input that does not change the image has no latency.
        reaction.asked(at(30));
        reaction.carried_out(None);
        reaction.shown(9, at(90));
        assert_eq!(reaction.waits.len(), 2);
    }
}
