//! Output of a session: the image and the status.

use crate::files::printable;
use crate::files::warnings::{Severity, Warnings};
use crate::frame::core::denoising::{DenoiseFilter, Denoising};
use crate::frame::core::rig::Rig;
use crate::render::{BadSample, CausticChoice, Display, Inspection, Integrator, Legend, RayCounts, Region};
use crate::scene::LoadStage;
use bevy_ecs::prelude::Resource;
use std::collections::VecDeque;
use std::ops::Deref;
use std::time::Duration;

/// A developed image, in the session's size at the time it was requested.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// sRGB-encoded RGBA, 4 bytes per pixel, row by row from the top; empty before the first image.
    pub rgba: Vec<u8>,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Increases with every restart.
    pub generation: u64,
    /// Divisor of the film's sides; 1 is full resolution.
    pub divider: u32,
    /// Samples per pixel of the film.
    pub spp: u32,
    /// The displayed view, which may lag behind the requested one.
    pub inspection: Inspection,
    /// How it is denoised, if it is the image itself, which may not be what was last requested.
    pub denoising: Denoising,
    /// Colour scale of the view, if it has one.
    pub legend: Option<Legend>,
    /// Increases with every image, also within a generation.
    pub number: u64,
}

/// Progress of the current image.
#[derive(Clone, Debug, Default)]
pub struct RenderProgress {
    /// Samples per pixel.
    pub spp: u32,
    /// Region that gets all samples, in pixels of the film, and its samples per pixel.
    pub region: Option<(Region, u32)>,
    /// Render time since the restart, seconds.
    pub seconds: f64,
    /// Rays since the restart.
    pub rays: RayCounts,
    /// Wall time from the restart to the last of these rays, seconds.
    pub elapsed: f64,
    /// Width of the film that the image was developed from, in pixels.
    pub film_width: u32,
    /// Height of that film in pixels.
    pub film_height: u32,
    /// Divisor of the film's sides; 1 is full resolution.
    pub divider: u32,
    /// Relative error of the whole image, or of the region, once it is known.
    pub estimated_error: Option<f64>,
    /// How caustics are rendered at full resolution, if the scene may have any and it is known.
    pub caustics: Option<CausticChoice>,
    /// Number of portals through which the environment is sampled at full resolution.
    pub n_portals: usize,
    /// How the image is denoised.
    pub denoising: Denoising,
    /// The filter of the denoised image, if that is displayed.
    pub denoised_by: DenoiseFilter,
    /// Relative error of the denoised image, if that is displayed and known.
    pub denoised_error: Option<f64>,
    /// Samples per pixel of which it was made.
    pub denoised_spp: u32,
    /// Whether it is mixed with the raw image, which has more samples and the smaller error.
    pub mixes_raw: bool,
    /// Whether a denoised image is wanted at full resolution, and the first one is not there yet.
    pub awaits_denoised: bool,
    /// Number of samples that were rejected because they were not finite.
    pub n_bad: u64,
    /// The first few of them.
    pub bad: Vec<BadSample>,
    /// Number of samples brighter than any radiance in the scene can be, which is a bug of the program.
    pub n_above: u64,
    /// Number of worker threads.
    pub threads: usize,
}

/// State of a session; dereferences to the progress of its image.
#[derive(Resource, Clone, Debug, Default)]
pub struct Status {
    /// Progress of the image.
    pub progress: RenderProgress,
    /// Name of the open scene.
    pub scene: String,
    /// The camera as controlled by commands.
    pub rig: Rig,
    /// Exposure and tone curve.
    pub display: Display,
    /// The integrator.
    pub integrator: Integrator,
    /// Millions of camera rays per second, recently.
    pub camera_mrays: f64,
    /// Millions of bounce rays per second, recently.
    pub bounce_mrays: f64,
    /// Millions of shadow rays per second, recently.
    pub shadow_mrays: f64,
    /// Cause of the last restart.
    pub restart_cause: String,
    /// Number of restarts.
    pub restarts: u64,
    /// What is being loaded or built in the background.
    pub loading: Option<String>,
    /// The stage of the scene that is being opened.
    pub opening: Option<LoadStage>,
    /// Messages, the newest last.
    pub messages: VecDeque<Message>,
    /// Texts of earlier messages that no longer apply, such as errors of a scene file that has been corrected.
    pub withdrawn: Vec<String>,
    /// Whether rendering is paused by a command.
    pub paused: bool,
    /// Whether the target is reached.
    pub done: bool,
}

impl Deref for Status {
    type Target = RenderProgress;

    fn deref(&self) -> &RenderProgress {
        &self.progress
    }
}

/// A message for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Time, on the clock of [`Session::update`](crate::frame::Session::update).
    pub at: Duration,
    /// How serious it is.
    pub kind: MessageKind,
    /// One or more lines, safe to print.
    pub text: String,
    /// Others of the same kind that `text` only counts, safe to print.
    pub others: Vec<String>,
}

/// How serious a [`Message`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// Information; nothing is wrong.
    Note,
    /// The scene is in its file.
    Saved,
    /// Something differs from the request, and the session continues.
    Warning,
    /// A request has failed.
    Error,
}

impl Status {
    /// Maximum number of messages.
    const MAX_MESSAGES: usize = 100;

    /// Millions of rays per second, all classes.
    pub fn mrays(&self) -> f64 {
        self.camera_mrays + self.bounce_mrays + self.shadow_mrays
    }

    /// Relative error of the denoised image, if it is displayed and can be told: it is estimated from two halves of the
    /// samples, and as long as these have an error over 100 %, both may lack the same light.
    pub fn known_denoised_error(&self) -> Option<f64> {
        self.denoised_error.filter(|_| self.estimated_error.is_none_or(|error| error <= 1.0))
    }

    /// Withdraws the last errors of a scene file, by their texts.
    pub(crate) fn withdraw(&mut self, texts: Vec<String>) {
        self.withdrawn = texts;
    }

    /// Adds a message, made safe to print, at a time on the session's clock; drops the oldest one beyond a hundred.
    pub fn say(&mut self, at: Duration, kind: MessageKind, text: impl Into<String>) {
        self.say_first(at, kind, &text.into(), Vec::new());
    }

    /// Adds a message for each kind of warning, with the others of that kind.
    pub(crate) fn say_warnings(&mut self, at: Duration, warnings: &Warnings) {
        for first in warnings.summary() {
            let kind = match first.severity {
                Severity::Notice => MessageKind::Note,
                Severity::Warning => MessageKind::Warning,
            };
            let others = warnings.others_like(&first).map(|other| printable::lines(&other.to_string())).collect();
            self.say_first(at, kind, &first.to_string(), others);
        }
    }

    /// - `others`: texts of the same kind, safe to print.
    fn say_first(&mut self, at: Duration, kind: MessageKind, text: &str, others: Vec<String>) {
        let text = printable::lines(text);
        // Displaying messages is the task of the session's owner; the log only keeps a copy.
        tracing::info!("{kind:?}: {text}");
        if self.messages.len() == Self::MAX_MESSAGES {
            self.messages.pop_front();
        }
        self.messages.push_back(Message { at, kind, text, others });
    }
}
