//! The picture that others are measured against: a given file, or a long render of our own with another seed.
//!
//! Own renders are kept in a folder, by scene, size and settings, so that the next report starts at once. A file is
//! used again if it has at least the samples that are asked for.

use super::LinearPicture;
use crate::frame::write_film;
use crate::render::{Display, Film, Prepared, RenderSettings, advance};
use crate::scene::whole_file::write_whole;
use crate::scene::{FileKind, Fingerprint, InputFile};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A picture taken for the truth.
#[derive(Clone, Debug)]
pub struct Reference {
    pub picture: LinearPicture,
    /// Of an own render.
    pub made: Option<Made>,
    /// Where it lies, if it lies anywhere.
    pub path: Option<PathBuf>,
}

/// How an own render was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Made {
    pub spp: u32,
    /// Root of its own relMSE, as it estimated it.
    pub relative_error: Option<f64>,
}

/// Own renders on disk.
#[derive(Clone, Debug)]
pub struct ReferenceStore {
    folder: Option<PathBuf>,
}

/// What a kept render is a picture of.
#[derive(Clone, Debug)]
pub struct Key {
    name: String,
    size: (u32, u32),
}

impl Key {
    /// - `title`: of the scene, so that a person finds the file.
    /// - `settings`: without their seed and techniques, which do not change what is true.
    pub fn new(title: &str, scene: Fingerprint, settings: &RenderSettings, size: (u32, u32)) -> Self {
        let stem = Path::new(title).file_stem().map_or(title.into(), |stem| stem.to_string_lossy());
        let plain: String =
            stem.chars().take(40).map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        // Another version may have mended what was wrong.
        let settings = RenderSettings { seed: 0, techniques: Default::default(), ..*settings };
        let rest = format!("{settings:?} {}", env!("CARGO_PKG_VERSION"));
        let hash = Fingerprint::default().with(scene.0.to_le_bytes()).with(rest.bytes());
        Self { name: format!("{plain}-{}x{}-{hash}", size.0, size.1), size }
    }
}

impl ReferenceStore {
    /// In the cache folder of the platform; keeps nothing where there is none.
    pub fn of_platform() -> Self {
        let folders = directories::ProjectDirs::from("", "", "firstlight");
        Self { folder: folders.map(|folders| folders.cache_dir().join("references")) }
    }

    pub fn in_folder(folder: &Path) -> Self {
        Self { folder: Some(folder.to_path_buf()) }
    }

    /// A render with at least `min_spp` samples a pixel, if one was kept and can be read.
    pub fn find(&self, key: &Key, min_spp: u32) -> Option<Reference> {
        let path = self.folder.as_ref()?.join(format!("{}.exr", key.name));
        let note = InputFile::open(&path.with_extension("json"), FileKind::Settings).ok()?.bytes().ok()?;
        let made: Made = serde_json::from_slice(&note).ok()?;
        let picture = LinearPicture::read_exr(&path).ok()?;
        let fits = made.spp >= min_spp && (picture.width, picture.height) == key.size;
        fits.then_some(Reference { picture, made: Some(made), path: Some(path) })
    }

    /// Renders with `spp` samples a pixel and keeps the picture; `progress` is told the share that is done.
    ///
    /// The second part of the answer says why the picture could not be kept, if so. When `stop` says so, the samples so
    /// far are the answer, and not kept; `None` before the first.
    pub fn make(
        &self,
        key: &Key,
        prepared: &Prepared,
        settings: &RenderSettings,
        spp: u32,
        progress: &mut dyn FnMut(f64),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<(Reference, Option<String>)> {
        // Any seed but the one that is measured: a picture agrees too well with itself.
        let settings = RenderSettings { seed: !settings.seed, techniques: Default::default(), ..*settings };
        let mut film = Film::new(key.size.0, key.size.1);
        let mut slice = 4;
        while film.spp() < spp {
            let (start, goal) = (Instant::now(), film.spp().saturating_add(slice).min(spp));
            advance(prepared, &settings, &mut film, goal, stop);
            if stop() && film.spp() < goal {
                break;
            }
            progress(f64::from(film.spp()) / f64::from(spp));
            slice = (f64::from(slice) * 0.25 / start.elapsed().as_secs_f64().max(1e-6)).clamp(4.0, 1024.0) as u32;
        }
        if film.spp() == 0 {
            return None;
        }
        let made = Made { spp: film.spp(), relative_error: film.error_estimate().map(|estimate| estimate.relative) };
        let (path, trouble) = match if film.spp() < spp { Ok(None) } else { self.keep(key, &film, &made) } {
            Ok(path) => (path, None),
            Err(reason) => (None, Some(format!("the reference could not be cached: {reason}"))),
        };
        Some((Reference { picture: LinearPicture::of(&film), made: Some(made), path }, trouble))
    }

    fn keep(&self, key: &Key, film: &Film, made: &Made) -> Result<Option<PathBuf>, String> {
        let Some(folder) = &self.folder else { return Ok(None) };
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let path = folder.join(format!("{}.exr", key.name));
        let note = path.with_extension("json");
        // The note comes last and goes first: a picture without one counts as none.
        if note.exists() {
            std::fs::remove_file(&note).map_err(|error| format!("{}: {error}", note.display()))?;
        }
        write_film(film, &Display::default(), &path)?;
        let text = serde_json::to_vec(made).map_err(|error| error.to_string())?;
        write_whole(&note, &text)?;
        Ok(Some(path))
    }
}

impl Reference {
    /// A picture that somebody else made.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read(path: &Path) -> Result<Self, String> {
        Ok(Self { picture: LinearPicture::read_exr(path)?, made: None, path: Some(path.to_path_buf()) })
    }

    /// relMSE of the reference itself, if it is known.
    pub fn relative_mse(&self) -> Option<f64> {
        self.made.and_then(|made| made.relative_error).map(|error| error * error)
    }
}
