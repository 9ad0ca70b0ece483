//! Spheres of the scene's materials for lists: rendered one after the other on a thread, while they are looked at.

use crate::frame::{MaterialPreview, Session, Waker};
use crate::viewer::image_job::ImageJob;
use bevy_ecs::prelude::Entity;
use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use std::collections::HashMap;

/// Width of an image in pixels.
const SIDE: u32 = 48;

/// The images, by the entities of their materials.
#[derive(Default)]
pub struct Previews {
    waker: Option<Waker>,
    /// Number of scenes that the session had adopted: entities are those of the last one.
    adopted: u64,
    known: HashMap<Entity, Known>,
    rendering: Option<Rendering>,
    /// They may not use time that the image needs.
    moving: bool,
}

struct Known {
    /// Of the scene when it was compared last.
    revision: u64,
    preview: MaterialPreview,
    texture: TextureHandle,
}

struct Rendering {
    entity: Entity,
    preview: MaterialPreview,
    job: ImageJob,
}

impl Previews {
    /// - `waker`: called when an image is ready.
    pub fn new(waker: Waker) -> Self {
        Self { waker: Some(waker), ..Self::default() }
    }

    /// Says whether the view moves, which ends what is being rendered.
    pub fn set_moving(&mut self, moving: bool) {
        self.moving = moving;
        if let Some(rendering) = self.rendering.as_ref().filter(|_| moving) {
            rendering.job.stop();
        }
    }

    /// Takes an image that is ready; returns whether there is one, so that the list is to be drawn again.
    pub fn receive(&mut self, context: &Context) -> bool {
        let Some(image) = self.rendering.as_ref().and_then(|rendering| rendering.job.ended()) else { return false };
        let Some(Rendering { entity, preview, .. }) = self.rendering.take() else { return false };
        if let Some(image) = image {
            let image = ColorImage::from_rgb([SIDE as usize; 2], &image);
            let texture = context.load_texture("material", image, TextureOptions::LINEAR);
            self.known.insert(entity, Known { revision: 0, preview, texture });
        }
        true
    }

    /// The image of a material; `None` until there is one. An older one is shown until that of a changed material is
    /// ready.
    pub fn of(&mut self, session: &Session, entity: Entity) -> Option<TextureHandle> {
        if std::mem::replace(&mut self.adopted, session.n_adopted()) != session.n_adopted() {
            self.forget();
        }
        let revision = session.revision();
        if let Some(known) = self.known.get(&entity).filter(|known| known.revision == revision) {
            return Some(known.texture.clone());
        }
        let preview = MaterialPreview::of(session.world(), entity)?;
        if let Some(known) = self.known.get_mut(&entity).filter(|known| known.preview == preview) {
            known.revision = revision;
            return Some(known.texture.clone());
        }
        if self.rendering.is_none() && !self.moving {
            self.rendering = self.waker.clone().and_then(|waker| render(entity, preview, waker));
        }
        Some(self.known.get(&entity)?.texture.clone())
    }

    fn forget(&mut self) {
        self.known.clear();
        self.rendering = None;
    }
}

fn render(entity: Entity, preview: MaterialPreview, waker: Waker) -> Option<Rendering> {
    let of = preview.clone();
    let job = ImageJob::start(waker, move |stop| of.render(SIDE, stop))?;
    Some(Rendering { entity, preview, job })
}
