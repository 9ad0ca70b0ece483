//! Images and frames that are rendered in the background while the window stays usable: their threads, their progress,
//! and ending them.
//!
//! They have threads of their own, which work half of the time while the view moves, so that the window is answered first.

use crate::frame::{Reel, Waker};
use crate::render::{RenderSettings, worker_threads};
use crate::viewer::order::{Advance, Order, Subject};
use crate::viewer::overlay::{self, GLASS, TEXT_SIZE};
use crate::viewer::status::{percent, samples};
use egui::{Align2, Area, Button, Context, CornerRadius, Frame, Label, Margin, Order as Layer, Rect, RichText, Ui};
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
    path: PathBuf,
    told: Arc<Mutex<Told>>,
    cancelled: Arc<AtomicBool>,
    /// What there is by now is to be written.
    kept: Arc<AtomicBool>,
    /// The error to be reached.
    goal: Option<f64>,
    since: Instant,
    thread: JoinHandle<()>,
}

/// Progress, as the thread tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Told {
    share: f64,
    /// The largest share so far: what was done stays done.
    most: f64,
    spp: u32,
    error: Option<f64>,
    is_flat: bool,
    /// When the samples were done, if the image is being denoised.
    sampled_at: Option<Instant>,
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
        let (told, goal) = (Arc::new(Mutex::new(Told::default())), order.target.error);
        let (cancelled, kept) = (Arc::new(AtomicBool::default()), Arc::new(AtomicBool::default()));
        let work = Work {
            told: told.clone(),
            cancelled: cancelled.clone(),
            kept: kept.clone(),
            moving: self.moving.clone(),
            ending: self.ending.clone(),
            waker: self.waker.clone(),
        };
        let path = std::path::absolute(&order.path).unwrap_or_else(|_| order.path.clone());
        let title = path.file_name().map_or_else(|| stem.clone(), |name| name.to_string_lossy().into_owned());
        let (sender, waker, written) = (self.sender.clone(), self.waker.clone(), path.clone());
        let run = move || {
            let outcome = match worker_threads().num_threads(threads).build() {
                Ok(pool) => pool.install(|| work.run(&Order { path: written, ..order }, source, &stem)),
                Err(error) => Err(format!("cannot start threads: {error}")),
            };
            // If the window is gone, nobody is told.
            if let Some(outcome) = outcome.transpose() {
                let _ = sender.send(outcome.map_err(|reason| format!("the image was not saved: {reason}")));
            }
            waker();
        };
        let thread = std::thread::Builder::new().name("save".to_owned()).spawn(run);
        let thread = thread.map_err(|error| format!("the image was not saved: cannot start a thread: {error}"))?;
        self.running.push(Running { title, path, told, cancelled, kept, goal, since: Instant::now(), thread });
        Ok(())
    }

    /// The absolute paths that they are going to write.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.running.iter().map(|running| running.path.clone()).collect()
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

    /// Draws the progress at the lower right of `free`, each with buttons that end it; dialogs lie above.
    pub fn show(&self, context: &Context, free: Rect) {
        let mut corner = free.right_bottom() - egui::vec2(10.0, 8.0);
        for (i, running) in self.running.iter().enumerate() {
            let area = Area::new(egui::Id::new(("render", i))).order(Layer::Middle);
            let shown = area.fixed_pos(corner).pivot(Align2::RIGHT_BOTTOM).show(context, |ui| {
                let frame = Frame::NONE.fill(GLASS).corner_radius(CornerRadius::same(4));
                frame.inner_margin(Margin::symmetric(9, 6)).show(ui, |ui| {
                    ui.set_width(WIDTH.min(0.6 * free.width()));
                    running.show(ui);
                });
            });
            corner.y = shown.response.rect.top() - 6.0;
        }
    }
}

impl Running {
    fn show(&self, ui: &mut Ui) {
        let told = *self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let title = RichText::new(format!("Rendering {}", self.title)).size(TEXT_SIZE).strong();
        ui.add(Label::new(title).truncate());
        overlay::progress(ui, ui.available_width(), told.most as f32);
        let is_kept = self.kept.load(Ordering::Relaxed);
        let text = match is_kept {
            true => "saving what there is".to_owned(),
            false => told.line(self.goal, self.since.elapsed().as_secs_f64()),
        };
        if told.sampled_at.is_some() {
            ui.ctx().request_repaint_after(Duration::from_secs(1));
        }
        let text = ui.label(RichText::new(text).size(TEXT_SIZE - 1.0));
        if told.is_flat {
            text.on_hover_text("four times the samples took less than a third of the noise away");
        }
        ui.horizontal(|ui| {
            let (keep, cancel) = match told.frame {
                None => ("write the image with the noise that it has now", "stop; nothing of it is saved"),
                Some(_) => ("write this frame with the noise that it has now, and stop", "stop; whole frames stay"),
            };
            // Before every pixel has a sample there is nothing, and after the last one all is kept.
            let button = Button::new("Keep what there is");
            if ui
                .add_enabled(told.spp > 0 && told.sampled_at.is_none() && !is_kept, button)
                .on_hover_text(keep)
                .clicked()
            {
                self.kept.store(true, Ordering::Relaxed);
            }
            if ui.button("Cancel").on_hover_text(cancel).clicked() {
                self.cancelled.store(true, Ordering::Relaxed);
            }
        });
    }
}

impl Told {
    /// - `goal`: the error to be reached; `seconds`: since the order began.
    fn line(&self, goal: Option<f64>, seconds: f64) -> String {
        let mut parts = Vec::new();
        if let Some((frame, n)) = self.frame {
            parts.push(format!("frame {frame} of {n}"));
        }
        match (self.error, self.spp) {
            (Some(error), _) if self.frame.is_none() || self.is_flat => {
                parts.push(format!("noise {}", percent(error)));
            }
            (_, spp) if spp > 0 && self.frame.is_none() => parts.push(samples(spp)),
            (_, 0) if parts.is_empty() => parts.push("preparing".to_owned()),
            _ => {}
        }
        let to = goal.filter(|_| self.frame.is_none()).map_or("go".to_owned(), percent);
        // What follows the samples takes its own time.
        if let Some(since) = self.sampled_at {
            parts.push(format!("denoising for {}", crate::viewer::status::seconds(since.elapsed().as_secs_f64())));
        } else if self.share >= 1.0 {
            parts.push("finishing".to_owned());
        } else if let Some(goal) = goal.filter(|_| self.is_flat) {
            parts.push(format!("{} may be out of reach", percent(goal)));
        } else if self.share > 0.0 && seconds > 1.0 {
            parts.push(format!("{} to {to}", crate::viewer::status::about(seconds * (1.0 / self.share - 1.0))));
        }
        parts.join(", ")
    }
}

/// What the thread of an order holds.
struct Work {
    told: Arc<Mutex<Told>>,
    cancelled: Arc<AtomicBool>,
    kept: Arc<AtomicBool>,
    moving: Arc<AtomicBool>,
    ending: Arc<AtomicBool>,
    waker: Waker,
}

impl Work {
    /// Whether the samples are to end. While the view moves, each worker rests here.
    fn stops(&self) -> bool {
        let stops = [&self.cancelled, &self.kept, &self.ending].iter().any(|flag| flag.load(Ordering::Relaxed));
        if !stops && self.moving.load(Ordering::Relaxed) {
            std::thread::sleep(REST);
        }
        stops
    }

    /// - `share`: of all frames; `frame`: the one of `now`, and their number.
    fn tell(&self, now: Advance, share: f64, frame: Option<(u32, u32)>) {
        let Advance { spp, error, is_flat, is_sampled, .. } = now;
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let most = told.most.max(share);
        *told = Told { share, most, spp, error, is_flat, sampled_at: is_sampled.then(Instant::now), frame };
        drop(told);
        (self.waker)();
    }

    /// Returns where it is and the message at the end; `None` for what was cancelled.
    fn run(&self, order: &Order, source: Source, stem: &str) -> Result<Option<(PathBuf, String)>, String> {
        match source {
            Source::Still(subject) => {
                let tell = |now: Advance| self.tell(now, now.share, None);
                let cancelled = || self.cancelled.load(Ordering::Relaxed);
                let Some(finished) = order.render_unless(&cancelled, &subject, &|| self.stops(), tell)? else {
                    return Ok(None);
                };
                let news = format!("saved {} ({})", finished.path.display(), finished.describe(order.size));
                Ok(Some((finished.path, news)))
            }
            Source::Frames(reel, settings) => {
                let news = self.frames(order, *reel, settings, stem)?;
                Ok(news.map(|news| (order.path.clone(), news)))
            }
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
        let is_new = !order.path.exists();
        std::fs::create_dir_all(&order.path).map_err(|error| format!("{}: {error}", order.path.display()))?;
        let mut reel = reel.open()?;
        let is_ended = || self.cancelled.load(Ordering::Relaxed) || self.ending.load(Ordering::Relaxed);
        let (mut saved, mut short) = (0, String::new());
        for number in frames {
            let done = number - first;
            let (extraction, draft) = reel.at(f64::from(number) / fps);
            let subject = Subject { scene: extraction.prepared, settings, draft };
            let tell = |now: Advance| {
                self.tell(now, (f64::from(done) + now.share) / f64::from(n), Some((done + 1, n)));
            };
            let one = Order { path: order.frame_path(stem, number), may_replace: true, ..order.clone() };
            // Half a frame is none, unless somebody keeps it.
            let Some(frame) = one.render_unless(&is_ended, &subject, &|| self.stops(), tell)? else { break };
            saved += 1;
            if !frame.is_complete {
                short = format!(" (the last one: {})", frame.describe(order.size));
            }
            if self.kept.load(Ordering::Relaxed) {
                break;
            }
        }
        let folder = order.path.display();
        if saved == 0 && is_new {
            // What others have put there meanwhile stays, and so does the folder.
            let _ = std::fs::remove_dir(&order.path);
        }
        Ok(Some(match saved {
            0 => format!("saved none of {n} frames"),
            1 if n == 1 => format!("saved 1 frame in {folder}{short}"),
            saved if saved == n => format!("saved {n} frames in {folder}{short}"),
            saved => format!("saved {saved} of {n} frames in {folder}{short}"),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_told_in_words() {
        let told = Told { share: 0.25, spp: 16, error: Some(0.04), ..Told::default() };
        assert_eq!(told.line(None, 20.0), "noise 4.0 %, about 60 s to go");
        assert_eq!(told.line(Some(0.02), 20.0), "noise 4.0 %, about 60 s to 2.0 %");
        assert_eq!(Told { frame: Some((3, 60)), ..told }.line(Some(0.02), 20.0), "frame 3 of 60, about 60 s to go");
        assert_eq!(Told { error: None, share: 0.0, ..told }.line(None, 20.0), "16 samples per pixel");
        assert_eq!(Told { error: None, share: 1.0, ..told }.line(None, 20.0), "16 samples per pixel, finishing");
        let sampled_at = Instant::now().checked_sub(Duration::from_secs(3));
        let denoised = Told { error: None, share: 1.0, sampled_at, ..told };
        assert_eq!(denoised.line(None, 20.0), "16 samples per pixel, denoising for 3.0 s");
        assert_eq!(Told::default().line(None, 0.1), "preparing");
    }

    #[test]
    fn a_goal_that_is_far_has_an_estimate_or_is_said_to_be_out_of_reach() {
        let far = Told { share: 2e-3, spp: 16, error: Some(0.3), ..Told::default() };
        assert_eq!(far.line(Some(0.02), 20.0), "noise 30 %, about 3 h to 2.0 %");
        assert_eq!(Told { share: 1e-5, ..far }.line(Some(0.02), 20.0), "noise 30 %, about 23 days to 2.0 %");
        let flat = Told { share: 0.0, is_flat: true, ..far };
        assert_eq!(flat.line(Some(0.02), 20.0), "noise 30 %, 2.0 % may be out of reach");
        let frame = Told { frame: Some((1, 60)), ..flat };
        assert_eq!(frame.line(Some(0.02), 20.0), "frame 1 of 60, noise 30 %, 2.0 % may be out of reach");
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
            may_replace: false,
            frames: Some(3..=5),
            is_turntable: false,
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
        renders.begin(long.clone(), Source::Frames(Box::new(reel), settings), "c".to_owned(), 1).unwrap();
        let outcome = renders.finish().pop().unwrap().unwrap().1;
        assert!(outcome.contains("of 100001 frames"), "{outcome}");
        assert_eq!(long.path.exists(), !outcome.starts_with("saved none"), "no empty folder stays");
    }
}
