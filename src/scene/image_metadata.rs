//! The metadata in an image with which it can be opened again: scene, camera, display settings and samples.
//!
//! It is RON text: in a PNG in the text chunk [`NOTE_KEY`] (iTXt), in an EXR in the attribute of that name. Paths are
//! relative to the image. It also holds a fingerprint of the scene, so that later changes of the scene are noticed; a
//! scene with unsaved changes is stored in the metadata as a whole.

use crate::files::archive_cache::unpacked_folder;
use crate::files::input_file::{FileKind, InputFile, ReadError};
use crate::files::limits::Limits;
use crate::files::relative::{absolute, relative_path, text_to_path};
use crate::files::write_error::WriteError;
use crate::format::bounds::{check_film_size, check_max_depth, check_stops};
use crate::format::camera::CameraPart;
use crate::format::camera::camera;
use crate::format::choice::UpAxis;
use crate::format::parts::FilmPart;
use crate::format::scene_file::SceneFile;
use crate::render::{Display, Film, Integrator, SampleAllocation};
use crate::scene::animation::edited::show_camera;
use crate::scene::source::SceneSource;
use exr::meta::attribute::{AttributeValue, Text};
use ron::extensions::Extensions;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::io::{BufReader, Read, Seek};
use std::path::{Path, PathBuf};

/// Name of the metadata in an image: of the text chunk in a PNG, of the attribute in an EXR.
pub const NOTE_KEY: &str = "firstlight";

pub use crate::files::whole_file::FILM_KEY;

/// Format version; increased by incompatible changes.
pub(super) const FORMAT: u32 = 1;

/// Why the metadata of an image cannot be used, or its scene not be found; the text follows the path of the image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MetadataError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The part before the pixels of the PNG or EXR is truncated, damaged or too long.
    #[error("cannot be read: {0}")]
    Damaged(#[source] Box<dyn Error + Send + Sync>),
    /// The file is in neither format.
    #[error("is neither a PNG nor an OpenEXR image")]
    Format,
    /// The image was not made by this program, or has lost its metadata.
    #[error("it has no embedded firstlight scene: only images rendered by firstlight can be opened")]
    Missing,
    /// The metadata has invalid syntax.
    #[error("its firstlight metadata cannot be parsed: {0}")]
    Syntax(#[source] Box<dyn Error + Send + Sync>),
    /// The metadata has a newer format version.
    #[error("it was made by {program}, whose metadata format is not supported by this version")]
    Newer {
        /// Name and version of the program that wrote it.
        program: String,
    },
    /// The metadata holds values out of range.
    #[error("its firstlight metadata is invalid: {0}")]
    Invalid(String),
    /// The scene file is neither at its path nor in the folder of the image.
    #[error("its scene {} was not found: put it next to the image", .0.display())]
    NoScene(PathBuf),
    /// The scene was unpacked from an archive, and has been deleted since.
    #[error("its scene {} was in an archive, whose unpacked files are gone: open the archive again", .0.display())]
    NoArchive(PathBuf),
}

impl From<MetadataError> for WriteError {
    fn from(error: MetadataError) -> Self {
        Self::Metadata(Box::new(error))
    }
}

impl From<MetadataError> for String {
    fn from(error: MetadataError) -> Self {
        error.to_string()
    }
}

/// The metadata of an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageMetadata {
    /// Format version of the metadata.
    pub format: u32,
    /// Name and version of the program.
    pub program: String,
    /// The scene of the image.
    pub scene: ImageScene,
    /// Fingerprint of the contents of the scene, as of `SceneContent`.
    pub fingerprint: String,
    /// View, projection and lens.
    pub camera: CameraPart,
    /// Size and pixel filter.
    pub film: FilmPart,
    /// The integrator.
    pub integrator: Integrator,
    /// Maximum length of paths in segments; `None`: unlimited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<u32>,
    /// Exposure and tone curve.
    pub display: Display,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Index of the first sample of each pixel.
    pub first_sample: u32,
    /// Samples per pixel, or the mean over all pixels.
    pub spp: u32,
    /// How samples are distributed over the pixels.
    #[serde(default, skip_serializing_if = "is_uniform")]
    pub allocation: SampleAllocation,
    /// Some pixels have more samples: the image was stopped in the middle of a pass and cannot be reproduced exactly.
    #[serde(default)]
    pub uneven: bool,
    /// Name of the denoiser, if the pixels are denoised.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub denoised: Option<String>,
    /// Name of the denoiser of the layer `denoised`, if the image has one beside its raw pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub denoised_layer: Option<String>,
    /// What the image has and what was asked for, if it was written before that was reached.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_early: Option<String>,
    /// The scene itself, if it had unsaved changes; paths are relative to the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

/// The scene of an image. Paths are relative to the image, with `/` as separator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImageScene {
    /// A built-in scene, by name.
    Builtin(String),
    /// A scene file, by path.
    Scene(String),
    /// A model, in the default scene.
    Model {
        /// Path of the model.
        path: String,
        /// `y` or `z`, if it was given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        up: Option<char>,
        /// Name of the camera of the model, if one was chosen.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        camera: Option<String>,
    },
    /// Not from a file: see `text`.
    None,
}

/// The samples of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSamples {
    /// Index of the first sample of each pixel.
    pub first: u32,
    /// Samples that each pixel has at least.
    pub spp: u32,
    /// Whether some pixels have more.
    pub uneven: bool,
}

impl ImageMetadata {
    /// The same with the name of the filter of a denoised image; raw without one.
    ///
    /// - `in_layer`: the pixels are raw, and a layer is denoised.
    pub fn denoised_by(self, filter: Option<String>, in_layer: bool) -> Self {
        let (denoised_layer, denoised) = if in_layer { (filter, None) } else { (None, filter) };
        Self { denoised, denoised_layer, ..self }
    }

    /// Reads the metadata of a PNG or EXR image.
    ///
    /// # Errors
    /// If the image cannot be read or has no metadata.
    pub fn read(path: &Path) -> Result<Self, MetadataError> {
        Self::read_within(path, &Limits::of_this_process())
    }

    /// Like [`Self::read`], with the given limits.
    ///
    /// # Errors
    /// Like [`Self::read`].
    pub fn read_within(path: &Path, limits: &Limits) -> Result<Self, MetadataError> {
        Self::from_note(&note_of(path, limits)?)
    }

    /// Its text.
    pub fn to_note(&self) -> String {
        let pretty = ron::ser::PrettyConfig::new().depth_limit(2).indentor("  ").extensions(Extensions::IMPLICIT_SOME);
        // Serialising plain data cannot fail.
        options().to_string_pretty(self, pretty).expect("a note is plain data")
    }

    /// The metadata for an image that is moved from `from` to `to`: adapts its paths.
    pub fn moved(mut self, from: &Path, to: &Path) -> Self {
        let folder = |path: &Path| absolute(path).parent().map(Path::to_path_buf).unwrap_or_default();
        let moved = |path: &str| relative_path(&folder(to), &folder(from).join(text_to_path(path)));
        match &mut self.scene {
            ImageScene::Scene(path) | ImageScene::Model { path, .. } => *path = moved(path),
            ImageScene::Builtin(_) | ImageScene::None => {}
        }
        self
    }

    /// Parses the text; the inverse of [`Self::to_note`].
    ///
    /// # Errors
    /// If the syntax, the format version or a value is invalid.
    pub fn from_note(text: &str) -> Result<Self, MetadataError> {
        let shot: Self = options().from_str(text).map_err(|error| MetadataError::Syntax(Box::new(error)))?;
        if shot.format > FORMAT {
            return Err(MetadataError::Newer { program: shot.program });
        }
        shot.check().map_err(MetadataError::Invalid)?;
        Ok(shot)
    }

    /// Checks the values against the limits of scene files.
    fn check(&self) -> Result<(), String> {
        if let Err(problems) = self.camera.components() {
            return Err(problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "));
        }
        check_film_size(self.film.width, self.film.height)?;
        check_max_depth(self.max_depth)?;
        check_stops(self.display.exposure_stops)?;
        if self.first_sample.checked_add(self.spp).is_none_or(|end| end > Film::MAX_SAMPLES) {
            let (first, spp) = (self.first_sample, self.spp);
            return Err(format!("{spp} samples from {first} on: sample numbers must be below {}", Film::MAX_SAMPLES));
        }
        match self.scene {
            ImageScene::Model { up: Some(up), .. } if !matches!(up, 'y' | 'z') => {
                Err(format!("`up` is {up:?}, but must be 'y' or 'z'"))
            }
            _ => Ok(()),
        }
    }

    /// The source of the scene of the image at `path`; `None` if it was not opened from a file.
    ///
    /// # Errors
    /// If its file does not exist.
    pub fn source(&self, path: &Path) -> Result<Option<SceneSource>, MetadataError> {
        // Paths are relative to the image file, not to a symbolic link to it.
        let lies_at = if path.is_symlink() { absolute(path) } else { path.to_path_buf() };
        let folder = lies_at.parent().unwrap_or(Path::new(""));
        let find = |relative: &str| {
            let from_picture = text_to_path(relative);
            let beside = from_picture.file_name().map(|name| folder.join(name));
            let found = [Some(folder.join(&from_picture)), beside].into_iter().flatten().find(|path| path.is_file());
            found.ok_or_else(|| match unpacked_folder(&folder.join(&from_picture)) {
                Some(_) => MetadataError::NoArchive(from_picture),
                None => MetadataError::NoScene(from_picture),
            })
        };
        Ok(match &self.scene {
            ImageScene::Builtin(name) => Some(SceneSource::Builtin(name.clone())),
            ImageScene::Scene(path) => Some(SceneSource::of_scene(find(path)?)),
            ImageScene::Model { path, .. } => Some(SceneSource::Model(find(path)?)),
            ImageScene::None => None,
        })
    }

    /// The up axis that was given for a model; `None`: none was given.
    pub fn up(&self) -> Option<UpAxis> {
        match self.scene {
            ImageScene::Model { up: Some('z'), .. } => Some(UpAxis::Z),
            ImageScene::Model { up: Some(_), .. } => Some(UpAxis::Y),
            _ => None,
        }
    }

    /// The camera that was chosen for a model, by name.
    pub(super) fn model_camera(&self) -> Option<&str> {
        match &self.scene {
            ImageScene::Model { camera, .. } => camera.as_deref(),
            _ => None,
        }
    }

    /// Why the samples of the other image cannot be combined with those of this one, if so; the text follows "a
    /// different".
    pub fn differs_from(&self, other: &Self) -> Option<&'static str> {
        let seen = |shot: &Self| {
            let (view, projection, lens) = camera(&shot.camera);
            let lens = (lens.effective_radius() > 0.0).then_some(lens);
            (view.eye, view.forward, view.up, projection, lens)
        };
        let checks = [
            (self.program != other.program, "version of firstlight"),
            (self.fingerprint != other.fingerprint, "scene or version of the scene"),
            ((self.film.width, self.film.height) != (other.film.width, other.film.height), "size"),
            (seen(self) != seen(other), "view"),
            (self.integrator != other.integrator, "integrator"),
            (self.max_depth != other.max_depth, "maximum depth"),
            (self.film.filter != other.film.filter, "pixel filter"),
            (self.seed != other.seed, "seed"),
            (self.allocation != other.allocation, "allocation of samples"),
        ];
        checks.into_iter().find(|(differs, _)| *differs).map(|(_, what)| what)
    }

    /// Sets camera, film, integrator, depth and display of a scene file to those of the image. Its camera is the one that
    /// was rendered, whatever the tracks of the scene say.
    pub fn apply(&self, file: &mut SceneFile) {
        show_camera(file, self.camera.clone());
        file.film = self.film;
        file.integrator = self.integrator;
        file.max_depth = self.max_depth;
        file.display = self.display;
    }
}

fn is_uniform(allocation: &SampleAllocation) -> bool {
    *allocation == SampleAllocation::Uniform
}

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// The metadata among the attributes of an OpenEXR image.
pub(crate) fn note_in(meta: &exr::meta::MetaData) -> Option<String> {
    let mut notes = meta
        .headers
        .iter()
        .flat_map(|header| header.shared_attributes.other.iter().chain(&header.own_attributes.other));
    match notes.find(|(key, _)| **key == *NOTE_KEY) {
        Some((_, AttributeValue::Text(text))) => Some(string_of(text)),
        _ => None,
    }
}

/// Text as an attribute, in UTF-8; the constructors of the library support only Latin-1.
pub(crate) fn exr_text(text: &str) -> AttributeValue {
    AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes()))
}

/// The inverse of [`exr_text`]; text that is not valid UTF-8 is read as Latin-1.
pub(crate) fn string_of(text: &Text) -> String {
    let bytes = text.as_slice();
    str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|&byte| char::from(byte)).collect(), str::to_owned)
}

/// The text of the metadata, within the limits.
fn note_of(path: &Path, limits: &Limits) -> Result<String, MetadataError> {
    // A film has metadata too, and may be longer than other images.
    let longest = FileKind::Film.limit(limits).max(FileKind::Image.limit(limits));
    let mut file = InputFile::open_within(path, FileKind::Image, longest)?;
    let mut start = [0; 8];
    let n = file.read(&mut start).map_err(ReadError::from)?;
    file.rewind().map_err(ReadError::from)?;
    if start[..n] == *b"\x89PNG\r\n\x1a\n" {
        let unreadable = |error: png::DecodingError| MetadataError::Damaged(Box::new(error));
        let most = usize::try_from(limits.note_bytes).unwrap_or(usize::MAX);
        let reader = BufReader::new(file);
        let decoder =
            png::Decoder::new_with_limits(reader, png::Limits { bytes: most }).read_info().map_err(unreadable)?;
        let info = decoder.info();
        let mut chunk =
            info.utf8_text.iter().find(|chunk| chunk.keyword == NOTE_KEY).ok_or(MetadataError::Missing)?.clone();
        // A few kilobytes could decompress to gigabytes.
        chunk.decompress_text_with_limit(most).map_err(unreadable)?;
        return chunk.get_text().map_err(unreadable);
    }
    if start[..n.min(4)] == [0x76, 0x2f, 0x31, 0x01] {
        let note = note_in(&exr_header(file, limits)?).ok_or(MetadataError::Missing)?;
        let is_long = note.len() as u64 > limits.note_bytes;
        return if is_long { Err(MetadataError::Damaged("its metadata is too long".into())) } else { Ok(note) };
    }
    Err(MetadataError::Format)
}

/// The header of an EXR image, within the limits.
fn exr_header(file: InputFile, limits: &Limits) -> Result<exr::meta::MetaData, MetadataError> {
    /// Limit for the part before the pixels, without the metadata: for a film, about fifty bytes per block of pixels,
    /// and the names of objects and materials.
    const HEADER_BYTES: u64 = 64 << 20;
    let header = BufReader::new(file).take(limits.note_bytes.saturating_add(HEADER_BYTES));
    exr::meta::MetaData::read_from_buffered(header, false).map_err(|error| MetadataError::Damaged(Box::new(error)))
}

/// Names of the channels of an EXR image, in order.
///
/// # Errors
/// If the file cannot be read or is not an EXR image.
pub fn exr_channels(path: &Path) -> Result<Vec<String>, MetadataError> {
    let limits = Limits::of_this_process();
    let longest = FileKind::Film.limit(&limits).max(FileKind::Image.limit(&limits));
    let header = exr_header(InputFile::open_within(path, FileKind::Image, longest)?, &limits)?;
    let channels = header.headers.first().map(|header| header.channels.list.iter());
    Ok(channels.into_iter().flatten().map(|channel| channel.name.to_string()).collect())
}
