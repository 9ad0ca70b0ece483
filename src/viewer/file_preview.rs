//! A small image of the file that is selected in the browser, read on a thread of its own.

use crate::scene::{FileKind, InputFile};
use egui::{ColorImage, Context, TextureHandle, TextureOptions, Ui};
use image::{GenericImageView, ImageReader};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

/// A small image of the selected file.
#[derive(Default)]
pub struct FilePreview {
    path: Option<PathBuf>,
    /// The file that is shown before one is selected.
    first: Option<PathBuf>,
    awaited: Option<Receiver<Option<Small>>>,
    shown: Option<(TextureHandle, [u32; 2])>,
}

/// A small image, and the size of the whole one, pixels.
type Small = (ColorImage, [u32; 2]);

impl FilePreview {
    /// Points.
    pub const WIDTH: f32 = 170.0;
    /// Of a window that has room for it, points.
    pub const LEAST_WINDOW: f32 = 900.0;

    /// - `first`: the file that is shown before one is selected.
    pub fn new(first: Option<PathBuf>) -> Self {
        Self { first, ..Self::default() }
    }

    /// Draws the image of the selected file, if it is one.
    pub fn show(&mut self, ui: &mut Ui, selected: Option<&Path>) {
        let path = selected.map(Path::to_path_buf).or_else(|| self.first.clone());
        if self.path != path {
            let awaited = path.as_deref().filter(|path| is_image(path)).and_then(|path| read_beside(path, ui.ctx()));
            *self = Self { path, awaited, first: self.first.take(), shown: None };
        }
        if let Some(name) = self.path.as_ref().filter(|_| selected.is_none()).and_then(|path| path.file_name()) {
            ui.label(crate::files::printable::name(&name.to_string_lossy()));
        }
        if let Some(found) = self.awaited.as_ref().and_then(|awaited| awaited.try_recv().ok()) {
            let load = |(image, size)| (ui.ctx().load_texture("file preview", image, TextureOptions::LINEAR), size);
            (self.awaited, self.shown) = (None, found.map(load));
        }
        match &self.shown {
            Some((texture, [width, height])) => {
                ui.add(egui::Image::new(texture).max_width(ui.available_width()));
                ui.weak(format!("{width} × {height}"));
            }
            None if self.awaited.is_some() => drop(ui.weak("…")),
            None => drop(ui.weak("no image is selected")),
        }
    }
}

fn is_image(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    ["png", "jpg", "jpeg"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}

/// Reads an image on a thread of its own; `None` if the system has none.
fn read_beside(path: &Path, context: &Context) -> Option<Receiver<Option<Small>>> {
    let (sender, receiver) = channel();
    let (path, context) = (path.to_path_buf(), context.clone());
    let work = move || {
        // If another file is selected meanwhile, nobody waits for it.
        let _ = sender.send(small(&path));
        context.request_repaint();
    };
    std::thread::Builder::new().name("file preview".to_owned()).spawn(work).ok()?;
    Some(receiver)
}

/// The image of a file, twice as sharp as it is shown; `None` if it cannot be read.
fn small(path: &Path) -> Option<Small> {
    let bytes = InputFile::open(path, FileKind::Image).ok()?.bytes().ok()?;
    let image = ImageReader::new(Cursor::new(&bytes)).with_guessed_format().ok()?.decode().ok()?;
    let (width, height) = image.dimensions();
    let side = 2 * FilePreview::WIDTH as u32;
    let image = image.thumbnail(side.min(width), side.min(height)).to_rgba8();
    let size = [image.width() as usize, image.height() as usize];
    Some((ColorImage::from_rgba_unmultiplied(size, image.as_raw()), [width, height]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_small_and_others_have_none() {
        let folder = tempfile::tempdir().unwrap();
        let [wide, text] = ["wide.PNG", "text.png"].map(|name| folder.path().join(name));
        let pixels = image::RgbImage::from_pixel(1000, 200, image::Rgb([200, 100, 50]));
        pixels.save_with_format(&wide, image::ImageFormat::Png).unwrap();
        std::fs::write(&text, "text").unwrap();
        let (image, size) = small(&wide).unwrap();
        assert_eq!((image.size, size), ([340, 68], [1000, 200]));
        assert_eq!(image.pixels[0], egui::Color32::from_rgb(200, 100, 50));
        assert!(is_image(&wide) && !is_image(Path::new("room.ron")));
        assert!(small(&text).is_none() && small(folder.path()).is_none());
    }
}
