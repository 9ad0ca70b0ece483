//! Pictures on disk: developed as PNG, linear as EXR; whole or not at all.

use crate::render::{Display, Film, develop};
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// What kinds of pictures can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// 8 bits, sRGB, exposed and tone-mapped.
    Png,
    /// 32-bit floats, linear Rec. 709, as the film has it.
    Exr,
}

impl PictureFormat {
    /// The kind that a file name asks for.
    pub fn of(path: &Path) -> Result<Self, String> {
        match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some(other) => {
                Err(format!("{}: pictures of kind `.{other}` cannot be written: use .png or .exr", path.display()))
            }
            None => Err(format!("{}: the name says no kind of picture: end it in .png or .exr", path.display())),
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }
}

/// Finds out whether a picture can be written here, without leaving anything behind.
pub fn check_writable(path: &Path) -> Result<(), String> {
    PictureFormat::of(path)?;
    if path.is_dir() {
        return Err(format!("{}: is a folder: name a file", path.display()));
    }
    temporary_beside(path).map(drop)
}

/// Writes a film as its name asks: to a temporary name first, which then takes the place of `path`.
pub fn write_film(film: &Film, display: &Display, path: &Path) -> Result<(), String> {
    let size = (film.width(), film.height());
    let file = encode_beside(film, display, size, PictureFormat::of(path)?, path)?;
    file.persist(path).map_err(|error| unwritable(path, &error.error))?;
    Ok(())
}

/// Writes a film into `folder` as `STEM-0001`, or with the first higher number that is free: never over a file that is
/// there, even one that another program makes at the same moment. Answers with the path.
///
/// `size`: pixels of a PNG, which a coarser film is stretched to; linear light stays as it was measured.
pub fn write_new_film(
    film: &Film,
    display: &Display,
    size: (u32, u32),
    folder: &Path,
    stem: &str,
    format: PictureFormat,
) -> Result<PathBuf, String> {
    let name = |number: u32| folder.join(format!("{stem}-{number:04}.{}", format.extension()));
    let mut file = encode_beside(film, display, size, format, &name(1))?;
    for number in 1..=u32::MAX {
        let path = name(number);
        file = match file.persist_noclobber(&path) {
            Ok(_) => return Ok(path),
            Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => error.file,
            Err(error) => return Err(unwritable(&path, &error.error)),
        };
    }
    Err(format!("{}: every number is taken: move some of the pictures away", name(u32::MAX).display()))
}

/// The whole picture in a temporary file in the folder of `path`.
fn encode_beside(
    film: &Film,
    display: &Display,
    (width, height): (u32, u32),
    format: PictureFormat,
    path: &Path,
) -> Result<tempfile::NamedTempFile, String> {
    let mut out = BufWriter::new(temporary_beside(path)?);
    match format {
        PictureFormat::Png => {
            let mut rgba = Vec::new();
            develop(film, display, width, height, &mut rgba);
            let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
            PngEncoder::new(&mut out)
                .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
                .map_err(|error| unwritable(path, &error))?;
        }
        PictureFormat::Exr => {
            let bytes: Vec<u8> =
                film.means().iter().flat_map(|mean| mean.to_array()).flat_map(f32::to_ne_bytes).collect();
            // The encoder seeks, so it writes to memory first.
            let mut memory = std::io::Cursor::new(Vec::new());
            OpenExrEncoder::new(&mut memory)
                .write_image(&bytes, film.width(), film.height(), ExtendedColorType::Rgb32F)
                .map_err(|error| unwritable(path, &error))?;
            out.write_all(memory.get_ref()).map_err(|error| unwritable(path, &error))?;
        }
    }
    let file = out.into_inner().map_err(|error| unwritable(path, error.error()))?;
    file.as_file().sync_all().map_err(|error| unwritable(path, &error))?;
    Ok(file)
}

fn unwritable(path: &Path, error: &dyn std::fmt::Display) -> String {
    format!("{}: cannot be written: {error}", path.display())
}

fn temporary_beside(path: &Path) -> Result<tempfile::NamedTempFile, String> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".firstlight-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file: the user's mask decides.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            format!("{}: cannot be written: there is no folder {}", path.display(), folder.display())
        }
        _ => format!("{}: cannot be written: {error}", path.display()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_pictures_take_free_names_and_leave_the_rest_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (film, display) = (Film::new(5, 3), Display::default());
        std::fs::write(folder.path().join("gallery-0002.png"), "not ours").unwrap();
        let save = |format| write_new_film(&film, &display, (10, 6), folder.path(), "gallery", format).unwrap();
        let first = save(PictureFormat::Png);
        assert_eq!(first, folder.path().join("gallery-0001.png"));
        assert_eq!(save(PictureFormat::Png), folder.path().join("gallery-0003.png"));
        assert_eq!(save(PictureFormat::Exr), folder.path().join("gallery-0001.exr"));
        assert_eq!(std::fs::read(folder.path().join("gallery-0002.png")).unwrap(), b"not ours");
        assert_eq!(image::image_dimensions(first).unwrap(), (10, 6));
        let linear = image::image_dimensions(folder.path().join("gallery-0001.exr")).unwrap();
        assert_eq!(linear, (5, 3));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4, "nothing temporary is left");
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let folder = tempfile::tempdir().unwrap().path().join("gone");
        let error = write_new_film(&Film::new(1, 1), &Display::default(), (1, 1), &folder, "a", PictureFormat::Png)
            .unwrap_err();
        assert!(error.contains("there is no folder") && error.contains("gone"), "{error}");
    }
}
