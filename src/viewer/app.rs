//! The event loop: who is asked when, and when to sleep.
//!
//! Three things happen, each as seldom as it may. *Events* only note what a person did. A *tick* hands that to the
//! session, lets it go on, and finds out whether there is anything new to see; it runs after events, when a worker has
//! news, and while a key is held. *Drawing* follows a tick that found something new. Nothing else runs, so a finished
//! picture costs nothing.

use super::display::Display;
use super::handles::Handles;
use super::input::Input;
use super::keys::Action;
use super::overlay::Help;
use super::panel::{self, PanelState};
use super::presenter::{PresentError, Presenter};
use super::reaction::Reaction;
use super::saver::{Saved, Saver, new_scene_file};
use super::status;
use super::toasts::{Toasts, Tone};
use super::{camera_text, display, overlay};
use crate::frame::{
    Command, Edit, Looking, MessageKind, PictureFormat, Selection, Session, SessionOptions, Settings, SettingsStore,
    Target, Waker, gizmo,
};
use crate::render::{Inspection, Integrator};
use crate::scene::{SceneSource, UpAxis};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use thiserror::Error;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{MouseButton, MouseScrollDelta, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Fullscreen, Window, WindowId};

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
    /// Where kept pictures go.
    pub folder: PathBuf,
    /// Where to write down what is done.
    pub record: Option<PathBuf>,
}

/// Why the window could not be opened, or closed by itself.
#[derive(Debug, Error)]
pub enum ViewerError {
    #[error(
        "no window can be opened: the display does not answer; check DISPLAY or WAYLAND_DISPLAY, or render without a window: firstlight render SCENE -o out.png"
    )]
    NoDisplay,
    #[error("no window can be opened: {0}")]
    NoWindow(winit::error::OsError),
    #[error("the event loop ended by itself: {0}")]
    EventLoop(winit::error::EventLoopError),
    #[error("{0}")]
    Session(String),
    #[error("{0}")]
    Scene(String),
    #[error(transparent)]
    Present(#[from] PresentError),
}

/// A worker has news.
#[derive(Clone, Copy, Debug)]
struct Wake;

/// Ticks and frames come no faster: more would only cost the workers their processors.
const FRAME: Duration = Duration::from_micros(8_000);
/// So long a movement waits for the picture of the one before it.
const LATEST: Duration = Duration::from_millis(250);
/// Figures that change by themselves are shown again so often.
const FIGURES: Duration = Duration::from_millis(250);
/// What a window stops at by itself, so that nothing runs hot for ever: an error that nobody sees.
const GOOD_ENOUGH: Target = Target { spp: None, seconds: None, error: Some(0.005) };
/// Pixels of a touchpad that count as a notch of a wheel.
const PIXELS_A_NOTCH: f64 = 40.0;

/// Opens a window and stays until it is closed.
pub fn run(options: ViewerOptions) -> Result<(), ViewerError> {
    let mut builder = EventLoop::<Wake>::with_user_event();
    match display::find() {
        Display::Default => {}
        Display::None => return Err(ViewerError::NoDisplay),
        Display::ForceX11 => {
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
    let mut app = App::new(options, pending, waker)?;
    event_loop.run_app(&mut app).map_err(ViewerError::EventLoop)?;
    app.session.end_record();
    app.keep_window_size();
    for saved in app.saver.finish() {
        app.tell_saved(saved);
    }
    app.failure.map_or(Ok(()), Err)
}

struct App {
    options: ViewerOptions,
    /// The session's clock counts from here.
    start: Instant,
    /// A wake-up is on its way.
    pending: Arc<AtomicBool>,
    session: Session,
    saver: Saver,
    input: Input,
    toasts: Toasts,
    help: Help,
    panel: PanelState,
    handles: Handles,
    reaction: Reaction,
    overlays: bool,
    // Before the window, so that the device goes before the display.
    presenter: Option<Presenter>,
    window: Option<Arc<Window>>,
    title: String,
    /// Logical pixels.
    window_size: (u32, u32),
    occluded: bool,
    /// Something happened since the last tick.
    stirred: bool,
    /// The picture on the window.
    shown_picture: Option<u64>,
    shown_figures: String,
    last_tick: Option<Instant>,
    /// When a movement was last handed over.
    steered_at: Instant,
    last_draw: Option<Instant>,
    /// When to tick again even if nothing happens.
    wake_at: Option<Instant>,
    /// When the overlays want to be drawn again.
    repaint_at: Option<Instant>,
    failure: Option<ViewerError>,
}

impl App {
    fn new(options: ViewerOptions, pending: Arc<AtomicBool>, waker: Waker) -> Result<Self, ViewerError> {
        let mut session = Session::new(SessionOptions {
            width: options.width,
            height: options.height,
            threads: options.threads,
            seed: options.seed,
            target: GOOD_ENOUGH,
            up: options.up,
            waker: Some(waker.clone()),
        })
        .map_err(ViewerError::Session)?;
        if let Some(path) = &options.record {
            session.record(path, &options.source, options.up).map_err(ViewerError::Session)?;
        }
        session.open(options.source.clone());
        let start = Instant::now();
        Ok(Self {
            start,
            steered_at: start,
            pending,
            session,
            saver: Saver::new(&options.folder, waker),
            input: Input::new(options.width, options.height),
            toasts: Toasts::default(),
            help: Help::default(),
            panel: PanelState::default(),
            handles: Handles::default(),
            reaction: Reaction::default(),
            overlays: true,
            presenter: None,
            window: None,
            title: String::new(),
            window_size: (options.width, options.height),
            occluded: false,
            stirred: true,
            shown_picture: None,
            shown_figures: String::new(),
            last_tick: None,
            last_draw: None,
            wake_at: None,
            repaint_at: None,
            failure: None,
            options,
        })
    }

    /// For the next window.
    fn keep_window_size(&self) {
        let store = SettingsStore::of_platform();
        let settings = Settings { window: Some(self.window_size), ..store.settings().0 };
        if let Err(error) = store.keep_settings(&settings) {
            log::warn!("{error}");
        }
    }

    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewerError> {
        let size = LogicalSize::new(self.options.width, self.options.height);
        self.title = title(&self.options.source.title());
        let attributes = Window::default_attributes().with_title(&self.title).with_inner_size(size);
        let window = Arc::new(event_loop.create_window(attributes).map_err(ViewerError::NoWindow)?);
        let presenter = Presenter::new(window.clone())?;
        overlay::style(presenter.egui_context());
        (self.window, self.presenter) = (Some(window), Some(presenter));
        self.resized();
        self.toasts.add(Tone::News, "H shows the keys, N the panel", Instant::now());
        Ok(())
    }

    /// The window may have another size, or another scale.
    fn resized(&mut self) {
        let (Some(window), Some(presenter)) = (&self.window, &self.presenter) else { return };
        let size = window.inner_size();
        let logical = size.to_logical::<u32>(window.scale_factor());
        if logical.width > 0 && logical.height > 0 && window.fullscreen().is_none() {
            self.window_size = (logical.width, logical.height);
        }
        let (width, height) = (size.width.min(presenter.max_side()), size.height.min(presenter.max_side()));
        self.input.resize(width, height);
        self.session.send(Command::Resize { width, height });
        self.stirred = true;
        window.request_redraw();
    }

    /// Hands over what was asked for, lets the session go on, and looks for something new.
    fn tick(&mut self, now: Instant, event_loop: &ActiveEventLoop) {
        self.stirred = false;
        self.last_tick = Some(now);
        let clock = now - self.start;
        let restarts = self.session.status().restarts;
        self.session.update(clock);
        // A movement that came before the last one was seen would only take its place: it waits, and adds up.
        let answered = self.is_answered(now);
        if answered {
            self.steer(now, clock);
            let generation = self.session.status().restarts;
            self.reaction.carried_out((generation != restarts).then_some(generation));
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
        let title = title(&self.session.status().scene);
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
        if !self.occluded && (new_picture || repaint || (new_figures && figures_due)) {
            window.request_redraw();
        }
        let moving = match answered {
            true => self.input.is_moving().then(|| now + FRAME),
            false => Some(self.steered_at + LATEST),
        };
        let figures = (new_figures && !figures_due).then(|| self.last_draw.map_or(now, |then| then + FIGURES));
        let repaint_at = self.repaint_at.filter(|at| *at > now);
        let session = self.session.next_wake(clock).map(|at| self.start + at);
        self.wake_at = [session, self.toasts.next_change(), moving, figures, repaint_at].into_iter().flatten().min();
    }

    /// The last change of the view has been rendered, or that takes too long to wait for.
    fn is_answered(&self, now: Instant) -> bool {
        let rendered = self.session.picture().generation >= self.session.status().restarts;
        rendered || now >= self.steered_at + LATEST
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

    fn figures(&self) -> String {
        let status = self.session.status();
        format!("{}\n{}", status::figures(status), status::settings(status))
    }

    fn draw(&mut self, now: Instant) -> Result<(), PresentError> {
        let figures = self.figures();
        let (Some(presenter), Some(window)) = (&mut self.presenter, &self.window) else { return Ok(()) };
        let picture = self.session.picture();
        if self.shown_picture != Some(picture.number) {
            presenter.set_picture(picture)?;
            tracing::debug!("picture {} of view {} at 1/{}", picture.number, picture.generation, picture.divider);
            self.shown_picture = Some(picture.number);
        }
        let scale = f64::from(presenter.pixels_per_point());
        let size = window.inner_size();
        let size = glam::DVec2::new(f64::from(size.width), f64::from(size.height)) / scale;
        self.handles.update(&mut self.session, self.panel.gizmo, size);
        let (session, handles, panel) = (&self.session, &self.handles, &mut self.panel);
        let around = panel::Around {
            reaction: &self.reaction,
            speed: self.input.speed(),
            spinning: self.input.is_spinning(),
            memory: panel.shown.then(memory_of_process).flatten(),
        };
        let mut asked = panel::Asked::default();
        let (left, right) = figures.split_once('\n').unwrap_or((&figures, ""));
        let (toasts, help, overlays) = (self.toasts.at(now), &mut self.help, self.overlays);
        let presented = presenter.present(|context| {
            if overlays {
                handles.draw(context);
                if panel.shown {
                    panel::show(context, panel, session, &around, &mut asked);
                }
                let inspection = session.world().resource::<Looking>().0.inspection;
                if inspection != Inspection::Picture {
                    overlay::legend(context, inspection.label(), session.status().legend);
                }
                overlay::status_line(context, left, right);
                overlay::toasts(context, toasts);
            }
            if help.open {
                overlay::help(context, help);
            }
        })?;
        self.reaction.shown(self.session.picture().generation, Instant::now());
        tracing::trace!("drawn in {:.1} ms", now.elapsed().as_secs_f64() * 1e3);
        if presented.again {
            window.request_redraw();
        }
        self.repaint_at = now.checked_add(presented.repaint_after).filter(|_| presented.repaint_after < Duration::MAX);
        self.last_draw = Some(now);
        self.shown_figures = figures;
        // The overlays may have asked for a time that the last tick did not know.
        self.wake_at = self.wake_at.into_iter().chain(self.repaint_at).min();
        self.carry_out(asked, now);
        Ok(())
    }

    /// Draws; if the graphics device is lost, makes a new one; if that fails too, keeps the light and gives up.
    fn draw_or_leave(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        let Err(error) = self.draw(now) else { return };
        log::error!("{error}");
        self.presenter = None;
        self.shown_picture = None;
        let again = self.window.clone().map(Presenter::new);
        match again {
            Some(Ok(presenter)) => {
                overlay::style(presenter.egui_context());
                self.presenter = Some(presenter);
                if self.draw(now).is_ok() {
                    return;
                }
            }
            Some(Err(error)) => log::error!("{error}"),
            None => {}
        }
        self.screenshot(true);
        self.failure = Some(error.into());
        event_loop.exit();
    }

    /// What was asked for in the panel.
    fn carry_out(&mut self, asked: panel::Asked, now: Instant) {
        if !asked.commands.is_empty() {
            self.reaction.asked(now);
            self.stirred = true;
        }
        for command in asked.commands {
            self.session.send(command);
        }
        if let Some(speed) = asked.speed {
            self.input.set_speed(speed, now);
        }
        if asked.toggle_spin {
            self.input.toggle_spin(now);
            self.stirred = true;
        }
        if let Some(linear) = asked.screenshot {
            self.screenshot(linear);
        }
    }

    /// The mouse in points, as overlays count.
    fn mouse(&self) -> glam::DVec2 {
        let scale = self.presenter.as_ref().map_or(1.0, |presenter| f64::from(presenter.pixels_per_point()));
        glam::DVec2::from_array(self.input.cursor_place()) / scale
    }

    fn act(&mut self, action: Action, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        match action {
            Action::Send(command) => self.session.send(command),
            Action::TogglePause => {
                let paused = self.session.status().paused;
                self.session.send(if paused { Command::Resume } else { Command::Pause });
            }
            Action::ToggleIntegrator => {
                let other = match self.session.status().integrator {
                    Integrator::Path => Integrator::Phong,
                    Integrator::Phong => Integrator::Path,
                };
                self.session.send(Command::SetIntegrator(other));
            }
            Action::Screenshot { linear } => self.screenshot(linear),
            Action::SaveScene { new } => {
                let known = self.session.scene_file().filter(|_| !new);
                let path = known.unwrap_or_else(|| new_scene_file(&self.options.folder, &self.session.status().scene));
                self.session.send(Command::SaveScene { path });
            }
            Action::PrintView => {
                let text = camera_text::camera_text(&self.session.status().rig);
                // Standard output may be closed; the window goes on.
                match writeln!(std::io::stdout(), "{text}") {
                    Ok(()) => self.toasts.add(Tone::News, "camera printed to the terminal", now),
                    Err(error) => self.toasts.add(Tone::Problem, format!("the camera was not printed: {error}"), now),
                }
            }
            Action::Inspect(inspection) => {
                let shown = self.session.world().resource::<Looking>().0.inspection;
                let wanted = if shown == inspection { Inspection::Picture } else { inspection };
                self.session.send(Command::SetInspection(wanted));
            }
            Action::ToggleSharpZone => {
                let shown = !self.session.world().resource::<Looking>().0.sharp_zone;
                self.session.send(Command::SetSharpZone { shown });
                if shown && !self.session.status().rig.lens.enabled {
                    self.toasts.add(Tone::News, "all is sharp: O opens the lens", now);
                }
            }
            Action::NextGizmo => {
                let modes = gizmo::Mode::ALL;
                self.panel.gizmo = match self.panel.gizmo {
                    None => Some(modes[0]),
                    Some(mode) => modes.into_iter().skip_while(|other| *other != mode).nth(1),
                };
                let name = self.panel.gizmo.map_or("no handles", gizmo::Mode::label);
                let hint =
                    if self.session.world().resource::<Selection>().0.is_empty() { ": click on something" } else { "" };
                self.toasts.add(Tone::News, format!("handles: {name}{hint}"), now);
            }
            Action::ToggleSpin => self.input.toggle_spin(now),
            Action::TogglePanel => self.panel.shown = !self.panel.shown,
            Action::ToggleHelp => self.help.toggle(),
            Action::ToggleOverlays => self.overlays = !self.overlays,
            Action::ToggleFullscreen => {
                if let Some(window) = &self.window {
                    let full = window.fullscreen().is_some();
                    window.set_fullscreen((!full).then_some(Fullscreen::Borderless(None)));
                }
            }
            Action::Leave if self.help.open => self.help.open = false,
            Action::Leave if !self.session.world().resource::<Selection>().0.is_empty() => {
                self.session.send(Command::Edit(Edit::SelectNone));
            }
            Action::Leave | Action::Quit => event_loop.exit(),
        }
        self.repaint_at = Some(now);
    }

    fn screenshot(&mut self, linear: bool) {
        let format = if linear { PictureFormat::Exr } else { PictureFormat::Png };
        let status = self.session.status();
        let picture = self.session.picture();
        let size = (picture.width.max(1), picture.height.max(1));
        let (display, scene) = (status.display, status.scene.clone());
        let draft = (!scene.is_empty()).then(|| self.session.shot_draft());
        self.saver.save(self.session.keep_film(), draft, display, size, &scene, format);
    }

    fn tell_saved(&mut self, saved: Saved) {
        let now = Instant::now();
        match saved {
            Ok(kept) => {
                let coarse = if kept.coarse { ", coarse because the view changed at once" } else { "" };
                let news = format!("saved {}{coarse}", kept.path.display());
                eprintln!("{news}");
                self.toasts.add(Tone::News, news, now);
            }
            Err(error) => {
                eprintln!("error: {error}");
                self.toasts.add(Tone::Problem, error, now);
            }
        }
    }
}

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none()
            && let Err(error) = self.open_window(event_loop)
        {
            self.failure = Some(error);
            event_loop.exit();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: Wake) {
        self.pending.store(false, Ordering::Release);
        self.stirred = true;
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let now = Instant::now();
        if event == WindowEvent::RedrawRequested {
            self.draw_or_leave(event_loop);
            return;
        }
        let Some(presenter) = &mut self.presenter else { return };
        let response = presenter.on_window_event(&event);
        // Overlays take the keyboard only while somebody types into them; they always want Tab, which is ours.
        let typing = presenter.egui_context().wants_keyboard_input();
        let has_widgets = self.help.open || self.panel.shown && self.overlays;
        if response.repaint && has_widgets && !self.input.is_dragging() {
            self.repaint_at = Some(now);
        }
        self.stirred = true;
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => self.resized(),
            WindowEvent::Occluded(occluded) => {
                self.occluded = occluded;
                self.session.send(Command::SetHidden { hidden: occluded });
                self.repaint_at = Some(now);
            }
            WindowEvent::Focused(false) => self.input.release_all(now),
            WindowEvent::DroppedFile(path) => self.session.send(Command::Open { path }),
            WindowEvent::ModifiersChanged(modifiers) => {
                self.input.set_modifiers(modifiers.state(), now);
            }
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                let pressed = event.state.is_pressed();
                // Typing into the list of keys must not keep a person in it.
                let leaves = event.logical_key == Key::Named(NamedKey::Escape);
                if pressed && typing && !(leaves && self.help.open) {
                    return;
                }
                if pressed {
                    self.reaction.asked(now);
                }
                if let Some(action) = self.input.key(event.physical_key, &event.logical_key, pressed, event.repeat, now)
                {
                    self.act(action, event_loop);
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.input.cursor(position.x, position.y);
                if self.input.is_dragging() || self.handles.is_grabbed() {
                    self.reaction.asked(now);
                }
                let (mouse, snap) = (self.mouse(), self.input.modifiers().control_key());
                let (command, news) = self.handles.mouse_at(mouse, snap);
                if let Some(command) = command {
                    self.session.send(command);
                }
                if news {
                    self.repaint_at = Some(now);
                }
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. }
                if !state.is_pressed() && self.handles.release() =>
            {
                self.session.send(Command::Edit(Edit::End));
                self.repaint_at = Some(now);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. }
                if state.is_pressed() && !response.consumed && self.handles.grab(self.mouse()) =>
            {
                self.session.send(Command::Edit(Edit::Begin));
            }
            WindowEvent::MouseInput { state, button, .. } if !(state.is_pressed() && response.consumed) => {
                self.input.button(button, state.is_pressed(), now);
                self.reaction.asked(now);
                // What is selected is drawn, and changes no picture.
                self.repaint_at = Some(now);
            }
            WindowEvent::MouseWheel { delta, .. } if !response.consumed => {
                // Shift turns a vertical wheel into a horizontal one on some systems.
                let notches = match delta {
                    MouseScrollDelta::LineDelta(x, y) => f64::from(x + y),
                    MouseScrollDelta::PixelDelta(by) => (by.x + by.y) / PIXELS_A_NOTCH,
                };
                if self.input.wheel(notches, now) {
                    self.toasts.add(Tone::News, format!("speed ×{:.2}", self.input.speed()), now);
                }
            }
            _ => {}
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let StartCause::ResumeTimeReached { .. } = cause {
            self.wake_at = None;
            self.stirred = true;
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        if self.stirred {
            match self.last_tick.map(|then| then + FRAME).filter(|soon| *soon > now) {
                Some(soon) => self.wake_at = Some(soon),
                None => self.tick(now, event_loop),
            }
        }
        event_loop.set_control_flow(self.wake_at.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The device goes before the display does.
        self.presenter = None;
        self.window = None;
    }
}

/// Bytes that the process holds, where the system tells.
fn memory_of_process() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * PAGE)
}

/// Linux on the processors that we know counts memory in pages of this many bytes.
const PAGE: u64 = 4096;

fn title(scene: &str) -> String {
    let name = Path::new(scene).file_name().map_or(scene.into(), |name| name.to_string_lossy());
    if name.is_empty() { "firstlight".to_owned() } else { format!("firstlight — {name}") }
}
