//! The event loop: dispatch of events, ticks and drawing, and when to sleep.
//!
//! There are three kinds of steps, each run as rarely as possible. *Events* only record user input. A *tick* passes it
//! to the session, advances the session, and checks for anything new to show; it runs after events, when a worker
//! reports, and while a key is held. *Drawing* follows a tick that found something new. Nothing else runs, so a
//! finished image costs nothing.
//!
//! | file | about |
//! |---|---|
//! | here | opening, ticking, going to sleep |
//! | `events` | window events |
//! | `draw` | drawing of the image and the overlays |
//! | `act` | actions of keys and of the panel |
//! | `leave` | unsaved edits: questions, storage, recovery |
//! | `memory` | state kept between runs |

mod act;
mod draw;
mod events;
mod leave;
mod leaving;
mod memory;

use crate::frame::{
    Command, Explaining, Focus, FocusTarget, LatencyHistogram, MessageKind, Session, SessionOptions, Target, Waker,
};
use crate::render::{ErrorMetric, Inspection, SampleAllocation};
use crate::scene::{ModelChoice, SceneSource, UpAxis};
use crate::viewer::app::leaving::Leaving;
use crate::viewer::app::memory::Memory;
use crate::viewer::bar::{self, Figures};
use crate::viewer::browser::Browser;
use crate::viewer::dialog::Dialog;
use crate::viewer::display;
use crate::viewer::display::DisplayServer;
use crate::viewer::handles::Handles;
use crate::viewer::help::Help;
use crate::viewer::input::Input;
use crate::viewer::menu::HereMenu;
use crate::viewer::overlay;
use crate::viewer::palette::Palette;
use crate::viewer::panel::PanelState;
use crate::viewer::presenter::{PresentError, Presenter};
use crate::viewer::reaction::Reaction;
use crate::viewer::region_tool::RegionTool;
use crate::viewer::saver::Saver;
use crate::viewer::story::PathFilter;
use crate::viewer::toasts::{Toasts, Tone};
use bevy_ecs::prelude::Entity;
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

/// Options of the window.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    pub source: SceneSource,
    /// Width of the window, logical pixels.
    pub width: u32,
    pub height: u32,
    /// `None` for one thread per processor.
    pub threads: Option<usize>,
    pub seed: u32,
    /// The axis of models that points up; `None` to guess.
    pub up: Option<UpAxis>,
    /// The parts of a glTF model that are shown.
    pub choice: ModelChoice,
    /// An image that replaces the scene's own environment.
    pub environment: Option<PathBuf>,
    /// Folder for saved images.
    pub folder: PathBuf,
    /// File to which the session is recorded.
    pub record: Option<PathBuf>,
    /// Whether to print latency and speed at exit, as one JSON object; rendering then never stops by itself.
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
    /// The program was stopped from outside, by Ctrl+C in the terminal or by the system.
    #[error("{0}")]
    Stopped(String),
    #[error(transparent)]
    Present(#[from] PresentError),
}

/// Event: a worker has something to report.
#[derive(Clone, Copy, Debug)]
struct Wake;

/// Minimum interval of ticks and frames: a higher rate would only take processor time from the workers.
const FRAME: Duration = Duration::from_micros(4_000);
/// Longest time that a movement waits for the image of the previous one, and overlays for the next image.
const MAX_WAIT: Duration = Duration::from_millis(250);
/// Delay of repaints requested by overlays, because they request one after every input, and a window does not react
/// while it is drawn. With a new image they are drawn in any case.
const REPAINT_DELAY: Duration = Duration::from_millis(100);
/// Delay of repaints while there is a widget to be dragged or pressed.
const WIDGET_REPAINT_DELAY: Duration = Duration::from_millis(33);
/// Update interval of figures that change by themselves.
const FIGURES_INTERVAL: Duration = Duration::from_millis(250);
/// Time after the last resize after which the size is considered final.
const RESIZE_DELAY: Duration = Duration::from_millis(500);
/// An inspection, or opening a scene, that takes longer is reported as in progress; until it is done another image is
/// shown.
const SLOW: Duration = Duration::from_millis(150);
/// Exit status of a program that is stopped twice, by the convention of shells.
const STOPPED: i32 = 130;
/// Target at which a window stops by itself, so that the machine does not run for ever: the error is invisible.
const DEFAULT_TARGET: Target = Target { spp: None, seconds: None, error: Some(0.005) };

/// Opens a window and returns when it is closed.
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
                // If the loop has ended, nothing needs to be woken.
                let _ = proxy.send_event(Wake);
            }
        })
    };
    let stop_requested = Arc::new(AtomicBool::new(false));
    let (asked, proxy) = (stop_requested.clone(), event_loop.create_proxy());
    let taken_over = ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::SeqCst) {
            std::process::exit(STOPPED);
        }
        // If the loop has ended, the program ends by itself.
        let _ = proxy.send_event(Wake);
    });
    if let Err(error) = taken_over {
        log::warn!("Ctrl+C will not keep unsaved edits: {error}");
    }
    let mut app = App::new(options, pending, waker, stop_requested)?;
    display::silence_loss_panics();
    let ended = match catch_unwind(AssertUnwindSafe(|| event_loop.run_app(&mut app))) {
        Ok(ended) => ended.map_err(ViewerError::EventLoop),
        Err(panic) if display::is_loss(panic.as_ref()) => Err(ViewerError::DisplayLost),
        Err(panic) => {
            // Tries to store the edits.
            let _ = catch_unwind(AssertUnwindSafe(|| app.keep_or_forget_edits()));
            resume_unwind(panic)
        }
    };
    app.keep_or_forget_edits();
    // Also if the display is gone.
    app.session.end_record();
    app.keep_window_size();
    app.keep_panel();
    for saved in app.saver.finish() {
        app.report_saved(saved);
    }
    if app.options.print_figures {
        app.print_figures();
    }
    if app.stop_requested.load(Ordering::SeqCst) {
        let message = app.stopped_message();
        app.failure.get_or_insert(ViewerError::Stopped(message));
    }
    let ended = ended.and(app.failure.take().map_or(Ok(()), Err));
    if matches!(ended, Err(ViewerError::DisplayLost)) {
        // Its window and surface can no longer be released.
        std::mem::forget(app);
    }
    ended
}

struct App {
    options: ViewerOptions,
    /// Origin of the session's clock.
    start: Instant,
    /// A wake event is in the queue.
    pending: Arc<AtomicBool>,
    session: Session,
    saver: Saver,
    dialog: Dialog,
    browser: Browser,
    input: Input,
    toasts: Toasts,
    help: Help,
    palette: Palette,
    here: HereMenu,
    /// The question of the first start is shown.
    greeting: bool,
    panel: PanelState,
    handles: Handles,
    brush: RegionTool,
    /// The paths of an explained pixel that are drawn.
    path_filter: PathFilter,
    memory: Memory,
    reaction: Reaction,
    overlays: bool,
    /// The mouse is on the bar, or was when it moved last.
    over_bar: bool,
    // Before the window, so that the device is dropped before the display.
    presenter: Option<Presenter>,
    window: Option<Arc<Window>>,
    title: String,
    /// Logical pixels.
    window_size: (u32, u32),
    /// When to store the window's size.
    keep_size_at: Option<Instant>,
    occluded: bool,
    /// Whether anything happened since the last tick.
    needs_tick: bool,
    /// Generation of the image on the window.
    seen: u64,
    /// Since when, or since the last drawing, there is a change that is not visible yet.
    unseen_since: Option<Instant>,
    /// Number of the image that the window shows.
    shown_picture: Option<u64>,
    shown_figures: Figures,
    /// An inspection that is to be shown but not ready yet, and since when.
    inspected_since: Option<(Inspection, Instant)>,
    /// Since when a scene is being opened.
    opening_since: Option<Instant>,
    /// The active entity of the selection, as far as it has been told.
    selected: Option<Entity>,
    last_tick: Option<Instant>,
    /// When a movement was last passed to the session.
    steered_at: Instant,
    last_draw: Option<Instant>,
    /// When to tick again even if nothing happens.
    wake_at: Option<Instant>,
    /// When the overlays are to be repainted.
    repaint_at: Option<Instant>,
    failure: Option<ViewerError>,
    leaving: Leaving,
    /// The program is to end, by Ctrl+C in the terminal or by the system.
    stop_requested: Arc<AtomicBool>,
}

impl App {
    fn new(
        options: ViewerOptions,
        pending: Arc<AtomicBool>,
        waker: Waker,
        stop_requested: Arc<AtomicBool>,
    ) -> Result<Self, ViewerError> {
        let mut session = Session::new(SessionOptions {
            width: options.width,
            height: options.height,
            threads: options.threads,
            seed: options.seed,
            allocation: SampleAllocation::Adaptive(ErrorMetric::RelativeMse),
            // A renderer that stops after a second cannot be measured.
            target: if options.print_figures { Target::default() } else { DEFAULT_TARGET },
            yielding: true,
            up: options.up,
            waker: Some(waker.clone()),
        })
        .map_err(|error| ViewerError::Session(error.into()))?;
        if let Some(path) = &options.record {
            session.record(path, &options.source, options.up).map_err(|error| ViewerError::Session(error.into()))?;
        }
        session.open_choice(options.source.clone(), options.environment.clone(), options.choice.clone());
        let mut memory = Memory::of_platform();
        let trouble = memory.begin(&mut session);
        let leaving = Leaving::new(memory.recovery(), waker.clone());
        let start = Instant::now();
        let mut toasts = Toasts::default();
        if let Some(trouble) = trouble {
            crate::console::remark(format_args!("warning: {trouble}"));
            toasts.add(Tone::Problem, trouble, start);
        }
        Ok(Self {
            start,
            steered_at: start,
            pending,
            session,
            saver: Saver::new(&options.folder, waker.clone()),
            dialog: Dialog::new(waker),
            browser: Browser::default(),
            input: Input::new(options.width, options.height, memory.navigation()),
            toasts,
            help: Help::default(),
            palette: Palette::default(),
            here: HereMenu::default(),
            greeting: memory.is_new(),
            panel: memory.panel(),
            handles: Handles::default(),
            brush: RegionTool::default(),
            path_filter: PathFilter::default(),
            memory,
            leaving,
            stop_requested,
            selected: None,
            reaction: Reaction::default(),
            overlays: true,
            over_bar: false,
            presenter: None,
            window: None,
            title: String::new(),
            window_size: (options.width, options.height),
            keep_size_at: None,
            occluded: false,
            needs_tick: true,
            seen: 0,
            unseen_since: None,
            shown_picture: None,
            shown_figures: Figures::default(),
            inspected_since: None,
            opening_since: None,
            last_tick: None,
            last_draw: None,
            wake_at: None,
            repaint_at: None,
            failure: None,
            options,
        })
    }

    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewerError> {
        let size = fitting(event_loop, self.options.width, self.options.height);
        self.title = title(&self.options.source.title(), false);
        let attributes = Window::default_attributes().with_title(&self.title).with_inner_size(size);
        let window = Arc::new(event_loop.create_window(attributes).map_err(ViewerError::NoWindow)?);
        let presenter = Presenter::new(window.clone())?;
        overlay::style(presenter.egui_context());
        (self.window, self.presenter) = (Some(window), Some(presenter));
        self.resized();
        Ok(())
    }

    /// Adapts to a new size or scale factor of the window.
    fn resized(&mut self) {
        let (Some(window), Some(presenter)) = (&self.window, &self.presenter) else { return };
        let size = window.inner_size();
        let logical = size.to_logical::<u32>(window.scale_factor());
        if logical.width > 0 && logical.height > 0 && window.fullscreen().is_none() {
            self.window_size = (logical.width, logical.height);
            self.keep_size_at = Some(Instant::now() + RESIZE_DELAY);
        }
        let (width, height) = (size.width.min(presenter.max_side()), size.height.min(presenter.max_side()));
        self.input.resize(width, height);
        self.session.send(Command::Resize { width, height });
        self.needs_tick = true;
        window.request_redraw();
    }

    /// Prints the latencies (milliseconds), and the camera rays of the last image with the seconds from the restart to
    /// the last of them, including everything else the window does.
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
        // Standard output may be closed.
        let _ = crate::console::print(figures);
    }

    /// Stores the state of the panel, at exit.
    fn keep_panel(&self) {
        if let Some(trouble) = self.memory.keep_panel(&self.panel) {
            log::warn!("{trouble}");
        }
    }

    /// Stores the window's size. Not only at exit: X11 ends the program itself when the display is lost.
    fn keep_window_size(&mut self) {
        self.keep_size_at = None;
        if let Some(trouble) = self.memory.keep_window(self.window_size) {
            log::warn!("{trouble}");
        }
    }

    /// Passes on input, advances the session, and checks for anything new to show.
    fn tick(&mut self, now: Instant, event_loop: &ActiveEventLoop) {
        self.needs_tick = false;
        self.last_tick = Some(now);
        let clock = now - self.start;
        let restarts = self.session.status().restarts;
        self.session.update(clock);
        // A movement before the last one is visible would only replace it: it waits, and adds up. Movements are also
        // limited to the frame rate, although a finished image is checked for more often.
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
        match (status.opening, self.opening_since) {
            // A scene that is there at once would only flash.
            (Some(_), None) => (self.opening_since, self.repaint_at) = (Some(now), Some(now + SLOW)),
            // The seconds go on.
            (Some(_), Some(_)) => self.repaint_at = Some(self.repaint_at.unwrap_or(now + FIGURES_INTERVAL)),
            (None, Some(_)) => (self.opening_since, self.repaint_at) = (None, Some(now)),
            (None, None) => {}
        }
        for text in &status.withdrawn {
            self.toasts.withdraw(text);
        }
        let new = status.messages.iter().filter(|message| message.at == clock);
        let n_warnings = new.clone().filter(|message| message.kind == MessageKind::Warning).count();
        let is_flood = n_warnings > Toasts::MOST_WARNINGS;
        if is_flood {
            self.toasts.add(Tone::Problem, format!("{n_warnings} warnings: see Messages in the panel (N)"), now);
        }
        for message in new.filter(|message| !is_flood || message.kind != MessageKind::Warning) {
            let tone = if message.kind == MessageKind::Note { Tone::News } else { Tone::Problem };
            self.toasts.add(tone, message.text.clone(), now);
        }
        // Without a first scene there is no reason to stay open, and the terminal is where the name was typed.
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
            self.report_saved(saved);
        }
        self.tell_selection(now);
        self.take_files(now);
        self.follow_edits(now, event_loop);
        if self.keep_size_at.is_some_and(|at| now >= at) {
            self.keep_window_size();
        }
        let title = title(&self.session.status().scene, self.session.has_unsaved_edits());
        let n_toasts = self.toasts.len();
        self.toasts.at(now);
        let Some(window) = &self.window else { return };
        // Until the first scene is loaded, the title is that of the scene to be shown.
        if title != self.title && !self.session.status().scene.is_empty() {
            window.set_title(&title);
            self.title = title;
        }
        let new_picture = self.shown_picture != Some(self.session.picture().number);
        let figures_due = self.last_draw.is_none_or(|then| now >= then + FIGURES_INTERVAL);
        let new_figures = self.overlays && self.figures() != self.shown_figures;
        let repaint = self.repaint_at.is_some_and(|at| now >= at) || self.toasts.len() != n_toasts;
        // The image for the last change has priority: drawing an older one would only delay it.
        let unseen_since = self.unseen_since.filter(|_| !self.is_rendered());
        let comes = unseen_since.is_some_and(|since| now < since + MAX_WAIT);
        if !self.occluded && !comes && (new_picture || repaint || (new_figures && figures_due)) {
            window.request_redraw();
        }
        let moving = match answered {
            true => soon.or_else(|| self.input.is_moving().then(|| now + FRAME)),
            false => Some(self.steered_at + MAX_WAIT),
        };
        let late = unseen_since.filter(|_| comes).map(|since| since + MAX_WAIT);
        let figures = (new_figures && !figures_due).then(|| self.last_draw.map_or(now, |then| then + FIGURES_INTERVAL));
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

    /// Whether there are widgets on the window that react to the mouse.
    fn has_widgets(&self) -> bool {
        let explains = self.session.world().resource::<Explaining>().story.is_some();
        let is_open = self.help.open || self.palette.open || self.here.is_open() || self.leaving.question.is_some();
        is_open
            || self.browser.is_open()
            || self.overlays && (self.panel.shown || explains || self.over_bar || self.in_menu())
    }

    /// Whether a menu is open.
    fn in_menu(&self) -> bool {
        self.presenter.as_ref().is_some_and(|presenter| egui::Popup::is_any_open(presenter.egui_context()))
    }

    /// Whether a place of the window, in physical pixels, is that of the bar.
    fn is_bar_at(&self, place: [f64; 2]) -> bool {
        let Some(presenter) = self.presenter.as_ref().filter(|_| self.overlays) else { return false };
        let scale = presenter.pixels_per_point();
        let [x, y] = place.map(|pixels| pixels as f32 / scale);
        bar::is_at(egui::pos2(x, y), self.input.size()[1] as f32 / scale)
    }

    /// Whether focus follows the mouse, and the mouse is not in the panel.
    fn focus_follows(&self) -> bool {
        let follows = matches!(self.session.world().resource::<Focus>().target, FocusTarget::Cursor(_));
        follows && self.presenter.as_ref().is_some_and(|presenter| !presenter.egui_context().is_pointer_over_area())
    }

    /// Whether the last change of the view is visible, or has taken too long to wait for. Rendering the next image
    /// while this one is drawn would delay both on a single processor.
    fn is_answered(&self, now: Instant) -> bool {
        let restarts = self.session.status().restarts;
        self.seen >= restarts || (self.occluded && self.is_rendered()) || now >= self.steered_at + MAX_WAIT
    }

    /// Whether there is an image of the current scene.
    fn is_rendered(&self) -> bool {
        self.session.picture().generation >= self.session.status().restarts
    }

    /// Passes the movement by keys and mouse to the session.
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

/// The size of the first window, logical pixels: at most what the monitor has room for beside frames and bars.
fn fitting(event_loop: &ActiveEventLoop, width: u32, height: u32) -> LogicalSize<f64> {
    let wanted = LogicalSize::new(f64::from(width), f64::from(height));
    let Some(monitor) = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next()) else {
        return wanted;
    };
    let room = monitor.size().to_logical::<f64>(monitor.scale_factor());
    fit_into(wanted, room)
}

/// Leaves room for the title, the frame and the bars of the desktop; a monitor without a size has no limit.
fn fit_into(wanted: LogicalSize<f64>, monitor: LogicalSize<f64>) -> LogicalSize<f64> {
    let most = |size: f64, least: f64| if size > 0.0 { (0.98 * size).min(size - least).max(64.0) } else { f64::MAX };
    LogicalSize::new(wanted.width.min(most(monitor.width, 8.0)), wanted.height.min(most(monitor.height, 64.0)))
}

/// Returns the window title; an asterisk marks unsaved edits.
fn title(scene: &str, unsaved: bool) -> String {
    let name = short_name(scene);
    let mark = if unsaved { "*" } else { "" };
    if name.is_empty() {
        "firstlight".to_owned()
    } else {
        format!("firstlight — {mark}{}", crate::files::printable::name(&name))
    }
}

/// Returns the name of a scene without its folder.
fn short_name(scene: &str) -> String {
    Path::new(scene).file_name().map_or(scene.into(), |name| name.to_string_lossy()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_window_fits_the_monitor() {
        let fit = |width, height, monitor: (f64, f64)| {
            let size = fit_into(LogicalSize::new(width, height), LogicalSize::new(monitor.0, monitor.1));
            (size.width, size.height)
        };
        assert_eq!(fit(1280.0, 720.0, (1920.0, 1080.0)), (1280.0, 720.0));
        // Twice as many dots for each logical pixel.
        assert_eq!(fit(1280.0, 720.0, (800.0, 500.0)), (784.0, 436.0));
        assert_eq!(fit(1280.0, 720.0, (0.0, 0.0)), (1280.0, 720.0));
    }
}
