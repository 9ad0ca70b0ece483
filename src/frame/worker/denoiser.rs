//! The thread that denoises: beside the render thread, on a copy of what the film shows.
//!
//! It gathers the guides of a view while the film gets its first samples. Then the render thread hands over a copy, adds
//! more samples, and takes the result when it is there. What the user waits for, such as the first image of a view, gets
//! as much of the processor as samples do; other images get less. Another view makes the thread drop what it is at within
//! some rows. Start reading at [`Denoiser::start`].

use crate::frame::core::denoising::DenoiseFilter;
use crate::frame::worker::shared::{DENOISE, DENOISE_NICENESS, NICENESS, lock, make_pool};
use crate::frame::worker::views::{Settled, ViewKey};
use crate::render::{DenoiseSource, GuideGatherer, Prepared, RenderSettings, StillImage};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

/// A view whose guides are to be gathered, and an image of it that is to be denoised.
pub struct Request {
    pub key: ViewKey,
    pub prepared: Prepared,
    pub settings: RenderSettings,
    /// Samples per pixel that the guides have at least.
    pub guide_samples: u32,
    /// Without one, guides are all that is wanted so far.
    pub image: Option<ToDenoise>,
    /// The user waits for it: nothing denoised is there yet, or it is about to be worse than the raw image.
    pub is_urgent: bool,
    pub threads: usize,
}

/// What is to be denoised.
pub struct ToDenoise {
    pub filter: DenoiseFilter,
    pub source: DenoiseSource,
    /// Samples per pixel of the source.
    pub spp: u32,
    /// What radiance is multiplied by for the display.
    pub exposure: f32,
}

/// Guides of the latest view, as good as they are so far.
#[derive(Default)]
struct KnownGuides {
    key: Option<ViewKey>,
    gatherer: GuideGatherer,
}

impl KnownGuides {
    /// Gathers what the request needs and is not there yet; `None` if `stop` returned true.
    fn gather(&mut self, request: &Request, stop: &(dyn Fn() -> bool + Sync)) -> Option<()> {
        let Request { key, prepared, settings, guide_samples, .. } = request;
        if self.key != Some(*key) {
            self.gatherer.start(key.size);
            self.key = Some(*key);
        }
        self.gatherer.gather(prepared, settings, *guide_samples, stop).then_some(())
    }
}

#[derive(Default)]
struct DenoiserSlot {
    request: Option<Request>,
    result: Option<Settled>,
    /// The view that has guides, and their samples per pixel.
    guides: Option<(ViewKey, u32)>,
    /// A request has been done since the last look.
    has_news: bool,
    /// A request is there or being worked on.
    is_busy: bool,
    quit: bool,
}

#[derive(Default)]
struct DenoiserState {
    slot: Mutex<DenoiserSlot>,
    arrived: Condvar,
    /// Results of other generations are of no use.
    wanted: Arc<AtomicU64>,
    quit: AtomicBool,
}

/// The near end of the thread.
pub struct Denoiser {
    shared: Arc<DenoiserState>,
    thread: Option<JoinHandle<()>>,
}

impl Denoiser {
    /// - `yielding`: gives way to other threads.
    /// - `wanted`: the generation that is wanted; what is done for another one is dropped at once.
    /// - `tell`: called when a request is done.
    ///
    /// Without a thread, if the system has none, nothing is denoised.
    pub fn start(yielding: bool, wanted: Arc<AtomicU64>, tell: impl Fn() + Send + 'static) -> Self {
        let shared = Arc::new(DenoiserState { wanted, ..DenoiserState::default() });
        let of_thread = shared.clone();
        let thread = std::thread::Builder::new().name("firstlight denoise".to_owned());
        let thread = thread.spawn(move || run(&of_thread, yielding, &tell)).ok();
        Self { shared, thread }
    }

    /// Drops what has been asked for another generation, and its result.
    pub fn want(&self, generation: u64) {
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

    /// Samples per pixel of the guides of a view; 0 without any.
    pub fn guide_samples(&self, key: ViewKey) -> u32 {
        lock(&self.shared.slot).guides.filter(|(of, _)| *of == key).map_or(0, |(_, samples)| samples)
    }

    /// Whether a request has been done since the last [`Denoiser::take`].
    pub fn has_news(&self) -> bool {
        lock(&self.shared.slot).has_news
    }

    pub fn take(&self) -> Option<Settled> {
        let mut slot = lock(&self.shared.slot);
        slot.has_news = false;
        slot.result.take()
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

fn run(shared: &DenoiserState, yielding: bool, tell: &dyn Fn()) {
    let mut known = KnownGuides::default();
    let mut pools = Pools { yielding, ..Pools::default() };
    while let Some(mut request) = next(shared) {
        let (key, image) = (request.key, request.image.take());
        let Some(pool) = pools.of(&request) else { continue };
        let stop = || shared.quit.load(Ordering::Relaxed) || shared.wanted.load(Ordering::Relaxed) != key.generation;
        let work = || {
            known.gather(&request, &stop)?;
            let Some(ToDenoise { filter, source, spp, exposure }) = image else { return Some(None) };
            let start = Instant::now();
            let (by, denoised) = filter.denoise(&source, known.gatherer.guides(), &stop)?;
            let (guide_samples, took) = (known.gatherer.samples(), start.elapsed());
            let still = StillImage::new(&denoised.color, key.size, &request.prepared.camera, exposure);
            Some(Some(Settled { key, filter, by, spp, guide_samples, denoised, still: Some(still), took }))
        };
        let made = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
        match made {
            // A panic has been reported by its thread; the raw image stays.
            Err(_) => known = KnownGuides::default(),
            Ok(None) => tracing::trace!("denoising dropped"),
            Ok(Some(_)) => {}
        }
        if let Ok(Some(settled)) = made {
            let mut slot = lock(&shared.slot);
            slot.guides = Some((key, known.gatherer.samples()));
            slot.result = settled;
            slot.has_news = true;
            // What comes next needs this thread.
            slot.is_busy = slot.request.is_some();
            drop(slot);
            tell();
        }
    }
}

/// The threads that denoise: what the user waits for, and everything else.
#[derive(Default)]
struct Pools {
    yielding: bool,
    urgent: Option<Arc<rayon::ThreadPool>>,
    usual: Option<Arc<rayon::ThreadPool>>,
}

impl Pools {
    /// The pool of a request; `None` if there can be none.
    fn of(&mut self, request: &Request) -> Option<Arc<rayon::ThreadPool>> {
        let (pool, niceness) =
            if request.is_urgent { (&mut self.urgent, NICENESS) } else { (&mut self.usual, DENOISE_NICENESS) };
        if pool.as_ref().is_none_or(|pool| pool.current_num_threads() != request.threads) {
            *pool = make_pool(request.threads, DENOISE, self.yielding.then_some(niceness)).ok();
        }
        pool.clone()
    }
}

/// The next request; `None` when it is time to go.
fn next(shared: &DenoiserState) -> Option<Request> {
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
