//! The thread that denoises: beside the render thread, with less of the processor, on a copy of what the film shows.
//!
//! The render thread hands over a copy, adds more samples, and takes the result when it is there. Another view makes
//! the thread drop what it is at within some rows. Start reading at [`Denoiser::start`].

use super::views::{Settled, ViewKey};
use super::{DENOISE, DENOISE_NICENESS, lock, make_pool};
use crate::frame::denoising::DenoiseFilter;
use crate::render::{DenoiseSource, FEATURE_SAMPLES, Prepared, RenderSettings, SurfaceGuides, gather_guides};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

/// What is to be denoised.
pub struct Request {
    pub key: ViewKey,
    pub filter: DenoiseFilter,
    pub source: DenoiseSource,
    pub prepared: Prepared,
    pub settings: RenderSettings,
    /// Samples per pixel of the source.
    pub spp: u32,
    pub threads: usize,
}

#[derive(Default)]
struct Slot {
    request: Option<Request>,
    result: Option<Settled>,
    /// A request is there or being worked on.
    is_busy: bool,
    quit: bool,
}

#[derive(Default)]
struct Shared {
    slot: Mutex<Slot>,
    arrived: Condvar,
    /// Results of other generations are of no use.
    wanted: AtomicU64,
    quit: AtomicBool,
}

/// The near end of the thread.
pub struct Denoiser {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Denoiser {
    /// - `yielding`: gives way to other threads.
    /// - `tell`: called when a result is there.
    ///
    /// Without a thread, if the system has none, nothing is denoised.
    pub fn start(yielding: bool, tell: impl Fn() + Send + 'static) -> Self {
        let shared = Arc::new(Shared::default());
        let of_thread = shared.clone();
        let thread = std::thread::Builder::new().name("firstlight denoise".to_owned());
        let thread = thread.spawn(move || run(&of_thread, yielding, &tell)).ok();
        Self { shared, thread }
    }

    /// From now on this generation is wanted: what is done for another one is dropped.
    pub fn want(&self, generation: u64) {
        self.shared.wanted.store(generation, Ordering::Relaxed);
        let mut slot = lock(&self.shared.slot);
        if slot.request.take_if(|request| request.key.generation != generation).is_some() {
            slot.is_busy = false;
        }
        slot.result = None;
    }

    /// Whether it is at work, so that a request would only wait.
    pub fn is_busy(&self) -> bool {
        lock(&self.shared.slot).is_busy || self.thread.is_none()
    }

    pub fn request(&self, request: Request) {
        let mut slot = lock(&self.shared.slot);
        (slot.request, slot.is_busy) = (Some(request), true);
        drop(slot);
        self.shared.arrived.notify_all();
    }

    pub fn has_result(&self) -> bool {
        lock(&self.shared.slot).result.is_some()
    }

    pub fn take(&self) -> Option<Settled> {
        lock(&self.shared.slot).result.take()
    }
}

impl Drop for Denoiser {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Relaxed);
        lock(&self.shared.slot).quit = true;
        self.shared.arrived.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic over there has been reported already.
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared, yielding: bool, tell: &dyn Fn()) {
    let mut known: Option<(ViewKey, SurfaceGuides)> = None;
    let mut last_pool: Option<Arc<rayon::ThreadPool>> = None;
    while let Some(request) = next(shared) {
        let Request { key, filter, source, prepared, settings, spp, threads } = request;
        let last = last_pool.take().filter(|pool| pool.current_num_threads() == threads);
        let Some(pool) = last.or_else(|| make_pool(threads, DENOISE, yielding.then_some(DENOISE_NICENESS)).ok()) else {
            continue;
        };
        let stop = || shared.quit.load(Ordering::Relaxed) || shared.wanted.load(Ordering::Relaxed) != key.generation;
        let of_view = known.take().filter(|(of, _)| *of == key).map(|(_, guides)| guides);
        let work = || {
            let gather = || gather_guides(&prepared, &settings, key.size, FEATURE_SAMPLES, &stop);
            let guides = of_view.or_else(gather)?;
            let start = Instant::now();
            let (by, denoised) = filter.denoise(&source, &guides, &stop)?;
            Some((guides, by, denoised, start.elapsed()))
        };
        // A panic has been reported by its thread; the raw image stays.
        let made = catch_unwind(AssertUnwindSafe(|| pool.install(work))).ok().flatten();
        last_pool = Some(pool);
        if let Some((guides, by, denoised, took)) = made {
            known = Some((key, guides));
            lock(&shared.slot).result = Some(Settled { key, filter, by, spp, denoised, took });
            tell();
        }
    }
}

/// The next request; `None` when it is time to go.
fn next(shared: &Shared) -> Option<Request> {
    let mut slot = lock(&shared.slot);
    loop {
        if slot.quit {
            return None;
        }
        if let Some(request) = slot.request.take() {
            return Some(request);
        }
        slot.is_busy = false;
        slot = shared.arrived.wait(slot).unwrap_or_else(PoisonError::into_inner);
    }
}
