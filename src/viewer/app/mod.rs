//! The event loop: who is asked when, and when to sleep.
//!
//! Three things happen, each as seldom as it may. *Events* only note what a person did. A *tick* hands that to the
//! session, lets it go on, and finds out whether there is anything new to see; it runs after events, when a worker has
//! news, and while a key is held. *Drawing* follows a tick that found something new. Nothing else runs, so a finished
//! picture costs nothing.
//!
//! | file | about |
//! |---|---|
//! | here | opening, ticking, going to sleep |
//! | `events` | what winit tells |
//! | `draw` | picture and overlays onto the window |
//! | `act` | what keys and the panel ask for |
//! | `leave` | unsaved edits: asked about, kept, offered again |
//! | `memory` | what is kept from one run to the next |

mod act;
mod draw;
mod events;
mod leave;
mod leaving;
mod memory;

use super::dialog::Dialog;
use super::display::{self, DisplayServer};
use super::handles::Handles;
use super::input::Input;
use super::overlay::{self, Help};
use super::panel::PanelState;
use super::presenter::{PresentError, Presenter};
use super::reaction::Reaction;
use super::region_tool::RegionTool;
use super::saver::Saver;
use super::story::WaysShown;
use super::toasts::{Toasts, Tone};
use crate::frame::{
    Command, Explaining, Focus, FocusTarget, LatencyHistogram, MessageKind, Session, SessionOptions, Target, Waker,
};
use crate::render::Inspection;
use crate::scene::{ModelChoice, SceneSource, UpAxis};
use leaving::Leaving;
use memory::Memory;
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use thiserror::Error;
use winit::dpi::LogicalSize;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::Window;

/// How to open the window.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    pub source: SceneSource,
    /// Of the window, logical pixels.
    pub width: u32,
    pub height: u32,
    /// One for each processor when not given.
    pub threads: Option<usize>,
    pub seed: u32,
    /// Which axis of models points up; guessed when not given.
    pub up: Option<UpAxis>,
    /// What of a glTF model is shown.
    pub choice: ModelChoice,
    /// An image that takes the place of the scene's own environment.
    pub environment: Option<PathBuf>,
    /// Where kept pictures go.
    pub folder: PathBuf,
    /// Where to write down what is done.
    pub record: Option<PathBuf>,
    /// Print at the end how prompt and how fast it was, one JSON object; until then no picture is good enough.
    pub print_figures: bool,
}

/// Why the window could not be opened, or closed by itself.
#[derive(Debug, Error)]
pub enum ViewerError {
    #[error(
        "cannot open a window: the display does not respond; check DISPLAY or WAYLAND_DISPLAY, or render without a window: firstlight render SCENE -o out.png"
    )]
    NoDisplay,
    #[error("lost the connection to the display; settings, bookmarks and unsaved changes are kept")]
    DisplayLost,
    #[error("cannot open a window: {0}")]
    NoWindow(winit::error::OsError),
    #[error("the event loop ended unexpectedly: {0}")]
    EventLoop(winit::error::EventLoopError),
    #[error("{0}")]
    Session(String),
    #[error("{0}")]
    Scene(String),
    /// Somebody asked the program to end, by Ctrl+C in the terminal or as systems do.
    #[error("{0}")]
    Stopped(String),
    #[error(transparent)]
    Present(#[from] PresentError),
}

/// A worker has news.
#[derive(Clone, Copy, Debug)]
struct Wake;

/// Ticks and frames come no faster: more would only cost the workers their processors.
const FRAME: Duration = Duration::from_micros(4_000);
/// So long a movement waits for the picture of the one before it, and overlays for the picture that is to come.
const LATEST: Duration = Duration::from_millis(250);
/// Overlays that want to be drawn again wait so long, for after every input they do, and a window that is being drawn answers to
/// no other. With a new picture they are drawn in any case.
const SETTLED: Duration = Duration::from_millis(100);
/// The same while there is something to be moved or pressed.
const LIVELY: Duration = Duration::from_millis(33);
/// Figures that change by themselves are shown again so often.
const FIGURES: Duration = Duration::from_millis(250);
/// So long after the last change of its size a window has come to rest.
const AT_REST: Duration = Duration::from_millis(500);
/// The exit status of a program that is told to end twice, as shells count it.
const STOPPED: i32 = 130;
/// What a window stops at by itself, so that nothing runs hot for ever: an error that nobody sees.
const GOOD_ENOUGH: Target = Target { spp: None, seconds: None, error: Some(0.005) };

/// Opens a window and stays until it is closed.
pub fn run(options: ViewerOptions) -> Result<(), ViewerError> {
    let mut builder = EventLoop::<Wake>::with_user_event();
    match display::find() {
        DisplayServer::Default => {}
        DisplayServer::None => return Err(ViewerError::NoDisplay),
        DisplayServer::ForceX11 => {
            #[cfg(all(unix, not(target_os = "macos")))]
            winit::platform::x11::EventLoopBuilderExtX11::with_x11(&mut builder);
        }
    }
    // The text of the library's own error is a path into its source.
    let event_loop = builder.build().map_err(|_| ViewerError::NoDisplay)?;
    let pending = Arc::new(AtomicBool::new(false));
    let waker: Waker = {
        let (proxy, pending) = (event_loop.create_proxy(), pending.clone());
        Arc::new(move || {
            // One event wakes the window; more would only queue up.
            if !pending.swap(true, Ordering::AcqRel) {
                // The loop may be over, and then nobody needs waking.
                let _ = proxy.send_event(Wake);
            }
        })
    };
    let told_to_end = Arc::new(AtomicBool::new(false));
    let (asked, proxy) = (told_to_end.clone(), event_loop.create_proxy());
    let taken_over = ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::SeqCst) {
            std::process::exit(STOPPED);
        }
        // The loop may be over, and then the program ends by itself.
        let _ = proxy.send_event(Wake);
    });
    if let Err(error) = taken_over {
        log::warn!("Ctrl+C will not keep unsaved edits: {error}");
    }
    let mut app = App::new(options, pending, waker, told_to_end)?;
    display::say_nothing_of_its_loss();
    let ended = match catch_unwind(AssertUnwindSafe(|| event_loop.run_app(&mut app))) {
        Ok(ended) => ended.map_err(ViewerError::EventLoop),
        Err(panic) if display::is_loss(panic.as_ref()) => Err(ViewerError::DisplayLost),
        Err(panic) => {
            // What can still be said of the scene is said.
            let _ = catch_unwind(AssertUnwindSafe(|| app.keep_or_forget_edits()));
            resume_unwind(panic)
        }
    };
    app.keep_or_forget_edits();
    // Also when the display is gone.
    app.session.end_record();
    app.keep_window_size();
    for saved in app.saver.finish() {
        app.tell_saved(saved);
    }
    if app.options.print_figures {
        app.print_figures();
    }
    if app.told_to_end.load(Ordering::SeqCst) {
        let message = app.stopped_message();
        app.failure.get_or_insert(ViewerError::Stopped(message));
    }
    let ended = ended.and(app.failure.take().map_or(Ok(()), Err));
    if matches!(ended, Err(ViewerError::DisplayLost)) {
        // Its window and surface can no longer be given back.
        std::mem::forget(app);
    }
    ended
}

struct App {
    options: ViewerOptions,
    /// The session's clock counts from here.
    start: Instant,
    /// A wake-up is on its way.
    pending: Arc<AtomicBool>,
    session: Session,
    saver: Saver,
    dialog: Dialog,
    input: Input,
    toasts: Toasts,
    help: Help,
    panel: PanelState,
    handles: Handles,
    brush: RegionTool,
    /// Which paths of an explained pixel are drawn.
    ways: WaysShown,
    memory: Memory,
    reaction: Reaction,
    overlays: bool,
    // Before the window, so that the device goes before the display.
    presenter: Option<Presenter>,
    window: Option<Arc<Window>>,
    title: String,
    /// Logical pixels.
    window_size: (u32, u32),
    /// When the window's size is to be kept, since it has come to rest.
    keep_size_at: Option<Instant>,
    occluded: bool,
    /// Something happened since the last tick.
    stirred: bool,
    /// Generation of the picture on the window.
    seen: u64,
    /// Since when, or since the last drawing, there is a change that cannot be seen yet.
    unseen_since: Option<Instant>,
    /// The picture that the window draws.
    shown_picture: Option<u64>,
    shown_figures: String,
    /// What is to be shown in place of the picture and is not there yet, and since when.
    inspected_since: Option<(Inspection, Instant)>,
    last_tick: Option<Instant>,
    /// When a movement was last handed over.
    steered_at: Instant,
    last_draw: Option<Instant>,
    /// When to tick again even if nothing happens.
    wake_at: Option<Instant>,
    /// When the overlays want to be drawn again.
    repaint_at: Option<Instant>,
    failure: Option<ViewerError>,
    leaving: Leaving,
    /// By Ctrl+C in the terminal, or by the system.
    told_to_end: Arc<AtomicBool>,
}

impl App {
    fn new(
        options: ViewerOptions,
        pending: Arc<AtomicBool>,
        waker: Waker,
        told_to_end: Arc<AtomicBool>,
    ) -> Result<Self, ViewerError> {
        let mut session = Session::new(SessionOptions {
            width: options.width,
            height: options.height,
            threads: options.threads,
            seed: options.seed,
            // What rests after a second cannot be measured.
            target: if options.print_figures { Target::default() } else { GOOD_ENOUGH },
            yielding: true,
            up: options.up,
            waker: Some(waker.clone()),
        })
        .map_err(|error| ViewerError::Session(error.into()))?;
        if let Some(path) = &options.record {
            session.record(path, &options.source, options.up).map_err(|error| ViewerError::Session(error.into()))?;
        }
        session.open_choice(options.source.clone(), options.environment.clone(), options.choice.clone());
        let memory = Memory::of_platform();
        let leaving = Leaving::new(memory.recovery(), waker.clone());
        let start = Instant::now();
        Ok(Self {
            start,
            steered_at: start,
            pending,
            session,
            saver: Saver::new(&options.folder, waker.clone()),
            dialog: Dialog::new(waker),
            input: Input::new(options.width, options.height, memory.navigation()),
            toasts: Toasts::default(),
            help: Help::default(),
            panel: PanelState::default(),
            handles: Handles::default(),
            brush: RegionTool::default(),
            ways: WaysShown::default(),
            memory,
            leaving,
            told_to_end,
            reaction: Reaction::default(),
            overlays: true,
            presenter: None,
            window: None,
            title: String::new(),
            window_size: (options.width, options.height),
            keep_size_at: None,
            occluded: false,
            stirred: true,
            seen: 0,
            unseen_since: None,
            shown_picture: None,
            shown_figures: String::new(),
            inspected_since: None,
            last_tick: None,
            last_draw: None,
            wake_at: None,
            repaint_at: None,
            failure: None,
            options,
        })
    }

    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewerError> {
        let size = LogicalSize::new(self.options.width, self.options.height);
        self.title = title(&self.options.source.title(), false);
        let attributes = Window::default_attributes().with_title(&self.title).with_inner_size(size);
        let window = Arc::new(event_loop.create_window(attributes).map_err(ViewerError::NoWindow)?);
        let presenter = Presenter::new(window.clone())?;
        overlay::style(presenter.egui_context());
        (self.window, self.presenter) = (Some(window), Some(presenter));
        self.resized();
        self.toasts.add(Tone::News, "H: keys, N: panel", Instant::now());
        Ok(())
    }

    /// The window may have another size, or another scale.
    fn resized(&mut self) {
        let (Some(window), Some(presenter)) = (&self.window, &self.presenter) else { return };
        let size = window.inner_size();
        let logical = size.to_logical::<u32>(window.scale_factor());
        if logical.width > 0 && logical.height > 0 && window.fullscreen().is_none() {
            self.window_size = (logical.width, logical.height);
            self.keep_size_at = Some(Instant::now() + AT_REST);
        }
        let (width, height) = (size.width.min(presenter.max_side()), size.height.min(presenter.max_side()));
        self.input.resize(width, height);
        self.session.send(Command::Resize { width, height });
        self.stirred = true;
        window.request_redraw();
    }

    /// How long people waited (milliseconds), and the paths of the last picture with the seconds from the restart to the last
    /// of them, in which the window did all that it does.
    fn print_figures(&self) {
        let milliseconds = |waits: &LatencyHistogram| {
            let of = |share| waits.quantile(share).map(|wait| wait.as_secs_f64() * 1e3);
            json!({ "count": waits.len(), "p50": of(0.5), "p99": of(0.99), "longest": of(1.0) })
        };
        let status = self.session.status();
        let figures = json!({
            "scene": status.scene,
            "width": status.film_width * status.divider,
            "height": status.film_height * status.divider,
            "reaction_ms": milliseconds(self.reaction.waits()),
            "cancel_ms": milliseconds(&self.session.cancels()),
            "camera_rays": status.rays.camera,
            "seconds": status.elapsed,
        });
        // Standard output may be closed, and then nobody reads it.
        let _ = crate::console::print(figures);
    }

    /// The next window is as large. Not only at the end: X11 ends the program itself when the display goes.
    fn keep_window_size(&mut self) {
        self.keep_size_at = None;
        if let Some(trouble) = self.memory.keep_window(self.window_size) {
            log::warn!("{trouble}");
        }
    }

    /// Hands over what was asked for, lets the session go on, and looks for something new.
    fn tick(&mut self, now: Instant, event_loop: &ActiveEventLoop) {
        self.stirred = false;
        self.last_tick = Some(now);
        let clock = now - self.start;
        let restarts = self.session.status().restarts;
        self.session.update(clock);
        // A movement that came before the last one was seen would only take its place: it waits, and adds up. Nor does it
        // come faster than frames, though a picture that is ready is looked at sooner.
        let answered = self.is_answered(now);
        let soon = Some(self.steered_at + FRAME).filter(|soon| *soon > now);
        if answered && soon.is_none() {
            self.steer(now, clock);
            let generation = self.session.status().restarts;
            self.reaction.carried_out((generation != restarts).then_some(generation));
        }
        if self.session.status().restarts > self.seen {
            self.unseen_since.get_or_insert(now);
        }
        for trouble in self.memory.follow(&mut self.session) {
            self.toasts.add(Tone::Problem, trouble, now);
        }
        let status = self.session.status();
        for message in status.messages.iter().filter(|message| message.at == clock) {
            let tone = if message.kind == MessageKind::Note { Tone::News } else { Tone::Problem };
            self.toasts.add(tone, message.text.clone(), now);
        }
        // Without a first scene there is nothing to stay for, and the terminal is where the name was typed.
        if status.scene.is_empty()
            && status.loading.is_none()
            && status.messages.iter().any(|message| message.kind == MessageKind::Error)
        {
            let errors = status.messages.iter().filter(|message| message.kind == MessageKind::Error);
            let lines: Vec<&str> = errors.map(|message| message.text.as_str()).collect();
            self.failure = Some(ViewerError::Scene(lines.join("\n")));
            event_loop.exit();
            return;
        }
        for saved in self.saver.finished() {
            self.tell_saved(saved);
        }
        self.take_files(now);
        self.follow_edits(now, event_loop);
        if self.keep_size_at.is_some_and(|at| now >= at) {
            self.keep_window_size();
        }
        let title = title(&self.session.status().scene, self.session.has_unsaved_edits());
        let n_toasts = self.toasts.len();
        self.toasts.at(now);
        let Some(window) = &self.window else { return };
        // Until the first scene is there, the window is called after what it will show.
        if title != self.title && !self.session.status().scene.is_empty() {
            window.set_title(&title);
            self.title = title;
        }
        let new_picture = self.shown_picture != Some(self.session.picture().number);
        let figures_due = self.last_draw.is_none_or(|then| now >= then + FIGURES);
        let new_figures = self.overlays && self.figures() != self.shown_figures;
        let repaint = self.repaint_at.is_some_and(|at| now >= at) || self.toasts.len() != n_toasts;
        // The picture that the last change asked for comes first: drawing an older one would only keep it waiting.
        let unseen_since = self.unseen_since.filter(|_| !self.is_rendered());
        let comes = unseen_since.is_some_and(|since| now < since + LATEST);
        if !self.occluded && !comes && (new_picture || repaint || (new_figures && figures_due)) {
            window.request_redraw();
        }
        let moving = match answered {
            true => soon.or_else(|| self.input.is_moving().then(|| now + FRAME)),
            false => Some(self.steered_at + LATEST),
        };
        let late = unseen_since.filter(|_| comes).map(|since| since + LATEST);
        let figures = (new_figures && !figures_due).then(|| self.last_draw.map_or(now, |then| then + FIGURES));
        let repaint_at = self.repaint_at.filter(|at| *at > now);
        let session = self.session.next_wake(clock).map(|at| self.start + at);
        self.wake_at = [
            session,
            self.toasts.next_change(),
            moving,
            late,
            figures,
            repaint_at,
            self.keep_size_at,
            self.leaving.wake_at(),
        ]
        .into_iter()
        .flatten()
        .min();
    }

    /// Something on the window answers to the mouse.
    fn has_widgets(&self) -> bool {
        let explains = self.session.world().resource::<Explaining>().story.is_some();
        self.help.open || self.leaving.question.is_some() || self.overlays && (self.panel.shown || explains)
    }

    /// What is under the mouse is to be sharp, and the mouse is not in the panel.
    fn focus_follows(&self) -> bool {
        let follows = matches!(self.session.world().resource::<Focus>().target, FocusTarget::Cursor(_));
        follows && self.presenter.as_ref().is_some_and(|presenter| !presenter.egui_context().is_pointer_over_area())
    }

    /// The last change of the view can be seen, or that takes too long to wait for. To render the next while this one
    /// is being drawn would keep both waiting where one processor has to do all.
    fn is_answered(&self, now: Instant) -> bool {
        let restarts = self.session.status().restarts;
        self.seen >= restarts || (self.occluded && self.is_rendered()) || now >= self.steered_at + LATEST
    }

    /// There is a picture of what the scene is now.
    fn is_rendered(&self) -> bool {
        self.session.picture().generation >= self.session.status().restarts
    }

    /// Hands over how keys and mouse moved.
    fn steer(&mut self, now: Instant, clock: Duration) {
        let commands = self.input.take(now);
        if commands.is_empty() {
            return;
        }
        for command in commands {
            self.session.send(command);
        }
        self.session.update(clock);
        self.steered_at = now;
    }
}

/// A star stands before what has edits that are not saved.
fn title(scene: &str, unsaved: bool) -> String {
    let name = short_name(scene);
    let mark = if unsaved { "*" } else { "" };
    if name.is_empty() {
        "firstlight".to_owned()
    } else {
        format!("firstlight — {mark}{}", crate::printable::name(&name))
    }
}

/// A scene without its folder.
fn short_name(scene: &str) -> String {
    Path::new(scene).file_name().map_or(scene.into(), |name| name.to_string_lossy()).into_owned()
}
