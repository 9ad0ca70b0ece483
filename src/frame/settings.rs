//! Persistent settings, and the bookmarks of each scene: small RON files in the platform's folder for settings. A file
//! that cannot be read is renamed and reported, and never stops the program.

use crate::files::whole_file::write_whole;
use crate::format::bounds::check_stops;
use crate::frame::core::denoising::{DenoiseFilter, Denoising};
use crate::frame::core::rig::Rig;
use crate::render::Display;
use crate::scene::{
    BadValue, FileKind, Fingerprint, InputFile, ReadError, SceneSource, WriteError, absolute, check_film_size,
    path_to_text, unpacked_folder,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Settings that do not belong to a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Size of the window in logical pixels.
    pub window: Option<(u32, u32)>,
    /// Exposure and tone curve for scenes without their own, such as models.
    pub display: Option<Display>,
    /// Recently opened scenes, the latest first: built-in names and absolute paths.
    pub recent: Vec<String>,
    /// Key bindings and gestures.
    pub navigation: Navigation,
    /// Whether the user has been asked for them.
    pub greeted: bool,
    /// The noise of the image in the window.
    pub denoising: Denoising,
    /// What denoises it.
    pub denoiser: DenoiseFilter,
    /// Whether the panel is shown.
    pub panel: bool,
    /// Which of its sections are open, by their titles; others are as in a new window.
    pub sections: BTreeMap<String, bool>,
}

impl Default for Settings {
    /// A window begins with the denoised image.
    fn default() -> Self {
        Self {
            window: None,
            display: None,
            recent: Vec::new(),
            navigation: Navigation::default(),
            greeted: false,
            denoising: Denoising::Denoised,
            denoiser: DenoiseFilter::default(),
            panel: false,
            sections: BTreeMap::new(),
        }
    }
}

/// Preset of key bindings and gestures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Navigation {
    /// firstlight's own.
    #[default]
    Firstlight,
    /// Like Blender.
    Blender,
    /// Like Maya.
    Maya,
}

impl Navigation {
    /// All presets, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Firstlight, Self::Blender, Self::Maya];

    /// Name for the user.
    pub fn label(self) -> &'static str {
        match self {
            Self::Firstlight => "firstlight",
            Self::Blender => "Blender",
            Self::Maya => "Maya",
        }
    }
}

impl Settings {
    /// Maximum number of recent scenes.
    pub const MAX_RECENT: usize = 16;

    /// Puts a scene first in the list of recent ones.
    pub fn remember(&mut self, source: &SceneSource) {
        // What was unpacked may be gone when it is chosen.
        if source.path().is_some_and(|path| unpacked_folder(path).is_some()) {
            return;
        }
        let name = scene_name(source);
        self.recent.retain(|other| *other != name);
        self.recent.insert(0, name);
        self.recent.truncate(Self::MAX_RECENT);
    }
}

/// The bookmarks of one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SceneBookmarks {
    /// Built-in name or absolute path, for information.
    pub scene: String,
    /// Views by number, 1 to 9.
    pub views: BTreeMap<u8, Rig>,
    /// The view at which the window was left, if it is not the one that the scene opens with.
    pub left: Option<LeftView>,
}

/// The view at which a window was left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftView {
    /// The camera.
    pub rig: Rig,
    /// Exposure and tone curve.
    pub display: Display,
}

/// Data of files that users may have edited.
trait KeptSettings {
    fn check(&self) -> Result<(), BadValue>;
}

impl KeptSettings for Settings {
    fn check(&self) -> Result<(), BadValue> {
        self.window.map_or(Ok(()), |(width, height)| check_film_size(width, height))?;
        self.display.map_or(Ok(()), |display| check_stops(display.exposure_stops))
    }
}

impl KeptSettings for SceneBookmarks {
    fn check(&self) -> Result<(), BadValue> {
        self.views.values().try_for_each(Rig::check)?;
        self.left.map_or(Ok(()), |LeftView { rig, display }| rig.check().and(check_stops(display.exposure_stops)))
    }
}

/// Reads and writes settings and bookmarks.
#[derive(Clone, Debug)]
pub struct SettingsStore {
    folder: Option<PathBuf>,
}

impl SettingsStore {
    /// Uses the platform's folder for settings; stores nothing if there is none.
    #[cfg(feature = "cli")]
    pub fn of_platform() -> Self {
        let folders = directories::ProjectDirs::from("", "", "firstlight");
        Self { folder: folders.map(|folders| folders.config_dir().to_path_buf()) }
    }

    /// Uses a folder of the caller's choice.
    pub fn in_folder(folder: &Path) -> Self {
        Self { folder: Some(folder.to_path_buf()) }
    }

    /// The folder, if there is one.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Returns the settings, defaults if there are none, and the reason if a file could not be read.
    pub fn settings(&self) -> (Settings, Option<String>) {
        self.read("settings.ron")
    }

    /// Writes the settings.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn keep_settings(&self, settings: &Settings) -> Result<(), WriteError> {
        self.write("settings.ron", settings)
    }

    /// Returns the bookmarks of a scene, empty if there are none, and the reason if a file could not be read.
    pub fn bookmarks(&self, source: &SceneSource) -> (SceneBookmarks, Option<String>) {
        let (bookmarks, trouble): (SceneBookmarks, _) = self.read(&bookmark_file(source));
        (SceneBookmarks { scene: scene_name(source), ..bookmarks }, trouble)
    }

    /// Writes the bookmarks of a scene.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn keep_bookmarks(&self, source: &SceneSource, bookmarks: &SceneBookmarks) -> Result<(), WriteError> {
        let bookmarks = SceneBookmarks { scene: scene_name(source), ..bookmarks.clone() };
        self.write(&bookmark_file(source), &bookmarks)
    }

    fn read<T: DeserializeOwned + Default + KeptSettings>(&self, name: &str) -> (T, Option<String>) {
        let Some(path) = self.folder.as_ref().map(|folder| folder.join(name)) else { return (T::default(), None) };
        let text = match InputFile::open(&path, FileKind::Settings).and_then(InputFile::text) {
            Ok(text) => Ok(text),
            Err(ReadError::Io(error)) if error.kind() == std::io::ErrorKind::NotFound => return (T::default(), None),
            // Such as text that is not UTF-8; what could not be read now may be readable later.
            Err(error @ (ReadError::NotText { .. } | ReadError::TooLong { .. })) => Err(format!(" {error}")),
            Err(error) => return (T::default(), Some(format!("{}: {error}", path.display()))),
        };
        let understood = text.and_then(|text| options().from_str::<T>(&text).map_err(|error| error.to_string()));
        match understood.and_then(|value| value.check().map(|()| value).map_err(|bad| format!(" {bad}"))) {
            Ok(value) => (value, None),
            Err(error) => {
                // Renamed, so that its contents are not lost when new settings are written.
                let aside = free_aside(&path);
                let kept = match std::fs::rename(&path, &aside) {
                    Ok(()) => format!("the file was renamed to {}", aside.display()),
                    Err(_) => "the file was left in place".to_owned(),
                };
                (T::default(), Some(format!("{}:{error}; using defaults, {kept}", path.display())))
            }
        }
    }

    fn write(&self, name: &str, value: &impl Serialize) -> Result<(), WriteError> {
        let Some(path) = self.folder.as_ref().map(|folder| folder.join(name)) else { return Ok(()) };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)
                .map_err(|source| WriteError::NoFolder { folder: folder.to_path_buf(), source })?;
        }
        let pretty = ron::ser::PrettyConfig::new()
            .indentor("    ")
            .depth_limit(4)
            .extensions(ron::extensions::Extensions::IMPLICIT_SOME);
        // Serialising plain data cannot fail.
        let text = options().to_string_pretty(value, pretty).expect("settings are plain data") + "\n";
        write_whole(&path, text.as_bytes())
    }
}

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}

/// Name of a scene that does not depend on the working directory: the built-in one, or an absolute path.
pub fn scene_name(source: &SceneSource) -> String {
    match source {
        SceneSource::Builtin(name) => name.clone(),
        SceneSource::Scene(path)
        | SceneSource::Foreign(path)
        | SceneSource::Model(path)
        | SceneSource::Picture(path) => path_to_text(&absolute(path)),
    }
}

/// File name of a scene's bookmarks; scenes of the same name in different folders have different files.
fn bookmark_file(source: &SceneSource) -> String {
    let name = scene_name(source);
    let stem = Path::new(&name).file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let plain: String =
        stem.chars().take(40).map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
    format!("bookmarks/{plain}-{}.ron", Fingerprint::of(name.as_bytes()))
}

/// A name beside a file that cannot be understood, free unless there are many.
fn free_aside(path: &Path) -> PathBuf {
    const MOST: u32 = 100;
    let numbered = (2..MOST).map(|i| path.with_extension(format!("broken-{i}")));
    let mut names = std::iter::once(path.with_extension("broken")).chain(numbered);
    names.find(|name| !name.exists()).unwrap_or_else(|| path.with_extension("broken"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Lens, Projection, View};

    #[test]
    fn what_is_kept_comes_back_and_what_is_broken_is_set_aside() {
        let folder = tempfile::tempdir().unwrap();
        let store = SettingsStore::in_folder(&folder.path().join("new/firstlight"));
        assert_eq!(store.settings(), (Settings::default(), None));
        let mut settings = Settings { window: Some((800, 600)), ..Settings::default() };
        settings.display = Some(Display { exposure_stops: -0.1, ..Display::default() });
        for i in 0..20 {
            settings.remember(&SceneSource::Builtin(format!("scene {i}")));
        }
        settings.remember(&SceneSource::Builtin("scene 10".to_owned()));
        assert_eq!((settings.recent.len(), settings.recent[0].as_str()), (Settings::MAX_RECENT, "scene 10"));
        store.keep_settings(&settings).unwrap();
        assert_eq!(store.settings(), (settings, None));

        let path = folder.path().join("new/firstlight/settings.ron");
        std::fs::write(&path, "(window: (800, ").unwrap();
        let (settings, trouble) = store.settings();
        assert_eq!(settings, Settings::default());
        let trouble = trouble.unwrap();
        assert!(trouble.contains("settings.ron:1:") && trouble.contains("settings.broken"), "{trouble}");
        assert_eq!(std::fs::read_to_string(path.with_extension("broken")).unwrap(), "(window: (800, ");
        assert_eq!(store.settings(), (Settings::default(), None));
        for damaged in [b"(window: \xff\xfe)".to_vec(), vec![b' '; (1 << 20) + 1]] {
            std::fs::write(&path, &damaged).unwrap();
            let trouble = store.settings().1.unwrap();
            assert!(trouble.contains("renamed to"), "{trouble}");
            let (_, aside) = trouble.rsplit_once("renamed to ").unwrap();
            assert!(std::fs::read(aside).unwrap() == damaged);
            let first = std::fs::read_to_string(path.with_extension("broken")).unwrap();
            assert_eq!(first, "(window: (800, ", "what was renamed before stays");
        }
        // Unknown fields of a newer version do not invalidate the rest.
        std::fs::write(&path, "(window: (3, 4), theme: \"dark\")").unwrap();
        assert_eq!(store.settings().0.window, Some((3, 4)));
    }

    #[test]
    fn every_scene_has_bookmarks_of_its_own_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let store = SettingsStore::in_folder(folder.path());
        let [a, b] = ["a/room.ron", "b/room.ron"].map(|path| SceneSource::Scene(folder.path().join(path)));
        let lens = Lens { focus_distance: f64::INFINITY, ..Lens::thin(1.0 / 3.0, 0.1) };
        let bookmark = Rig { view: View::default(), projection: Projection::perspective(33.3), lens };
        let mut bookmarks = store.bookmarks(&a).0;
        bookmarks.views.insert(3, bookmark);
        store.keep_bookmarks(&a, &bookmarks).unwrap();
        assert_eq!(store.bookmarks(&a), (bookmarks, None));
        assert_eq!(store.bookmarks(&b).0.views.len(), 0);
    }
}
