//! Pictures on disk: developed as PNG, linear as EXR; whole or not at all.

use crate::render::{Display, Film, develop};
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::{BufWriter, Write};
use std::path::Path;

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
    let format = PictureFormat::of(path)?;
    let fail = |error: &dyn std::fmt::Display| format!("{}: cannot be written: {error}", path.display());
    let file = temporary_beside(path)?;
    let mut out = BufWriter::new(file);
    let (width, height) = (film.width(), film.height());
    match format {
        PictureFormat::Png => {
            let mut rgba = Vec::new();
            develop(film, display, width, height, &mut rgba);
            let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
            PngEncoder::new(&mut out)
                .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
                .map_err(|error| fail(&error))?;
        }
        PictureFormat::Exr => {
            let bytes: Vec<u8> =
                film.means().iter().flat_map(|mean| mean.to_array()).flat_map(f32::to_ne_bytes).collect();
            // The encoder seeks, so it writes to memory first.
            let mut memory = std::io::Cursor::new(Vec::new());
            OpenExrEncoder::new(&mut memory)
                .write_image(&bytes, width, height, ExtendedColorType::Rgb32F)
                .map_err(|error| fail(&error))?;
            out.write_all(memory.get_ref()).map_err(|error| fail(&error))?;
        }
    }
    let file = out.into_inner().map_err(|error| fail(error.error()))?;
    file.as_file().sync_all().map_err(|error| fail(&error))?;
    file.persist(path).map_err(|error| fail(&error.error))?;
    Ok(())
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
