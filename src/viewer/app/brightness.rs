//! The exposure by the brightness of the image: set on request, and offered where the image is far from it.

use crate::frame::{Command, usual_exposure};
use crate::viewer::app::App;
use crate::viewer::keys::Action;
use crate::viewer::toasts::Tone;
use std::mem::discriminant;
use std::time::Instant;

/// Stops from the usual exposure from which on an image is very dark or very bright.
const FAR: f32 = 3.0;
/// Seconds of rendering after which an image is judged.
const JUDGED_AFTER: f64 = 2.0;

impl App {
    pub(super) fn set_exposure(&mut self, now: Instant) {
        match self.session.film_snapshot().and_then(|film| usual_exposure(&film)) {
            Some(stops) => self.session.send(Command::SetExposure { stops }),
            None => self.toasts.add(Tone::News, "there is no light in the image to set the exposure by", now),
        }
    }

    /// Offers another exposure for an image that is nearly black or white.
    pub(super) fn follow_brightness(&mut self, now: Instant) {
        let status = self.session.status();
        let scene = (self.session.n_adopted(), discriminant(&self.session.inputs().environment.part));
        let is_ready = status.divider == 1 && status.seconds >= JUDGED_AFTER && self.is_rendered();
        if self.judged == Some(scene) || !is_ready {
            return;
        }
        let Some(film) = self.session.film_snapshot() else { return };
        self.judged = Some(scene);
        let off = usual_exposure(&film).map_or(0.0, |usual| usual - status.display.exposure_stops);
        let (text, button) = match off {
            off if off >= FAR => ("the image is very dark", "Brighten it"),
            off if off <= -FAR => ("the image is very bright", "Darken it"),
            _ => return,
        };
        self.toasts.add_offer(Tone::News, text.to_owned(), (button, Action::AutoExposure), now);
    }
}
