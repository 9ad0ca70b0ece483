//! State kept between runs: the bookmarks of each scene, recent files, the window's size, and its noise.

use crate::frame::{
    Bookmarks, Command, CurrentScene, DenoiseFilter, Denoising, LeftView, Navigation, Picture, Recovery, SavedAs,
    SceneBookmarks, Session, Settings, SettingsStore, ViewMode, scene_name,
};
use crate::scene::{Animation, Fingerprint, SceneSource, builtin_text, text_to_path};
use crate::viewer::openable::Recent;
use crate::viewer::panel::PanelState;
use crate::viewer::thumbnails::Thumbnails;
use std::path::PathBuf;

/// The settings store, and its content as far as it is known here.
pub struct Memory {
    store: SettingsStore,
    /// The scene of the bookmarks.
    scene: Option<SceneSource>,
    /// Number of scenes that the session had adopted when last checked.
    adopted: u64,
    /// As they are in the store.
    bookmarks: Bookmarks,
    /// The view that the scene opened with, and the one that is seen now.
    views: Option<[LeftView; 2]>,
    /// Whether it was opened since the last question.
    is_opened: bool,
    /// The view at which the scene was left last time, as it is in the store.
    left: Option<LeftView>,
    /// Contents of the last save of the open scene.
    saved: Option<Fingerprint>,
    /// Whether that view has been offered.
    has_offered: bool,
    recent: Vec<String>,
    thumbnails: Thumbnails,
    /// The scene has an image of this session in the list of recent ones.
    is_pictured: bool,
    /// As it is in the store.
    noise: (Denoising, DenoiseFilter),
}

impl Memory {
    pub fn of_platform() -> Self {
        Self::of(SettingsStore::of_platform())
    }

    fn of(store: SettingsStore) -> Self {
        let settings = store.settings().0;
        let (mut recent, noise) = (settings.recent, (settings.denoising, settings.denoiser));
        recent.retain(|name| builtin_text(name).is_some() || text_to_path(name).exists());
        let thumbnails = Thumbnails::beside(store.folder());
        Self {
            store,
            scene: None,
            adopted: 0,
            bookmarks: Bookmarks::default(),
            views: None,
            is_opened: false,
            left: None,
            saved: None,
            has_offered: true,
            recent,
            thumbnails,
            is_pictured: false,
            noise,
        }
    }

    /// Has the image displayed with the noise that it had last; returns why it cannot be denoised by what denoised it
    /// last. The choice stays in the store until another one is made.
    pub fn begin(&mut self, session: &mut Session) -> Option<String> {
        let trouble = self.noise.1.check().err();
        if trouble.is_some() {
            self.noise.1 = DenoiseFilter::Own;
        }
        let (denoising, denoiser) = self.noise;
        session.send(Command::SetDenoising(denoising));
        session.send(Command::SetDenoiseFilter(denoiser));
        // Until these commands are carried out, nothing has been chosen.
        let look = &mut session.world_mut().resource_mut::<ViewMode>().0;
        (look.denoising, look.filter) = self.noise;
        trouble.map(|reason| format!("{reason}. firstlight's own filter is used."))
    }

    /// Returns storage for unsaved edits in the same folder.
    pub fn recovery(&self) -> Recovery {
        Recovery::beside(self.store.folder())
    }

    /// Recently opened scenes, the latest first: built-in names and paths.
    pub fn recent(&self) -> Recent<'_> {
        Recent { names: &self.recent, thumbnails: &self.thumbnails }
    }

    /// Folder of the file that was opened last.
    pub fn last_folder(&self) -> Option<PathBuf> {
        let mut folders = self.recent.iter().filter_map(|name| Some(text_to_path(name).parent()?.to_path_buf()));
        folders.find(|folder| folder.is_absolute() && folder.is_dir())
    }

    /// Keeps an image of the open scene for the list of recent ones; it shows that scene.
    ///
    /// - `again`: also if there is one already.
    pub fn keep_thumbnail(&mut self, picture: &Picture, again: bool) {
        if self.is_pictured && !again {
            return;
        }
        let name = self.scene.as_ref().map(scene_name);
        // A scene without an entry has no image either.
        let Some(name) = name.filter(|name| self.recent.contains(name)) else { return };
        if builtin_text(&name).is_none() {
            self.thumbnails.keep(&name, picture);
        }
        self.is_pictured = true;
    }

    /// Stores what has changed, and loads the bookmarks of a scene that was opened; returns errors.
    pub fn follow(&mut self, session: &mut Session) -> Vec<String> {
        let mut troubles = Vec::new();
        let adopted = session.n_adopted();
        if adopted != self.adopted {
            self.adopted = adopted;
            let source = session.world().get_resource::<CurrentScene>().map(|current| current.0.source.clone());
            if let Some(source) = source.filter(|source| self.scene.as_ref() != Some(source)) {
                troubles.extend(self.leave());
                troubles.extend(self.open(source, session));
            }
            return troubles;
        }
        let view = seen(session);
        let content = session.world().resource::<SavedAs>().content;
        let is_saved = content.is_some() && content != self.saved;
        self.saved = content;
        if is_saved {
            // The file has the view now.
            (self.left, self.views) = (None, Some([view, view]));
        }
        if !is_on_tracks(session) {
            self.views = Some([self.views.map_or(view, |[first, _]| first), view]);
        }
        let look = session.world().resource::<ViewMode>().0;
        if (look.denoising, look.filter) != self.noise {
            self.noise = (look.denoising, look.filter);
            troubles.extend(self.keep_noise());
        }
        let bookmarks = *session.world().resource::<Bookmarks>();
        let saved = session.scene_file().map(SceneSource::Scene);
        let is_renamed = saved.is_some() && saved != self.scene;
        if is_renamed && let Some(saved) = saved {
            // A saved scene is known by its new file and takes its bookmarks along.
            troubles.extend(self.remember(&saved));
            (self.scene, self.is_pictured) = (Some(saved), false);
        }
        if let Some(source) = &self.scene
            && (bookmarks != self.bookmarks || is_renamed || is_saved)
        {
            troubles.extend(self.keep_views(source, &bookmarks));
            self.bookmarks = bookmarks;
        }
        troubles
    }

    fn keep_views(&self, source: &SceneSource, bookmarks: &Bookmarks) -> Option<String> {
        let views = (1..).zip(bookmarks.0).filter_map(|(slot, rig)| Some((slot, rig?))).collect();
        let kept = SceneBookmarks { views, left: self.left, ..SceneBookmarks::default() };
        self.store.keep_bookmarks(source, &kept).err().map(|error| format!("views of this scene are not kept: {error}"))
    }

    /// Keeps the view at which the scene is left, for the next time; called when the window closes, too.
    pub fn leave(&mut self) -> Option<String> {
        let ([first, last], source) = (self.views.take()?, self.scene.clone()?);
        // Who has not moved keeps what was left before.
        let left = if last == first { self.left } else { Some(last) };
        if std::mem::replace(&mut self.left, left) == left {
            return None;
        }
        self.keep_views(&source, &self.bookmarks)
    }

    /// Whether a scene was opened since the last call.
    pub fn take_opened(&mut self) -> bool {
        std::mem::take(&mut self.is_opened)
    }

    /// The view at which this scene was left last time, once after it was opened, if another one is seen now.
    pub fn take_left(&mut self, session: &Session) -> Option<Box<LeftView>> {
        if std::mem::replace(&mut self.has_offered, true) {
            return None;
        }
        self.left.filter(|left| *left != seen(session) && !is_on_tracks(session)).map(Box::new)
    }

    fn open(&mut self, source: SceneSource, session: &mut Session) -> Vec<String> {
        let (kept, trouble) = self.store.bookmarks(&source);
        let mut bookmarks = Bookmarks::default();
        for (slot, rig) in kept.views {
            bookmarks.set(slot, rig);
        }
        (self.bookmarks, self.left) = (bookmarks, kept.left);
        (self.views, self.has_offered, self.saved) = (None, false, None);
        // A command, so that a recording of the session contains them too.
        session.send(Command::SetBookmarks(Box::new(bookmarks)));
        *session.world_mut().resource_mut::<Bookmarks>() = bookmarks;
        let troubles = trouble.into_iter().chain(self.remember(&source)).collect();
        (self.scene, self.is_pictured, self.is_opened) = (Some(source), false, true);
        troubles
    }

    /// Puts the scene first among the recent ones.
    fn remember(&mut self, source: &SceneSource) -> Vec<String> {
        // Reads the file again: another window may have written to it.
        let (mut settings, unreadable) = self.store.settings();
        settings.remember(source);
        let unkept = self.store.keep_settings(&settings).err().map(String::from);
        self.recent = settings.recent;
        self.thumbnails.retain(&self.recent);
        unreadable.into_iter().chain(unkept).collect()
    }

    /// The last chosen keys and gestures.
    pub fn navigation(&self) -> Navigation {
        self.store.settings().0.navigation
    }

    /// Whether the user has never been asked for keys and gestures.
    pub fn is_new(&self) -> bool {
        let settings = self.store.settings().0;
        !settings.greeted && settings.navigation == Navigation::default()
    }

    /// Changes what is stored for the next window, if it is a change. Returns why it cannot be stored.
    fn keep(&self, change: impl FnOnce(&mut Settings)) -> Option<String> {
        let before = self.store.settings().0;
        let mut settings = before.clone();
        change(&mut settings);
        (settings != before).then(|| self.store.keep_settings(&settings).err().map(String::from)).flatten()
    }

    /// Stores keys and gestures for the next window; the user is not asked for them again.
    pub fn keep_navigation(&self, navigation: Navigation) -> Option<String> {
        self.keep(|settings| (settings.navigation, settings.greeted) = (navigation, true))
    }

    /// The panel as the last window left it.
    pub fn panel(&self) -> PanelState {
        let settings = self.store.settings().0;
        PanelState::remembered(settings.panel, &settings.sections)
    }

    /// Stores which parts of the panel are open.
    pub fn keep_panel(&self, panel: &PanelState) -> Option<String> {
        self.keep(|settings| {
            settings.panel = panel.shown;
            settings.sections.extend(panel.open.iter().map(|(title, open)| ((*title).to_owned(), *open)));
        })
    }

    /// Stores the noise of the image for the next window.
    fn keep_noise(&self) -> Option<String> {
        self.keep(|settings| (settings.denoising, settings.denoiser) = self.noise)
    }

    /// Stores the window's size for the next window, logical pixels.
    pub fn keep_window(&self, size: (u32, u32)) -> Option<String> {
        self.keep(|settings| settings.window = Some(size))
    }
}

/// Whether the camera is where the time of an animation says.
fn is_on_tracks(session: &Session) -> bool {
    session.world().get_resource::<Animation>().is_some_and(Animation::moves_camera)
}

/// What is on the screen.
fn seen(session: &Session) -> LeftView {
    let status = session.status();
    LeftView { rig: status.rig, display: status.display }
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
    fn the_view_at_which_a_scene_was_left_is_offered_once() {
        let folder = tempfile::tempdir().unwrap();
        let memory = || Memory::of(SettingsStore::in_folder(folder.path()));
        let begin = |memory: &mut Memory| {
            let mut session = Session::new(SessionOptions::default()).unwrap();
            opened(&mut session, "cornell");
            for _ in 0..2 {
                session.update(Duration::ZERO);
                assert_eq!(memory.follow(&mut session), Vec::<String>::new());
            }
            session
        };
        let mut first = memory();
        let mut session = begin(&mut first);
        assert_eq!(first.take_left(&session), None, "nobody has been here");
        session.send(Command::Orbit { yaw_deg: 10.0, pitch_deg: 3.0 });
        session.send(Command::SetBookmark { slot: 2 });
        session.update(Duration::ZERO);
        first.follow(&mut session);
        session.send(Command::SetExposure { stops: 1.5 });
        session.update(Duration::ZERO);
        first.follow(&mut session);
        let left = seen(&session);
        assert_eq!(left.display.exposure_stops, 1.5);
        assert_eq!(first.leave(), None);
        // Who opens it and leaves it as it was loses nothing either.
        for _ in 0..2 {
            let mut next = memory();
            let session = begin(&mut next);
            assert_eq!(next.take_left(&session).as_deref(), Some(&left));
            assert_eq!(next.take_left(&session), None);
            assert_eq!(next.leave(), None);
        }
        let kept = memory().store.bookmarks(&SceneSource::Builtin("cornell".to_owned())).0;
        assert_eq!((kept.left, kept.views.get(&2)), (Some(left), Some(&left.rig)));
        // The file of a saved scene has its view.
        let path = folder.path().join("room.ron");
        let mut next = memory();
        let mut session = begin(&mut next);
        session.send(Command::SaveScene { path: path.clone() });
        for _ in 0..2000 {
            session.update(Duration::ZERO);
            assert_eq!(next.follow(&mut session), Vec::<String>::new());
            if session.scene_file().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(next.leave(), None);
        let kept = memory().store.bookmarks(&SceneSource::Scene(path)).0;
        assert_eq!((kept.left, kept.views.get(&2)), (None, Some(&left.rig)));
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
        // Another scene has no bookmarks.
        opened(&mut session, "ball");
        follow(&mut session, &mut first);
        assert_eq!(*session.world().resource::<Bookmarks>(), Bookmarks::default());
        // Bookmarks survive opening another scene, and the next run.
        let mut session = Session::new(SessionOptions::default()).unwrap();
        let mut second = memory();
        assert_eq!(second.recent, ["ball", "cornell"]);
        opened(&mut session, "cornell");
        follow(&mut session, &mut second);
        assert_eq!(*session.world().resource::<Bookmarks>(), kept);
        assert_eq!(second.recent, ["cornell", "ball"]);
        assert_eq!(second.last_folder(), None);
        // A saved scene takes its bookmarks along, and is among the recent ones.
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
        assert!(second.recent[0].ends_with("room.ron") && second.recent.len() == 3, "{:?}", second.recent);
        assert_eq!(second.last_folder().as_deref(), Some(folder.path()));
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
        // What is gone is not offered.
        std::fs::remove_file(folder.path().join("room.ron")).unwrap();
        assert_eq!(memory().recent, ["cornell", "ball"]);
    }

    /// As on a full disk: a bookmark is not said to be saved.
    #[test]
    fn a_bookmark_that_cannot_be_kept_is_told() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("bookmarks"), "in the way").unwrap();
        let mut memory = Memory::of(SettingsStore::in_folder(folder.path()));
        let mut session = Session::new(SessionOptions::default()).unwrap();
        opened(&mut session, "cornell");
        session.update(Duration::ZERO);
        memory.follow(&mut session);
        session.send(Command::SetBookmark { slot: 3 });
        session.update(Duration::ZERO);
        let told = memory.follow(&mut session);
        assert!(told.len() == 1 && told[0].starts_with("views of this scene are not kept: "), "{told:?}");
        let said = &session.status().messages;
        assert!(said.iter().any(|message| message.text == "bookmark 3 is this view"), "{said:?}");
    }

    #[test]
    fn a_window_begins_denoised_and_then_with_what_was_chosen_last() {
        let folder = tempfile::tempdir().unwrap();
        let memory = || Memory::of(SettingsStore::in_folder(folder.path()));
        for (expected, chosen) in [
            (Denoising::Denoised, Denoising::Split),
            (Denoising::Split, Denoising::Raw),
            (Denoising::Raw, Denoising::Raw),
        ] {
            let (mut session, mut memory) = (Session::new(SessionOptions::default()).unwrap(), memory());
            assert_eq!(memory.begin(&mut session), None);
            for _ in 0..2 {
                assert_eq!(session.world().resource::<ViewMode>().0.denoising, expected);
                session.update(Duration::ZERO);
                assert_eq!(memory.follow(&mut session), Vec::<String>::new());
            }
            session.send(Command::SetDenoising(chosen));
            session.update(Duration::ZERO);
            assert_eq!(memory.follow(&mut session), Vec::<String>::new());
        }
        assert_eq!(memory().store.settings().0.denoising, Denoising::Raw);
        assert_eq!(memory().store.settings().0.denoiser, DenoiseFilter::Own);
    }
}
