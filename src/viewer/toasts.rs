//! Short messages over the image that disappear by themselves. Times are passed in, for tests.

use crate::files::printable;
use std::time::{Duration, Instant};

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    News,
    Problem,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Toast {
    pub text: String,
    pub tone: Tone,
    until: Instant,
}

/// The messages on the screen, oldest first.
#[derive(Debug, Default)]
pub struct Toasts {
    shown: Vec<Toast>,
}

impl Toasts {
    /// More warnings at once are one message, so that they do not cover a model that has just been opened.
    pub const MOST_WARNINGS: usize = 2;
    /// Maximum number of messages; more would cover the image. The oldest is removed.
    const MAX_SHOWN: usize = 5;

    pub fn add(&mut self, tone: Tone, text: impl Into<String>, now: Instant) {
        let text = printable::lines(&text.into());
        // Long enough to read; for a problem, to read twice.
        let reading = Duration::from_millis(1500 + 40 * text.len() as u64);
        let until = now + if tone == Tone::Problem { 2 * reading + Duration::from_secs(3) } else { reading };
        // The first word is the topic: a message replaces an older one of the same topic.
        let topic = |text: &str| text.split_whitespace().next().map(str::to_owned);
        if tone == Tone::News {
            self.shown.retain(|toast| toast.tone != Tone::News || topic(&toast.text) != topic(&text));
        }
        self.shown.retain(|toast| toast.text != text);
        self.shown.push(Toast { text, tone, until });
        if self.shown.len() > Self::MAX_SHOWN {
            self.shown.remove(0);
        }
    }

    /// Removes a problem that exists no longer.
    pub fn withdraw(&mut self, text: &str) {
        let text = printable::lines(text);
        self.shown.retain(|toast| toast.tone != Tone::Problem || toast.text != text);
    }

    /// Returns the messages that are still visible.
    pub fn at(&mut self, now: Instant) -> &[Toast] {
        self.shown.retain(|toast| toast.until > now);
        &self.shown
    }

    pub fn len(&self) -> usize {
        self.shown.len()
    }

    /// When the next message disappears.
    pub fn next_change(&self) -> Option<Instant> {
        self.shown.iter().map(|toast| toast.until).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn toasts_go_away_and_problems_stay_longer() {
        let (mut toasts, start) = (Toasts::default(), Instant::now());
        toasts.add(Tone::News, "saved a.png", start);
        toasts.add(Tone::Problem, "no such file", start);
        assert_eq!(toasts.at(start).len(), 2);
        let first = toasts.next_change().unwrap();
        assert_eq!(toasts.at(first)[0].text, "no such file");
        let second = toasts.next_change().unwrap();
        assert!(second > first + Duration::from_secs(2));
        assert!(toasts.at(second).is_empty());
        assert_eq!(toasts.next_change(), None);
    }

    #[test]
    fn a_problem_that_is_mended_is_withdrawn() {
        let (mut toasts, start) = (Toasts::default(), Instant::now());
        toasts.add(Tone::Problem, "a.ron:3:1: unknown field", start);
        toasts.add(Tone::Problem, "no such file", start);
        toasts.withdraw("a.ron:3:1: unknown field");
        assert_eq!(toasts.at(start).iter().map(|toast| toast.text.as_str()).collect::<Vec<_>>(), ["no such file"]);
    }

    #[test]
    fn news_of_one_kind_is_shown_once_and_the_screen_is_never_full() {
        let (mut toasts, start) = (Toasts::default(), Instant::now());
        toasts.add(Tone::News, "speed 1.25", start);
        toasts.add(Tone::News, "speed 1.56", start);
        assert_eq!(toasts.at(start).len(), 1);
        assert_eq!(toasts.at(start)[0].text, "speed 1.56");
        for i in 0..50 {
            toasts.add(Tone::Problem, format!("problem {i}"), start);
        }
        assert_eq!(toasts.at(start).len(), Toasts::MAX_SHOWN);
        assert_eq!(toasts.at(start).last().unwrap().text, "problem 49");
    }
}
