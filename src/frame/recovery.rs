//! Recovery of unsaved edits: they are stored beside the settings as long as they are unsaved, and offered at the next
//! start after a crash, a lost display or a signal.
//!
//! Each window has its own scene file and holds a lock on a file beside it. A scene whose lock is free is an orphan.
//! Nothing here knows a window.

use crate::files::whole_file::lock_file;
use crate::scene::{Description, FileKind, InputFile, LoadOptions, SceneSource, load, save_scene};
use bevy_ecs::prelude::World;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

/// Stores the edits of one window.
#[derive(Debug, Default)]
pub struct Recovery {
    /// `None` if nothing can be stored.
    folder: Option<PathBuf>,
    place: Option<RecoverySlot>,
    writer: Option<JoinHandle<Result<(), String>>>,
    /// The last attempt to store has failed, such as on a full disk.
    has_failed: bool,
}

/// The files of a window.
#[derive(Debug)]
struct RecoverySlot {
    scene: PathBuf,
    /// Locked while it is open.
    _lock: File,
}

/// Unsaved edits of a window that no longer runs.
#[derive(Debug)]
pub struct LeftBehind {
    /// Title of the scene.
    pub title: String,
    scene: PathBuf,
    /// Prevents other windows from offering them.
    _lock: File,
}

const SCENE: &str = "ron";
const TITLE: &str = "title";
const LOCK: &str = "lock";

impl Recovery {
    /// Stores edits in a subfolder of `folder`, the folder for settings.
    pub fn beside(folder: Option<&Path>) -> Self {
        Self { folder: folder.map(|folder| folder.join("recovery")), ..Self::default() }
    }

    /// Whether edits are stored.
    pub fn has_kept(&self) -> bool {
        self.place.is_some() && !self.has_failed
    }

    /// Replaces the stored scene, on another thread; returns the error of the previous attempt, if any.
    pub fn keep(&mut self, description: Description, title: &str) -> Option<String> {
        let trouble = self.wait();
        let scene = match self.place() {
            Ok(Some(scene)) => scene,
            Ok(None) => return trouble,
            Err(error) => return Some(error),
        };
        let title = title.to_owned();
        let work = move || -> Result<(), String> {
            crate::files::whole_file::write_whole(&scene.with_extension(TITLE), title.as_bytes())?;
            description.save_draft(&scene)?;
            Ok(())
        };
        match std::thread::Builder::new().name("firstlight recovery".to_owned()).spawn(work) {
            Ok(writer) => {
                self.writer = Some(writer);
                trouble
            }
            Err(error) => Some(format!("unsaved edits are not backed up: cannot start a thread: {error}")),
        }
    }

    /// Waits until the pending write is on disk; returns its error, if any.
    pub fn wait(&mut self) -> Option<String> {
        // A panic has been printed by the thread itself.
        let written = self.writer.take()?.join().unwrap_or(Ok(()));
        self.has_failed = written.is_err();
        written.err()
    }

    /// Removes the stored edits, because there is nothing unsaved any more.
    pub fn forget(&mut self) {
        self.wait();
        if let Some(place) = self.place.take() {
            remove(&place.scene);
        }
    }

    /// The scene file of this window; `None` if nothing can be stored.
    fn place(&mut self) -> Result<Option<PathBuf>, String> {
        let Some(folder) = &self.folder else { return Ok(None) };
        if let Some(place) = &self.place {
            return Ok(Some(place.scene.clone()));
        }
        let failed =
            |error: std::io::Error| format!("{}: unsaved edits cannot be backed up: {error}", folder.display());
        std::fs::create_dir_all(folder).map_err(failed)?;
        for number in 0..1000 {
            let scene = folder.join(format!("{}-{number}.{SCENE}", std::process::id()));
            // Keeps the files of an earlier process with the same id.
            if let Some(lock) = lock(&scene).map_err(failed)?.filter(|_| !scene.exists()) {
                self.place = Some(RecoverySlot { scene: scene.clone(), _lock: lock });
                return Ok(Some(scene));
            }
        }
        Err(format!("{}: unsaved edits cannot be backed up: the folder holds too many backups", folder.display()))
    }

    /// Edits of windows that no longer run, the oldest first. What such windows left without a scene, as on a full
    /// disk, is removed.
    pub fn left_behind(&self) -> Vec<LeftBehind> {
        let Some(entries) = self.folder.as_ref().and_then(|folder| std::fs::read_dir(folder).ok()) else {
            return Vec::new();
        };
        let is = |path: &Path, wanted: &str| path.extension().is_some_and(|extension| extension == wanted);
        let paths = entries.flatten().map(|entry| entry.path());
        let (mut scenes, others): (Vec<PathBuf>, Vec<PathBuf>) = paths.partition(|path| is(path, SCENE));
        for path in others.iter().filter(|path| is(path, LOCK) && !path.with_extension(SCENE).exists()) {
            if let Ok(Some(_lock)) = lock(path) {
                remove(path);
            }
        }
        scenes.sort_by_key(|path| (path.metadata().and_then(|data| data.modified()).ok(), path.clone()));
        let left = |scene: PathBuf| {
            let lock = lock(&scene).ok()??;
            let title = InputFile::open(&scene.with_extension(TITLE), FileKind::Settings).and_then(InputFile::text);
            let title = title.unwrap_or_else(|_| "a scene".to_owned());
            Some(LeftBehind { title, scene, _lock: lock })
        };
        scenes.into_iter().filter_map(left).collect()
    }
}

impl LeftBehind {
    /// Converts the edits to a new scene file and removes them.
    ///
    /// # Errors
    /// If they cannot be read or written; then they stay.
    pub fn restore(self, to: &Path) -> Result<(), String> {
        let scene =
            load(&SceneSource::Scene(self.scene.clone()), &LoadOptions { preview: true, ..LoadOptions::default() });
        let scene = scene.map_err(|error| error.to_string())?;
        let mut world = World::new();
        scene.spawn(&mut world);
        save_scene(&mut world, Some(&scene), to)?;
        self.discard();
        Ok(())
    }

    /// Removes the edits permanently.
    pub fn discard(self) {
        remove(&self.scene);
    }
}

/// Takes the lock beside a scene file, if it is free.
fn lock(scene: &Path) -> std::io::Result<Option<File>> {
    let file = lock_file(&scene.with_extension(LOCK))?;
    Ok(file.try_lock().is_ok().then_some(file))
}

fn remove(scene: &Path) {
    // The scene first: without it the other files are ignored, and a scene that cannot be removed is offered again.
    for extension in [SCENE, TITLE, LOCK] {
        let _ = std::fs::remove_file(scene.with_extension(extension));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn description(name: &str) -> Description {
        let scene = load(&SceneSource::Builtin(name.to_owned()), &LoadOptions::default()).unwrap();
        let mut world = World::new();
        scene.spawn(&mut world);
        Description::of(&mut world, Some(&scene))
    }

    #[test]
    fn what_is_left_behind_is_found_and_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let mut window = Recovery::beside(Some(folder.path()));
        assert!(window.left_behind().is_empty() && !window.has_kept());
        assert_eq!(window.keep(description("cornell"), "cornell"), None);
        assert_eq!(window.keep(description("cornell-balls"), "my room"), None);
        assert_eq!(window.wait(), None);
        // The window is running, so another one does not offer its edits.
        let next = Recovery::beside(Some(folder.path()));
        assert!(window.has_kept() && next.left_behind().is_empty());
        drop(window);
        let found = next.left_behind();
        assert_eq!(found.iter().map(|left| left.title.as_str()).collect::<Vec<_>>(), ["my room"]);
        assert!(next.left_behind().is_empty(), "another window is asking already");
        let target = folder.path().join("back.ron");
        found.into_iter().for_each(|left| left.restore(&target).unwrap());
        let back = load(&SceneSource::Scene(target), &LoadOptions::default()).unwrap();
        assert_eq!(back.file.objects, description("cornell-balls").file.objects);
        assert_eq!(std::fs::read_dir(folder.path().join("recovery")).unwrap().count(), 0);
    }

    /// As on a full disk: what could not be written is not said to be kept.
    #[test]
    fn what_could_not_be_stored_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut window = Recovery::beside(Some(folder.path()));
        window.keep(description("cornell"), "cornell");
        assert_eq!((window.wait(), window.has_kept()), (None, true));
        let scene = window.place.as_ref().unwrap().scene.clone();
        std::fs::remove_file(&scene).unwrap();
        std::fs::create_dir_all(scene.join("in the way")).unwrap();
        window.keep(description("cornell"), "cornell");
        assert!(window.wait().is_some() && !window.has_kept());
        std::fs::remove_dir_all(&scene).unwrap();
        // Nothing is offered, and what is left goes with the window.
        let (next, files) = (Recovery::beside(Some(folder.path())), scene.parent().unwrap());
        assert!(next.left_behind().is_empty() && std::fs::read_dir(files).unwrap().count() > 0);
        window.keep(description("cornell"), "cornell");
        assert_eq!((window.wait(), window.has_kept()), (None, true));
        std::fs::remove_file(&scene).unwrap();
        drop(window);
        assert!(next.left_behind().is_empty());
        assert_eq!(std::fs::read_dir(files).unwrap().count(), 0);
    }

    #[test]
    fn what_is_saved_or_discarded_is_not_offered() {
        let folder = tempfile::tempdir().unwrap();
        let mut window = Recovery::beside(Some(folder.path()));
        window.keep(description("cornell"), "cornell");
        window.forget();
        assert!(!window.has_kept());
        window.keep(description("cornell"), "cornell");
        window.wait();
        drop(window);
        let next = Recovery::beside(Some(folder.path()));
        next.left_behind().into_iter().for_each(LeftBehind::discard);
        assert!(next.left_behind().is_empty());
        assert_eq!(std::fs::read_dir(folder.path().join("recovery")).unwrap().count(), 0);
        // Without a folder for settings nothing is stored, and nothing fails.
        let mut nowhere = Recovery::beside(None);
        assert_eq!(nowhere.keep(description("cornell"), "cornell"), None);
        assert!(!nowhere.has_kept());
    }
}
