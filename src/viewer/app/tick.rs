//! A tick: passes input to the session, advances it, and checks for anything new to show.

use crate::frame::{Command, MessageKind, Selection};
use crate::viewer::app::act::{FOCUS_IS_UNSEEN, LEFT};
use crate::viewer::app::options::ViewerError;
use crate::viewer::app::{App, FIGURES_INTERVAL, FRAME, MAX_WAIT, SLOW};
use crate::viewer::keys::Action;
use crate::viewer::openable::short_name;
use crate::viewer::toasts::{ALL_MESSAGES, IN_FOLDER, Toasts, Tone};
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

impl App {
    /// Passes on input, advances the session, and checks for anything new to show.
    pub(super) fn tick(&mut self, now: Instant, event_loop: &ActiveEventLoop) {
        self.needs_tick = false;
        self.last_tick = Some(now);
        let clock = now - self.start;
        let restarts = self.session.status().restarts;
        self.session.update(clock);
        // A movement before the last one is visible would only replace it: it waits, and adds up. Movements are also
        // limited to the frame rate, although a finished image is checked for more often.
        let answered = self.is_answered(now);
        let soon = Some(self.steered_at + FRAME).filter(|soon| *soon > now);
        if answered && soon.is_none() {
            self.steer(now, clock);
            let generation = self.session.status().restarts;
            self.reaction.carried_out((generation != restarts).then_some(generation));
        }
        if self.session.status().restarts > self.seen {
            self.unseen_since.get_or_insert(now);
        }
        for trouble in self.memory.follow(&mut self.session) {
            self.toasts.add(Tone::Problem, trouble, now);
        }
        // It is about the scene before.
        if self.memory.take_opened() {
            self.toasts.end(LEFT);
            self.input.forget_drag();
            self.asks_for_room = true;
        }
        if self.asks_for_room
            && let Some(in_room) = self.session.is_in_room()
        {
            self.input.set_in_room(in_room);
            self.asks_for_room = false;
        }
        if let Some(left) = self.memory.take_left(&self.session) {
            self.toasts.add_offer(Tone::News, LEFT.to_owned(), ("Go back to it", Action::ReturnTo(left)), now);
        }
        let status = self.session.status();
        match (status.opening, self.opening_since) {
            // A scene that is there at once would only flash.
            (Some(_), None) => (self.opening_since, self.repaint_at) = (Some(now), Some(now + SLOW)),
            // The seconds go on.
            (Some(_), Some(_)) => self.repaint_at = Some(self.repaint_at.unwrap_or(now + FIGURES_INTERVAL)),
            (None, Some(_)) => (self.opening_since, self.repaint_at) = (None, Some(now)),
            (None, None) => {}
        }
        self.loading_since = status.loading.is_some().then(|| self.loading_since.unwrap_or(now));
        if status.rig.lens.enabled {
            self.toasts.end(FOCUS_IS_UNSEEN);
        }
        for text in &status.withdrawn {
            self.toasts.withdraw(text);
        }
        let new = status.messages.iter().filter(|message| message.at == clock);
        let n_warnings = new.clone().filter(|message| message.kind == MessageKind::Warning).count();
        let is_flood = n_warnings > Toasts::MOST_WARNINGS;
        if is_flood {
            self.toasts.add_offer(Tone::Problem, format!("{n_warnings} warnings"), ALL_MESSAGES, now);
        }
        for message in new.filter(|message| !is_flood || message.kind != MessageKind::Warning) {
            match message.kind {
                MessageKind::Note => self.toasts.add(Tone::News, message.text.clone(), now),
                MessageKind::Warning | MessageKind::Error if message.others.is_empty() => {
                    self.toasts.add(Tone::Problem, message.text.clone(), now);
                }
                MessageKind::Warning | MessageKind::Error => {
                    self.toasts.add_offer(Tone::Problem, message.text.clone(), ALL_MESSAGES, now);
                }
                MessageKind::Saved => {
                    self.toasts.add_offer(Tone::News, message.text.clone(), IN_FOLDER, now);
                    self.last_saved = self.session.scene_file().and_then(|path| std::path::absolute(path).ok());
                }
            }
        }
        // Without a first scene there is no reason to stay open, and the terminal is where the name was typed.
        if status.scene.is_empty()
            && status.loading.is_none()
            && status.messages.iter().any(|message| message.kind == MessageKind::Error)
        {
            let errors = status.messages.iter().filter(|message| message.kind == MessageKind::Error);
            let lines: Vec<&str> = errors.map(|message| message.text.as_str()).collect();
            self.failure = Some(ViewerError::Scene(lines.join("\n")));
            event_loop.exit();
            return;
        }
        for saved in self.saver.finished() {
            self.report_saved(saved);
        }
        self.keep_thumbnail(false);
        self.follow_brightness(now);
        self.follow_renders(now);
        self.follow_outlines(now);
        self.tell_selection(now);
        self.take_files(now);
        self.follow_edits(now, event_loop);
        if self.keep_size_at.is_some_and(|at| now >= at) {
            self.keep_window_size();
        }
        let title = title(&self.session.status().scene, self.session.has_unsaved_edits());
        if self.toasts.take_news(now) {
            self.repaint_at = Some(now);
        }
        let Some(window) = &self.window else { return };
        // Until the first scene is loaded, the title is that of the scene to be shown.
        if title != self.title && !self.session.status().scene.is_empty() {
            window.set_title(&title);
            self.title = title;
        }
        let new_picture = self.shown_picture != Some(self.session.picture().number);
        let figures_due = self.last_draw.is_none_or(|then| now >= then + FIGURES_INTERVAL);
        let new_figures = self.overlays && self.figures() != self.shown_figures;
        let repaint = self.repaint_at.is_some_and(|at| now >= at);
        // The image for the last change has priority: drawing an older one would only delay it.
        let unseen_since = self.unseen_since.filter(|_| !self.is_rendered());
        let comes = unseen_since.is_some_and(|since| now < since + MAX_WAIT);
        if !self.occluded && !comes && (new_picture || repaint || (new_figures && figures_due)) {
            window.request_redraw();
        }
        let moving = match answered {
            true => soon.or_else(|| self.input.is_moving().then(|| now + FRAME)),
            false => Some(self.steered_at + MAX_WAIT),
        };
        let late = unseen_since.filter(|_| comes).map(|since| since + MAX_WAIT);
        let figures = (new_figures && !figures_due).then(|| self.last_draw.map_or(now, |then| then + FIGURES_INTERVAL));
        let repaint_at = self.repaint_at.filter(|at| *at > now);
        let session = self.session.next_wake(clock).map(|at| self.start + at);
        self.wake_at = [
            session,
            self.toasts.next_change(),
            moving,
            late,
            figures,
            repaint_at,
            self.loading_since.map(|since| since + SLOW).filter(|at| *at > now),
            self.keep_size_at,
            self.leaving.wake_at(),
            self.outlines.wake_at(),
        ]
        .into_iter()
        .flatten()
        .min();
    }

    /// Whether the last change of the view is visible, or has taken too long to wait for. Rendering the next image
    /// while this one is drawn would delay both on a single processor.
    fn is_answered(&self, now: Instant) -> bool {
        let restarts = self.session.status().restarts;
        self.seen >= restarts || (self.occluded && self.is_rendered()) || now >= self.steered_at + MAX_WAIT
    }

    /// Whether there is an image of the current scene.
    pub(super) fn is_rendered(&self) -> bool {
        self.session.picture().generation >= self.session.status().restarts
    }

    /// Has the silhouettes of this view traced.
    fn follow_outlines(&mut self, now: Instant) {
        let restarts = self.session.status().restarts;
        if !self.overlays || self.seen < restarts || self.handles.is_grabbed() || self.grab.is_some() {
            return;
        }
        let is_selected = !self.session.world().resource::<Selection>().0.is_empty();
        if self.outlines.follow(&self.session, restarts, self.steered_at, is_selected, now) {
            self.repaint_at = Some(now);
        }
    }

    /// Passes the movement by keys and mouse to the session.
    fn steer(&mut self, now: Instant, clock: Duration) {
        let commands = self.input.take(now);
        if commands.is_empty() {
            return;
        }
        // A double click is for the pivot as well.
        let is_for_focus = |command: &Command| matches!(command, Command::FocusAt { .. });
        let only_focuses = commands.iter().all(is_for_focus);
        for command in commands {
            self.session.send(command);
        }
        self.session.update(clock);
        if only_focuses {
            self.offer_depth_of_field(now);
        }
        self.steered_at = now;
    }
}

/// Returns the window title; an asterisk marks unsaved edits.
pub(super) fn title(scene: &str, unsaved: bool) -> String {
    let name = short_name(scene);
    let mark = if unsaved { "*" } else { "" };
    if name.is_empty() {
        "firstlight".to_owned()
    } else {
        format!("firstlight — {mark}{}", crate::files::printable::name(&name))
    }
}
