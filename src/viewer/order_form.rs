//! The form of "Save image …" and "Render frames …": size, quality, format and place of what is to be rendered.

use crate::frame::{DenoiseFilter, Denoising, PictureFormat, Session, Status, Target, ViewMode, has_left_camera};
use crate::scene::FilmSize;
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::form_preview::FormPreview;
use crate::viewer::order::Order;
use crate::viewer::saver::{new_file, new_folder};
use crate::viewer::status;
use crate::viewer::time_line::Strip;
use egui::{
    Align2, Button, ComboBox, Context, DragValue, Grid, Key, Modifiers, RichText, TextureHandle, Ui, Vec2, Window,
};
use std::path::{Path, PathBuf};

/// Sizes beside those of the scene and of the window.
const SIZES: [(u32, u32); 4] = [(1920, 1080), (2560, 1440), (3840, 2160), (1080, 1080)];
const FORMATS: [(PictureFormat, &str, &str); 3] = [
    (PictureFormat::Png, "PNG", "as displayed, without loss"),
    (PictureFormat::Jpeg, "JPEG", "as displayed, small"),
    (PictureFormat::Exr, "EXR", "linear light, for other programs"),
];
const WIDTH: f32 = 330.0;
/// Of a side.
const MOST_PIXELS: u32 = 32_768;

/// What ends an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Limit {
    Error,
    Samples,
    Time,
}

/// What ends an image, and the values of each.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ending {
    limit: Limit,
    /// Per cent.
    error: f64,
    spp: u32,
    seconds: f64,
}

/// Of a saved image where the window has none that is better, per cent.
const NOISE: f64 = 1.0;

impl Default for Ending {
    fn default() -> Self {
        Self { limit: Limit::Error, error: NOISE, spp: 64, seconds: 60.0 }
    }
}

impl Ending {
    fn target(&self) -> Target {
        match self.limit {
            Limit::Error => Target { error: Some(self.error / 100.0), ..Target::default() },
            Limit::Samples => Target { spp: Some(self.spp), ..Target::default() },
            Limit::Time => Target { seconds: Some(self.seconds), ..Target::default() },
        }
    }

    /// What to expect of a limit of time or of samples.
    ///
    /// - `pace`: samples per pixel and second.
    fn expected(&self, pace: f64) -> Option<String> {
        match self.limit {
            Limit::Error => None,
            Limit::Samples => Some(format!("about {}", status::about(f64::from(self.spp) / pace))),
            Limit::Time if self.seconds * pace < 1.0 => Some("too short for one sample per pixel".to_owned()),
            Limit::Time => Some(format!("about {:.0} samples per pixel", self.seconds * pace)),
        }
    }

    fn show(&mut self, ui: &mut Ui) {
        for (limit, name, about) in [
            (Limit::Error, "noise", "until the noise of the saved image is as low as this"),
            (Limit::Samples, "samples", "so many samples per pixel"),
            (Limit::Time, "time", "so many seconds for each image"),
        ] {
            ui.selectable_value(&mut self.limit, limit, name).on_hover_text(about);
        }
        let value = match self.limit {
            Limit::Error => DragValue::new(&mut self.error).range(0.01..=50.0).speed(0.02).suffix(" %"),
            Limit::Samples => DragValue::new(&mut self.spp).range(1..=1_000_000).speed(1.0),
            Limit::Time => DragValue::new(&mut self.seconds).range(0.1..=1e6).speed(0.5).suffix(" s"),
        };
        ui.add(value.update_while_editing(false));
    }
}

/// What the form asks the window for.
pub enum Wish {
    Begin(Order),
    /// A place for it.
    Choose(DialogPurpose),
}

/// Frames of a turntable, unless another number is chosen: five seconds of 24.
const TURN: u32 = 120;

/// The form; it remembers what was chosen last.
pub struct OrderForm {
    is_open: bool,
    /// The scene that it was filled in for.
    scene: String,
    size: (u32, u32),
    /// Width over height that is kept when one of them is changed.
    ratio: Option<f64>,
    of_scene: (u32, u32),
    of_image: Ending,
    of_frames: Ending,
    /// Nobody has chosen yet what ends an image.
    is_usual: bool,
    denoised: bool,
    filter: DenoiseFilter,
    format: PictureFormat,
    file: PathBuf,
    /// Somebody has chosen the file.
    is_chosen: bool,
    folder: PathBuf,
    /// First and last frame; `None` for a single image.
    frames: Option<(u32, u32)>,
    /// The frames are those of a turn of the camera.
    is_turntable: bool,
    /// Whether the view has left the camera of the animation, if that moves one.
    left_camera: Option<bool>,
    problem: Option<String>,
}

impl Default for OrderForm {
    fn default() -> Self {
        Self {
            is_open: false,
            scene: String::new(),
            size: SIZES[0],
            ratio: None,
            of_scene: SIZES[0],
            of_image: Ending::default(),
            of_frames: Ending::default(),
            is_usual: true,
            denoised: true,
            filter: DenoiseFilter::default(),
            format: PictureFormat::Png,
            file: PathBuf::new(),
            is_chosen: false,
            folder: PathBuf::new(),
            frames: None,
            is_turntable: false,
            left_camera: None,
            problem: None,
        }
    }
}

impl OrderForm {
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Width and height of what is to be saved, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Opens the form for the scene of the session.
    ///
    /// - `frames`: what plays of its animation, or a turn around it if nothing moves, rather than one image; `folder`: of
    ///   files that are not chosen yet; `taken`: absolute paths that others are going to write.
    /// - `turns`: the view is turning around, which frames are to show too.
    pub fn open(&mut self, session: &Session, frames: bool, turns: bool, (folder, taken): (&Path, &[PathBuf])) {
        let world = session.world();
        let FilmSize { width, height } = world.get_resource::<FilmSize>().copied().unwrap_or_default();
        let look = world.resource::<ViewMode>().0;
        let scene = &session.status().scene;
        (self.of_scene, self.filter) = ((width, height), look.filter);
        if self.scene != *scene {
            let picture = session.picture();
            let size = larger(self.of_scene, (picture.width, picture.height));
            (self.scene, self.size, self.frames) = (scene.clone(), size, None);
            self.folder = PathBuf::new();
            self.denoised = look.denoising != Denoising::Raw;
        }
        // Frames of before are not mixed with new ones.
        if self.folder.as_os_str().is_empty() || self.folder.exists() {
            self.folder = new_folder(folder, scene);
        }
        self.frames = match frames {
            false => {
                self.is_turntable = false;
                None
            }
            true => {
                let strip = Strip::of(session).filter(|_| !turns);
                self.is_turntable = strip.is_none();
                Some(strip.map_or((0, TURN - 1), |Strip { plays: [first, last], .. }| (first, last)))
            }
        };
        // A saved image is no worse than what is seen, unless that has been chosen.
        let told = session.status();
        let seen = told.known_denoised_error().or(told.estimated_error).map_or(NOISE, |error| 100.0 * error);
        if !frames && self.is_usual {
            self.of_image.error = (seen.clamp(0.25, NOISE) * 100.0).floor() / 100.0;
        }
        // Each time another one, so that nothing is replaced by a second click.
        (self.file, self.is_chosen) = (new_file(folder, scene, self.format.extension(), taken), false);
        (self.is_open, self.problem) = (true, None);
    }

    /// Takes over the place that was chosen; a name with the extension of a format chooses that too.
    pub fn place(&mut self, purpose: DialogPurpose, path: PathBuf) {
        if purpose == DialogPurpose::SaveFrames {
            self.folder = path;
            return;
        }
        match PictureFormat::of(&path) {
            Ok(format) => (self.file, self.format, self.is_chosen) = (path, format, true),
            Err(_) => {
                // The name that is asked about has no extension.
                let mut name = path.file_name().unwrap_or_default().to_owned();
                name.push(".");
                name.push(self.format.extension());
                (self.file, self.is_chosen) = (path.with_file_name(name), false);
            }
        }
    }

    /// The path that is shown first in the dialog.
    pub fn path(&self) -> &Path {
        if self.frames.is_some() { &self.folder } else { &self.file }
    }

    fn ending(&mut self) -> &mut Ending {
        if self.frames.is_some() { &mut self.of_frames } else { &mut self.of_image }
    }

    fn order(&mut self) -> Order {
        Order {
            size: self.size,
            target: self.ending().target(),
            denoiser: self.denoised.then_some(self.filter),
            format: self.format,
            path: self.path().to_owned(),
            may_replace: self.is_chosen,
            frames: self.frames.map(|(first, last)| first..=last),
            is_turntable: self.is_turntable,
        }
    }

    /// Draws the form while it is open.
    ///
    /// - `preview`: a small image of what would be saved.
    pub fn show(&mut self, context: &Context, session: &Session, preview: Option<&TextureHandle>) -> Option<Wish> {
        if !self.is_open {
            return None;
        }
        let window = (session.picture().width, session.picture().height);
        self.left_camera = has_left_camera(session);
        let (mut wish, mut open) = (None, true);
        // A value that is typed and a list of sizes have their own Enter and Escape.
        let is_typed = context.wants_keyboard_input() || egui::Popup::is_any_open(context);
        let pressed = |key| !is_typed && context.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let (is_entered, is_left) = (pressed(Key::Enter), pressed(Key::Escape));
        let title = match self.frames {
            Some(_) if self.is_turntable => "Render a turntable",
            Some(_) => "Render frames",
            None => "Save image",
        };
        let width = WIDTH.min(context.content_rect().width() - 40.0).max(80.0);
        Window::new(title)
            .open(&mut open)
            .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
            .collapsible(false)
            .resizable(false)
            .show(context, |ui| {
                ui.set_width(width);
                let room = Vec2::new(width, FormPreview::HEIGHT);
                let frame = |ui: &mut Ui| match preview {
                    Some(preview) => drop(ui.image(preview)),
                    None => drop(ui.weak("…")),
                };
                ui.allocate_ui_with_layout(room, egui::Layout::centered_and_justified(egui::Direction::TopDown), frame);
                ui.add_space(4.0);
                Grid::new("order").num_columns(2).spacing([14.0, 7.0]).show(ui, |ui| {
                    self.rows(ui, window, pace_of(session.status()), &mut wish);
                });
                ui.add_space(6.0);
                if let Some(problem) = &self.problem {
                    ui.colored_label(crate::viewer::overlay::PROBLEM, problem);
                }
                // Within a row, which has a height of its own.
                ui.horizontal(|ui| {
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        let name = if self.frames.is_some() { "Render" } else { "Save" };
                        let begin = Button::new(RichText::new(name).strong()).min_size(Vec2::new(86.0, 26.0));
                        let begin = ui.add(begin).on_hover_text("in the background; the window stays usable");
                        if begin.clicked() || is_entered {
                            let order = self.order();
                            match order.check() {
                                Ok(()) => wish = Some(Wish::Begin(order)),
                                Err(problem) => self.problem = Some(problem),
                            }
                        }
                        if ui.add(Button::new("Cancel").min_size(Vec2::new(70.0, 26.0))).clicked() {
                            self.is_open = false;
                        }
                    });
                });
            });
        self.is_open &= open && !is_left && !matches!(wish, Some(Wish::Begin(_)));
        wish
    }

    /// - `pace`: samples of a pixel per second, if known.
    fn rows(&mut self, ui: &mut Ui, window: (u32, u32), pace: Option<f64>, wish: &mut Option<Wish>) {
        ui.label("size");
        ui.horizontal(|ui| {
            let before = self.size;
            for side in [&mut self.size.0, &mut self.size.1] {
                ui.add(DragValue::new(side).range(1..=MOST_PIXELS).speed(2.0).update_while_editing(false));
            }
            if let Some(ratio) = self.ratio {
                self.size = in_ratio(before, self.size, ratio);
            }
            let sizes = sizes(self.of_scene, window);
            let used = sizes.iter().find(|(_, size)| *size == self.size);
            let used = used.map_or("other".to_owned(), |(name, size)| match &name[..] {
                "" => as_text(*size),
                name => name.to_owned(),
            });
            ComboBox::from_id_salt("size").selected_text(used).width(130.0).show_ui(ui, |ui| {
                for (name, size) in sizes {
                    let colon = if name.is_empty() { "" } else { ": " };
                    if ui.selectable_value(&mut self.size, size, format!("{name}{colon}{}", as_text(size))).clicked() {
                        self.ratio = self.ratio.map(|_| ratio_of(size));
                    }
                }
            });
        });
        ui.end_row();
        ui.label("keep ratio");
        let mut keeps = self.ratio.is_some();
        if ui.checkbox(&mut keeps, "").on_hover_text("a side that is changed takes the other with it").clicked() {
            self.ratio = keeps.then(|| ratio_of(self.size));
        }
        ui.end_row();
        ui.label("until");
        ui.horizontal(|ui| {
            let before = self.of_image;
            self.ending().show(ui);
            self.is_usual &= self.of_image == before;
        });
        ui.end_row();
        let n_pixels = f64::from(self.size.0) * f64::from(self.size.1);
        if let Some(expected) = pace.and_then(|pace| self.ending().expected(pace / n_pixels)) {
            ui.label("");
            ui.weak(expected);
            ui.end_row();
        }
        ui.label("denoised");
        ui.checkbox(&mut self.denoised, "").on_hover_text("filter what noise is left");
        ui.end_row();
        ui.label("format");
        ui.horizontal(|ui| {
            for (format, name, about) in FORMATS {
                if ui.selectable_label(self.format == format, name).on_hover_text(about).clicked() {
                    self.format = format;
                    self.is_chosen &= !self.file.set_extension(format.extension());
                }
            }
        });
        ui.end_row();
        if let Some((first, last)) = &mut self.frames {
            ui.label("frames");
            ui.horizontal(|ui| {
                if self.is_turntable {
                    let mut n = *last - *first + 1;
                    ui.add(DragValue::new(&mut n).range(1..=100_000).speed(0.5).update_while_editing(false));
                    (*first, *last) = (0, n - 1);
                    return drop(ui.label("of one turn of the camera around what it looks at"));
                }
                ui.add(DragValue::new(first).speed(0.2).update_while_editing(false));
                ui.label("to");
                ui.add(DragValue::new(last).speed(0.2).update_while_editing(false));
            });
            ui.end_row();
            if let Some(has_left) = self.left_camera.filter(|_| !self.is_turntable) {
                ui.label("camera");
                let (text, about) = match has_left {
                    true => ("this view in all frames", "`Camera` on the time line goes back to that of the animation"),
                    false => ("of the animation", "until you move the view"),
                };
                ui.label(text).on_hover_text(about);
                ui.end_row();
            }
        }
        let (label, purpose) = match self.frames {
            Some(_) => ("folder", DialogPurpose::SaveFrames),
            None => ("file", DialogPurpose::SaveImage),
        };
        ui.label(label);
        ui.horizontal(|ui| {
            let path = self.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let full = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("Choose …").clicked() {
                    *wish = Some(Wish::Choose(purpose));
                }
                let folder = full.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
                let text = match &*folder {
                    "" => name,
                    folder => format!("{name} in {folder}"),
                };
                let text = egui::Label::new(crate::files::printable::name(&text).into_owned()).truncate();
                ui.add(text).on_hover_text(full.display().to_string());
            });
        });
        ui.end_row();
    }
}

/// Samples of a pixel per second that the window takes, once it has taken some.
fn pace_of(status: &Status) -> Option<f64> {
    let n_pixels = f64::from(status.film_width) * f64::from(status.film_height);
    let pace = n_pixels * f64::from(status.spp) / status.seconds;
    (status.spp > 0 && pace.is_finite() && pace > 0.0).then_some(pace)
}

fn as_text((width, height): (u32, u32)) -> String {
    format!("{width} × {height}")
}

/// The sizes to choose from, each once, and whose it is.
fn sizes(scene: (u32, u32), window: (u32, u32)) -> Vec<(String, (u32, u32))> {
    let named = match scene == window {
        true => vec![("scene and window", scene)],
        false => vec![("scene", scene), ("window", window)],
    };
    let others = SIZES.into_iter().filter(|size| *size != scene && *size != window).map(|size| ("", size));
    named.into_iter().chain(others).map(|(name, size)| (name.to_owned(), size)).collect()
}

fn ratio_of((width, height): (u32, u32)) -> f64 {
    f64::from(width) / f64::from(height.max(1))
}

/// A size of which one side has been changed, with the other one of this ratio.
fn in_ratio(before: (u32, u32), now: (u32, u32), ratio: f64) -> (u32, u32) {
    let side = |pixels: f64| pixels.round().clamp(1.0, f64::from(MOST_PIXELS)) as u32;
    match now {
        _ if now == before => now,
        (width, _) if width != before.0 => (width, side(f64::from(width) / ratio)),
        (_, height) => (side(f64::from(height) * ratio), height),
    }
}

/// The size of the scene, or that of the window where it has more pixels: an image is not coarser than what is seen.
fn larger(scene: (u32, u32), window: (u32, u32)) -> (u32, u32) {
    let pixels = |size: (u32, u32)| u64::from(size.0) * u64::from(size.1);
    if pixels(window) > pixels(scene) { window } else { scene }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::SessionOptions;
    use crate::scene::{LoadOptions, SceneSource, load};
    use std::time::Duration;

    #[test]
    fn an_image_is_not_coarser_than_the_window() {
        assert_eq!(larger((640, 360), (1280, 720)), (1280, 720));
        assert_eq!(larger((3840, 2160), (1280, 720)), (3840, 2160));
        assert_eq!(larger((640, 360), (0, 0)), (640, 360));
    }

    #[test]
    fn sides_keep_their_ratio() {
        let ratio = ratio_of((1920, 1080));
        assert_eq!(in_ratio((1920, 1080), (1920, 1080), ratio), (1920, 1080));
        assert_eq!(in_ratio((1920, 1080), (1280, 1080), ratio), (1280, 720));
        assert_eq!(in_ratio((1, 1), (1, 1080), ratio), (1920, 1080), "of what it was at first, not of what is rounded");
        assert_eq!(in_ratio((1920, 1080), (32_768, 1080), 0.01), (32_768, 32_768));
    }

    #[test]
    fn each_size_is_offered_once() {
        for (scene, window, n) in [
            ((640, 360), (1280, 720), 6),
            ((640, 360), (640, 360), 5),
            ((1920, 1080), (1280, 720), 5),
            ((1920, 1080), (3840, 2160), 4),
            ((1920, 1080), (1920, 1080), 4),
        ] {
            let sizes = sizes(scene, window);
            assert_eq!(sizes.len(), n, "{sizes:?}");
            assert!((0..n).all(|i| !sizes[..i].iter().any(|(_, size)| *size == sizes[i].1)), "{sizes:?}");
        }
    }

    #[test]
    fn frames_never_go_where_there_are_some() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::new(SessionOptions { width: 16, height: 16, ..SessionOptions::default() }).unwrap();
        session.adopt(load(&SceneSource::Builtin("studio".to_owned()), &LoadOptions::default()).unwrap());
        session.update(Duration::from_millis(1));
        let mut form = OrderForm::default();
        let mut proposed = || {
            form.open(&session, true, false, (folder.path(), &[]));
            assert!(form.is_turntable && form.order().frames == Some(0..=TURN - 1), "nothing moves");
            form.path().to_owned()
        };
        let first = proposed();
        assert_eq!((&first, proposed()), (&folder.path().join("studio-frames"), first.clone()));
        std::fs::create_dir(&first).unwrap();
        assert_eq!(proposed(), folder.path().join("studio-frames-2"));
        form.open(&session, false, true, (folder.path(), &[]));
        assert!(!form.order().is_turntable, "an image");
    }

    #[test]
    fn the_name_and_the_format_agree() {
        let mut form = OrderForm::default();
        form.place(DialogPurpose::SaveImage, PathBuf::from("/a/room.exr"));
        assert_eq!((form.file.clone(), form.format), (PathBuf::from("/a/room.exr"), PictureFormat::Exr));
        form.place(DialogPurpose::SaveImage, PathBuf::from("/a/room.v2"));
        assert_eq!(form.file, Path::new("/a/room.v2.exr"));
        assert!(!form.order().may_replace, "another name than the one that was asked about");
        assert_eq!(form.order().target.error, Some(0.01));
        form.of_image.limit = Limit::Samples;
        let order = form.order();
        assert_eq!((order.target.spp, order.target.error, order.frames), (Some(64), None, None));
        form.frames = Some((2, 9));
        assert_eq!(form.order().target.error, Some(0.01), "frames have a limit of their own");
        form.place(DialogPurpose::SaveFrames, PathBuf::from("/b"));
        assert_eq!((form.order().path, form.order().frames), (PathBuf::from("/b"), Some(2..=9)));
    }
}
