//! What the render thread and its handle share: jobs and orders, results, messages, thread pools.

use crate::frame::core::denoising::{DenoiseFilter, Denoising};
use crate::frame::core::latency::LatencyHistogram;
use crate::frame::core::offline::Target;
use crate::frame::core::status::{Picture, RenderProgress};
use crate::render::{
    Display, Explanation, Film, Inspection, Prepared, RayCounts, RenderSettings, SeenSurface, worker_threads,
};
use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Threads that build trees, in a pool separate from the workers: work stealing in a shared pool would otherwise run
/// tree builds while an image waits.
pub(super) const BESIDE: &str = "beside";
pub(super) const WORKERS: &str = "firstlight";
pub(super) const DENOISE: &str = "denoise";

/// Niceness of yielding threads: a third of the default weight. It is the same for both pools, so that samples of the
/// previous image do not slow down tree builds.
pub(super) const NICENESS: i32 = 5;
/// Niceness of the threads that denoise while others add samples: a third of the weight of those.
pub(super) const DENOISE_NICENESS: i32 = 10;

/// Called when there are new results.
pub type Waker = Arc<dyn Fn() + Send + Sync>;

/// What to render.
#[derive(Clone)]
pub struct Job {
    pub generation: u64,
    /// Jobs of the same number differ in the size of the image alone.
    pub view: u64,
    pub prepared: Prepared,
    pub settings: RenderSettings,
    pub width: u32,
    pub height: u32,
    /// While an animation plays: seconds from a frame of it to the next.
    pub pace: Option<f64>,
}

/// Display of the job; samples do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewOptions {
    /// What is displayed in place of the image.
    pub inspection: Inspection,
    /// Of the image itself, where no inspection is displayed.
    pub denoising: Denoising,
    /// Denoises at full resolution.
    pub filter: DenoiseFilter,
    /// Tints the pixels in focus and draws the focal plane.
    pub sharp_zone: bool,
}

/// A request to explain a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// Generation of the job that the position belongs to; the question is dropped when another job arrives.
    pub generation: u64,
    /// Position in fractions of the image from its upper left corner.
    pub x: f64,
    pub y: f64,
    pub n_samples: u32,
}

/// The explanation of a pixel.
#[derive(Clone, Debug)]
pub struct Answer {
    pub explanation: Explanation,
    /// Radiance from light paths at the pixel so far; `None` if the film is not at full resolution.
    pub light_traced: Option<DVec3>,
    /// The surface in the middle of the pixel.
    pub seen: Option<SeenSurface>,
}

/// State of the current job.
#[derive(Clone, Debug, Default)]
pub struct Stats {
    pub progress: RenderProgress,
    pub generation: u64,
    /// Rays of the latest steps, and the time that they took in seconds.
    pub recent_rays: RayCounts,
    pub recent_seconds: f64,
    /// Whether there is nothing left to do: the target is reached, or rendering is paused.
    pub asleep: bool,
    /// Whether the target is reached.
    pub done: bool,
    /// Failure of the renderer itself.
    pub failure: Option<String>,
}

/// Changed instructions for the thread. All of them take effect together: a target without its region would give
/// samples to the rest of the image.
#[derive(Default)]
pub struct Orders {
    /// Discards all samples; the other fields keep them.
    pub job: Option<Job>,
    pub target: Option<Target>,
    pub paused: Option<bool>,
    /// Number of threads; 0 for one per processor.
    pub threads: Option<usize>,
    /// The region that gets the next samples, in fractions of the image: left, top, right, bottom.
    pub region: Option<Option<[f64; 4]>>,
}

impl Orders {
    /// Whether there are no changes.
    pub fn is_empty(&self) -> bool {
        matches!(self, Self { job: None, target: None, paused: None, threads: None, region: None })
    }

    /// Merges later orders, which override earlier ones.
    pub(super) fn follow(&mut self, later: Self) {
        let Self { job, target, paused, threads, region } = later;
        self.job = job.or(self.job.take());
        self.target = target.or(self.target);
        self.paused = paused.or(self.paused);
        self.threads = threads.or(self.threads);
        self.region = region.or(self.region);
    }
}

/// A request for a film for saving.
pub(super) struct ToKeep {
    pub sender: Sender<KeptFilm>,
    /// Also the denoised image, if one is displayed or about to be.
    pub denoised: bool,
}

/// A film that is kept for saving.
#[derive(Clone)]
pub struct KeptFilm {
    /// Linear radiance.
    pub film: Film,
    /// The denoised image that is displayed, if it was asked for and is one at full resolution.
    pub denoised: Option<KeptDenoised>,
}

/// A denoised image that is displayed.
#[derive(Clone)]
pub struct KeptDenoised {
    /// Radiance of each pixel, row by row from the top; W·m⁻²·sr⁻¹.
    pub colors: Vec<Vec3>,
    /// The filter that was used.
    pub by: DenoiseFilter,
}

/// Messages to the thread; a later message of a kind replaces an earlier one.
#[derive(Default)]
pub(super) struct Inbox {
    pub orders: Orders,
    /// When the oldest job that has not been taken was posted, if the thread was busy then.
    pub posted: Option<Instant>,
    /// A better snapshot for the job of this generation, which gives the same samples.
    pub prepared: Option<(u64, Prepared)>,
    pub display: Option<Display>,
    pub look: Option<ViewOptions>,
    pub question: Option<(Question, Sender<Answer>)>,
    pub film_wanted: Vec<Sender<Film>>,
    pub to_keep: Vec<ToKeep>,
    pub quit: bool,
}

/// Results of the thread.
#[derive(Default)]
pub(super) struct Outbox {
    pub picture: Picture,
    /// Whether the image has not been taken yet.
    pub fresh: bool,
    pub stats: Stats,
}

pub(super) struct Shared {
    pub inbox: Mutex<Inbox>,
    pub arrived: Condvar,
    /// Set when the inbox has a message; polled by the workers.
    pub interrupt: AtomicBool,
    /// Whether the thread waits for a message.
    pub sleeping: AtomicBool,
    /// Number of the newest image displayed in a window; 0 if the window does not report it.
    pub seen: AtomicU64,
    pub outbox: Mutex<Outbox>,
    pub pool: Mutex<Arc<rayon::ThreadPool>>,
    pub beside: Mutex<Arc<rayon::ThreadPool>>,
    pub cancels: Mutex<LatencyHistogram>,
    /// The latest generation. What is denoised for another one is dropped before the render thread knows of it: the
    /// first samples need the processor.
    pub wanted: Arc<AtomicU64>,
    pub waker: Option<Waker>,
    pub yielding: bool,
}

impl Shared {
    /// A denoised image is there: a sleeping thread takes it at once, another one after its next step.
    pub(super) fn tell_of_result(&self) {
        let inbox = lock(&self.inbox);
        if self.sleeping.load(Ordering::Acquire) {
            self.interrupt.store(true, Ordering::Release);
        }
        drop(inbox);
        self.arrived.notify_all();
    }
}

pub(super) fn make_pool(
    threads: usize,
    name: &'static str,
    niceness: Option<i32>,
) -> Result<Arc<rayon::ThreadPool>, String> {
    worker_threads()
        .num_threads(threads)
        .thread_name(move |i| format!("{name} {i}"))
        .start_handler(move |_| {
            if let Some(niceness) = niceness {
                yield_to_others(niceness);
            }
        })
        .build()
        .map(Arc::new)
        .map_err(|error| format!("cannot start {threads} worker threads: {error}"))
}

/// Lowers the priority of this thread, so that it gets the processor time that others leave.
fn yield_to_others(_niceness: i32) {
    // Niceness per thread exists on Linux only.
    #[cfg(target_os = "linux")]
    {
        // Niceness may always be raised; if it fails, the priority stays as it is.
        let _ = rustix::process::setpriority_process(None, _niceness);
    }
}

/// Locks a mutex; poisoning is ignored, because the data is consistent at every point where a thread could panic.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
