//! Images and frames that are rendered to files beside the window.

use crate::console;
use crate::frame::{Command, Reel};
use crate::viewer::app::App;
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::order::{Order, Subject};
use crate::viewer::order_form::Wish;
use crate::viewer::renders::{Outcome, Source};
use crate::viewer::saver::file_stem;
use crate::viewer::time_line::Strip;
use crate::viewer::toasts::Tone;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time after the last movement of the view during which other renders make room.
const SETTLED: Duration = Duration::from_millis(300);

impl App {
    pub(super) fn open_form(&mut self, frames: bool, now: Instant) {
        let turns = self.input.is_spinning();
        if frames && turns {
            // Its image needs a view that rests.
            self.input.toggle_spin(now);
        }
        if frames && !turns {
            match Strip::of(&self.session) {
                // A model in the pose of its file begins to move.
                Some(strip) => strip.before_play(false).into_iter().for_each(|command| self.session.send(command)),
                // As for a turntable that is seen first.
                None => self.session.send(Command::PivotOnMiddle),
            }
        }
        self.form.open(&self.session, frames, turns, (&self.options.folder, &self.renders.paths()));
    }

    /// Does what the form asks for.
    pub(super) fn grant(&mut self, wish: Wish, now: Instant) {
        match wish {
            Wish::Begin(order) => {
                if let Err(reason) = self.begin_order(order) {
                    self.toasts.add(Tone::Problem, reason, now);
                }
            }
            Wish::Choose(purpose) => {
                let path = self.form.path().to_owned();
                self.choose_place(purpose, &path);
            }
        }
        self.repaint_at = Some(now);
        self.needs_tick = true;
    }

    fn begin_order(&mut self, order: Order) -> Result<(), String> {
        let missing = || "there is nothing to render yet".to_owned();
        let (scene, settings) = self.session.rendered().ok_or_else(missing)?;
        let status = self.session.status();
        let (stem, threads) = (file_stem(&status.scene), status.threads);
        let source = match order.frames {
            None => {
                let draft = self.session.shot_draft();
                Source::Still(Box::new(Subject { scene, settings, draft }))
            }
            Some(ref frames) => {
                let reel = match order.is_turntable {
                    true => Reel::turntable_of(&mut self.session, *frames.end() + 1),
                    false => Reel::of(&mut self.session),
                };
                Source::Frames(Box::new(reel.ok_or_else(missing)?), settings)
            }
        };
        self.renders.begin(order, source, stem, threads)
    }

    /// Shows the browser for the place of the scene, of the image or of the frames.
    ///
    /// - `path`: the proposal.
    pub(super) fn choose_place(&mut self, purpose: DialogPurpose, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = path.parent().unwrap_or(Path::new("."));
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let screen = self.presenter.as_ref().map(|presenter| presenter.egui_context().content_rect().size());
        self.browser.open(purpose, folder, &name, screen.unwrap_or_default());
    }

    /// Takes the results of renders, and tells them whether the view moves.
    pub(super) fn follow_renders(&mut self, now: Instant) {
        let moves = self.input.is_moving() || self.input.is_dragging() || now < self.steered_at + SETTLED;
        self.panel.previews.set_moving(moves);
        if let Some(presenter) = &self.presenter
            && self.panel.previews.receive(presenter.egui_context())
        {
            self.repaint_at = Some(now);
        }
        if self.renders.is_empty() {
            return;
        }
        self.renders.set_moving(moves);
        for outcome in self.renders.finished() {
            self.report_outcome(outcome);
        }
        // Their progress is drawn as often as figures.
        let soon = self.last_draw.map_or(now, |then| then + super::FIGURES_INTERVAL);
        self.repaint_at = Some(self.repaint_at.map_or(soon, |at| at.min(soon)));
    }

    pub(super) fn report_outcome(&mut self, outcome: Outcome) {
        let now = Instant::now();
        match outcome {
            Ok((path, news)) => {
                console::inform(&news);
                self.tell_saved(path, news, now);
            }
            Err(error) => {
                console::remark(format_args!("error: {error}"));
                self.toasts.add(Tone::Problem, error, now);
            }
        }
        self.repaint_at = Some(now);
    }
}
