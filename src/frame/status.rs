//! What a session has to show: the picture, and how it is getting on.

use super::rig::Rig;
use crate::printable;
use crate::render::{BadSample, CausticChoice, Display, Inspection, Integrator, Legend, RayCounts, Region};
use bevy_ecs::prelude::Resource;
use std::collections::VecDeque;
use std::time::Duration;

/// A developed picture, as large as the session's size when it was asked for.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// sRGB-encoded, row by row from the top, 4 bytes a pixel; empty before the first picture.
    pub rgba: Vec<u8>,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Grows with every restart.
    pub generation: u64,
    /// By what the sides of the film behind it were divided.
    pub divider: u32,
    /// Samples per pixel of the film behind it.
    pub spp: u32,
    /// What it shows, which may not be what was asked for last.
    pub inspection: Inspection,
    /// Of that inspection, where colours stand for numbers.
    pub legend: Option<Legend>,
    /// Grows with every picture, also within a generation.
    pub number: u64,
}

/// How the session is getting on.
#[derive(Resource, Clone, Debug, Default)]
pub struct Status {
    /// What is open.
    pub scene: String,
    /// The camera, as commands steer it.
    pub rig: Rig,
    /// Exposure and tone curve.
    pub display: Display,
    /// The light model.
    pub integrator: Integrator,
    /// Samples per pixel.
    pub spp: u32,
    /// What gets all samples now, pixels of the film, and how many it has.
    pub region: Option<(Region, u32)>,
    /// Seconds of rendering since the restart.
    pub seconds: f64,
    /// Rays since the restart.
    pub rays: RayCounts,
    /// Seconds from the restart to the last of these rays, whatever they were spent on.
    pub elapsed: f64,
    /// Millions of camera rays per second, recently.
    pub camera_mrays: f64,
    /// Millions of bounce rays per second, recently.
    pub bounce_mrays: f64,
    /// Millions of shadow rays per second, recently.
    pub shadow_mrays: f64,
    /// Pixels of the film behind the picture.
    pub film_width: u32,
    /// Height of that film in pixels.
    pub film_height: u32,
    /// By what its sides are divided; 1 is full resolution.
    pub divider: u32,
    /// Relative error of the whole picture, or of the region, when it is known.
    pub estimated_error: Option<f64>,
    /// How caustics are looked for, where the scene may have some and it is known.
    pub caustics: Option<CausticChoice>,
    /// Relative error of the denoised picture, where that is shown.
    pub denoised_error: Option<f64>,
    /// Why the samples were last dropped.
    pub restart_cause: String,
    /// How often they were.
    pub restarts: u64,
    /// What is being read or built beside the picture.
    pub loading: Option<String>,
    /// The newest last.
    pub messages: VecDeque<Message>,
    /// Samples that were not finite and were left out.
    pub n_bad: u64,
    /// The first few of them.
    pub bad: Vec<BadSample>,
    /// Samples brighter than anything in the scene can be: a fault of the program.
    pub n_above: u64,
    /// Number of worker threads.
    pub threads: usize,
    /// Whether rendering is paused by a command.
    pub paused: bool,
    /// The target is reached.
    pub done: bool,
}

/// Something that a person should read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// When, on the clock of [`Session::update`](super::Session::update).
    pub at: Duration,
    /// How serious it is.
    pub kind: MessageKind,
    /// One line or several, safe to print.
    pub text: String,
}

/// How serious a [`Message`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// Something to know; nothing is wrong.
    Note,
    /// Something is not as asked, and the session continues.
    Warning,
    /// Something asked for has failed.
    Error,
}

impl Status {
    /// Messages that are kept.
    const MAX_MESSAGES: usize = 100;

    /// Millions of rays a second, all classes together.
    pub fn mrays(&self) -> f64 {
        self.camera_mrays + self.bounce_mrays + self.shadow_mrays
    }

    /// Adds a message, safe to print, at a time on the session's clock; beyond a hundred the oldest is dropped.
    pub fn say(&mut self, at: Duration, kind: MessageKind, text: impl Into<String>) {
        let text = printable::lines(&text.into());
        // Whoever holds the session tells people; the log only keeps it for those who look for it.
        tracing::info!("{kind:?}: {text}");
        if self.messages.len() == Self::MAX_MESSAGES {
            self.messages.pop_front();
        }
        self.messages.push_back(Message { at, kind, text });
    }
}
