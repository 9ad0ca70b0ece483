//! Spheres of the scene's materials for lists: rendered one after the other on a thread, while they are looked at.

use crate::frame::{MaterialPreview, Session, Waker};
use crate::render::worker_threads;
use bevy_ecs::prelude::Entity;
use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

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
    stop: Arc<AtomicBool>,
    receiver: Receiver<Option<Vec<u8>>>,
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
            rendering.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Takes an image that is ready; returns whether there is one, so that the list is to be drawn again.
    pub fn receive(&mut self, context: &Context) -> bool {
        let Some(rendering) = &self.rendering else { return false };
        let image = match rendering.receiver.try_recv() {
            Err(TryRecvError::Empty) => return false,
            Err(TryRecvError::Disconnected) => None,
            Ok(image) => image,
        };
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
        if let Some(rendering) = self.rendering.take() {
            rendering.stop.store(true, Ordering::Relaxed);
        }
    }
}

fn render(entity: Entity, preview: MaterialPreview, waker: Waker) -> Option<Rendering> {
    let ((sender, receiver), stop) = (channel(), Arc::new(AtomicBool::default()));
    let (of, stopped) = (preview.clone(), stop.clone());
    let work = move || {
        let stop = || stopped.load(Ordering::Relaxed);
        let pool = worker_threads().num_threads(1).build();
        let image = pool.ok().and_then(|pool| pool.install(|| of.render(SIDE, &stop)));
        // If the window is gone, nobody waits for it.
        let _ = sender.send(image);
        waker();
    };
    std::thread::Builder::new().name("preview".to_owned()).spawn(work).ok()?;
    Some(Rendering { entity, preview, stop, receiver })
}
