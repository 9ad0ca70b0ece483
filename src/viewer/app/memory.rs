//! What is kept from one run to the next: the bookmarks of each scene, what was opened lately, the window's size.

use crate::frame::{Bookmarks, Command, CurrentScene, Navigation, Recovery, SceneBookmarks, Session, SettingsStore};
use crate::scene::SceneSource;

/// What the store has, as far as it is known here.
pub struct Memory {
    store: SettingsStore,
    /// Of what the bookmarks are.
    scene: Option<SceneSource>,
    /// How many scenes had taken their place.
    adopted: u64,
    /// As they lie in the store.
    bookmarks: Bookmarks,
    recent: Vec<String>,
}

impl Memory {
    pub fn of_platform() -> Self {
        Self::of(SettingsStore::of_platform())
    }

    fn of(store: SettingsStore) -> Self {
        let recent = store.settings().0.recent;
        Self { store, scene: None, adopted: 0, bookmarks: Bookmarks::default(), recent }
    }

    /// Keeps unsaved edits in the same place.
    pub fn recovery(&self) -> Recovery {
        Recovery::beside(self.store.folder())
    }

    /// What was opened last comes first: built-in names and paths.
    pub fn recent(&self) -> &[String] {
        &self.recent
    }

    /// Keeps what has changed, and brings what a scene that was opened had; tells what went wrong.
    pub fn follow(&mut self, session: &mut Session) -> Vec<String> {
        let mut troubles = Vec::new();
        let adopted = session.n_adopted();
        if adopted != self.adopted {
            self.adopted = adopted;
            let source = session.world().get_resource::<CurrentScene>().map(|current| current.0.source.clone());
            if let Some(source) = source.filter(|source| self.scene.as_ref() != Some(source)) {
                troubles.extend(self.open(source, session));
            }
            return troubles;
        }
        let bookmarks = *session.world().resource::<Bookmarks>();
        let saved = session.scene_file().map(SceneSource::Scene);
        let is_renamed = saved.is_some() && saved != self.scene;
        if is_renamed && let Some(saved) = saved {
            // From the saving on it is known by that file, and takes its views along.
            troubles.extend(self.remember(&saved));
            self.scene = Some(saved);
        }
        if let Some(source) = &self.scene
            && (bookmarks != self.bookmarks || is_renamed)
        {
            let views = (1..).zip(bookmarks.0).filter_map(|(slot, rig)| Some((slot, rig?))).collect();
            let kept = SceneBookmarks { views, ..SceneBookmarks::default() };
            troubles.extend(self.store.keep_bookmarks(source, &kept).err().map(String::from));
            self.bookmarks = bookmarks;
        }
        troubles
    }

    fn open(&mut self, source: SceneSource, session: &mut Session) -> Vec<String> {
        let (kept, trouble) = self.store.bookmarks(&source);
        let mut bookmarks = Bookmarks::default();
        for (slot, rig) in kept.views {
            bookmarks.set(slot, rig);
        }
        self.bookmarks = bookmarks;
        // A command, so that a recording of the session knows them too.
        session.send(Command::SetBookmarks(Box::new(bookmarks)));
        *session.world_mut().resource_mut::<Bookmarks>() = bookmarks;
        let troubles = trouble.into_iter().chain(self.remember(&source)).collect();
        self.scene = Some(source);
        troubles
    }

    /// Puts it first among what was opened lately.
    fn remember(&mut self, source: &SceneSource) -> Vec<String> {
        // The file anew: another window may have written to it.
        let (mut settings, unreadable) = self.store.settings();
        settings.remember(source);
        let unkept = self.store.keep_settings(&settings).err().map(String::from);
        self.recent = settings.recent;
        unreadable.into_iter().chain(unkept).collect()
    }

    /// Keys and gestures, as they were chosen last.
    pub fn navigation(&self) -> Navigation {
        self.store.settings().0.navigation
    }

    /// For the next window.
    pub fn keep_navigation(&self, navigation: Navigation) -> Option<String> {
        let mut settings = self.store.settings().0;
        settings.navigation = navigation;
        self.store.keep_settings(&settings).err().map(String::from)
    }

    /// For the next window, logical pixels.
    pub fn keep_window(&self, size: (u32, u32)) -> Option<String> {
        let mut settings = self.store.settings().0;
        settings.window = Some(size);
        self.store.keep_settings(&settings).err().map(String::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::SessionOptions;
    use crate::scene::{LoadOptions, load};
    use std::time::Duration;

    fn opened(session: &mut Session, name: &str) {
        let scene = load(&SceneSource::Builtin(name.to_owned()), &LoadOptions::default()).unwrap();
        session.adopt(scene);
    }

    #[test]
    fn bookmarks_come_back_with_their_scene_and_with_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let memory = || Memory::of(SettingsStore::in_folder(folder.path()));
        let mut session = Session::new(SessionOptions::default()).unwrap();
        let mut first = memory();
        let follow = |session: &mut Session, memory: &mut Memory| {
            session.update(Duration::ZERO);
            assert_eq!(memory.follow(session), Vec::<String>::new());
            session.update(Duration::ZERO);
        };
        opened(&mut session, "cornell");
        follow(&mut session, &mut first);
        session.send(Command::Orbit { yaw_deg: 10.0, pitch_deg: 3.0 });
        session.send(Command::SetBookmark { slot: 3 });
        follow(&mut session, &mut first);
        let kept = *session.world().resource::<Bookmarks>();
        assert!(kept.get(3).is_some());
        // Another scene has none of them.
        opened(&mut session, "ball");
        follow(&mut session, &mut first);
        assert_eq!(*session.world().resource::<Bookmarks>(), Bookmarks::default());
        // Neither is anything lost by looking at the other one, nor by the next run.
        let mut session = Session::new(SessionOptions::default()).unwrap();
        let mut second = memory();
        assert_eq!(second.recent(), ["ball", "cornell"]);
        opened(&mut session, "cornell");
        follow(&mut session, &mut second);
        assert_eq!(*session.world().resource::<Bookmarks>(), kept);
        assert_eq!(second.recent(), ["cornell", "ball"]);
        // A scene that is saved takes its views along, and is among what was opened lately.
        let path = folder.path().join("room.ron");
        session.send(Command::SaveScene { path: path.clone() });
        for _ in 0..2000 {
            follow(&mut session, &mut second);
            if session.scene_file().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        follow(&mut session, &mut second);
        assert!(second.recent()[0].ends_with("room.ron") && second.recent().len() == 3, "{:?}", second.recent());
        let mut session = Session::new(SessionOptions::default()).unwrap();
        let mut third = memory();
        session.adopt(load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap());
        follow(&mut session, &mut third);
        assert_eq!(*session.world().resource::<Bookmarks>(), kept);
        assert_eq!(second.navigation(), Navigation::Firstlight);
        assert_eq!(second.keep_navigation(Navigation::Maya), None);
        assert_eq!((second.keep_window((700, 500)), second.navigation()), (None, Navigation::Maya));
        assert_eq!(second.store.settings().0.window, Some((700, 500)));
        assert_eq!(second.store.settings().0.recent[1..], ["cornell", "ball"]);
    }
}
