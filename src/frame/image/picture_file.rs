//! Image files: developed as PNG or JPEG, linear as EXR; written atomically.
//!
//! A PNG and an EXR may carry metadata ([`NOTE_KEY`]): a text chunk (iTXt), an attribute. A JPEG has none, so no scene
//! can be opened from it.

use crate::files::whole_file::{Replace, WholeFile, unwritable};
use crate::render::{Display, Film, Purpose, Room, develop, develop_colors, relative_errors};
use crate::scene::image_metadata::{NOTE_KEY, exr_text};
use crate::scene::{FileKind, InputFile, WriteError, read_picture};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec, Text, WritableImage,
};
use glam::Vec3;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Image file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// 8 bits, sRGB, exposed and tone-mapped.
    Png,
    /// As a PNG, compressed with loss, without metadata.
    Jpeg,
    /// 32-bit floats, linear Rec. 709 radiance.
    Exr,
}

/// Quality of a JPEG, 1 to 100: artefacts are rarely visible.
const JPEG_QUALITY: u8 = 92;

impl PictureFormat {
    /// Returns the format of a file name's extension.
    ///
    /// # Errors
    /// If there is no extension, or an unknown one.
    pub fn of(path: &Path) -> Result<Self, WriteError> {
        match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("png") => Ok(Self::Png),
            Some("jpg" | "jpeg") => Ok(Self::Jpeg),
            Some("exr") => Ok(Self::Exr),
            Some(other) => Err(WriteError::Format { path: path.to_path_buf(), extension: other.to_owned() }),
            None => Err(WriteError::NoExtension(path.to_path_buf())),
        }
    }

    /// File name extension of the format.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
            Self::Exr => "exr",
        }
    }
}

/// A film as an image file.
#[derive(Clone, Copy)]
pub struct Print<'a> {
    /// The film, linear radiance.
    pub film: &'a Film,
    /// Exposure and tone curve of a PNG or JPEG.
    pub display: &'a Display,
    /// Size of a PNG or JPEG in pixels, to which a coarser film is scaled; an EXR keeps the size of the film.
    pub size: (u32, u32),
    /// Metadata of the image, which a JPEG does not keep.
    pub note: Option<&'a str>,
    /// Radiance to write in place of the film's, one entry per pixel, row by row from the top.
    pub denoised: Option<&'a [Vec3]>,
}

/// Whether an image file has its end, without which it was cut short. The pixels of an EXR have no mark at their end: they
/// are decoded.
pub fn is_whole_picture(path: &Path) -> bool {
    let ends_with = |mark: &[u8]| {
        let mut file = InputFile::open(path, FileKind::Image).ok()?;
        let mut end = vec![0; mark.len()];
        file.seek(SeekFrom::End(-(mark.len() as i64))).ok()?;
        file.read_exact(&mut end).ok()?;
        Some(end == mark)
    };
    let is_whole = match PictureFormat::of(path) {
        // The last chunk: no data, its name, its checksum.
        Ok(PictureFormat::Png) => ends_with(b"\0\0\0\0IEND\xae\x42\x60\x82"),
        Ok(PictureFormat::Jpeg) => ends_with(b"\xff\xd9"),
        Ok(PictureFormat::Exr) => Some(read_picture(path).is_ok()),
        Err(_) => None,
    };
    is_whole.unwrap_or(false)
}

/// Writes a film in the format of the file name, without metadata.
///
/// # Errors
/// As [`Print::write`].
pub fn write_film(film: &Film, display: &Display, path: &Path) -> Result<(), WriteError> {
    Print { film, display, size: (film.width(), film.height()), note: None, denoised: None }
        .write(path, Replace::AllButFilms)
}

/// Writes the relative error of each pixel ([`relative_errors`]) as a grey EXR: 0.05 is 5 %.
///
/// # Errors
/// If it is not known yet, or the file cannot be written.
pub fn write_errors(film: &Film, path: &Path, replace: Replace) -> Result<(), WriteError> {
    let errors = relative_errors(film).ok_or_else(|| WriteError::ErrorUnknown(path.to_path_buf()))?;
    let channel = |name: &str| AnyChannel::new(name, FlatSamples::F32(errors.clone()));
    let channels = ["R", "G", "B"].map(channel).into_iter().collect();
    let bytes = encode(film, channels, None).map_err(|error| unwritable(path, error))?;
    let mut out = WholeFile::begin(path, replace)?;
    out.write_all(&bytes).map_err(|error| unwritable(path, error))?;
    out.finish()
}

/// The names of new files of this stem.
///
/// - `taken`: absolute paths of files that are still to be written.
pub fn numbered(folder: &Path, stem: &str, extension: &str, taken: &[PathBuf]) -> impl Iterator<Item = PathBuf> {
    let is_taken = |path: &PathBuf| std::path::absolute(path).is_ok_and(|path| taken.contains(&path));
    let names = (1..=u32::MAX).map(move |number| folder.join(format!("{stem}-{number:04}.{extension}")));
    names.filter(move |path| !is_taken(path))
}

/// The first name that no file has, by which errors call the image.
///
/// # Errors
/// If there is none.
pub(super) fn free_of(names: &mut impl Iterator<Item = PathBuf>) -> Result<PathBuf, WriteError> {
    let mut last = PathBuf::new();
    let is_free = |path: &PathBuf| {
        last.clone_from(path);
        !path.exists()
    };
    names.find(is_free).ok_or(WriteError::NoFreeName(last))
}

impl Print<'_> {
    /// Writes the image in the format of the file name, to a temporary file that then replaces `path`.
    ///
    /// # Errors
    /// If the name has no known extension, or the file cannot be written.
    pub fn write(&self, path: &Path, replace: Replace) -> Result<(), WriteError> {
        self.encode_beside(PictureFormat::of(path)?, path, replace)?.finish()
    }

    /// Writes the image into `folder` as `STEM-0001`, or with the next free number: never over an existing file, even
    /// if another program creates it at the same time. Returns the path.
    ///
    /// - `taken`: absolute paths of files that are still to be written.
    ///
    /// # Errors
    /// If no number is free, or the file cannot be written.
    pub fn write_new(
        &self,
        folder: &Path,
        stem: &str,
        format: PictureFormat,
        taken: &[PathBuf],
    ) -> Result<PathBuf, WriteError> {
        self.write_first(numbered(folder, stem, format.extension(), taken), format)
    }

    /// Writes the image to `path`, or where that is taken beside it as [`write_new`](Self::write_new) does. Returns the
    /// path.
    ///
    /// # Errors
    /// Likewise.
    pub fn write_unused(&self, path: &Path, stem: &str) -> Result<PathBuf, WriteError> {
        let format = PictureFormat::of(path)?;
        let beside = numbered(path.parent().unwrap_or(Path::new("")), stem, format.extension(), &[]);
        self.write_first(std::iter::once(path.to_path_buf()).chain(beside), format)
    }

    /// Writes the image under the first free name.
    fn write_first(
        &self,
        mut names: impl Iterator<Item = PathBuf>,
        format: PictureFormat,
    ) -> Result<PathBuf, WriteError> {
        let first = free_of(&mut names)?;
        let file = self.encode_beside(format, &first, Replace::AllButFilms)?;
        file.finish_new(std::iter::once(first.clone()).chain(names))?.ok_or(WriteError::NoFreeName(first))
    }

    /// Encodes the image as the bytes of a file.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn bytes(&self, format: PictureFormat) -> Result<Vec<u8>, WriteError> {
        drop(self.room(format).map_err(WriteError::Memory)?);
        let mut bytes = Vec::new();
        match format {
            PictureFormat::Png => self.png(&mut bytes).map_err(|error| WriteError::Encode(Box::new(error)))?,
            PictureFormat::Jpeg => self.jpeg(&mut bytes).map_err(|error| WriteError::Encode(Box::new(error)))?,
            PictureFormat::Exr => bytes = self.exr().map_err(|error| WriteError::Encode(Box::new(error)))?,
        }
        Ok(bytes)
    }

    /// Reserves the memory for encoding: the encoders do not check for it.
    fn room(&self, format: PictureFormat) -> io::Result<Room> {
        Ok(match format {
            PictureFormat::Png | PictureFormat::Jpeg => Room::for_files(self.size.0, self.size.1, &[Purpose::Png])?,
            PictureFormat::Exr => Room::for_files(self.film.width(), self.film.height(), &[Purpose::Exr])?,
        })
    }

    /// Writes the image to a temporary file in the folder of `path`.
    fn encode_beside(&self, format: PictureFormat, path: &Path, replace: Replace) -> Result<WholeFile, WriteError> {
        drop(self.room(format).map_err(|error| unwritable(path, error))?);
        let mut out = WholeFile::begin(path, replace)?;
        match format {
            PictureFormat::Png => self.png(&mut out).map_err(|error| unwritable(path, error))?,
            PictureFormat::Jpeg => self.jpeg(&mut out).map_err(|error| unwritable(path, error))?,
            PictureFormat::Exr => {
                let bytes = self.exr().map_err(|error| unwritable(path, error))?;
                out.write_all(&bytes).map_err(|error| unwritable(path, error))?;
            }
        }
        Ok(out)
    }

    /// The developed image, 3 bytes per pixel.
    fn rgb(&self) -> Vec<u8> {
        let (width, height) = self.size;
        let mut rgb = Vec::new();
        match self.denoised {
            None => develop(self.film, self.display, width, height, &mut rgb),
            Some(colors) => {
                let from = (self.film.width(), self.film.height());
                develop_colors(colors, from, self.display, (width, height), &mut rgb);
            }
        }
        // In place: all pixels are opaque, so alpha is dropped.
        let n_pixels = rgb.len() / 4;
        (0..n_pixels).for_each(|i| rgb.copy_within(4 * i..4 * i + 3, 3 * i));
        rgb.truncate(3 * n_pixels);
        rgb
    }

    fn jpeg(&self, out: &mut impl Write) -> io::Result<()> {
        let (width, height) = self.size;
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(out, JPEG_QUALITY);
        let encoded = encoder.encode(&self.rgb(), width, height, image::ExtendedColorType::Rgb8);
        encoded.map_err(|error| match error {
            // As a cause it would be hidden.
            image::ImageError::IoError(error) => error,
            error => io::Error::other(error),
        })
    }

    fn png(&self, out: &mut impl Write) -> Result<(), png::EncodingError> {
        let (width, height) = self.size;
        let rgb = self.rgb();
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        if let Some(note) = self.note {
            encoder.add_itxt_chunk(NOTE_KEY.to_owned(), note.to_owned())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&rgb)?;
        writer.finish()
    }

    fn exr(&self) -> Result<Vec<u8>, exr::error::Error> {
        let channels = match self.denoised {
            None => mean_channels(self.film),
            Some(colors) => channels_of(colors),
        };
        encode(self.film, channels, self.note)
    }
}

/// Encodes channels of the size of `film` as an EXR in memory, because the encoder seeks.
fn encode(
    film: &Film,
    channels: SmallVec<[AnyChannel<FlatSamples>; 4]>,
    note: Option<&str>,
) -> Result<Vec<u8>, exr::error::Error> {
    let size = (film.width() as usize, film.height() as usize);
    let attributes = LayerAttributes::named(env!("CARGO_PKG_NAME"));
    let layer = Layer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let mut image = Image::from_layer(layer);
    if let Some(note) = note {
        image.attributes.other.insert(Text::from(NOTE_KEY), exr_text(note));
    }
    let mut memory = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut memory)?;
    Ok(memory.into_inner())
}

/// The mean radiance of a film as the red, green and blue channels of an EXR.
pub(crate) fn mean_channels(film: &Film) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
    channels_of(&film.means())
}

fn channels_of(colors: &[Vec3]) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
    let channel =
        |name: &str, c: usize| AnyChannel::new(name, FlatSamples::F32(colors.iter().map(|color| color[c]).collect()));
    SmallVec::from_vec(vec![channel("R", 0), channel("G", 1), channel("B", 2)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_pictures_take_free_names_and_leave_the_rest_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (film, display) = (Film::new(5, 3), Display::default());
        std::fs::write(folder.path().join("gallery-0002.png"), "not ours").unwrap();
        let print = Print { film: &film, display: &display, size: (10, 6), note: None, denoised: None };
        let taken = [folder.path().join("gallery-0004.png")];
        let save = |format| print.write_new(folder.path(), "gallery", format, &taken).unwrap();
        let first = save(PictureFormat::Png);
        assert_eq!(first, folder.path().join("gallery-0001.png"));
        assert_eq!(save(PictureFormat::Png), folder.path().join("gallery-0003.png"));
        assert_eq!(save(PictureFormat::Exr), folder.path().join("gallery-0001.exr"));
        assert_eq!(save(PictureFormat::Png), folder.path().join("gallery-0005.png"), "another is to be written before");
        assert_eq!(std::fs::read(folder.path().join("gallery-0002.png")).unwrap(), b"not ours");
        assert_eq!(image::image_dimensions(first).unwrap(), (10, 6));
        let linear = image::image_dimensions(folder.path().join("gallery-0001.exr")).unwrap();
        assert_eq!(linear, (5, 3));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 5, "nothing temporary is left");
    }

    /// What cannot be written has the name that it would have got.
    #[test]
    fn errors_of_new_pictures_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let (film, display) = (Film::new(5, 3), Display::default());
        let print = Print { film: &film, display: &display, size: (10, 6), note: None, denoised: None };
        let too_long = "x".repeat(250);
        let told = print.write_new(folder.path(), &too_long, PictureFormat::Png, &[]).unwrap_err().to_string();
        assert!(told.contains("x-0001.png: "), "{told}");
    }

    #[test]
    fn a_full_disk_is_told_in_the_same_words_for_all_formats() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }

            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let (film, display) = (Film::new(5, 3), Display::default());
        let print = Print { film: &film, display: &display, size: (10, 6), note: None, denoised: None };
        let path = Path::new("a");
        for error in
            [unwritable(path, print.jpeg(&mut Full).unwrap_err()), unwritable(path, print.png(&mut Full).unwrap_err())]
        {
            assert_eq!(error.to_string(), "a: cannot be written: the disk is full");
        }
    }

    #[test]
    fn images_that_are_cut_short_are_not_whole() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.jpg", "a.exr"] {
            let path = folder.path().join(name);
            write_film(&Film::new(33, 20), &Display::default(), &path).unwrap();
            assert!(is_whole_picture(&path), "{name}");
            let bytes = std::fs::read(&path).unwrap();
            for length in [bytes.len() - 1, bytes.len() - 9, bytes.len() / 2, 3, 0] {
                std::fs::write(&path, &bytes[..length]).unwrap();
                assert!(!is_whole_picture(&path), "{name}, {length} of {} bytes", bytes.len());
            }
            std::fs::remove_file(&path).unwrap();
            assert!(!is_whole_picture(&path), "{name}");
        }
    }
}
