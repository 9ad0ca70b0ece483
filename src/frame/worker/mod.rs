//! The render thread: owns the film and a pool of workers, follows the [`Scheduler`](super::Scheduler), and hands over
//! finished images. It never accesses the world, and other threads wait for it only while a lock is held.
//!
//! A new job sets a flag that the workers poll, so that they abandon their work within milliseconds. Every job has a
//! generation number; an image carries that of its job.
//!
//! This file is the handle used by the session; `thread` is the thread itself, `show` makes the images, and `idle`
//! keeps memory.

mod denoised;
mod denoiser;
mod idle;
mod show;
mod thread;
mod views;

use super::denoising::{DenoiseFilter, Denoising};
use super::{LatencyHistogram, Picture, Target};
use crate::render::{
    BadSample, CausticChoice, Display, Explanation, Film, Inspection, Prepared, RayCounts, Region, RenderSettings,
    SeenSurface, worker_threads,
};
use glam::DVec3;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Threads that build trees, in a pool separate from the workers: work stealing in a shared pool would otherwise run
/// tree builds while an image waits.
const BESIDE: &str = "beside";
const WORKERS: &str = "firstlight";
const DENOISE: &str = "denoise";

/// Niceness of yielding threads: a third of the default weight. It is the same for both pools, so that samples of the
/// previous image do not slow down tree builds.
const NICENESS: i32 = 5;
/// Niceness of the threads that denoise while others add samples: a third of the weight of those.
const DENOISE_NICENESS: i32 = 10;

/// Called when there are new results.
pub type Waker = Arc<dyn Fn() + Send + Sync>;

/// What to render.
#[derive(Clone)]
pub struct Job {
    pub generation: u64,
    pub prepared: Prepared,
    pub settings: RenderSettings,
    pub width: u32,
    pub height: u32,
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

/// Progress of the current job.
#[derive(Clone, Debug, Default)]
pub struct Stats {
    pub generation: u64,
    /// Size of the film that the image was developed from.
    pub film_width: u32,
    pub film_height: u32,
    pub divider: u32,
    /// Minimum samples per pixel of that film.
    pub spp: u32,
    /// Region that gets all samples, in pixels of that film, and its samples per pixel.
    pub region: Option<(Region, u32)>,
    /// Render time since the restart, seconds.
    pub seconds: f64,
    /// Relative error of the whole image, or of the region, once it is known.
    pub error: Option<f64>,
    /// How caustics are rendered, if the scene may have any; for the film at full resolution.
    pub caustics: Option<CausticChoice>,
    /// How the displayed image is denoised.
    pub denoising: Denoising,
    /// The filter of the denoised image, if that is displayed.
    pub denoised_by: DenoiseFilter,
    /// Relative error of the denoised image, if that is displayed and known.
    pub denoised_error: Option<f64>,
    /// Samples per pixel of which it was made.
    pub denoised_spp: u32,
    /// Whether it is mixed with the raw image, which has more samples and the smaller error.
    pub mixes_raw: bool,
    /// Whether a denoised image is wanted at full resolution, and the first one is not there yet.
    pub awaits_denoised: bool,
    /// Rays of the latest steps, and the time that they took in seconds.
    pub recent_rays: RayCounts,
    pub recent_seconds: f64,
    /// Rays since the restart.
    pub rays: RayCounts,
    /// Wall time from the restart to the last of these rays, seconds.
    pub elapsed: f64,
    pub n_bad: u64,
    pub bad: Vec<BadSample>,
    pub n_above: u64,
    pub threads: usize,
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
    fn follow(&mut self, later: Self) {
        let Self { job, target, paused, threads, region } = later;
        self.job = job.or(self.job.take());
        self.target = target.or(self.target);
        self.paused = paused.or(self.paused);
        self.threads = threads.or(self.threads);
        self.region = region.or(self.region);
    }
}

/// Messages to the thread; a later message of a kind replaces an earlier one.
#[derive(Default)]
struct Inbox {
    orders: Orders,
    /// When the oldest job that has not been taken was posted, if the thread was busy then.
    posted: Option<Instant>,
    /// A better snapshot for the job of this generation, which gives the same samples.
    prepared: Option<(u64, Prepared)>,
    display: Option<Display>,
    look: Option<ViewOptions>,
    question: Option<(Question, Sender<Answer>)>,
    film_wanted: Vec<Sender<Film>>,
    to_keep: Vec<Sender<Film>>,
    quit: bool,
}

/// Results of the thread.
#[derive(Default)]
struct Outbox {
    picture: Picture,
    /// Whether the image has not been taken yet.
    fresh: bool,
    stats: Stats,
}

struct Shared {
    inbox: Mutex<Inbox>,
    arrived: Condvar,
    /// Set when the inbox has a message; polled by the workers.
    interrupt: AtomicBool,
    /// Whether the thread waits for a message.
    sleeping: AtomicBool,
    /// Number of the newest image displayed in a window; 0 if the window does not report it.
    seen: AtomicU64,
    outbox: Mutex<Outbox>,
    pool: Mutex<Arc<rayon::ThreadPool>>,
    beside: Mutex<Arc<rayon::ThreadPool>>,
    cancels: Mutex<LatencyHistogram>,
    /// The latest generation. What is denoised for another one is dropped before the render thread knows of it: the
    /// first samples need the processor.
    wanted: Arc<AtomicU64>,
    waker: Option<Waker>,
    yielding: bool,
}

impl Shared {
    /// A denoised image is there: a sleeping thread takes it at once, another one after its next step.
    fn tell_of_result(&self) {
        let inbox = lock(&self.inbox);
        if self.sleeping.load(Ordering::Acquire) {
            self.interrupt.store(true, Ordering::Release);
        }
        drop(inbox);
        self.arrived.notify_all();
    }
}

/// Handle of the render thread.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread.
    ///
    /// - `threads`: 0 for one per processor.
    /// - `yielding`: workers yield to other threads, such as those that draw a window.
    pub fn start(threads: usize, yielding: bool, target: Target, waker: Option<Waker>) -> Result<Self, String> {
        let shared = Arc::new(Shared {
            inbox: Mutex::default(),
            arrived: Condvar::new(),
            interrupt: AtomicBool::new(false),
            sleeping: AtomicBool::new(false),
            seen: AtomicU64::new(0),
            outbox: Mutex::default(),
            pool: Mutex::new(make_pool(threads, WORKERS, yielding.then_some(NICENESS))?),
            beside: Mutex::new(make_pool(threads, BESIDE, yielding.then_some(NICENESS))?),
            cancels: Mutex::default(),
            wanted: Arc::default(),
            waker,
            yielding,
        });
        let thread = std::thread::Builder::new()
            .name("firstlight render".to_owned())
            .spawn({
                let (shared, of_denoiser) = (shared.clone(), shared.clone());
                move || {
                    let (wanted, tell) = (shared.wanted.clone(), move || of_denoiser.tell_of_result());
                    let denoiser = denoiser::Denoiser::start(yielding, wanted, tell);
                    thread::Loop::new(&shared, denoiser, target).run();
                }
            })
            .map_err(|error| format!("cannot start the render thread: {error}"))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    pub fn order(&self, orders: Orders) {
        if orders.is_empty() {
            return;
        }
        if let Some(job) = &orders.job {
            self.shared.wanted.store(job.generation, Ordering::Relaxed);
        }
        let interrupts = orders.job.is_some() && !self.shared.sleeping.load(Ordering::Acquire);
        self.post(|inbox| {
            inbox.orders.follow(orders);
            inbox.posted = inbox.posted.or(interrupts.then(Instant::now));
        });
    }

    /// Replaces the snapshot of the job of this generation by one that gives the same samples faster; keeps all
    /// samples.
    pub fn set_prepared(&self, generation: u64, prepared: Prepared) {
        self.post(|inbox| inbox.prepared = Some((generation, prepared)));
    }

    /// Changes exposure and tone curve; keeps all samples.
    pub fn set_display(&self, display: Display) {
        self.post(|inbox| inbox.display = Some(display));
    }

    /// Changes the view; keeps all samples.
    pub fn set_look(&self, look: ViewOptions) {
        self.post(|inbox| inbox.look = Some(look));
    }

    /// Asks for the explanation of a pixel; never blocks. The sender is dropped if there can be no answer any more.
    pub fn ask(&self, question: Question) -> Receiver<Answer> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.question = Some((question, sender)));
        receiver
    }

    /// Latencies from posting a job until the thread abandoned its previous work.
    pub fn cancels(&self) -> LatencyHistogram {
        lock(&self.shared.cancels).clone()
    }

    /// Pool for other work, such as building trees, with as many threads as render.
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        lock(&self.shared.beside).clone()
    }

    /// Returns a copy of the film; blocks until the workers have paused, some milliseconds. `None` without a film, or
    /// after five seconds.
    pub fn film(&self) -> Option<Film> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.film_wanted.push(sender));
        receiver.recv_timeout(Duration::from_secs(5)).ok()
    }

    /// Requests the film of the current view for saving: see [`Session::keep_film`](super::Session::keep_film).
    pub fn keep_film(&self) -> Receiver<Film> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.to_keep.push(sender));
        receiver
    }

    /// Swaps `picture` with the newest image if there is a new one; returns whether it did.
    pub fn take(&self, picture: &mut Picture) -> bool {
        let mut outbox = lock(&self.shared.outbox);
        if !outbox.fresh {
            return false;
        }
        outbox.fresh = false;
        std::mem::swap(picture, &mut outbox.picture);
        true
    }

    pub fn stats(&self) -> Stats {
        lock(&self.shared.outbox).stats.clone()
    }

    /// Whether there is an image that has not been taken.
    pub fn has_picture(&self) -> bool {
        lock(&self.shared.outbox).fresh
    }

    /// Reports that the image of this number is displayed.
    pub fn note_seen(&self, number: u64) {
        // Under the lock, like any message, but without interrupting the workers.
        let inbox = lock(&self.shared.inbox);
        self.shared.seen.store(number, Ordering::Release);
        drop(inbox);
        self.shared.arrived.notify_all();
    }

    /// Whether there is nothing to do, and no message that could change that.
    pub fn is_asleep(&self) -> bool {
        self.shared.sleeping.load(Ordering::Acquire) && !self.shared.interrupt.load(Ordering::Acquire)
    }

    fn post(&self, write: impl FnOnce(&mut Inbox)) {
        let mut inbox = lock(&self.shared.inbox);
        write(&mut inbox);
        // Under the lock: otherwise the thread could check the flag, miss the notification, and wait forever.
        self.shared.interrupt.store(true, Ordering::Release);
        drop(inbox);
        self.shared.arrived.notify_all();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.post(|inbox| inbox.quit = true);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported already.
            let _ = thread.join();
        }
    }
}

fn make_pool(threads: usize, name: &'static str, niceness: Option<i32>) -> Result<Arc<rayon::ThreadPool>, String> {
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
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
