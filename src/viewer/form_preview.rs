//! A small image of what the form would save: all of it, in its proportions, also what the window or the panel cuts off.

use crate::frame::navigation::Rig;
use crate::frame::{Session, Target, Waker, render_offline_until};
use crate::render::{Display, Film, Prepared, RenderSettings, develop, worker_threads};
use crate::scene::DisplaySettings;
use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};

/// Most pixels along each side.
const MOST: (u32, u32) = (240, 150);
const SPP: u32 = 16;

/// What an image shows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Content {
    size: (u32, u32),
    revision: u64,
    rig: Rig,
    display: Display,
}

/// The image, and the one that is being rendered.
pub struct FormPreview {
    waker: Waker,
    shown: Option<(Content, TextureHandle)>,
    rendering: Option<Rendering>,
}

struct Rendering {
    content: Content,
    stop: Arc<AtomicBool>,
    receiver: Receiver<Option<Vec<u8>>>,
}

impl FormPreview {
    /// Points that the form keeps free for it.
    pub const HEIGHT: f32 = MOST.1 as f32;

    /// - `waker`: called when an image is ready.
    pub fn new(waker: Waker) -> Self {
        Self { waker, shown: None, rendering: None }
    }

    /// The image for a file of this size; the one before until a new one is ready, `None` until there is one.
    ///
    /// - `is_moving`: the view moves, and needs the time.
    pub fn of(
        &mut self,
        context: &Context,
        session: &Session,
        file: (u32, u32),
        is_moving: bool,
    ) -> Option<TextureHandle> {
        if let Some(image) = self.rendering.as_ref().and_then(|rendering| rendering.receiver.try_recv().ok())
            && let Some(Rendering { content, .. }) = self.rendering.take()
            && let Some(image) = image
        {
            let image = ColorImage::from_rgb([content.size.0 as usize, content.size.1 as usize], &image);
            self.shown = Some((content, context.load_texture("what is saved", image, TextureOptions::LINEAR)));
        }
        let (revision, rig) = (session.revision(), session.status().rig);
        let display = session.world().resource::<DisplaySettings>().0;
        let content = Content { size: small(file), revision, rig, display };
        let is_shown = self.shown.as_ref().is_some_and(|(shown, _)| *shown == content);
        match &self.rendering {
            Some(rendering) if is_moving || rendering.content != content => {
                rendering.stop.store(true, Ordering::Relaxed);
            }
            None if !is_shown && !is_moving => {
                self.rendering = session.rendered().and_then(|of| render(content, of, self.waker.clone()));
            }
            _ => {}
        }
        self.shown.as_ref().map(|(_, texture)| texture.clone())
    }

    /// Forgets the image, when the form is closed.
    pub fn close(&mut self) {
        self.shown = None;
        if let Some(rendering) = self.rendering.take() {
            rendering.stop.store(true, Ordering::Relaxed);
        }
    }
}

/// The largest size of these proportions.
fn small((width, height): (u32, u32)) -> (u32, u32) {
    let scale = (f64::from(MOST.0) / f64::from(width.max(1))).min(f64::from(MOST.1) / f64::from(height.max(1)));
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    (side(width), side(height))
}

fn render(content: Content, (scene, settings): (Prepared, RenderSettings), waker: Waker) -> Option<Rendering> {
    let ((sender, receiver), stop) = (channel(), Arc::new(AtomicBool::default()));
    let stopped = stop.clone();
    let (width, height) = content.size;
    let work = move || {
        let stop = || stopped.load(Ordering::Relaxed);
        let image = worker_threads().num_threads(1).build().ok().and_then(|pool| {
            let mut film = Film::try_new(width, height).ok()?;
            let target = Target { spp: Some(SPP), ..Target::default() };
            pool.install(|| render_offline_until(&scene, &settings, &mut film, target, &stop, |_| true));
            let mut rgba = Vec::new();
            develop(&film, &content.display, width, height, &mut rgba);
            let rgb = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
            (!stop()).then_some(rgb)
        });
        // If the form was closed, nobody waits for it.
        let _ = sender.send(image);
        waker();
    };
    std::thread::Builder::new().name("form preview".to_owned()).spawn(work).ok()?;
    Some(Rendering { content, stop, receiver })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_small_image_has_the_proportions_of_the_file() {
        assert_eq!(small((1920, 1080)), (240, 135));
        assert_eq!(small((1080, 1080)), (150, 150));
        assert_eq!(small((1, 32_768)), (1, 150));
        assert_eq!(small((32_768, 1)), (240, 1));
    }
}
