//! The event loop: dispatch of events, ticks and drawing, and when to sleep.
//!
//! There are three kinds of steps, each run as rarely as possible. *Events* only record user input. A *tick* passes it
//! to the session, advances the session, and checks for anything new to show; it runs after events, when a worker
//! reports, and while a key is held. *Drawing* follows a tick that found something new. Nothing else runs, so a
//! finished image costs nothing.
//!
//! | file | about |
//! |---|---|
//! | here | the state of the window |
//! | `options`, `run` | opening and closing |
//! | `tick` | ticking, going to sleep |
//! | `events` | window events |
//! | `draw` | drawing of the image and the overlays |
//! | `act` | actions of keys and of the panel |
//! | `brightness` | the exposure by the brightness of the image |
//! | `grabbing` | changes of the selection that follow the mouse |
//! | `orders` | images and frames that are rendered to files |
//! | `leave` | unsaved edits: questions, storage, recovery |
//! | `memory` | state kept between runs |

mod act;
mod brightness;
mod draw;
mod events;
mod grabbing;
mod leave;
mod leaving;
mod memory;
pub mod options;
mod orders;
pub mod run;
mod tick;

use crate::frame::{
    Command, Explaining, Focus, FocusTarget, Picture, Projector, Session, SessionOptions, Status, Target, Waker,
};
use crate::render::{ErrorMetric, Inspection, SampleAllocation};
use crate::scene::EnvironmentSource;
use crate::viewer::app::leaving::Leaving;
use crate::viewer::app::memory::Memory;
use crate::viewer::app::options::{ViewerError, ViewerOptions, size_to_keep};
use crate::viewer::bar::Figures;
use crate::viewer::browser::Browser;
use crate::viewer::dialog::Dialog;
use crate::viewer::form_preview::FormPreview;
use crate::viewer::grab::Grab;
use crate::viewer::handles::Handles;
use crate::viewer::help::Help;
use crate::viewer::input::Input;
use crate::viewer::menu::HereMenu;
use crate::viewer::order_form::OrderForm;
use crate::viewer::outlines::Outlines;
use crate::viewer::palette::Palette;
use crate::viewer::panel::{self, PanelState};
use crate::viewer::presenter::{PresentError, Presenter};
use crate::viewer::previews::Previews;
use crate::viewer::reaction::Reaction;
use crate::viewer::region_tool::RegionTool;
use crate::viewer::renders::Renders;
use crate::viewer::saver::Saver;
use crate::viewer::story::PathFilter;
use crate::viewer::time_line::Strip;
use crate::viewer::toasts::{Toasts, Tone};
use bevy_ecs::prelude::Entity;
use glam::DVec2;
use std::mem::Discriminant;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use winit::window::Window;

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
/// Target at which a window stops by itself, so that the machine does not run for ever: the error is invisible.
const DEFAULT_TARGET: Target = Target { spp: None, seconds: None, error: Some(0.005) };

struct App {
    options: ViewerOptions,
    /// Origin of the session's clock.
    start: Instant,
    /// A wake event is in the queue.
    pending: Arc<AtomicBool>,
    session: Session,
    saver: Saver,
    /// The form of what is to be rendered to a file, and what is being rendered.
    form: OrderForm,
    form_preview: FormPreview,
    renders: Renders,
    dialog: Dialog,
    browser: Browser,
    input: Input,
    toasts: Toasts,
    /// The file or the folder that was saved last, with its full path.
    last_saved: Option<PathBuf>,
    help: Help,
    palette: Palette,
    here: HereMenu,
    /// The question of the first start is shown.
    greeting: bool,
    panel: PanelState,
    handles: Handles,
    /// The change of the selection that follows the mouse.
    grab: Option<Grab>,
    outlines: Outlines,
    /// The animation, as it was drawn last.
    strip: Option<Strip>,
    brush: RegionTool,
    /// The paths of an explained pixel that are drawn.
    path_filter: PathFilter,
    memory: Memory,
    reaction: Reaction,
    overlays: bool,
    /// The mouse is on a widget, or was when it moved last.
    over_widgets: bool,
    /// What panels left free when the window was drawn last, points.
    free: egui::Rect,
    /// Width that the panel takes from the image, points.
    covered: f32,
    /// Restarts until the panel was opened, while the image from before is still shown.
    held: Option<u64>,
    // Before the window, so that the device is dropped before the display.
    presenter: Option<Presenter>,
    window: Option<Arc<Window>>,
    title: String,
    /// That of the next window, logical pixels.
    window_size: (u32, u32),
    /// What the monitor had room for when the window was opened, logical pixels.
    fitted_size: (u32, u32),
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
    /// Since when anything is being built.
    loading_since: Option<Instant>,
    /// The active entity of the selection, as far as it has been told.
    selected: Option<Entity>,
    last_tick: Option<Instant>,
    /// When a movement was last passed to the session.
    steered_at: Instant,
    /// A scene was opened, and whether its camera begins in a room is not known yet.
    asks_for_room: bool,
    last_draw: Option<Instant>,
    /// The scene, and the kind of its environment, of which the brightness was judged last.
    judged: Option<(u64, Discriminant<EnvironmentSource>)>,
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
        let mut memory = Memory::of_platform();
        let panel = PanelState { previews: Previews::new(waker.clone()), ..memory.panel() };
        // A model is framed before the panel is drawn.
        let covered = if panel.shown { panel::width(options.width as f32) } else { 0.0 };
        let image_width = options.width.saturating_sub(covered.round() as u32);
        let mut session = Session::new(SessionOptions {
            width: image_width,
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
            let recorded = session.record(path, &options.source, options.environment.as_deref(), &options.choice);
            recorded.map_err(|error| ViewerError::Session(error.into()))?;
        }
        session.open_choice(options.source.clone(), options.environment.clone(), options.choice.clone());
        let trouble = memory.begin(&mut session);
        let leaving = Leaving::new(memory.recovery(), waker.clone());
        let start = Instant::now();
        let mut toasts = Toasts::default();
        if let Some(trouble) = trouble {
            crate::console::remark(format_args!("warning: {trouble}"));
            toasts.add(Tone::Problem, trouble, start);
        }
        let input = Input::new(image_width, options.height, memory.navigation());
        Ok(Self {
            start,
            steered_at: start,
            asks_for_room: false,
            pending,
            session,
            form: OrderForm::default(),
            form_preview: FormPreview::new(waker.clone()),
            renders: Renders::new(waker.clone()),
            saver: Saver::new(&options.folder, waker.clone()),
            dialog: Dialog::new(waker.clone()),
            browser: Browser::default(),
            input,
            toasts,
            last_saved: None,
            help: Help::default(),
            palette: Palette::default(),
            here: HereMenu::default(),
            greeting: memory.is_new(),
            panel,
            handles: Handles::default(),
            grab: None,
            strip: None,
            outlines: Outlines::new(waker.clone()),
            brush: RegionTool::default(),
            path_filter: PathFilter::default(),
            memory,
            leaving,
            stop_requested,
            selected: None,
            reaction: Reaction::default(),
            overlays: true,
            over_widgets: false,
            free: egui::Rect::EVERYTHING,
            covered,
            held: None,
            presenter: None,
            window: None,
            title: String::new(),
            window_size: (options.width, options.height),
            fitted_size: (options.width, options.height),
            keep_size_at: None,
            occluded: false,
            needs_tick: true,
            seen: 0,
            unseen_since: None,
            shown_picture: None,
            shown_figures: Figures::default(),
            inspected_since: None,
            opening_since: None,
            loading_since: None,
            last_tick: None,
            last_draw: None,
            judged: None,
            wake_at: None,
            repaint_at: None,
            failure: None,
            options,
        })
    }

    /// Adapts to a new size or scale factor of the window.
    fn resized(&mut self) {
        let Some(window) = &self.window else { return };
        let size = window.inner_size();
        let logical = size.to_logical::<u32>(window.scale_factor());
        if logical.width > 0 && logical.height > 0 && window.fullscreen().is_none() {
            let wanted = (self.options.width, self.options.height);
            self.window_size = size_to_keep((logical.width, logical.height), self.fitted_size, wanted);
            self.keep_size_at = Some(Instant::now() + RESIZE_DELAY);
        }
        window.request_redraw();
        self.resize_image();
    }

    /// Gives the image the part of the window that the panel leaves free: what is saved is what is seen.
    fn resize_image(&mut self) {
        let (Some(window), Some(presenter)) = (&self.window, &self.presenter) else { return };
        let [width, height] = <[u32; 2]>::from(window.inner_size()).map(|side| side.min(presenter.max_side()));
        let covered = (self.covered * presenter.pixels_per_point()).round() as u32;
        // A window without pixels is minimised.
        let width = if width == 0 { 0 } else { width.saturating_sub(covered).max(1) };
        self.input.resize(width, height);
        self.session.send(Command::Resize { width, height });
        self.needs_tick = true;
    }

    /// Stores the window's size. Not only at exit: X11 ends the program itself when the display is lost.
    fn keep_window_size(&mut self) {
        self.keep_size_at = None;
        if let Some(trouble) = self.memory.keep_window(self.window_size) {
            log::warn!("{trouble}");
        }
    }

    /// Whether there are widgets on the window that react to the mouse.
    fn has_widgets(&self) -> bool {
        let explains = self.session.world().resource::<Explaining>().story.is_some();
        let is_open = self.help.open || self.palette.open || self.here.is_open() || self.leaving.question.is_some();
        is_open
            || self.browser.is_open()
            || self.form.is_open()
            || !self.renders.is_empty()
            || self.overlays && (self.panel.shown || explains || self.over_widgets || self.in_menu())
    }

    /// Whether a menu is open.
    fn in_menu(&self) -> bool {
        self.presenter.as_ref().is_some_and(|presenter| egui::Popup::is_any_open(presenter.egui_context()))
    }

    /// Whether a place of the window, in physical pixels, had a panel, a menu or another widget on it when it was drawn
    /// last. Overlays themselves know where the mouse was then: not after a jump, as of a finger on a screen.
    fn has_widget_at(&self, place: [f64; 2]) -> bool {
        let Some(presenter) = self.presenter.as_ref() else { return false };
        let (context, scale) = (presenter.egui_context(), presenter.pixels_per_point());
        let [x, y] = place.map(|pixels| pixels as f32 / scale);
        let place = egui::pos2(x, y);
        let layer = context.layer_id_at(place);
        layer.is_some_and(|layer| layer.order != egui::Order::Background) || !self.free.contains(place)
    }

    /// The projection to the image, and its size, in points.
    fn projector(&self) -> (Projector, DVec2) {
        let size = DVec2::from_array(self.input.size()) / self.scale();
        (Projector::new(&self.session.status().rig, size), size)
    }

    /// Gives the image another width if the panel, as it was drawn last, has been opened or closed.
    fn leave_room(&mut self, now: Instant) -> Result<(), PresentError> {
        let Some(presenter) = &self.presenter else { return Ok(()) };
        let covered = presenter.egui_context().content_rect().right() - self.free.right();
        if covered == self.covered {
            return Ok(());
        }
        let is_whole = covered > self.covered && self.session.picture().divider == 1;
        self.held = is_whole.then_some(self.session.status().restarts);
        self.covered = covered;
        self.resize_image();
        // Until there is a new image, the middle of this one is in the middle.
        if let Some(presenter) = &mut self.presenter {
            presenter.set_picture(self.session.picture(), self.input.size()[0] as u32)?;
        }
        self.repaint_at = Some(now);
        Ok(())
    }

    /// Whether focus follows the mouse, and the mouse is not in the panel.
    fn focus_follows(&self) -> bool {
        let follows = matches!(self.session.world().resource::<Focus>().target, FocusTarget::Cursor(_));
        follows && !self.over_widgets
    }
}

/// Whether an image is still better than a new one of the same view, in another width.
///
/// - `restarts`: when it was made.
fn outlasts(restarts: u64, status: &Status, new: &Picture) -> bool {
    status.restarts <= restarts + 1 && (new.divider > 1 || status.awaits_denoised)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::RenderProgress;

    #[test]
    fn an_image_is_held_until_there_is_one_as_good_of_the_same_view() {
        let lasts = |restarts, awaits_denoised, divider| {
            let progress = RenderProgress { awaits_denoised, ..RenderProgress::default() };
            let status = Status { progress, restarts, ..Status::default() };
            outlasts(3, &status, &Picture { divider, ..Picture::default() })
        };
        assert!(lasts(4, false, 3) && lasts(4, true, 1));
        assert!(!lasts(4, false, 1), "it is as good");
        assert!(!lasts(5, false, 3), "another view");
    }
}
