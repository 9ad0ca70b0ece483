//! The thread that renders: it owns the film and a pool of workers, does what the [`Scheduler`](super::Scheduler)
//! says, and hands over finished pictures. It never touches the world, and nobody ever waits for it longer than a lock
//! is held.
//!
//! A new job raises a flag that the workers look at all the time, so that they drop what they are at within
//! milliseconds. Every job has a generation; a picture carries the one of its job.
//!
//! Here is the near end; `thread` is the far one, `show` what it hands over, and `idle` the memory it keeps.

mod idle;
mod show;
mod thread;
mod views;

use super::{LatencyHistogram, Picture, Target};
use crate::render::{
    BadSample, CausticChoice, Display, Explanation, Film, Inspection, Prepared, RayCounts, Region, RenderSettings,
    worker_threads,
};
use glam::DVec3;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Threads that trees are built on, beside those that render. Were they the same, a picture would wait for a tree: who waits
/// for a part of the one may be given a part of the other to do.
const BESIDE: &str = "beside";
const WORKERS: &str = "firstlight";

/// How far yielding threads give way, workers and those beside them alike: they have a third of the weight of others. Who has asked for a mesh or a
/// tree waits for that, and not for more samples of the picture before it.
const NICENESS: i32 = 5;

/// Called whenever there is something new to be looked at.
pub type Waker = Arc<dyn Fn() + Send + Sync>;

/// What to render from now on.
#[derive(Clone)]
pub struct Job {
    pub generation: u64,
    pub prepared: Prepared,
    pub settings: RenderSettings,
    pub width: u32,
    pub height: u32,
}

/// What is shown of it; no sample depends on this.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewOptions {
    /// What is shown in place of the picture.
    pub inspection: Inspection,
    /// Tint what is sharp, and draw the focal plane.
    pub sharp_zone: bool,
}

/// A pixel to be explained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// Of the job that the place belongs to; the question is void when another one has come.
    pub generation: u64,
    /// Fractions of the picture from its upper left corner.
    pub x: f64,
    pub y: f64,
    pub n_samples: u32,
}

/// Why the pixel looks as it does, and what the film has there.
#[derive(Clone, Debug)]
pub struct Answer {
    pub explanation: Explanation,
    /// What light paths have brought there so far; `None` where the film is not at full resolution.
    pub light_traced: Option<DVec3>,
}

/// How far the current job is.
#[derive(Clone, Debug, Default)]
pub struct Stats {
    pub generation: u64,
    /// Of the film that the picture was developed from.
    pub film_width: u32,
    pub film_height: u32,
    pub divider: u32,
    /// Samples that every pixel of that film has.
    pub spp: u32,
    /// What gets all samples now, in pixels of that film, and how many it has.
    pub region: Option<(Region, u32)>,
    /// Seconds of rendering since the restart.
    pub seconds: f64,
    /// Relative error of the whole picture, or of the region, when it is known.
    pub error: Option<f64>,
    /// How it looks for caustics, where the scene may have some; of the film at full resolution.
    pub caustics: Option<CausticChoice>,
    /// Relative error of the denoised picture, where that is shown.
    pub denoised_error: Option<f64>,
    /// Rays of the last steps, and the seconds that they took.
    pub recent_rays: RayCounts,
    pub recent_seconds: f64,
    /// Since the restart.
    pub rays: RayCounts,
    /// Seconds from the restart to the last of these rays, whatever they were spent on.
    pub elapsed: f64,
    pub n_bad: u64,
    pub bad: Vec<BadSample>,
    pub n_above: u64,
    pub threads: usize,
    /// Nothing is left to do: the target is reached, or it is paused.
    pub asleep: bool,
    /// The target is reached.
    pub done: bool,
    /// What went wrong in the renderer itself.
    pub failure: Option<String>,
}

/// What is to be done from now on, as far as it has changed. All of it takes effect at once: a target without the
/// region that it is meant for would give samples to the rest.
#[derive(Default)]
pub struct Orders {
    /// Throws all samples away; the rest keeps them.
    pub job: Option<Job>,
    pub target: Option<Target>,
    pub paused: Option<bool>,
    /// 0 is one a processor.
    pub threads: Option<usize>,
    /// What gets the next samples, in fractions of the picture: left, top, right, bottom.
    pub region: Option<Option<[f64; 4]>>,
}

impl Orders {
    /// Whether nothing has changed.
    pub fn is_empty(&self) -> bool {
        matches!(self, Self { job: None, target: None, paused: None, threads: None, region: None })
    }

    /// Later orders take the place of earlier ones.
    fn follow(&mut self, later: Self) {
        let Self { job, target, paused, threads, region } = later;
        self.job = job.or(self.job.take());
        self.target = target.or(self.target);
        self.paused = paused.or(self.paused);
        self.threads = threads.or(self.threads);
        self.region = region.or(self.region);
    }
}

/// Messages to the thread; a later one of a kind takes the place of an earlier one.
#[derive(Default)]
struct Inbox {
    orders: Orders,
    /// When the first job that has not been taken over was posted, if the thread was at work then.
    posted: Option<Instant>,
    /// Of the job of this generation: gives the same samples.
    prepared: Option<(u64, Prepared)>,
    display: Option<Display>,
    look: Option<ViewOptions>,
    question: Option<(Question, Sender<Answer>)>,
    film_wanted: Vec<Sender<Film>>,
    to_keep: Vec<Sender<Film>>,
    quit: bool,
}

/// What the thread has to show.
#[derive(Default)]
struct Outbox {
    picture: Picture,
    /// The picture has not been taken yet.
    fresh: bool,
    stats: Stats,
}

struct Shared {
    inbox: Mutex<Inbox>,
    arrived: Condvar,
    /// Something lies in the inbox: come and look.
    interrupt: AtomicBool,
    /// The thread waits for a message.
    sleeping: AtomicBool,
    /// Number of the newest picture that is on a window; 0 when nobody tells.
    seen: AtomicU64,
    outbox: Mutex<Outbox>,
    pool: Mutex<Arc<rayon::ThreadPool>>,
    beside: Mutex<Arc<rayon::ThreadPool>>,
    cancels: Mutex<LatencyHistogram>,
    waker: Option<Waker>,
    yielding: bool,
}

/// The near end of the thread.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// `threads`: 0 is one a processor.
    /// With `yielding`, workers give way to other threads, such as those that draw a window.
    pub fn start(threads: usize, yielding: bool, target: Target, waker: Option<Waker>) -> Result<Self, String> {
        let shared = Arc::new(Shared {
            inbox: Mutex::default(),
            arrived: Condvar::new(),
            interrupt: AtomicBool::new(false),
            sleeping: AtomicBool::new(false),
            seen: AtomicU64::new(0),
            outbox: Mutex::default(),
            pool: Mutex::new(make_pool(threads, WORKERS, yielding)?),
            beside: Mutex::new(make_pool(threads, BESIDE, yielding)?),
            cancels: Mutex::default(),
            waker,
            yielding,
        });
        let thread = std::thread::Builder::new()
            .name("firstlight render".to_owned())
            .spawn({
                let shared = shared.clone();
                move || thread::Loop::new(&shared, target).run()
            })
            .map_err(|error| format!("cannot start the render thread: {error}"))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    pub fn order(&self, orders: Orders) {
        if orders.is_empty() {
            return;
        }
        let interrupts = orders.job.is_some() && !self.shared.sleeping.load(Ordering::Acquire);
        self.post(|inbox| {
            inbox.orders.follow(orders);
            inbox.posted = inbox.posted.or(interrupts.then(Instant::now));
        });
    }

    /// Keeps all samples: the snapshot of the job of this generation that gives the same ones, sooner.
    pub fn set_prepared(&self, generation: u64, prepared: Prepared) {
        self.post(|inbox| inbox.prepared = Some((generation, prepared)));
    }

    /// Keeps all samples.
    pub fn set_display(&self, display: Display) {
        self.post(|inbox| inbox.display = Some(display));
    }

    /// Keeps all samples.
    pub fn set_look(&self, look: ViewOptions) {
        self.post(|inbox| inbox.look = Some(look));
    }

    /// Why a pixel looks as it does; never waits. When the answer cannot come any more, the other end is closed.
    pub fn ask(&self, question: Question) -> Receiver<Answer> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.question = Some((question, sender)));
        receiver
    }

    /// How long the thread took to drop what it was at when a job came, the latest times.
    pub fn cancels(&self) -> LatencyHistogram {
        lock(&self.shared.cancels).clone()
    }

    /// As many threads as render, for work beside them such as building trees.
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        lock(&self.shared.beside).clone()
    }

    /// A copy of the film as it is now; waits until the workers have dropped what they are at, some milliseconds.
    pub fn film(&self) -> Option<Film> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.film_wanted.push(sender));
        receiver.recv_timeout(Duration::from_secs(5)).ok()
    }

    /// The film of what is seen now, worth keeping: see [`Session::keep_film`](super::Session::keep_film).
    pub fn keep_film(&self) -> Receiver<Film> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.to_keep.push(sender));
        receiver
    }

    /// Takes the newest picture, if there is a new one, in exchange for an old one's memory.
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

    /// Whether a picture lies ready that nobody has taken.
    pub fn has_picture(&self) -> bool {
        lock(&self.shared.outbox).fresh
    }

    /// The picture of this number is on the window.
    pub fn note_seen(&self, number: u64) {
        // Under the lock, as with any message; but it is no reason to drop anything.
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
        // Under the lock, or the thread could look at the flag, then miss the call, then wait for ever.
        self.shared.interrupt.store(true, Ordering::Release);
        drop(inbox);
        self.shared.arrived.notify_all();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.post(|inbox| inbox.quit = true);
        if let Some(thread) = self.thread.take() {
            // A panic over there has been reported already.
            let _ = thread.join();
        }
    }
}

fn make_pool(threads: usize, name: &'static str, yielding: bool) -> Result<Arc<rayon::ThreadPool>, String> {
    worker_threads()
        .num_threads(threads)
        .thread_name(move |i| format!("{name} {i}"))
        .start_handler(move |_| {
            if yielding {
                yield_to_others();
            }
        })
        .build()
        .map(Arc::new)
        .map_err(|error| format!("cannot start {threads} worker threads: {error}"))
}

/// From now on this thread takes what others leave of the processor, most of it while there are others.
fn yield_to_others() {
    // Elsewhere than on Linux a thread's own niceness cannot be set.
    #[cfg(target_os = "linux")]
    {
        // It may always be raised, and without it all is as it was.
        let _ = rustix::process::setpriority_process(None, NICENESS);
    }
}

/// The data behind a lock is whole at every moment at which a thread could panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
