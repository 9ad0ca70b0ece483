//! Films on disk: an OpenEXR picture that any viewer shows, with everything that is needed to go on with it.
//!
//! Red, green and blue are the means, as in any picture. Beside them, each `f64` of a pixel (see
//! [`FilmRecord`]) lies in two channels of 32-bit integers, its upper and its lower half, so nothing is rounded. Sample
//! numbers and the state of the error estimate are RON text in the attribute `firstlight.film` of the layer, with a
//! checksum; the note of the picture ([`Shot`]) says which scene it is, and makes it open as any picture.

use super::picture_file::mean_channels;
use crate::render::{Film, FilmLayout, FilmRecord, N_PLANES, Purpose, Room};
use crate::scene::file::check_film_size;
use crate::scene::limits::open_file;
use crate::scene::shot::NOTE_KEY;
use crate::scene::whole_file::{WholeFile, unwritable};
use crate::scene::{Fingerprint, Limits, Shot, plain_io};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels,
    ReadLayers, Text, WritableImage,
};
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use std::path::Path;

/// The attribute that makes a picture a film.
const FILM_KEY: &str = "firstlight.film";

/// A film and what it is a film of.
#[derive(Clone, Debug)]
pub struct FilmFile {
    pub film: Film,
    pub shot: Shot,
}

/// What stands in the attribute.
#[derive(Serialize, Deserialize)]
struct Header {
    /// A newer program that writes something else counts this up.
    format: u32,
    /// Of all numbers.
    check: String,
    layout: FilmLayout,
}

const FORMAT: u32 = 1;

/// Of all channels: three means, and two words for each number of the film.
const BYTES_A_PIXEL: u64 = 4 * (3 + 2 * N_PLANES as u64);

/// Writes a film with the note of what it shows; whole or not at all.
pub fn write_film_file(film: &Film, note: &str, path: &Path) -> Result<(), String> {
    drop(Room::for_files(film.width(), film.height(), &[Purpose::FilmFile]).map_err(|error| unwritable(path, &error))?);
    let record = film.to_record();
    let header = Header { format: FORMAT, check: checksum(&record).to_string(), layout: record.layout };
    // Plain structs and numbers can always be written.
    let header = ron::to_string(&header).expect("a film's header is plain data");
    let mut channels = mean_channels(film);
    for (plane, name) in record.planes.iter().zip(plane_names()) {
        let half =
            |shift: u32| FlatSamples::U32(plane.iter().map(|number| (number.to_bits() >> shift) as u32).collect());
        channels.push(AnyChannel::new(format!("{name}.upper").as_str(), half(32)));
        channels.push(AnyChannel::new(format!("{name}.lower").as_str(), half(0)));
    }
    let mut attributes = LayerAttributes::named(env!("CARGO_PKG_NAME"));
    attributes.other.insert(Text::from(FILM_KEY), AttributeValue::Text(Text::from(header.as_str())));
    let size = (film.width() as usize, film.height() as usize);
    let layer = Layer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let mut image = Image::from_layer(layer);
    image.attributes.other.insert(Text::from(NOTE_KEY), AttributeValue::Text(Text::from(note)));
    let mut out = WholeFile::begin(path)?;
    let mut memory = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut memory).map_err(|error| unwritable(path, &error))?;
    out.write_all(memory.get_ref()).map_err(|error| unwritable(path, &error))?;
    out.finish()
}

/// Reads a film back, to the last bit.
///
/// # Errors
/// A sentence that names the file: when it is not there, no film, cut short or damaged.
pub fn read_film_file(path: &Path) -> Result<FilmFile, String> {
    read_film_file_within(path, &Limits::of_this_process())
}

/// The same with limits of one's own.
pub fn read_film_file_within(path: &Path, limits: &Limits) -> Result<FilmFile, String> {
    read(path, limits).map_err(|reason| format!("{}: {reason}", path.display()))
}

fn read(path: &Path, limits: &Limits) -> Result<FilmFile, String> {
    let unreadable = |error: std::io::Error| format!("cannot be read: {}", plain_io(&error));
    let mut bytes = Vec::new();
    open_file(path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(unreadable)?;
    const NO_FILM: &str = "is no film to go on with: those are written by render --film FILE.exr";
    if bytes.get(..4) != Some(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err(NO_FILM.to_owned());
    }
    let damaged = |error: &dyn std::fmt::Display| format!("is cut short or damaged, and no film any more: {error}");
    let meta = exr::meta::MetaData::read_from_buffered(&bytes[..], false).map_err(|error| damaged(&error))?;
    let header = meta.headers.first().ok_or(NO_FILM)?;
    let Some(AttributeValue::Text(text)) = header.own_attributes.other.get(&Text::from(FILM_KEY)) else {
        return Err(NO_FILM.to_owned());
    };
    let film: Header = ron::from_str(&text.to_string()).map_err(|error| damaged(&error))?;
    if film.format > FORMAT {
        return Err("was written by a newer firstlight, in a way that this one does not know".to_owned());
    }
    let FilmLayout { width, height, .. } = film.layout;
    check_film_size(width, height)?;
    if (header.layer_size.width(), header.layer_size.height()) != (width as usize, height as usize) {
        return Err(damaged(&"its two sizes differ"));
    }
    let n_pixels = u64::from(width) * u64::from(height);
    if n_pixels > limits.film_pixels {
        let most = limits.film_pixels;
        return Err(format!("has {n_pixels} pixels, more than the {most} that may be read: {}", Limits::advice()));
    }
    // What claims to be larger than its bytes could unpack to is refused before any memory is asked for it.
    const MOST_UNPACKED: u64 = 1100;
    if n_pixels * BYTES_A_PIXEL > MOST_UNPACKED * bytes.len() as u64 {
        return Err(damaged(&"it is far too short for its size"));
    }
    drop(Room::for_files(width, height, &[Purpose::FilmFile]).map_err(|error| error.to_string())?);
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(std::io::Cursor::new(&bytes))
        .map_err(|error| damaged(&error))?;
    let channels = &image.layer_data.channel_data.list;
    let words = |name: String| {
        let found = channels.iter().find(|channel| channel.name.to_string() == name);
        match found.map(|channel| &channel.sample_data) {
            Some(FlatSamples::U32(words)) => Ok(words),
            _ => Err(damaged(&format!("the channel {name} is missing"))),
        }
    };
    let mut planes = Vec::with_capacity(N_PLANES);
    for name in plane_names() {
        let (upper, lower) = (words(format!("{name}.upper"))?, words(format!("{name}.lower"))?);
        let pairs = upper.iter().zip(lower);
        planes.push(pairs.map(|(&u, &l)| f64::from_bits(u64::from(u) << 32 | u64::from(l))).collect());
    }
    let record = FilmRecord { layout: film.layout, planes };
    if checksum(&record).to_string() != film.check {
        return Err(damaged(&"its checksum is wrong"));
    }
    let film = Film::from_record(&record).map_err(|error| damaged(&error))?;
    Ok(FilmFile { film, shot: Shot::read_within(path, limits)? })
}

fn plane_names() -> impl Iterator<Item = String> {
    ["sum", "rest", "mean", "lamps.sum", "lamps.rest"]
        .into_iter()
        .flat_map(|part| ["R", "G", "B"].map(|channel| format!("{part}.{channel}")))
}

fn checksum(record: &FilmRecord) -> Fingerprint {
    record.planes.iter().fold(Fingerprint::default(), |print, plane| {
        print.with(plane.iter().flat_map(|number| number.to_bits().to_le_bytes()))
    })
}
