//! Film files: OpenEXR images that any viewer displays, with all data that is needed to resume rendering.
//!
//! Red, green and blue are the means, as in any image. Each `f64` of a pixel (see [`FilmRecord`]) is stored in two
//! further channels of 32-bit integers, its upper and its lower half, so nothing is rounded. Sample numbers and the
//! state of the error estimate are RON text in the attribute `firstlight.film` of the layer; the image metadata
//! ([`ImageMetadata`]) identifies the scene, and makes the film open like any image. The same attribute has a checksum
//! of every byte of the file except its own digits, so that any change is detected. The last doubling of each pixel, from
//! which the denoiser knows the noise, and feature buffers ([`FeatureLayers`]), if the film has them, are further
//! channels, which programs that do not know them skip.

use crate::files::whole_file::{Replace, WholeFile, is_film, unwritable};
use crate::format::check_film_size;
use crate::frame::image::feature_layers::{
    FeatureHeader, FeatureLayers, LAYERS, channels_of, id_channels, read_layers,
};
use crate::frame::image::picture_file::mean_channels;
use crate::render::{Film, FilmLayout, FilmRecord, N_CHANGE_PLANES, N_PLANES, NoRoom, Purpose, Room};
use crate::scene::image_metadata::{FILM_KEY, NOTE_KEY, exr_text, note_in, string_of};
use crate::scene::{
    BadValue, FileKind, Fingerprint, ImageMetadata, InputFile, Limits, MetadataError, ReadError, SceneSource,
    WriteError,
};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels,
    ReadLayers, Text, WritableImage,
};
use serde::{Deserialize, Serialize};
use std::io::{BufReader, Read, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A film file that was read.
#[derive(Clone, Debug)]
pub struct FilmFile {
    /// The film with all of its data.
    pub film: Film,
    /// Scene, view and settings that it was rendered with.
    pub shot: ImageMetadata,
    /// Feature buffers, if the film has them.
    pub features: Option<FeatureLayers>,
}

/// Summary of a film file, without its pixels.
#[derive(Clone, Debug)]
pub struct FilmSummary {
    /// Scene, view and settings that it was rendered with.
    pub shot: ImageMetadata,
    /// Layout and sample ranges.
    pub layout: FilmLayout,
}

/// Why a film file cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct FilmError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    #[source]
    pub problem: FilmProblem,
}

/// The problem with a film file; the text follows its path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilmProblem {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file is not a film.
    #[error("is not a firstlight film: films are written by render --film FILE.exr")]
    NoFilm,
    /// The film has a format that this version does not know.
    #[error("was written by a newer version of firstlight")]
    Newer,
    /// The file is truncated or was changed.
    #[error("is truncated or damaged: {0}")]
    Damaged(String),
    /// The size is out of range.
    #[error(transparent)]
    Size(#[from] BadValue),
    /// The film has more pixels than the limits allow.
    #[error("has {pixels} pixels, above the limit of {limit}: {}", Limits::advice())]
    TooLarge {
        /// Pixels of the film.
        pixels: u64,
        /// Pixels that a film may have.
        limit: u64,
    },
    /// There is not enough memory for the film.
    #[error(transparent)]
    Memory(#[from] NoRoom),
    /// The metadata of the film is invalid.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
}

impl From<String> for FilmProblem {
    fn from(problem: String) -> Self {
        Self::Damaged(problem)
    }
}

impl FilmError {
    /// Whether a retry, or another machine, may succeed: the disk is not reachable, or memory is short.
    pub fn may_pass(&self) -> bool {
        match &self.problem {
            FilmProblem::Read(error) => error.may_pass(),
            FilmProblem::Memory(_) => true,
            _ => false,
        }
    }

    /// Whether the file is truncated or was changed.
    pub fn is_damaged(&self) -> bool {
        matches!(self.problem, FilmProblem::Damaged(_))
    }
}

impl From<FilmError> for String {
    fn from(error: FilmError) -> Self {
        error.to_string()
    }
}

/// Contents of the attribute.
#[derive(Serialize, Deserialize)]
struct FilmHeader {
    /// Format version; increased by incompatible changes.
    format: u32,
    /// Checksum of all bytes of the file with zeros in place of these 32 digits.
    check: String,
    layout: FilmLayout,
    /// FilmHeader of the feature buffers, if there are any; programs that do not know them skip their channels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    features: Option<FeatureHeader>,
}

/// The beginning of every format.
#[derive(Deserialize)]
struct HeaderStart {
    format: u32,
}

const FORMAT: u32 = 1;

/// Magic number of OpenEXR files.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Placeholder for the checksum.
const NO_CHECK: &str = "00000000000000000000000000000000";

/// Bytes per pixel of all channels, at least: three means, and two words for each number of the film.
const BYTES_A_PIXEL: u64 = 4 * (3 + 2 * N_PLANES as u64);

/// Writes a film with its metadata atomically. May replace a film of the same image whose samples are all in this one,
/// and no other film.
///
/// # Errors
/// If samples would be lost, another process has the file open, or it cannot be written.
pub fn write_film_file(film: &Film, note: &str, path: &Path) -> Result<(), WriteError> {
    let claim = WholeFile::claim(path, Replace::Anything)?;
    check_replaced_film(film, None, note, path)?;
    write_film_into(film, note, claim)
}

/// Like [`write_film_file`], into a file that was claimed before, without a check of what it replaces.
///
/// # Errors
/// If it cannot be written.
pub fn write_film_into(film: &Film, note: &str, out: WholeFile) -> Result<(), WriteError> {
    write_film_with_features(film, None, note, out)
}

/// Like [`write_film_into`], with feature buffers if given.
///
/// # Errors
/// If it cannot be written.
pub fn write_film_with_features(
    film: &Film,
    features: Option<&FeatureLayers>,
    note: &str,
    mut out: WholeFile,
) -> Result<(), WriteError> {
    let path = &out.path().to_path_buf();
    let purpose = if features.is_some() { Purpose::Layers } else { Purpose::FilmFile };
    drop(Room::for_files(film.width(), film.height(), &[purpose]).map_err(|error| unwritable(path, error))?);
    let FilmRecord { layout, planes, changes } = film.to_record();
    let of_features = features.map(FeatureLayers::header);
    let header = FilmHeader { format: FORMAT, check: NO_CHECK.to_owned(), layout, features: of_features };
    let mut bytes =
        encode(film, (&planes, changes), features, note, &header).map_err(|error| unwritable(path, error))?;
    let place = place_of_check(&bytes).expect("the header has just been written");
    let check = checksum(&bytes, &place).to_string();
    bytes[place].copy_from_slice(check.as_bytes());
    out.write_all(&bytes).map_err(|error| unwritable(path, error))?;
    out.finish()
}

/// Encodes a whole file in memory.
fn encode(
    film: &Film,
    (planes, changes): (&[Vec<f64>], Option<Vec<Vec<f32>>>),
    features: Option<&FeatureLayers>,
    note: &str,
    header: &FilmHeader,
) -> Result<Vec<u8>, exr::error::Error> {
    // Serialising plain data cannot fail.
    let header = ron::to_string(header).expect("a film's header is plain data");
    let mut channels = mean_channels(film);
    for (plane, name) in planes.iter().zip(plane_names()) {
        let half =
            |shift: u32| FlatSamples::U32(plane.iter().map(|number| (number.to_bits() >> shift) as u32).collect());
        channels.push(AnyChannel::new(format!("{name}.upper").as_str(), half(32)));
        channels.push(AnyChannel::new(format!("{name}.lower").as_str(), half(0)));
    }
    for (plane, name) in changes.into_iter().flatten().zip(change_names()) {
        channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(plane)));
    }
    if let Some(FeatureLayers { buffers, .. }) = features {
        for (name, numbers) in LAYERS.iter().flat_map(|layer| channels_of(buffers, layer)) {
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(numbers)));
        }
        for (name, words) in id_channels(buffers) {
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::U32(words)));
        }
    }
    let mut attributes = LayerAttributes::named(env!("CARGO_PKG_NAME"));
    attributes.other.insert(Text::from(FILM_KEY), AttributeValue::Text(Text::from(header.as_str())));
    let size = (film.width() as usize, film.height() as usize);
    let layer = Layer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let mut image = Image::from_layer(layer);
    image.attributes.other.insert(Text::from(NOTE_KEY), exr_text(note));
    let mut memory = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut memory)?;
    Ok(memory.into_inner())
}

/// Returns the position of the checksum's digits.
fn place_of_check(bytes: &[u8]) -> Option<Range<usize>> {
    let find = |what: &[u8], from: usize| {
        let within = bytes.get(from..)?;
        within.windows(what.len()).position(|part| part == what).map(|at| from + at + what.len())
    };
    let header = find(&[FILM_KEY.as_bytes(), b"\0string\0"].concat(), 0)?;
    let start = find(b"check:\"", header)?;
    let place = start..start + NO_CHECK.len();
    bytes.get(place.clone()).map(|_| place)
}

/// Returns the checksum of everything except the bytes at `place`.
fn checksum(bytes: &[u8], place: &Range<usize>) -> Fingerprint {
    Fingerprint::of(&bytes[..place.start]).with(&bytes[place.end..])
}

/// Checks that `film` can replace the file at `path` without losing samples or layers.
///
/// - `features`: what is written with it.
///
/// # Errors
/// If there is a film with other samples or more layers, of another image, or that cannot be read.
pub fn check_replaced_film(
    film: &Film,
    features: Option<&FeatureLayers>,
    note: &str,
    path: &Path,
) -> Result<(), WriteError> {
    if !is_film(path) {
        return Ok(());
    }
    let refused = |film: String| WriteError::OtherFilm { path: path.to_path_buf(), film };
    let old = read(path, &Limits::of_this_process()).map_err(|reason| refused(format!("that {reason}")))?;
    if let Some(what) = ImageMetadata::from_note(note)?.differs_from(&old.shot) {
        return Err(refused(format!("with a different {what}")));
    }
    let samples = |features: Option<&FeatureLayers>| features.map_or(0, |features| features.buffers.samples);
    if !film.layout().has_all_of(&old.film.layout()) {
        return Err(refused("with other samples".to_owned()));
    }
    match samples(old.features.as_ref()) > samples(features) {
        true => Err(refused("with layers that the new one does not have".to_owned())),
        false => Ok(()),
    }
}

/// Rejects an image that is a damaged film. An image is opened by its metadata alone, but that of a film is covered by
/// the checksum of the whole file.
///
/// # Errors
/// As [`read_film_file`].
pub fn check_film_source(source: &SceneSource) -> Result<(), FilmError> {
    match source {
        SceneSource::Picture(path) if is_film(path) => read_film_file(path).map(|_| ()),
        _ => Ok(()),
    }
}

/// Reads the header and the metadata of a film, without its pixels. The checksum covers the whole file and is not
/// verified.
///
/// # Errors
/// If the file does not exist or is not a film; the message names it.
pub fn read_film_summary(path: &Path) -> Result<FilmSummary, FilmError> {
    let limits = Limits::of_this_process();
    summary(path, &limits).map_err(|problem| FilmError { path: path.to_path_buf(), problem })
}

fn summary(path: &Path, limits: &Limits) -> Result<FilmSummary, FilmProblem> {
    let file = opened(path, limits)?;
    let damaged = |error: &dyn std::fmt::Display| FilmProblem::Damaged(error.to_string());
    let meta = exr::meta::MetaData::read_from_buffered(BufReader::new(file), false).map_err(|error| damaged(&error))?;
    let layout = layout_in(&meta)?;
    check_film_size(layout.width, layout.height)?;
    check_layout(&layout)?;
    let note = note_in(&meta).filter(|note| note.len() as u64 <= limits.note_bytes);
    let shot = ImageMetadata::from_note(&note.ok_or_else(|| damaged(&"its metadata is missing or too long"))?)?;
    Ok(FilmSummary { shot, layout })
}

/// Opens a file that begins as a film does: gigabytes of something else are not read.
fn opened(path: &Path, limits: &Limits) -> Result<InputFile<'static>, FilmProblem> {
    let mut file = InputFile::open_within(path, FileKind::Film, FileKind::Film.limit(limits))?;
    let mut start = [0; 4];
    let n = file.read(&mut start).and_then(|n| file.rewind().map(|()| n)).map_err(ReadError::from)?;
    if start[..n] == MAGIC { Ok(file) } else { Err(FilmProblem::NoFilm) }
}

/// The attribute with the header of a film.
fn header_text(meta: &exr::meta::MetaData) -> Result<String, FilmProblem> {
    let header = meta.headers.first().ok_or(FilmProblem::NoFilm)?;
    let Some(AttributeValue::Text(text)) = header.own_attributes.other.get(&Text::from(FILM_KEY)) else {
        return Err(FilmProblem::NoFilm);
    };
    let text = string_of(text);
    let HeaderStart { format, .. } =
        ron::from_str(&text).map_err(|error: ron::error::SpannedError| FilmProblem::Damaged(error.to_string()))?;
    if format > FORMAT { Err(FilmProblem::Newer) } else { Ok(text) }
}

/// Reads the layout of a film from its attribute.
fn layout_in(meta: &exr::meta::MetaData) -> Result<FilmLayout, FilmProblem> {
    let text = header_text(meta)?;
    let damaged = |error: ron::error::SpannedError| FilmProblem::Damaged(error.to_string());
    Ok(ron::from_str::<FilmHeader>(&text).map_err(damaged)?.layout)
}

/// Rejects a layout that no film has: without the checksum of the whole file, its numbers may be anyone's.
fn check_layout(layout: &FilmLayout) -> Result<(), FilmProblem> {
    let FilmLayout { width, height, tile_size, ref tiles, .. } = *layout;
    let per_side = |side: u32| u64::from(side.div_ceil(tile_size.max(1)));
    let n_blocks: usize = tiles.iter().map(|tile| tile.blocks.len()).sum();
    let fits = tile_size > 0
        && tiles.len() as u64 == per_side(width) * per_side(height)
        && n_blocks as u64 <= u64::from(width) * u64::from(height);
    let is_ascending = |ranges: &[(u32, u32)]| {
        ranges.windows(2).all(|pair| pair[0].1 < pair[1].0)
            && ranges.iter().all(|(start, end)| start <= end)
            && ranges.last().is_some_and(|(_, end)| *end <= Film::MAX_SAMPLES)
    };
    match fits && tiles.iter().flat_map(|tile| &tile.blocks).all(|block| is_ascending(&block.samples)) {
        true => Ok(()),
        false => Err(FilmProblem::Damaged("its samples are not those of a film of its size".to_owned())),
    }
}

/// Reads a film exactly.
///
/// # Errors
/// If the file does not exist, is not a film, is truncated or damaged; the message names it.
pub fn read_film_file(path: &Path) -> Result<FilmFile, FilmError> {
    read_film_file_within(path, &Limits::of_this_process())
}

/// Like [`read_film_file`], with other limits.
///
/// # Errors
/// As [`read_film_file`].
pub fn read_film_file_within(path: &Path, limits: &Limits) -> Result<FilmFile, FilmError> {
    read(path, limits).map_err(|problem| FilmError { path: path.to_path_buf(), problem })
}

fn read(path: &Path, limits: &Limits) -> Result<FilmFile, FilmProblem> {
    decode(&opened(path, limits)?.bytes()?, limits)
}

/// Decodes a film from the bytes of its file.
fn decode(bytes: &[u8], limits: &Limits) -> Result<FilmFile, FilmProblem> {
    if bytes.get(..4) != Some(&MAGIC) {
        return Err(FilmProblem::NoFilm);
    }
    let damaged = |error: &dyn std::fmt::Display| FilmProblem::Damaged(error.to_string());
    let meta = exr::meta::MetaData::read_from_buffered(bytes, false).map_err(|error| damaged(&error))?;
    let text = header_text(&meta)?;
    const WRONG: &str = "checksum mismatch";
    let place = place_of_check(bytes).ok_or_else(|| damaged(&WRONG))?;
    if checksum(bytes, &place).to_string().as_bytes() != &bytes[place] {
        return Err(damaged(&WRONG));
    }
    let FilmHeader { layout, features, .. } = ron::from_str(&text).map_err(|error| damaged(&error))?;
    let FilmLayout { width, height, .. } = layout;
    check_film_size(width, height)?;
    if (meta.headers[0].layer_size.width(), meta.headers[0].layer_size.height()) != (width as usize, height as usize) {
        return Err(damaged(&"inconsistent size"));
    }
    let n_pixels = u64::from(width) * u64::from(height);
    if n_pixels > limits.film_pixels {
        return Err(FilmProblem::TooLarge { pixels: n_pixels, limit: limits.film_pixels });
    }
    // A size that the bytes cannot unpack to is rejected before memory is allocated for it.
    const MOST_UNPACKED: u64 = 1100;
    if n_pixels * BYTES_A_PIXEL > MOST_UNPACKED * bytes.len() as u64 {
        return Err(damaged(&"the file is too short for its size"));
    }
    drop(Room::for_files(width, height, &[Purpose::FilmFile])?);
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|error| damaged(&error))?;
    let channels = &image.layer_data.channel_data.list;
    let samples = |name: &str| {
        let found = channels.iter().find(|channel| channel.name.to_string() == name);
        found.map(|channel| &channel.sample_data)
    };
    let missing = |name: &str| damaged(&format!("channel {name} is missing"));
    let words = |name: String| match samples(&name) {
        Some(FlatSamples::U32(words)) => Ok(words),
        _ => Err(missing(&name)),
    };
    let features = features.map(|of_features| {
        let numbers = |name: &str| match samples(name) {
            Some(FlatSamples::F32(numbers)) => Ok(numbers.clone()),
            _ => Err(missing(name)),
        };
        read_layers(of_features, (width, height), numbers, |name| words(name.to_owned()).cloned())
    });
    let features = features.transpose()?;
    let mut planes = Vec::with_capacity(N_PLANES);
    for name in plane_names() {
        let (upper, lower) = (words(format!("{name}.upper"))?, words(format!("{name}.lower"))?);
        let pairs = upper.iter().zip(lower);
        planes.push(pairs.map(|(&u, &l)| f64::from_bits(u64::from(u) << 32 | u64::from(l))).collect());
    }
    let of_change = |name: String| match samples(&name) {
        Some(FlatSamples::F32(numbers)) => Some(numbers.clone()),
        _ => None,
    };
    let record = FilmRecord { layout, planes, changes: change_names().map(of_change).collect() };
    let film = Film::from_record(&record).map_err(|error| damaged(&error))?;
    let note = note_in(&meta).filter(|note| note.len() as u64 <= limits.note_bytes);
    let shot = ImageMetadata::from_note(&note.ok_or_else(|| damaged(&"its metadata is missing or too long"))?)?;
    let of_film = (film.width(), film.height(), film.first_sample(), film.spp());
    if (shot.film.width, shot.film.height, shot.first_sample, shot.spp) != of_film {
        return Err(damaged(&"its metadata has a different size or number of samples"));
    }
    Ok(FilmFile { film, shot, features })
}

fn plane_names() -> impl Iterator<Item = String> {
    ["sum", "rest", "mean", "light.sum", "light.rest", "light.mean"]
        .into_iter()
        .flat_map(|part| ["R", "G", "B"].map(|channel| format!("{part}.{channel}")))
}

/// Names of [`FilmRecord::changes`].
fn change_names() -> impl Iterator<Item = String> {
    let of_part = |part| ["R", "G", "B", "relative"].map(|channel| format!("{part}.{channel}"));
    ["change", "light.change"].into_iter().flat_map(of_part).take(N_CHANGE_PLANES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::core::offline::{Target, render_offline};
    use crate::frame::image::picture_file::Print;
    use crate::render::RenderSettings;
    use crate::scene::{Extraction, ImageSamples, LoadOptions, MetadataDraft, SceneInputs, SceneSource, load};

    /// A film of a scene with light paths, and its metadata.
    fn tiny(spp: u32) -> (Film, String) {
        let loaded = load(&SceneSource::Builtin("cornell-balls".to_owned()), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        loaded.spawn(&mut world);
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees);
        let mut film = Film::new(3, 2);
        let target = Target { spp: Some(spp), ..Target::default() };
        let settings = RenderSettings::default();
        render_offline(&extraction.prepared, &settings, &mut film, target, |_| true);
        let samples = ImageSamples { first: 0, spp, uneven: false };
        let draft = MetadataDraft::of(&mut world, Some(&loaded));
        let note = draft.note(Path::new("a.exr"), (3, 2), samples, crate::render::Display::default());
        (film, note)
    }

    fn read_bytes(bytes: &[u8]) -> Result<FilmFile, FilmProblem> {
        decode(bytes, &Limits::USUAL)
    }

    #[test]
    fn whatever_byte_of_a_film_is_changed_it_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (film, note) = tiny(4);
        write_film_file(&film, &note, &folder.path().join("a.exr")).unwrap();
        let whole = std::fs::read(folder.path().join("a.exr")).unwrap();
        let kept = read_bytes(&whole).unwrap();
        assert!(film.half_steps().is_some() && kept.film.half_steps() == film.half_steps());
        assert!(kept.film.to_record() == film.to_record() && kept.shot.to_note() == note);
        for at in 0..whole.len() {
            for flip in [1, 2, 0x20, 0x80, 0xff] {
                let mut changed = whole.clone();
                changed[at] ^= flip;
                assert!(read_bytes(&changed).is_err(), "byte {at} ^ {flip:#x}");
            }
        }
        // Plausible changes by hand.
        let text = |text: &str| text.as_bytes().to_vec();
        for (from, to) in [
            (text("samples:[(0,4)]"), text("samples:[(0,8)]")),
            (text("mean_of:4"), text("mean_of:2")),
            (text("seed: 0"), text("seed: 1")),
            (text("spp: 4"), text("spp: 8")),
            (text("format:1"), text("format:0")),
            (text("format:1"), text("format:2")),
            (text("cornell-balls"), text("cornell-bells")),
        ] {
            let at = whole.windows(from.len()).position(|part| part == from);
            let at = at.unwrap_or_else(|| panic!("{} is not in the file", String::from_utf8_lossy(&from)));
            let mut changed = whole.clone();
            changed.splice(at..at + from.len(), to);
            assert!(read_bytes(&changed).is_err(), "{}", String::from_utf8_lossy(&from));
        }
    }

    /// The summary is read without the checksum: a few kilobytes must not stand for the work of gigabytes.
    #[test]
    fn samples_that_no_film_of_its_size_has_are_refused_by_the_summary_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let (film, note) = tiny(4);
        write_film_file(&film, &note, &path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let layout = read_film_summary(&path).unwrap().layout;
        let mut forged = vec![layout.clone(); 5];
        let block = layout.tiles[0].blocks[0].clone();
        forged[0].tiles[0].blocks = vec![block; 7];
        forged[1].tiles.push(layout.tiles[0].clone());
        forged[2].tiles[0].blocks[0].samples = vec![(2, 4), (0, 1)];
        forged[3].tiles[0].blocks[0].samples = vec![(0, u32::MAX)];
        forged[4].tile_size = 0;
        for layout in forged {
            let header = |layout| {
                ron::to_string(&FilmHeader { format: FORMAT, check: NO_CHECK.to_owned(), layout, features: None })
            };
            let text = header(layout).unwrap();
            let key = [FILM_KEY.as_bytes(), b"\0string\0"].concat();
            let at = whole.windows(key.len()).position(|part| part == key).unwrap() + key.len();
            let length = u32::from_le_bytes(whole[at..at + 4].try_into().unwrap()) as usize;
            let mut bytes = whole.clone();
            bytes.splice(at..at + 4 + length, [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat());
            std::fs::write(&path, bytes).unwrap();
            assert!(read_film_summary(&path).unwrap_err().is_damaged(), "{text}");
        }
    }

    #[test]
    fn metadata_beyond_the_limit_is_refused_in_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let (film, note) = tiny(1);
        write_film_file(&film, &note, &folder.path().join("film.exr")).unwrap();
        for name in ["film.exr", "a.exr", "a.png"] {
            let path = folder.path().join(name);
            let (size, display) = ((film.width(), film.height()), crate::render::Display::default());
            let print = Print { film: &film, display: &display, size, note: Some(&note), denoised: None };
            if name != "film.exr" {
                print.write(&path, Replace::AllButFilms).unwrap();
            }
            let read = |note_bytes| ImageMetadata::read_within(&path, &Limits { note_bytes, ..Limits::USUAL });
            assert_eq!(read(1 << 20).unwrap().to_note(), note, "{name}");
            assert!(read(note.len() as u64 - 1).is_err(), "{name}");
        }
    }

    /// Attributes are bytes, whatever encoding the library assumes.
    #[test]
    fn a_note_may_have_letters_of_any_language() {
        let folder = tempfile::tempdir().unwrap();
        let (film, note) = tiny(1);
        let note = note.replace("cornell-balls", "部屋 é");
        write_film_file(&film, &note, &folder.path().join("a.exr")).unwrap();
        let kept = read_film_file(&folder.path().join("a.exr")).unwrap();
        assert_eq!(kept.shot.to_note(), note);
        assert_eq!(ImageMetadata::read(&folder.path().join("a.exr")).unwrap().to_note(), note);
    }
}
