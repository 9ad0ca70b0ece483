//! Rendering while Python stays responsive: without its lock, with a progress callback, ended by Ctrl+C.

use crate::errors::{input, of_library};
use crate::image::Image;
use firstlight::prelude::{ErrorMetric, Flow, Integrator, PixelFilter, Progress, RenderOptions, SampleAllocation};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often Python looks for Ctrl+C.
const LOOK: Duration = Duration::from_millis(40);

/// Options of a rendering, by the names of the package.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RenderArgs {
    size: Option<(u32, u32)>,
    spp: Option<u32>,
    seconds: Option<f64>,
    error: Option<f64>,
    seed: Option<u32>,
    integrator: Option<String>,
    max_depth: Option<u32>,
    filter: Option<String>,
    adaptive: Option<bool>,
    exposure: f32,
    threads: Option<usize>,
    features: bool,
    denoise: bool,
}

impl RenderArgs {
    fn options(self) -> PyResult<RenderOptions> {
        let mut options = RenderOptions::default().exposure(self.exposure);
        if let Some((width, height)) = self.size {
            options = options.size(width, height);
        }
        if let Some(spp) = self.spp {
            options = options.spp(spp);
        }
        if let Some(seconds) = self.seconds {
            options = options.seconds(seconds);
        }
        if let Some(error) = self.error {
            options = options.error(error);
        }
        if let Some(seed) = self.seed {
            options = options.seed(seed);
        }
        if let Some(word) = self.integrator {
            options = options.integrator(choice::<Integrator>("integrator", &word)?);
        }
        if let Some(depth) = self.max_depth {
            options = options.max_depth(depth);
        }
        if let Some(word) = self.filter {
            options = options.filter(choice::<PixelFilter>("filter", &word)?);
        }
        if let Some(adaptive) = self.adaptive {
            options = options.allocation(match adaptive {
                true => SampleAllocation::Adaptive(ErrorMetric::RelativeMse),
                false => SampleAllocation::Uniform,
            });
        }
        if let Some(threads) = self.threads {
            options = options.threads(threads);
        }
        if self.features {
            options = options.features();
        }
        Ok(if self.denoise { options.denoise() } else { options })
    }
}

/// One of the words of a scene file.
fn choice<T: serde::de::DeserializeOwned>(field: &str, word: &str) -> PyResult<T> {
    serde_json::from_value(word.into()).map_err(|error| input(format!("`{field}`: {error}")))
}

enum News {
    Progress(Progress),
    Done,
}

/// Renders an image; returns it, and whether Ctrl+C ended it.
///
/// The image is rendered on a thread of its own. This one looks for Ctrl+C, which only Python's main thread gets, and
/// calls `progress`; an exception of it ends the rendering.
pub fn render(
    py: Python<'_>,
    scene: &Mutex<firstlight::Scene>,
    args: RenderArgs,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<(Image, bool)> {
    let (sender, news) = mpsc::channel();
    let news = Mutex::new(news);
    let stop = Arc::new(AtomicBool::new(false));
    let mut options = args.options()?;
    if progress.is_some() {
        let sender = sender.clone();
        options = options.on_progress(move |now| {
            // Fails if nobody listens any more.
            let _ = sender.send(News::Progress(*now));
            Flow::Continue
        });
    }
    let asked = stop.clone();
    options = options.stop_when(move || asked.load(Ordering::Relaxed));
    let (mut failed, mut interrupted) = (None, false);
    let result = std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let result = scene.lock().unwrap_or_else(PoisonError::into_inner).render(&options);
            let _ = sender.send(News::Done);
            result
        });
        let next = || news.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(LOOK);
        while !worker.is_finished() {
            match py.detach(next) {
                Ok(News::Done) | Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
                Ok(News::Progress(now)) => {
                    if let (Some(progress), false) = (&progress, stop.load(Ordering::Relaxed)) {
                        match tell(progress, &now) {
                            Ok(true) => {}
                            Ok(false) => stop.store(true, Ordering::Relaxed),
                            Err(error) => failed = Some(error),
                        }
                    }
                }
            }
            if let Err(error) = py.check_signals() {
                match error.is_instance_of::<PyKeyboardInterrupt>(py) && !interrupted {
                    true => interrupted = true,
                    false => failed = Some(error),
                }
            }
            if interrupted || failed.is_some() {
                stop.store(true, Ordering::Relaxed);
            }
        }
        py.detach(|| worker.join())
    });
    let result = result.unwrap_or_else(|panic| resume_unwind(panic));
    if let Some(error) = failed {
        return Err(error);
    }
    let image = result.map_err(of_library)?;
    if interrupted && image.spp() == 0 {
        return Err(PyKeyboardInterrupt::new_err("stopped before every pixel had a sample"));
    }
    Ok((Image::new(image), interrupted))
}

/// Calls a progress callback: samples per pixel, seconds, and the error if it is known. `False` ends the rendering.
fn tell(progress: &Bound<'_, PyAny>, now: &Progress) -> PyResult<bool> {
    let error = now.error.map(|error| error.relative);
    let answer = progress.call1((now.spp, now.seconds, error))?;
    Ok(answer.is_none() || answer.is_truthy()?)
}
