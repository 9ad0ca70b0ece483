//! Short messages over the image that disappear by themselves. Times are passed in, for tests.

use crate::files::printable;
use crate::viewer::keys::Action;
use std::time::{Duration, Instant};

/// The button of what was saved.
pub const IN_FOLDER: (&str, Action) = ("Show in its folder", Action::ShowSaved);
/// The button of a message that counts others.
pub const ALL_MESSAGES: (&str, Action) = ("Show all", Action::Section("Messages"));

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
    /// What it offers: the text of a button, and what that does.
    pub button: Option<(&'static str, Action)>,
    until: Instant,
}

/// The messages on the screen, oldest first.
#[derive(Debug, Default)]
pub struct Toasts {
    shown: Vec<Toast>,
    /// They have changed since they were asked last.
    is_new: bool,
}

impl Toasts {
    /// More warnings at once are one message, so that they do not cover a model that has just been opened.
    pub const MOST_WARNINGS: usize = 2;
    /// Maximum number of messages; more would cover the image. The oldest is removed.
    const MAX_SHOWN: usize = 5;
    /// Longest time that progress is shown.
    const PROGRESS: Duration = Duration::from_secs(600);

    pub fn add(&mut self, tone: Tone, text: impl Into<String>, now: Instant) {
        self.show(tone, text.into(), None, now);
    }

    /// Says something with a button, long enough to click it.
    pub fn add_offer(&mut self, tone: Tone, text: String, (button, action): (&'static str, Action), now: Instant) {
        self.show(tone, text, Some((button, action)), now);
    }

    /// Says that something is being done, until news of the same first word say what became of it, or it [ends](Self::end).
    pub fn add_progress(&mut self, text: &str, now: Instant) {
        self.show(Tone::News, text.to_owned(), None, now + Self::PROGRESS);
    }

    /// Removes news of this first word.
    pub fn end(&mut self, topic: &str) {
        self.keep(|toast| toast.tone != Tone::News || !toast.text.starts_with(topic));
    }

    fn show(&mut self, tone: Tone, text: String, button: Option<(&'static str, Action)>, now: Instant) {
        let text = printable::lines(&text);
        // Long enough to read; for a problem, to read twice; for an offer, to make up one's mind and reach it.
        let reading = Duration::from_millis(1500 + 40 * text.len() as u64);
        let shown = match (&button, tone) {
            (Some(_), _) => 2 * reading + Duration::from_secs(10),
            (None, Tone::Problem) => 2 * reading + Duration::from_secs(3),
            (None, _) => reading,
        };
        let until = now + shown;
        // The first word is the topic: a message replaces an older one of the same topic.
        let topic = |text: &str| text.split_whitespace().next().map(str::to_owned);
        if tone == Tone::News {
            self.shown.retain(|toast| toast.tone != Tone::News || topic(&toast.text) != topic(&text));
        }
        self.shown.retain(|toast| toast.text != text);
        self.is_new = true;
        self.shown.push(Toast { text, tone, button, until });
        if self.shown.len() > Self::MAX_SHOWN {
            self.shown.remove(0);
        }
    }

    /// Removes a problem that exists no longer.
    pub fn withdraw(&mut self, text: &str) {
        let text = printable::lines(text);
        self.keep(|toast| toast.tone != Tone::Problem || toast.text != text);
    }

    /// Returns the messages that are still visible.
    pub fn at(&mut self, now: Instant) -> &[Toast] {
        self.keep(|toast| toast.until > now);
        &self.shown
    }

    fn keep(&mut self, which: impl Fn(&Toast) -> bool) {
        let n = self.shown.len();
        self.shown.retain(which);
        self.is_new |= self.shown.len() != n;
    }

    /// Whether they have changed since the last call, so that they are to be drawn.
    pub fn take_news(&mut self, now: Instant) -> bool {
        self.at(now);
        std::mem::take(&mut self.is_new)
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
        assert!(toasts.take_news(start) && !toasts.take_news(start));
        let first = toasts.next_change().unwrap();
        assert!(toasts.take_news(first), "one is gone");
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
        toasts.add_progress("saving: busy", start);
        assert!(toasts.at(start + Duration::from_secs(100)).iter().any(|toast| toast.text == "saving: busy"));
        toasts.end("saving:");
        for i in 0..50 {
            toasts.add(Tone::Problem, format!("problem {i}"), start);
        }
        assert_eq!(toasts.at(start).len(), Toasts::MAX_SHOWN);
        assert_eq!(toasts.at(start).last().unwrap().text, "problem 49");
    }
}
