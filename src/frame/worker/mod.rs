//! The render thread: owns the film and a pool of workers, follows the [`Scheduler`](crate::frame::core::scheduler::Scheduler), and hands over
//! finished images. It never accesses the world, and other threads wait for it only while a lock is held.
//!
//! A new job sets a flag that the workers poll, so that they abandon their work within milliseconds. Every job has a
//! generation number; an image carries that of its job.
//!
//! This file is the handle used by the session; `thread` is the thread itself, `start` begins a job, `show` makes the
//! images, `idle` keeps memory, and `aside` the samples of the size before.

mod aside;
mod denoised;
mod denoiser;
mod idle;
mod shared;
mod show;
mod start;
mod thread;
mod views;

pub use shared::{Answer, Job, KeptDenoised, KeptFilm, Orders, Question, Stats, ViewOptions, Waker};

use crate::frame::core::latency::LatencyHistogram;
use crate::frame::core::offline::Target;
use crate::frame::core::status::Picture;
use crate::render::{Display, Film, Prepared};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use shared::{BESIDE, Inbox, NICENESS, Shared, ToKeep, WORKERS, lock, make_pool};

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

    /// Requests the film of the current view for saving: see [`Session::keep_film`](crate::frame::Session::keep_film).
    pub fn keep_film(&self, denoised: bool) -> Receiver<KeptFilm> {
        let (sender, receiver) = channel();
        self.post(|inbox| inbox.to_keep.push(ToKeep { sender, denoised }));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::core::denoising::Denoising;
    use crate::frame::worker::shared::{Job, Orders, Stats, ViewOptions};
    use crate::render::Display;
    use crate::scene::{Extraction, LoadOptions, Rendering, SceneInputs, SceneSource, load};

    /// What is displayed does not become noisy again where only rays get faster.
    #[test]
    fn the_denoised_image_stays_with_better_trees() {
        let loaded = load(&SceneSource::Builtin("cornell".to_owned()), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        loaded.spawn(&mut world);
        let prepared = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees).prepared;
        let settings = world.resource::<Rendering>().0;
        let target = Target { spp: Some(8), ..Target::default() };
        let worker = Worker::start(1, false, target, None).unwrap();
        let next = |is_awaited: &dyn Fn(&Stats) -> bool| {
            let mut picture = Picture::default();
            for _ in 0..5000 {
                if worker.take(&mut picture) && is_awaited(&worker.stats()) {
                    return worker.stats();
                }
                std::thread::sleep(Duration::from_millis(2));
            }
            panic!("no image came: {:?}", worker.stats());
        };
        worker.set_look(ViewOptions { denoising: Denoising::Denoised, ..ViewOptions::default() });
        let job =
            Job { generation: 1, view: 1, prepared: prepared.clone(), settings, width: 48, height: 36, pace: None };
        worker.order(Orders { job: Some(job), ..Orders::default() });
        let is_done = |stats: &Stats| stats.progress.denoised_error.is_some() && stats.progress.denoised_spp == 8;
        next(&|stats| stats.asleep && is_done(stats));
        worker.set_prepared(1, prepared);
        worker.set_display(Display { exposure_stops: 1.0, ..Display::default() });
        let after = next(&|_| true).progress;
        // With better guides, the same samples may have been denoised once more meanwhile.
        assert_eq!((after.denoised_error.is_some(), after.denoised_spp), (true, 8));
    }
}
