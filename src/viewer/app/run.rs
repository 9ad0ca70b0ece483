//! From the first window to the last file: the event loop is started here, and what outlives it is stored.

use crate::console;
use crate::frame::{LatencyHistogram, Waker};
use crate::render::Inspection;
use crate::viewer::app::options::{ViewerError, ViewerOptions};
use crate::viewer::app::tick::title;
use crate::viewer::app::{App, Wake};
use crate::viewer::display::{self, DisplayServer};
use crate::viewer::overlay;
use crate::viewer::presenter::Presenter;
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use winit::dpi::LogicalSize;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::Window;

/// Exit status of a program that is stopped twice, by the convention of shells.
const STOPPED: i32 = 130;
/// Seconds of rendering after which an image has little enough noise for its size in a menu.
const THUMBNAIL_SECONDS: f64 = 1.0;

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
    if let Some(trouble) = app.session.end_record() {
        console::remark(format_args!("error: {trouble}"));
    }
    app.keep_window_size();
    app.keep_panel();
    app.keep_view();
    app.keep_thumbnail(true);
    for outcome in app.renders.finish() {
        app.report_outcome(outcome);
    }
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
    // The process ends after this: waiting for workers and freeing a large scene would only take time. If the display is
    // lost, its window and surface can no longer be released either.
    std::mem::forget(app);
    ended
}

impl App {
    pub(super) fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewerError> {
        let size = fitting(event_loop, self.options.width, self.options.height);
        self.fitted_size = (size.width as u32, size.height as u32);
        self.title = title(&self.options.source.title(), false);
        let attributes = Window::default_attributes().with_title(&self.title).with_inner_size(size);
        let window = Arc::new(event_loop.create_window(attributes).map_err(ViewerError::NoWindow)?);
        let presenter = Presenter::new(window.clone())?;
        overlay::style(presenter.egui_context());
        (self.window, self.presenter) = (Some(window), Some(presenter));
        self.resized();
        Ok(())
    }

    /// Keeps the image for the list of recent files, once it is one.
    ///
    /// - `again`: also if there is one already, as at the end.
    pub(super) fn keep_thumbnail(&mut self, again: bool) {
        let (status, picture) = (self.session.status(), self.session.picture());
        let is_image = picture.inspection == Inspection::Picture && picture.divider == 1 && self.is_rendered();
        if is_image && !status.scene.is_empty() && (status.done || status.seconds >= THUMBNAIL_SECONDS) {
            self.memory.keep_thumbnail(picture, again);
        }
    }

    /// Stores the view at which the scene is left, at exit.
    fn keep_view(&mut self) {
        if let Some(trouble) = self.memory.leave() {
            log::warn!("{trouble}");
        }
    }

    /// Stores the state of the panel, at exit.
    fn keep_panel(&self) {
        if let Some(trouble) = self.memory.keep_panel(&self.panel) {
            log::warn!("{trouble}");
        }
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
