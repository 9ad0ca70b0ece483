//! Small images for menus and lists: of built-in scenes, of ready materials, and of recent scenes.
//!
//! Those of recent scenes are kept beside the settings, one file for each scene in the list of recent ones, which goes
//! with its entry. What cannot be read or written is left out.

use crate::files::whole_file::write_whole;
use crate::frame::Picture;
use crate::scene::{BUILTIN_SCENES, FileKind, Fingerprint, InputFile, LIBRARY_IMAGE, SCENES_IMAGE, library};
use egui::{Color32, ColorImage, Context, Image, Rect, TextureHandle, TextureOptions, Vec2, pos2, vec2};
use image::{ImageFormat, RgbImage, imageops};
use std::cell::RefCell;
use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Points.
const SHOWN: Vec2 = vec2(35.0, 22.0);
/// Width and height in pixels: sharp on a screen of four dots for each point.
const SIZE: (u32, u32) = (140, 88);

/// The images, each uploaded when it is shown first.
pub struct Thumbnails {
    folder: Option<PathBuf>,
    /// By the name of the scene; `None` where there is no image.
    textures: RefCell<HashMap<String, Option<TextureHandle>>>,
    builtin: RefCell<Option<TextureHandle>>,
    materials: RefCell<Option<TextureHandle>>,
    nothing: RefCell<Option<TextureHandle>>,
}

impl Thumbnails {
    /// - `settings`: the folder of the settings.
    pub fn beside(settings: Option<&Path>) -> Self {
        let folder = settings.map(|folder| folder.join("thumbnails"));
        let (textures, builtin, materials, nothing) = Default::default();
        Self { folder, textures, builtin, materials, nothing }
    }

    fn path(&self, name: &str) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{}.png", Fingerprint::of(name.as_bytes()))))
    }

    /// Keeps an image for the scene of this name.
    pub fn keep(&self, name: &str, picture: &Picture) {
        let Some((path, image)) = self.path(name).zip(small(picture)) else { return };
        let mut bytes = Cursor::new(Vec::new());
        let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|error| error.to_string());
        let encoded = image.write_to(&mut bytes, ImageFormat::Png).map_err(|error| error.to_string());
        let written = folder.and(encoded).and_then(|()| Ok(write_whole(&path, bytes.get_ref())?));
        match written {
            Ok(()) => drop(self.textures.borrow_mut().remove(name)),
            Err(error) => log::warn!("{}: {error}", path.display()),
        }
    }

    /// Removes the images of all scenes but these.
    pub fn retain(&self, names: &[String]) {
        let Some(folder) = &self.folder else { return };
        let kept: Vec<PathBuf> = names.iter().filter_map(|name| self.path(name)).collect();
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            if !kept.contains(&entry.path()) {
                // Another window may have removed it.
                let _ = std::fs::remove_file(entry.path());
            }
        }
        self.textures.borrow_mut().retain(|name, _| names.contains(name));
    }

    /// The image of a scene; a dark one where none has been kept.
    pub fn image(&self, context: &Context, name: &str) -> Image<'static> {
        if let Some(index) = BUILTIN_SCENES.iter().position(|(known, ..)| *known == name) {
            return self.builtin(context, index);
        }
        let mut textures = self.textures.borrow_mut();
        let known = textures.entry(name.to_owned()).or_insert_with(|| {
            let image = self.read(name)?;
            Some(load(context, "thumbnail", &image))
        });
        let dark = || {
            let pixel = ColorImage::filled([1, 1], Color32::from_gray(44));
            context.load_texture("no thumbnail", pixel, TextureOptions::LINEAR)
        };
        let texture = known.clone().unwrap_or_else(|| self.nothing.borrow_mut().get_or_insert_with(dark).clone());
        Image::new((texture.id(), SHOWN))
    }

    /// The image of a built-in scene.
    pub fn builtin(&self, context: &Context, index: usize) -> Image<'static> {
        let mut all = self.builtin.borrow_mut();
        let all = all.get_or_insert_with(|| load_encoded(context, "images of scenes", SCENES_IMAGE));
        Image::new((all.id(), SHOWN)).uv(part(index, BUILTIN_SCENES.len()))
    }

    /// The sphere of a ready material, by its place in the library.
    ///
    /// - `side`: points.
    pub fn material(&self, context: &Context, index: usize, side: f32) -> Image<'static> {
        let mut all = self.materials.borrow_mut();
        let all = all.get_or_insert_with(|| load_encoded(context, "material spheres", LIBRARY_IMAGE));
        Image::new((all.id(), vec2(side, side))).uv(part(index, library().len()))
    }

    fn read(&self, name: &str) -> Option<RgbImage> {
        let bytes = InputFile::open(&self.path(name)?, FileKind::Settings).ok()?.bytes().ok()?;
        let reader = image::ImageReader::with_format(Cursor::new(&bytes), ImageFormat::Png);
        // Another program may have put anything there.
        (reader.into_dimensions().ok()? == SIZE).then_some(())?;
        Some(image::load_from_memory_with_format(&bytes, ImageFormat::Png).ok()?.to_rgb8())
    }
}

/// The part of a row of `n` images that shows one of them.
fn part(index: usize, n: usize) -> Rect {
    let left = |i: usize| i as f32 / n as f32;
    Rect::from_min_max(pos2(left(index), 0.0), pos2(left(index + 1), 1.0))
}

fn load_encoded(context: &Context, name: &str, bytes: &[u8]) -> TextureHandle {
    let image = image::load_from_memory(bytes).map(|image| image.to_rgb8()).unwrap_or_default();
    load(context, name, &image)
}

fn load(context: &Context, name: &str, image: &RgbImage) -> TextureHandle {
    let size = [image.width() as usize, image.height() as usize];
    context.load_texture(name, ColorImage::from_rgb(size, image.as_raw()), TextureOptions::LINEAR)
}

/// The middle of an image in the shape of a thumbnail; `None` without an image.
fn small(picture: &Picture) -> Option<RgbImage> {
    let rgb = picture.rgba.chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect();
    let image = RgbImage::from_raw(picture.width, picture.height, rgb).filter(|image| !image.is_empty())?;
    let (width, height) = (picture.width, picture.height);
    let wide = (u64::from(height) * u64::from(SIZE.0) / u64::from(SIZE.1)) as u32;
    let high = (u64::from(width) * u64::from(SIZE.1) / u64::from(SIZE.0)) as u32;
    let (wide, high) = (wide.clamp(1, width), high.clamp(1, height));
    let middle = imageops::crop_imm(&image, (width - wide) / 2, (height - high) / 2, wide, high);
    Some(imageops::thumbnail(&*middle, SIZE.0, SIZE.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::ImageSource;

    #[test]
    fn there_is_a_picture_of_each_built_in_scene() {
        let pictures = image::load_from_memory(SCENES_IMAGE).unwrap();
        assert_eq!(pictures.width() % BUILTIN_SCENES.len() as u32, 0);
        assert_eq!(pictures.width() / BUILTIN_SCENES.len() as u32 * 5, pictures.height() * 8);
    }

    #[test]
    fn a_recent_scene_has_the_middle_of_its_image_until_its_entry_goes() {
        let folder = tempfile::tempdir().unwrap();
        let thumbnails = Thumbnails::beside(Some(folder.path()));
        // Red with a blue edge at the left, which is cut.
        let pixels = (0..300 * 100).map(|i| if i % 300 < 60 { [0, 0, 255, 255] } else { [255, 0, 0, 255] });
        let picture = Picture { rgba: pixels.flatten().collect(), width: 300, height: 100, ..Picture::default() };
        let names = ["/a/room.ron".to_owned(), "/b/room.ron".to_owned()];
        for name in &names {
            thumbnails.keep(name, &picture);
            let image = thumbnails.read(name).unwrap();
            assert!(image.dimensions() == SIZE && image.pixels().all(|pixel| pixel.0 == [255, 0, 0]));
        }
        let context = Context::default();
        let id_of = |name: &str| match thumbnails.image(&context, name).source(&context) {
            ImageSource::Texture(texture) => Some(texture.id),
            _ => None,
        };
        assert!(id_of(&names[0]).is_some() && id_of(&names[0]) != id_of("/c") && id_of("/c") == id_of("/d"));
        thumbnails.retain(&names[1..]);
        assert!(thumbnails.read(&names[0]).is_none() && thumbnails.read(&names[1]).is_some());
        // What is no thumbnail is not shown, and nothing is kept of an image that is not there.
        std::fs::write(thumbnails.path(&names[1]).unwrap(), "no image").unwrap();
        assert!(thumbnails.read(&names[1]).is_none());
        assert!(small(&Picture::default()).is_none());
    }
}
