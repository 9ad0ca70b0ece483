//! References for error measurements: a given file, or an own long render with another seed.
//!
//! Own renders are stored in a folder, by scene, size and settings, so that the next report starts at once. A stored
//! file is reused if it has at least the required samples.

use crate::files::whole_file::write_whole;
use crate::frame::write_film;
use crate::render::{Display, Film, Prepared, RenderSettings, SampleAllocation, advance};
use crate::report::LinearPicture;
use crate::scene::{FileKind, Fingerprint, InputFile};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// An image that serves as ground truth.
#[derive(Clone, Debug)]
pub struct ReferenceImage {
    pub picture: LinearPicture,
    /// How an own render was made; `None` for a given file.
    pub made: Option<Made>,
    /// Path of the file, if there is one.
    pub path: Option<PathBuf>,
}

/// How an own render was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Made {
    pub spp: u32,
    /// Root of its own relMSE, as estimated by the renderer.
    pub relative_error: Option<f64>,
}

/// Store of own renders on disk.
#[derive(Clone, Debug)]
pub struct ReferenceStore {
    folder: Option<PathBuf>,
}

/// Identity of a stored render.
#[derive(Clone, Debug)]
pub struct ReferenceKey {
    name: String,
    size: (u32, u32),
}

impl ReferenceKey {
    /// Computes the key.
    ///
    /// - `title`: of the scene, for readable file names.
    /// - `settings`: seed and techniques are ignored, because they do not change the expected image.
    pub fn new(title: &str, scene: Fingerprint, settings: &RenderSettings, size: (u32, u32)) -> Self {
        let stem = Path::new(title).file_stem().map_or(title.into(), |stem| stem.to_string_lossy());
        let plain: String =
            stem.chars().take(40).map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        // Includes the version, because another one may have fixed errors.
        let allocation = SampleAllocation::Uniform;
        let settings = RenderSettings { seed: 0, techniques: Default::default(), allocation, ..*settings };
        let rest = format!("{settings:?} {}", env!("CARGO_PKG_VERSION"));
        let hash = scene.with(rest.as_bytes());
        Self { name: format!("{plain}-{}x{}-{hash}", size.0, size.1), size }
    }
}

impl ReferenceStore {
    /// Store in the cache folder of the platform; stores nothing if there is none.
    pub fn of_platform() -> Self {
        let folders = directories::ProjectDirs::from("", "", "firstlight");
        Self { folder: folders.map(|folders| folders.cache_dir().join("references")) }
    }

    pub fn in_folder(folder: &Path) -> Self {
        Self { folder: Some(folder.to_path_buf()) }
    }

    /// Returns a render with at least `min_spp` samples per pixel, if a readable one is stored.
    pub fn find(&self, key: &ReferenceKey, min_spp: u32) -> Option<ReferenceImage> {
        let path = self.folder.as_ref()?.join(format!("{}.exr", key.name));
        let note = InputFile::open(&path.with_extension("json"), FileKind::Settings).ok()?.bytes().ok()?;
        let made: Made = serde_json::from_slice(&note).ok()?;
        let picture = LinearPicture::read_exr(&path).ok()?;
        let fits = made.spp >= min_spp && (picture.width, picture.height) == key.size;
        fits.then_some(ReferenceImage { picture, made: Some(made), path: Some(path) })
    }

    /// Renders with `spp` samples per pixel and stores the image; `progress` receives the completed fraction.
    ///
    /// The second part of the result is the reason why the image could not be stored, if so. If `stop` returns true,
    /// the samples so far are returned, and not stored; `None` before the first sample.
    pub fn make(
        &self,
        key: &ReferenceKey,
        prepared: &Prepared,
        settings: &RenderSettings,
        spp: u32,
        progress: &mut dyn FnMut(f64),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<(ReferenceImage, Option<String>)> {
        // Any seed other than the measured one: an image agrees too well with itself.
        let allocation = SampleAllocation::Uniform;
        let settings = RenderSettings { seed: !settings.seed, techniques: Default::default(), allocation, ..*settings };
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
        Some((ReferenceImage { picture: LinearPicture::of(&film), made: Some(made), path }, trouble))
    }

    fn keep(&self, key: &ReferenceKey, film: &Film, made: &Made) -> Result<Option<PathBuf>, String> {
        let Some(folder) = &self.folder else { return Ok(None) };
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let path = folder.join(format!("{}.exr", key.name));
        let note = path.with_extension("json");
        // The note is written last and removed first: an image without one is ignored.
        if note.exists() {
            std::fs::remove_file(&note).map_err(|error| format!("{}: {error}", note.display()))?;
        }
        write_film(film, &Display::default(), &path)?;
        let text = serde_json::to_vec(made).map_err(|error| error.to_string())?;
        write_whole(&note, &text)?;
        Ok(Some(path))
    }
}

impl ReferenceImage {
    /// Reads a reference made by another program.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(path: &Path) -> Result<Self, String> {
        Ok(Self { picture: LinearPicture::read_exr(path)?, made: None, path: Some(path.to_path_buf()) })
    }

    /// relMSE of the reference itself, if known.
    pub fn relative_mse(&self) -> Option<f64> {
        self.made.and_then(|made| made.relative_error).map(|error| error * error)
    }
}
