//! A small image of what the form would save: all of it, in its proportions, also what the window or the panel cuts off.

use crate::frame::navigation::Rig;
use crate::frame::{Session, Target, Waker, render_region_until};
use crate::render::{Display, Film, Prepared, RenderSettings, develop};
use crate::scene::DisplaySettings;
use crate::viewer::image_job::ImageJob;
use egui::{ColorImage, Context, TextureHandle, TextureOptions};

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
    rendering: Option<(Content, ImageJob)>,
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
        if let Some(image) = self.rendering.as_ref().and_then(|(_, job)| job.ended())
            && let Some((content, _)) = self.rendering.take()
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
            Some((of, job)) if is_moving || *of != content => job.stop(),
            None if !is_shown && !is_moving => {
                let job = session.rendered().and_then(|of| render(content, of, self.waker.clone()));
                self.rendering = job.map(|job| (content, job));
            }
            _ => {}
        }
        self.shown.as_ref().map(|(_, texture)| texture.clone())
    }

    /// Forgets the image, when the form is closed.
    pub fn close(&mut self) {
        (self.shown, self.rendering) = (None, None);
    }
}

/// The largest size of these proportions.
fn small((width, height): (u32, u32)) -> (u32, u32) {
    let scale = (f64::from(MOST.0) / f64::from(width.max(1))).min(f64::from(MOST.1) / f64::from(height.max(1)));
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    (side(width), side(height))
}

fn render(content: Content, (scene, settings): (Prepared, RenderSettings), waker: Waker) -> Option<ImageJob> {
    ImageJob::start(waker, move |stop| {
        let (width, height) = content.size;
        let mut film = Film::try_new(width, height).ok()?;
        let target = Target { spp: Some(SPP), ..Target::default() };
        render_region_until(&scene, &settings, &mut film, None, target, stop, |_| true);
        let mut rgba = Vec::new();
        develop(&film, &content.display, width, height, &mut rgba);
        let rgb = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        (!stop()).then_some(rgb)
    })
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
