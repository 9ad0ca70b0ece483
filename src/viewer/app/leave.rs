//! Unsaved edits: stored in the settings folder some seconds after they are made, confirmed when the window closes, and
//! offered at the next start if the window could not ask.

use crate::files::printable;
use crate::frame::Command;
use crate::viewer::app::App;
use crate::viewer::openable::short_name;
use crate::viewer::question::{Prompt, PromptAnswer};
use crate::viewer::saver::new_file;
use crate::viewer::toasts::Tone;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

/// Delay after the last edit before edits are stored, so that they are not stored during a drag.
const STORE_DELAY: Duration = Duration::from_secs(2);

impl App {
    /// Tracks edits and saving, shows pending questions, and closes the window when nothing prevents it.
    pub(super) fn follow_edits(&mut self, now: Instant, event_loop: &ActiveEventLoop) {
        if self.stop_requested.load(Ordering::SeqCst) {
            return event_loop.exit();
        }
        if let Some(answer) = self.leaving.answer.take() {
            self.answer(answer, now, event_loop);
        }
        while let Ok(restored) = self.leaving.restored.try_recv() {
            match restored {
                Ok(path) => {
                    self.toasts.add(Tone::News, format!("restored as {}", path.display()), now);
                    self.open(Command::Open { path }, now);
                }
                Err(reason) => self.toasts.add(Tone::Problem, format!("not restored: {reason}"), now),
            }
        }
        let unsaved = self.session.has_unsaved_edits();
        // If saving failed, the error has been shown and the window remains open.
        if let Some(then) = self.leaving.saving.take_if(|_| !self.session.is_saving()).filter(|_| !unsaved) {
            match then {
                Some(command) => self.open(command, now),
                None => return event_loop.exit(),
            }
        }
        self.leaving.is_warned &= !self.renders.is_empty();
        if std::mem::take(&mut self.leaving.wanted) && self.leaving.saving.is_none() {
            let is_warned = self.renders.is_empty() || std::mem::replace(&mut self.leaving.is_warned, true);
            if !unsaved && is_warned {
                return event_loop.exit();
            }
            match unsaved {
                true => self.ask_to_leave(None, now),
                false => {
                    let told = "an image is being rendered: close once more to keep it as it stands";
                    self.toasts.add(Tone::News, told, now);
                    self.repaint_at = Some(now);
                }
            }
        }
        let is_shown = !self.session.status().scene.is_empty();
        if self.leaving.question.is_none()
            && is_shown
            && let Some(left) = self.leaving.left_behind.pop_front()
        {
            self.ask(Prompt::Restore(left), now);
        }
        self.keep_edits(unsaved, now);
    }

    /// Executes a command that may replace the scene; with unsaved edits, after the user has decided about them.
    pub(super) fn open(&mut self, command: Command, now: Instant) {
        if matches!(command, Command::Open { .. }) && self.session.has_unsaved_edits() {
            return self.ask_to_leave(Some(command), now);
        }
        if matches!(command, Command::Open { .. }) {
            self.keep_thumbnail(true);
        }
        self.session.send(command);
        self.needs_tick = true;
    }

    fn ask_to_leave(&mut self, then: Option<Command>, now: Instant) {
        let title = short_name(&self.session.status().scene);
        let path = self.scene_path(false);
        let file = printable::line(&std::path::absolute(&path).unwrap_or(path).to_string_lossy()).into_owned();
        let renders = !self.renders.is_empty();
        self.ask(Prompt::Leave { title, file, renders, then }, now);
    }

    fn ask(&mut self, question: Prompt, now: Instant) {
        self.capture_mouse(false, now);
        self.input.release_all(now);
        if matches!(question, Prompt::Leave { .. })
            && let Some(Prompt::Restore(left)) = self.leaving.question.take()
        {
            self.leaving.left_behind.push_front(left);
        }
        self.leaving.question = Some(question);
        self.repaint_at = Some(now);
    }

    /// Executes the user's answer.
    pub(super) fn answer(&mut self, answer: PromptAnswer, now: Instant, event_loop: &ActiveEventLoop) {
        let Some(question) = self.leaving.question.take() else { return };
        self.repaint_at = Some(now);
        self.needs_tick = true;
        match (question, answer) {
            (Prompt::Leave { then, .. }, PromptAnswer::Yes) => {
                self.save_scene();
                self.leaving.saving = Some(then);
            }
            (Prompt::Leave { then: Some(command), .. }, PromptAnswer::No) => self.session.send(command),
            (Prompt::Leave { then: None, .. }, PromptAnswer::No) => {
                self.leaving.discarded = true;
                event_loop.exit();
            }
            // It is offered again by the next window.
            (_, PromptAnswer::Later) => {}
            (Prompt::Restore(left), PromptAnswer::Yes) => {
                let path = new_file(&self.options.folder, &left.title, "ron", &[]);
                if let Err(reason) = self.leaving.restore(left, path) {
                    self.toasts.add(Tone::Problem, reason, now);
                }
            }
            (Prompt::Restore(left), PromptAnswer::No) => left.discard(),
        }
    }

    fn keep_edits(&mut self, unsaved: bool, now: Instant) {
        if !unsaved {
            self.leaving.keep_at = None;
            if self.leaving.recovery.has_kept() {
                self.leaving.recovery.forget();
            }
            self.leaving.seen = self.session.revision();
            return;
        }
        let revision = self.session.revision();
        if revision != self.leaving.seen {
            self.leaving.seen = revision;
            self.leaving.keep_at = Some(now + STORE_DELAY);
        }
        if self.leaving.keep_at.is_some_and(|at| now >= at) {
            self.leaving.keep_at = None;
            self.write_edits(now);
        }
    }

    fn write_edits(&mut self, now: Instant) {
        let title = short_name(&self.session.status().scene);
        let description = self.session.describe();
        if let Some(trouble) = self.leaving.recovery.keep(description, &title) {
            self.toasts.add(Tone::Problem, trouble, now);
        }
    }

    /// At exit, for whatever reason: unsaved edits that were not discarded are stored for the next start.
    pub(super) fn keep_or_forget_edits(&mut self) {
        if self.leaving.discarded || !self.session.has_unsaved_edits() {
            return self.leaving.recovery.forget();
        }
        if self.leaving.keep_at.is_some() || !self.leaving.recovery.has_kept() {
            self.write_edits(Instant::now());
        }
        if let Some(trouble) = self.leaving.recovery.wait() {
            log::error!("{trouble}");
        }
    }

    /// The message when the program is stopped from outside.
    pub(super) fn stopped_message(&self) -> String {
        let is_unsaved = self.session.has_unsaved_edits() && !self.leaving.discarded;
        match (is_unsaved, self.leaving.recovery.has_kept()) {
            (true, true) => "stopped: unsaved changes can be restored at the next start",
            (true, false) => "stopped: unsaved changes could not be kept",
            (false, _) => "stopped",
        }
        .to_owned()
    }
}
