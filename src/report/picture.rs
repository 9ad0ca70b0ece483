//! Linear images in memory and as OpenEXR files.

use crate::render::Film;
use crate::scene::{Limits, decode_picture, picture_reader};
use glam::Vec3;
use std::path::Path;

/// Mean radiance per pixel, row by row from the top; linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPicture {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<Vec3>,
}

impl LinearPicture {
    pub fn of(film: &Film) -> Self {
        Self { width: film.width(), height: film.height(), pixels: film.means() }
    }

    /// Reads an OpenEXR image with red, green and blue.
    ///
    /// # Errors
    /// If the file cannot be read, is not such an image, or holds a number that is not finite.
    pub fn read_exr(path: &Path) -> Result<Self, String> {
        let fail = |reason: String| format!("{}: {reason}", path.display());
        let limits = Limits::of_this_process();
        let reader = picture_reader(path, &limits).map_err(|error| fail(error.into()))?;
        if reader.format() != Some(image::ImageFormat::OpenExr) {
            let reason = "is not an OpenEXR image: a reference must be .exr (linear light)";
            return Err(fail(reason.to_owned()));
        }
        let picture = decode_picture(reader, &limits).map_err(|error| fail(error.into()))?.into_rgb32f();
        let (width, height) = picture.dimensions();
        let pixels: Vec<Vec3> = picture.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
        if let Some(at) = pixels.iter().position(|pixel| !pixel.is_finite()) {
            let (x, y) = (at as u32 % width, at as u32 / width);
            return Err(fail(format!("cannot be used: pixel {x}, {y} is {}, which is not finite", pixels[at])));
        }
        Ok(Self { width, height, pixels })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::write_film;
    use crate::render::Display;

    #[test]
    fn what_is_no_linear_picture_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (png, exr) = (folder.path().join("a.png"), folder.path().join("a.exr"));
        for path in [&png, &exr] {
            write_film(&Film::new(5, 3), &Display::default(), path).unwrap();
        }
        let read = LinearPicture::read_exr(&exr).unwrap();
        assert_eq!(read, LinearPicture { width: 5, height: 3, pixels: vec![Vec3::ZERO; 15] });
        assert!(LinearPicture::read_exr(&png).unwrap_err().contains("not an OpenEXR image"));
        std::fs::write(&exr, b"text").unwrap();
        assert!(LinearPicture::read_exr(&exr).is_err());
        assert!(LinearPicture::read_exr(&folder.path().join("none.exr")).unwrap_err().contains("none.exr"));
    }
}
