//! The thread that renders: it owns the film and a pool of workers, does what the [`Scheduler`] says, and hands over
//! finished pictures. It never touches the world, and nobody ever waits for it longer than a lock is held.
//!
//! A new job raises a flag that the workers look at all the time, so that they drop what they are at within
//! milliseconds. Every job has a generation; a picture carries the one of its job.

use super::scheduler::{Scheduler, Step, StepReport};
use super::{Picture, Target};
use crate::render::{
    BadSample, Display, Film, Inspected, Inspection, Legend, RayCounts, RenderSettings, Snapshot, advance, depths,
    develop, inspect, tint_sharp_zone,
};
use glam::UVec2;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Called whenever there is something new to be looked at.
pub type Waker = Arc<dyn Fn() + Send + Sync>;

/// What to render from now on.
#[derive(Clone)]
pub struct Job {
    pub generation: u64,
    pub snapshot: Snapshot,
    pub settings: RenderSettings,
    pub width: u32,
    pub height: u32,
}

/// What is shown of it; no sample depends on this.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    pub inspection: Inspection,
    /// Tint what is sharp, and draw the focal plane.
    pub sharp_zone: bool,
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
    /// Seconds of rendering since the restart.
    pub seconds: f64,
    /// Relative error of the whole picture, when it is known.
    pub error: Option<f64>,
    /// Rays of the last steps, and the seconds that they took.
    pub recent_rays: RayCounts,
    pub recent_seconds: f64,
    /// Since the restart.
    pub rays: RayCounts,
    pub n_bad: u64,
    pub bad: Vec<BadSample>,
    pub threads: usize,
    /// Nothing is left to do: the target is reached, or it is paused.
    pub asleep: bool,
    /// The target is reached.
    pub done: bool,
    /// Of the inspection that is shown.
    pub legend: Option<Legend>,
    /// What went wrong in the renderer itself.
    pub failure: Option<String>,
}

/// Messages to the thread; a later one of a kind takes the place of an earlier one.
#[derive(Default)]
struct Inbox {
    job: Option<Job>,
    display: Option<Display>,
    look: Option<Look>,
    target: Option<Target>,
    paused: Option<bool>,
    threads: Option<usize>,
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
    outbox: Mutex<Outbox>,
    pool: Mutex<Arc<rayon::ThreadPool>>,
    waker: Option<Waker>,
}

/// The near end of the thread.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// `threads`: 0 is one a processor.
    pub fn start(threads: usize, target: Target, waker: Option<Waker>) -> Result<Self, String> {
        let shared = Arc::new(Shared {
            inbox: Mutex::default(),
            arrived: Condvar::new(),
            interrupt: AtomicBool::new(false),
            sleeping: AtomicBool::new(false),
            outbox: Mutex::default(),
            pool: Mutex::new(make_pool(threads)?),
            waker,
        });
        let thread = std::thread::Builder::new()
            .name("firstlight render".to_owned())
            .spawn({
                let shared = shared.clone();
                move || Loop::new(&shared, target).run()
            })
            .map_err(|error| format!("the render thread cannot be started: {error}"))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    pub fn set_job(&self, job: Job) {
        self.post(|inbox| inbox.job = Some(job));
    }

    /// Keeps all samples.
    pub fn set_display(&self, display: Display) {
        self.post(|inbox| inbox.display = Some(display));
    }

    /// Keeps all samples.
    pub fn set_look(&self, look: Look) {
        self.post(|inbox| inbox.look = Some(look));
    }

    /// Keeps all samples.
    pub fn set_target(&self, target: Target) {
        self.post(|inbox| inbox.target = Some(target));
    }

    /// Keeps all samples.
    pub fn set_paused(&self, paused: bool) {
        self.post(|inbox| inbox.paused = Some(paused));
    }

    /// Keeps all samples; 0 is one a processor.
    pub fn set_threads(&self, threads: usize) {
        self.post(|inbox| inbox.threads = Some(threads));
    }

    /// The pool that renders, for work beside it such as building trees.
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        lock(&self.shared.pool).clone()
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

/// What the thread itself holds.
struct Loop<'a> {
    shared: &'a Shared,
    clock: Instant,
    scheduler: Scheduler,
    display: Display,
    look: Look,
    /// The view of the scene that was made last, and what for.
    inspected: Option<(ViewKey, Inspected)>,
    /// Depths of the film's pixels, and what for.
    depths: Option<(ViewKey, Vec<f32>)>,
    job: Option<Job>,
    film: Option<(u32, Film)>,
    /// The film before it, as long as the new one has pixels without a sample.
    previous: Option<(u32, Film)>,
    stats: Stats,
    /// Developed pictures that are not shared, for their memory.
    spare: Picture,
    /// The picture that was shown last is not of these settings.
    redraw: bool,
    /// Who waits for a film worth keeping.
    to_keep: Vec<Sender<Film>>,
}

impl<'a> Loop<'a> {
    fn new(shared: &'a Shared, target: Target) -> Self {
        Self {
            shared,
            clock: Instant::now(),
            scheduler: Scheduler::new(1, 1, target),
            display: Display::default(),
            look: Look::default(),
            inspected: None,
            depths: None,
            job: None,
            film: None,
            previous: None,
            stats: Stats { asleep: true, ..Stats::default() },
            spare: Picture::default(),
            redraw: false,
            to_keep: Vec::new(),
        }
    }

    fn run(mut self) {
        while self.read_inbox() {
            let step = match &self.job {
                Some(_) => self.scheduler.next(self.clock.elapsed()),
                None => Step::Sleep,
            };
            match step {
                Step::Render { .. } => self.render(step),
                Step::Sleep => self.sleep(),
            }
        }
    }

    /// Takes over what has arrived; false when it is time to go.
    fn read_inbox(&mut self) -> bool {
        let inbox = {
            let mut inbox = lock(&self.shared.inbox);
            self.shared.sleeping.store(false, Ordering::Release);
            self.shared.interrupt.store(false, Ordering::Release);
            std::mem::take(&mut *inbox)
        };
        if inbox.quit {
            return false;
        }
        if let Some(threads) = inbox.threads {
            self.set_threads(threads);
        }
        if let Some(target) = inbox.target {
            self.scheduler.set_target(target);
        }
        if let Some(paused) = inbox.paused {
            self.scheduler.set_paused(paused);
        }
        if let Some(look) = inbox.look {
            self.redraw |= look != self.look;
            self.look = look;
        }
        if let Some(display) = inbox.display {
            self.redraw |= display != self.display;
            self.display = display;
        }
        for sender in inbox.film_wanted {
            if let Some((_, film)) = self.visible() {
                // Whoever asked may have gone.
                let _ = sender.send(film.clone());
            }
        }
        self.to_keep.extend(inbox.to_keep);
        // What is seen now is about to go.
        self.hand_out(inbox.job.is_some());
        if let Some(job) = inbox.job {
            let size = (job.width, job.height);
            self.scheduler.resize(size.0, size.1, self.clock.elapsed());
            let threads = lock(&self.shared.pool).current_num_threads();
            self.stats = Stats { generation: job.generation, threads, ..Stats::default() };
            self.job = Some(job);
            (self.film, self.previous) = (None, None);
            self.redraw = false;
        }
        true
    }

    fn set_threads(&mut self, threads: usize) {
        match make_pool(threads) {
            Ok(pool) => {
                self.stats.threads = pool.current_num_threads();
                *lock(&self.shared.pool) = pool;
                self.scheduler.forget_speed();
            }
            Err(error) => self.stats.failure = Some(error),
        }
    }

    /// One step of the scheduler, and the picture that comes of it.
    fn render(&mut self, step: Step) {
        let Step::Render { divider, mut target_spp, mut at_most } = step else { return };
        let Some(job) = &self.job else { return };
        if self.film.as_ref().is_none_or(|(of, _)| *of != divider) {
            let film = Film::new(job.width.div_ceil(divider), job.height.div_ceil(divider));
            if let Some(old) = self.film.replace((divider, film)).filter(|(_, old)| old.spp() > 0) {
                self.previous = Some(old);
            }
            self.stats.n_bad = 0;
            self.stats.bad.clear();
        }
        let Some((_, film)) = &mut self.film else { return };
        if divider == 1 && !self.to_keep.is_empty() {
            // Who keeps a picture wants to be able to make it again, so all pixels get as many samples.
            (target_spp, at_most) = (film.max_spp().max(1), None);
        }
        let pool = lock(&self.shared.pool).clone();
        let start = Instant::now();
        let interrupt = &self.shared.interrupt;
        let stop = || interrupt.load(Ordering::Relaxed) || at_most.is_some_and(|limit| start.elapsed() >= limit);
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            pool.install(|| advance(&job.snapshot, &job.settings, film, target_spp, &stop))
        }));
        let seconds = start.elapsed().as_secs_f64();
        let pass = match result {
            Ok(pass) => pass,
            Err(panic) => return self.fail(panic.as_ref()),
        };
        let stats = &mut self.stats;
        // Speed is that of the last half second or so.
        if stats.recent_seconds > 0.5 {
            stats.recent_seconds *= 0.5;
            for rays in [&mut stats.recent_rays.camera, &mut stats.recent_rays.bounce, &mut stats.recent_rays.shadow] {
                *rays /= 2;
            }
        }
        stats.recent_rays += pass.rays;
        stats.recent_seconds += seconds;
        stats.rays += pass.rays;
        stats.seconds += seconds;
        stats.n_bad += pass.n_bad;
        stats.bad.extend(pass.bad.into_iter().take(16_usize.saturating_sub(stats.bad.len())));
        let interrupted = !pass.completed && interrupt.load(Ordering::Relaxed);
        let replaced = interrupted && lock(&self.shared.inbox).job.is_some();
        let error = film.error_estimate().map(|error| error.relative);
        stats.error = error.filter(|_| divider == 1);
        let report = StepReport { paths: pass.rays.camera, seconds, spp: film.spp(), error };
        self.scheduler.finished(step, report, self.clock.elapsed());
        if film.spp() > 0 {
            self.previous = None;
        }
        self.hand_out(false);
        if !replaced && (self.redraw || self.previous.is_none()) {
            self.show(false);
        }
    }

    /// Gives the film to who wants to keep it: at full resolution, or as it is if there will be `no_better` one.
    fn hand_out(&mut self, no_better: bool) {
        if self.to_keep.is_empty() {
            return;
        }
        if let Some((divider, film)) = self.visible()
            && ((*divider == 1 && film.max_spp() == film.spp()) || no_better)
        {
            let film = film.clone();
            for sender in self.to_keep.drain(..) {
                // Whoever asked may have gone.
                let _ = sender.send(film.clone());
            }
        }
    }

    /// The newest film of which every pixel has a sample.
    fn visible(&self) -> Option<&(u32, Film)> {
        self.film.as_ref().filter(|(_, film)| film.spp() > 0).or(self.previous.as_ref())
    }

    /// Develops the film and hands it over, unless the last picture still waits to be taken and will do for now.
    fn show(&mut self, last: bool) {
        let film = self.film.as_ref().filter(|(_, film)| film.spp() > 0).or(self.previous.as_ref());
        let (Some(job), Some((divider, film))) = (&self.job, film) else { return };
        let stats = Stats {
            film_width: film.width(),
            film_height: film.height(),
            divider: *divider,
            spp: film.spp(),
            asleep: last,
            done: self.scheduler.reached(),
            ..self.stats.clone()
        };
        self.stats = stats.clone();
        {
            let mut outbox = lock(&self.shared.outbox);
            let waits = outbox.fresh && outbox.picture.generation == job.generation;
            outbox.stats = stats;
            if waits && !last && !self.redraw && outbox.stats.divider == outbox.picture.divider {
                return;
            }
        }
        let pool = lock(&self.shared.pool).clone();
        let (width, height) = (job.width, job.height);
        let picture = &mut self.spare;
        let interrupt = &self.shared.interrupt;
        // Another look or job is on its way: this picture would not be seen.
        let stop = || interrupt.load(Ordering::Relaxed);
        let key = ViewKey {
            generation: job.generation,
            inspection: self.look.inspection,
            size: UVec2::new(film.width(), film.height()),
        };
        let mut legend = None;
        if self.look.inspection == Inspection::Picture {
            pool.install(|| develop(film, &self.display, width, height, &mut picture.rgba));
        } else {
            let known = self.inspected.take().filter(|(of, _)| *of == key && !key.inspection.is_of_film());
            let view = known
                .map(|(_, view)| view)
                .or_else(|| pool.install(|| inspect(key.inspection, &job.snapshot, &job.settings, film, &stop)));
            let Some(view) = view else { return };
            enlarge(&view, width, height, &mut picture.rgba);
            legend = view.legend;
            self.inspected = Some((key, view));
        }
        if self.look.sharp_zone && job.snapshot.camera.lens_radius > 0.0 {
            let key = ViewKey { inspection: Inspection::Depth, ..key };
            let known = self.depths.take().filter(|(of, _)| *of == key).map(|(_, depths)| depths);
            let Some(depths) = known.or_else(|| pool.install(|| depths(&job.snapshot, key.size, &stop))) else {
                return;
            };
            let camera = &job.snapshot.camera;
            let zone = camera.sharp_zone(height);
            let size = UVec2::new(width, height);
            pool.install(|| tint_sharp_zone(&mut picture.rgba, size, &depths, key.size, zone, camera.focus_distance));
            self.depths = Some((key, depths));
        }
        (picture.width, picture.height) = (width, height);
        (picture.generation, picture.divider, picture.spp) = (job.generation, *divider, film.spp());
        {
            let mut outbox = lock(&self.shared.outbox);
            std::mem::swap(&mut outbox.picture, &mut self.spare);
            outbox.stats.legend = legend;
            outbox.fresh = true;
        }
        self.redraw = false;
        self.wake();
    }

    /// Shows the final state and waits for the next message.
    fn sleep(&mut self) {
        self.hand_out(true);
        // Without a film, asking in vain beats waiting in vain.
        self.to_keep.clear();
        let shown = {
            let outbox = lock(&self.shared.outbox);
            outbox.stats.asleep && outbox.stats.generation == self.stats.generation
        };
        if self.film.is_some() && (!shown || self.redraw) {
            self.show(true);
        } else if !shown {
            lock(&self.shared.outbox).stats = Stats { asleep: true, ..self.stats.clone() };
            self.wake();
        }
        let mut inbox = lock(&self.shared.inbox);
        while !self.shared.interrupt.load(Ordering::Acquire) {
            self.shared.sleeping.store(true, Ordering::Release);
            inbox = self.shared.arrived.wait(inbox).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A bug in the renderer must not take the window down: say so, and render nothing until something changes.
    fn fail(&mut self, panic: &(dyn std::any::Any + Send)) {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        self.stats.failure = Some(format!("the renderer failed: {}", text.unwrap_or("no reason given")));
        (self.job, self.film, self.previous) = (None, None, None);
        lock(&self.shared.outbox).stats = Stats { asleep: true, ..self.stats.clone() };
        self.wake();
    }

    fn wake(&self) {
        if let Some(waker) = &self.shared.waker {
            waker();
        }
    }
}

/// What a view of the scene was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ViewKey {
    generation: u64,
    inspection: Inspection,
    size: UVec2,
}

/// Without mixing: colours that stand for numbers have no mean.
fn enlarge(view: &Inspected, width: u32, height: u32, rgba: &mut Vec<u8>) {
    rgba.clear();
    rgba.reserve(4 * width as usize * height as usize);
    for y in 0..height {
        let row =
            &view.rgb[(u64::from(y) * u64::from(view.height) / u64::from(height)) as usize * view.width as usize..];
        for x in 0..width {
            let [r, g, b] = row[(u64::from(x) * u64::from(view.width) / u64::from(width)) as usize];
            rgba.extend_from_slice(&[r, g, b, 255]);
        }
    }
}

fn make_pool(threads: usize) -> Result<Arc<rayon::ThreadPool>, String> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("firstlight {i}"))
        .build()
        .map(Arc::new)
        .map_err(|error| format!("{threads} worker threads cannot be started: {error}"))
}

/// The data behind a lock is whole at every moment at which a thread could panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
