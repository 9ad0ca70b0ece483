//! Images and frames that are rendered in the background while the window stays usable: their threads, their progress,
//! and ending them.
//!
//! They have threads of their own, which work half of the time while the view moves, so that the window is answered first.

use crate::frame::{Reel, Waker};
use crate::render::{RenderSettings, worker_threads};
use crate::viewer::order::{Advance, Order, Subject};
use crate::viewer::overlay::{self, GLASS, TEXT_SIZE};
use crate::viewer::status::percent;
use egui::{Align2, Area, Context, CornerRadius, Frame, Margin, Order as Layer, Rect, RichText};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a worker rests each time that it looks whether it is to, while the view moves.
const REST: Duration = Duration::from_millis(2);
const WIDTH: f32 = 250.0;

/// What an image is rendered from.
pub enum Source {
    /// The image as it was seen when it was asked for.
    Still(Box<Subject>),
    /// The frames of an animation, with the settings of each.
    Frames(Box<Reel>, RenderSettings),
}

/// What became of an order: the file or the folder, and the message for the user.
pub type Outcome = Result<(PathBuf, String), String>;

/// Orders that are being carried out.
pub struct Renders {
    running: Vec<Running>,
    /// The view moves.
    moving: Arc<AtomicBool>,
    /// The window is closed: images are written as far as they are.
    ending: Arc<AtomicBool>,
    waker: Waker,
    sender: Sender<Outcome>,
    receiver: Receiver<Outcome>,
}

struct Running {
    title: String,
    told: Arc<Mutex<Told>>,
    cancelled: Arc<AtomicBool>,
    since: Instant,
    thread: JoinHandle<()>,
}

/// Progress, as the thread tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Told {
    share: f64,
    spp: u32,
    error: Option<f64>,
    /// The frame, counted from 1, and their number.
    frame: Option<(u32, u32)>,
}

impl Renders {
    /// - `waker`: called when there is progress.
    pub fn new(waker: Waker) -> Self {
        let (sender, receiver) = channel();
        Self { running: Vec::new(), moving: Arc::default(), ending: Arc::default(), waker, sender, receiver }
    }

    pub fn is_empty(&self) -> bool {
        self.running.is_empty()
    }

    /// Says whether the view moves.
    pub fn set_moving(&self, moving: bool) {
        self.moving.store(moving, Ordering::Relaxed);
    }

    /// Starts to carry out an order.
    ///
    /// - `stem`: of the names of frames.
    ///
    /// # Errors
    /// If the system has no thread for it.
    pub fn begin(&mut self, order: Order, source: Source, stem: String, threads: usize) -> Result<(), String> {
        let (told, cancelled) = (Arc::new(Mutex::new(Told::default())), Arc::new(AtomicBool::default()));
        let work = Work {
            told: told.clone(),
            cancelled: cancelled.clone(),
            moving: self.moving.clone(),
            ending: self.ending.clone(),
            waker: self.waker.clone(),
        };
        let path = std::path::absolute(&order.path).unwrap_or_else(|_| order.path.clone());
        let title = path.file_name().map_or_else(|| stem.clone(), |name| name.to_string_lossy().into_owned());
        let (sender, waker) = (self.sender.clone(), self.waker.clone());
        let saved = path.clone();
        let run = move || {
            let outcome = match worker_threads().num_threads(threads).build() {
                Ok(pool) => pool.install(|| work.run(&Order { path, ..order }, source, &stem)),
                Err(error) => Err(format!("cannot start threads: {error}")),
            };
            // If the window is gone, nobody is told.
            if let Some(outcome) = outcome.transpose() {
                let outcome = outcome.map(|news| (saved, news));
                let _ = sender.send(outcome.map_err(|reason| format!("the image was not saved: {reason}")));
            }
            waker();
        };
        let thread = std::thread::Builder::new().name("save".to_owned()).spawn(run);
        let thread = thread.map_err(|error| format!("the image was not saved: cannot start a thread: {error}"))?;
        self.running.push(Running { title, told, cancelled, since: Instant::now(), thread });
        Ok(())
    }

    /// The results since the last call.
    pub fn finished(&mut self) -> Vec<Outcome> {
        self.running.retain(|running| !running.thread.is_finished());
        self.receiver.try_iter().collect()
    }

    /// Ends all of them, and waits; what an image has by then is saved.
    pub fn finish(&mut self) -> Vec<Outcome> {
        self.ending.store(true, Ordering::Relaxed);
        for running in self.running.drain(..) {
            // A panic has been printed by the thread itself.
            let _ = running.thread.join();
        }
        self.receiver.try_iter().collect()
    }

    /// Draws the progress at the lower right of `free`, each with a button that ends it.
    pub fn show(&self, context: &Context, free: Rect) {
        for (i, running) in self.running.iter().enumerate() {
            let told = *running.told.lock().unwrap_or_else(PoisonError::into_inner);
            let corner = free.right_bottom() - egui::vec2(10.0, 8.0 + 74.0 * i as f32);
            let area = Area::new(egui::Id::new(("render", i))).order(Layer::Foreground);
            area.fixed_pos(corner).pivot(Align2::RIGHT_BOTTOM).show(context, |ui| {
                let frame = Frame::NONE.fill(GLASS).corner_radius(CornerRadius::same(4));
                frame.inner_margin(Margin::symmetric(9, 6)).show(ui, |ui| {
                    ui.set_width(WIDTH.min(0.6 * free.width()));
                    ui.horizontal(|ui| {
                        ui.label(RichText::new(format!("Rendering {}", running.title)).size(TEXT_SIZE).strong());
                        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                            if ui.button("Cancel").on_hover_text("stop; nothing of it is saved").clicked() {
                                running.cancelled.store(true, Ordering::Relaxed);
                            }
                        });
                    });
                    overlay::progress(ui, ui.available_width(), told.share as f32);
                    let text = told.line(running.since.elapsed().as_secs_f64());
                    ui.label(RichText::new(text).size(TEXT_SIZE - 1.0));
                });
            });
        }
    }
}

impl Told {
    /// - `seconds`: since the order began.
    fn line(&self, seconds: f64) -> String {
        let mut parts = Vec::new();
        if let Some((frame, n)) = self.frame {
            parts.push(format!("frame {frame} of {n}"));
        }
        match (self.error, self.spp) {
            (Some(error), _) if self.frame.is_none() => parts.push(format!("noise {}", percent(error))),
            (_, spp) if spp > 0 && self.frame.is_none() => parts.push(format!("{spp} samples per pixel")),
            (_, 0) if parts.is_empty() => parts.push("preparing".to_owned()),
            _ => {}
        }
        // The first guesses would be wild, and what follows the samples takes its own time.
        if self.share >= 1.0 {
            parts.push("finishing".to_owned());
        } else if self.share > 0.02 && seconds > 1.0 {
            parts.push(format!("{} to go", crate::viewer::status::about(seconds * (1.0 / self.share - 1.0))));
        }
        parts.join(", ")
    }
}

/// What the thread of an order holds.
struct Work {
    told: Arc<Mutex<Told>>,
    cancelled: Arc<AtomicBool>,
    moving: Arc<AtomicBool>,
    ending: Arc<AtomicBool>,
    waker: Waker,
}

impl Work {
    /// Whether the samples are to end. While the view moves, each worker rests here.
    fn stops(&self) -> bool {
        let stops = self.cancelled.load(Ordering::Relaxed) || self.ending.load(Ordering::Relaxed);
        if !stops && self.moving.load(Ordering::Relaxed) {
            std::thread::sleep(REST);
        }
        stops
    }

    fn tell(&self, told: Told) {
        *self.told.lock().unwrap_or_else(PoisonError::into_inner) = told;
        (self.waker)();
    }

    /// Returns the message at the end; `None` for what was cancelled.
    fn run(&self, order: &Order, source: Source, stem: &str) -> Result<Option<String>, String> {
        match source {
            Source::Still(subject) => {
                let tell = |now: Advance| {
                    self.tell(Told { share: now.share, spp: now.spp, error: now.error, frame: None });
                };
                let cancelled = || self.cancelled.load(Ordering::Relaxed);
                let Some(finished) = order.render_unless(&cancelled, &subject, &|| self.stops(), tell)? else {
                    return Ok(None);
                };
                Ok(Some(format!("saved {} ({})", order.path.display(), finished.describe(order.size))))
            }
            Source::Frames(reel, settings) => self.frames(order, *reel, settings, stem),
        }
    }

    fn frames(
        &self,
        order: &Order,
        reel: Reel,
        settings: RenderSettings,
        stem: &str,
    ) -> Result<Option<String>, String> {
        let Some(frames) = order.frames.clone() else { return Ok(None) };
        let (n, first, fps) = (frames.end() - frames.start() + 1, *frames.start(), reel.fps());
        std::fs::create_dir_all(&order.path).map_err(|error| format!("{}: {error}", order.path.display()))?;
        let mut reel = reel.open()?;
        let is_ended = || self.cancelled.load(Ordering::Relaxed) || self.ending.load(Ordering::Relaxed);
        let mut saved = 0;
        for number in frames {
            let done = number - first;
            let (extraction, draft) = reel.at(f64::from(number) / fps)?;
            let subject = Subject { scene: extraction.prepared, settings, draft };
            let tell = |now: Advance| {
                let share = (f64::from(done) + now.share) / f64::from(n);
                self.tell(Told { share, spp: now.spp, error: now.error, frame: Some((done + 1, n)) });
            };
            let one = Order { path: order.frame_path(stem, number), ..order.clone() };
            // Half a frame is none.
            if one.render_unless(&is_ended, &subject, &|| self.stops(), tell)?.is_none() {
                break;
            }
            saved += 1;
        }
        let folder = order.path.display();
        Ok(Some(match saved {
            1 if n == 1 => format!("saved 1 frame in {folder}"),
            saved if saved == n => format!("saved {n} frames in {folder}"),
            saved => format!("saved {saved} of {n} frames in {folder}"),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_told_in_words() {
        let told = Told { share: 0.25, spp: 16, error: Some(0.04), frame: None };
        assert_eq!(told.line(20.0), "noise 4.0 %, about 60 s to go");
        assert_eq!(Told { frame: Some((3, 60)), ..told }.line(20.0), "frame 3 of 60, about 60 s to go");
        assert_eq!(Told { error: None, share: 0.01, ..told }.line(20.0), "16 samples per pixel");
        assert_eq!(Told { error: None, share: 1.0, ..told }.line(20.0), "16 samples per pixel, finishing");
        assert_eq!(Told::default().line(0.1), "preparing");
    }

    #[test]
    fn frames_of_an_animation_are_rendered_to_a_folder_and_cancelling_keeps_what_is_whole() {
        use crate::frame::{DenoiseFilter, PictureFormat, Session, SessionOptions, Target};
        use crate::scene::{ImageMetadata, LoadOptions, SceneSource, load};
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::new(SessionOptions { width: 32, height: 24, ..SessionOptions::default() }).unwrap();
        let source = SceneSource::Builtin("carousel".to_owned());
        session.adopt(load(&source, &LoadOptions::default()).unwrap());
        session.update(Duration::from_millis(1));
        let settings = session.rendered().unwrap().1;
        let mut renders = Renders::new(Arc::new(|| ()));
        let order = Order {
            size: (32, 24),
            target: Target { spp: Some(1), ..Target::default() },
            denoiser: None::<DenoiseFilter>,
            format: PictureFormat::Png,
            path: folder.path().join("new"),
            frames: Some(3..=5),
        };
        let reel = Reel::of(&mut session).unwrap();
        let frames = Source::Frames(Box::new(reel), settings);
        renders.begin(order.clone(), frames, "c".to_owned(), 1).unwrap();
        let outcome = loop {
            if let Some(outcome) = renders.finished().pop() {
                break outcome.unwrap().1;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        assert!(outcome.starts_with("saved 3 frames in ") && outcome.ends_with("new"), "{outcome}");
        let read = |number: u32| std::fs::read(order.frame_path("c", number)).unwrap();
        assert!(read(3) != read(5), "it moves");
        // As the command `render --frames` makes them: the image has the moment.
        let shot = ImageMetadata::read(&order.frame_path("c", 4)).unwrap();
        assert!(shot.text.is_some_and(|text| text.contains("at: ")));
        let again = load(&SceneSource::Picture(order.frame_path("c", 4)), &LoadOptions::default()).unwrap();
        assert!(again.warnings.iter().next().is_none(), "{:?}", again.warnings.iter().next().map(ToString::to_string));
        // A window that closes ends it.
        let reel = Reel::of(&mut session).unwrap();
        let long = Order { frames: Some(0..=100_000), path: folder.path().join("long"), ..order };
        renders.begin(long, Source::Frames(Box::new(reel), settings), "c".to_owned(), 1).unwrap();
        let outcome = renders.finish().pop().unwrap().unwrap().1;
        assert!(outcome.contains("of 100001 frames"), "{outcome}");
    }
}
