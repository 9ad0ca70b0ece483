//! Short messages over the picture that go away by themselves. Told the time, so that they can be tested.

use crate::printable;
use std::time::{Duration, Instant};

/// News, or something that went wrong.
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
    /// More would cover the picture; the oldest goes.
    const MOST: usize = 5;

    pub fn add(&mut self, tone: Tone, text: impl Into<String>, now: Instant) {
        let text = printable::lines(&text.into());
        // Long enough to read: a problem is read twice.
        let reading = Duration::from_millis(1500 + 40 * text.len() as u64);
        let until = now + if tone == Tone::Problem { 2 * reading + Duration::from_secs(3) } else { reading };
        // The first word tells what it is about: news of the same kind replaces the older news.
        let topic = |text: &str| text.split_whitespace().next().map(str::to_owned);
        if tone == Tone::News {
            self.shown.retain(|toast| toast.tone != Tone::News || topic(&toast.text) != topic(&text));
        }
        self.shown.retain(|toast| toast.text != text);
        self.shown.push(Toast { text, tone, until });
        if self.shown.len() > Self::MOST {
            self.shown.remove(0);
        }
    }

    /// What is still to be seen.
    pub fn at(&mut self, now: Instant) -> &[Toast] {
        self.shown.retain(|toast| toast.until > now);
        &self.shown
    }

    pub fn len(&self) -> usize {
        self.shown.len()
    }

    /// When the next of them goes.
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
    fn news_of_one_kind_is_shown_once_and_the_screen_is_never_full() {
        let (mut toasts, start) = (Toasts::default(), Instant::now());
        toasts.add(Tone::News, "speed 1.25", start);
        toasts.add(Tone::News, "speed 1.56", start);
        assert_eq!(toasts.at(start).len(), 1);
        assert_eq!(toasts.at(start)[0].text, "speed 1.56");
        for i in 0..50 {
            toasts.add(Tone::Problem, format!("problem {i}"), start);
        }
        assert_eq!(toasts.at(start).len(), Toasts::MOST);
        assert_eq!(toasts.at(start).last().unwrap().text, "problem 49");
    }
}
