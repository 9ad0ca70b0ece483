//! Saves the open scene in the background: the world is described within the frame, and written on another thread.

use crate::frame::Waker;
use crate::frame::core::status::{MessageKind, Status};
use crate::frame::state::background::BackgroundTasks;
use crate::frame::state::history::{Content, History};
use crate::frame::state::resources::{Clock, CurrentScene};
use crate::scene::{Description, Fingerprint, SavedScene, SceneContent, WriteError};
use bevy_ecs::prelude::{Resource, World};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// File and contents of the last save of the open scene; reset when another scene is opened.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct SavedAs {
    /// The scene file; `None` if the scene was not saved.
    pub path: Option<PathBuf>,
    /// Fingerprint of the scene as it was saved.
    pub content: Option<Fingerprint>,
}

struct SavedState {
    path: PathBuf,
    result: Result<SavedScene, WriteError>,
    content: Fingerprint,
    clean: Content,
    /// Images that the scene names where it was opened, and not where it is saved.
    lost: Vec<String>,
}

/// Requests and running saves.
#[derive(Resource, Default)]
pub struct Saving {
    /// Files to write at the next frame.
    pub(super) requests: Vec<PathBuf>,
    finished: Arc<Mutex<Vec<SavedState>>>,
    threads: Vec<JoinHandle<()>>,
    waker: Option<Waker>,
}

impl Saving {
    /// - `waker`: called when a scene has been saved, or saving has failed.
    pub fn new(waker: Option<Waker>) -> Self {
        let mut saving = Self::default();
        saving.waker = waker;
        saving
    }

    /// Whether there is no request and no running save.
    pub fn is_idle(&self) -> bool {
        let finished = self.finished.lock().unwrap_or_else(PoisonError::into_inner);
        self.requests.is_empty() && finished.is_empty() && self.threads.iter().all(JoinHandle::is_finished)
    }
}

impl Drop for Saving {
    /// Waits for running saves, so that they complete even if the window closes.
    fn drop(&mut self) {
        for thread in self.threads.drain(..) {
            // A panic has been printed by the thread itself.
            let _ = thread.join();
        }
    }
}

/// Executes requests to save, and reports the results.
///
/// Reads the world; writes [`Saving`], [`SavedAs`], [`Status`].
pub fn save(world: &mut World) {
    let now = world.resource::<Clock>().0;
    let finished = {
        let mut saving = world.resource_mut::<Saving>();
        saving.threads.retain(|thread| !thread.is_finished());
        std::mem::take(&mut *saving.finished.lock().unwrap_or_else(PoisonError::into_inner))
    };
    for SavedState { path, result, content, clean, lost } in finished {
        match result {
            Ok(saved) => {
                let notes: String = saved.notes.iter().map(|note| format!("; {note}")).collect();
                let is_first = world.resource::<SavedAs>().path.as_ref() != Some(&path);
                let mut status = world.resource_mut::<Status>();
                status.scene = path.display().to_string();
                let whole = std::path::absolute(&path).unwrap_or_else(|_| path.clone());
                status.say(now, MessageKind::Saved, format!("saved {}{notes}", whole.display()));
                if is_first {
                    let text = |name: &String| {
                        format!("`{name}` is missing, and the saved scene does not name it; the opened one does")
                    };
                    status.say_warnings(now, &lost.iter().map(text).collect());
                }
                world.insert_resource(SavedAs { path: Some(path), content: Some(content) });
                world.resource_mut::<History>().mark_clean(clean);
            }
            Err(error) => world.resource_mut::<Status>().say(now, MessageKind::Error, error),
        }
    }
    for path in std::mem::take(&mut world.resource_mut::<Saving>().requests) {
        let current = world.get_resource::<CurrentScene>().map(|current| current.0.clone());
        let clean = History::content(world);
        let description = Description::of(world, current.as_deref());
        let content = SceneContent::of(world, &description);
        if let Some(title) = world.resource::<BackgroundTasks>().mesh_in_the_making() {
            let text = format!("{title} has not finished and is not in the file: save again afterwards");
            world.resource_mut::<Status>().say(now, MessageKind::Warning, text);
        }
        let mut saving = world.resource_mut::<Saving>();
        let (finished, waker) = (saving.finished.clone(), saving.waker.clone());
        let target = path.clone();
        let lost = current.as_ref().map_or_else(Vec::new, |current| current.lost_images.clone());
        let work = move || {
            let content = content.fingerprint();
            let result = description.save(&path);
            finished.lock().unwrap_or_else(PoisonError::into_inner).push(SavedState {
                path,
                result,
                content,
                clean,
                lost,
            });
            if let Some(waker) = waker {
                waker();
            }
        };
        match std::thread::Builder::new().name("firstlight save".to_owned()).spawn(work) {
            Ok(thread) => saving.threads.push(thread),
            Err(error) => {
                let message = format!("{}: cannot be saved: cannot start a thread: {error}", target.display());
                world.resource_mut::<Status>().say(now, MessageKind::Error, message);
            }
        }
    }
}
