//! The loop of the render thread: reads messages, executes the scheduler's next step, hands over images, and sleeps.

use crate::frame::core::denoising::Denoising;
use crate::frame::core::offline::Target;
use crate::frame::core::scheduler::{RenderStep, SLOWEST_FRAME, Scheduler, StepReport};
use crate::frame::core::status::Picture;
use crate::frame::worker::aside::SetAside;
use crate::frame::worker::denoiser::Denoiser;
use crate::frame::worker::idle::IdleFilms;
use crate::frame::worker::shared::{
    Answer, BESIDE, Job, KeptFilm, NICENESS, Question, Shared, Stats, ToKeep, ViewOptions, WORKERS, lock, make_pool,
};
use crate::frame::worker::views::Views;
use crate::render::{
    Display, Film, MovingImage, Region, SampleAllocation, advance_region, explain, known_caustic_choice,
    known_portal_count, seen_surface,
};
use glam::{DVec2, UVec2};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// How long the workers wait for a coarse image to be displayed before they continue.
const LONGEST_DRAW: Duration = Duration::from_millis(33);

/// Frames of an animation after which the workers no longer wait for the next one.
const LATE: f64 = 2.0;

/// Images before that the light of a moving image is the mean of, at most: what light changes with the camera lags by as
/// many.
pub(super) const MOST_IMAGES: f32 = 12.0;

/// Tiles per thread below which a film has smaller ones, in pixels along a side: the last tiles of a preview keep one
/// thread busy, and all others wait. Smaller still, and the batches of rays would be too small.
const FEWEST_TILES: usize = 4;
const SMALL_TILE: u32 = 16;

/// State of the render thread.
pub struct Loop<'a> {
    pub(super) shared: &'a Shared,
    pub(super) clock: Instant,
    /// Time of the last restart.
    pub(super) restarted_at: Instant,
    pub(super) scheduler: Scheduler,
    pub(super) display: Display,
    pub(super) look: ViewOptions,
    pub(super) views: Views,
    pub(super) denoiser: Denoiser,
    /// Smooths images of a moving camera; has memory only once it did.
    pub(super) moving: MovingImage,
    /// As how many images those before the next one count: few if the scene has changed since.
    pub(super) kept_images: f32,
    /// Region that gets all samples, in fractions of the image.
    region: Option<[f64; 4]>,
    /// Whether the film has tiles that are ahead because of a region.
    pub(super) is_uneven: bool,
    question: Option<(Question, Sender<Answer>)>,
    pub(super) job: Option<Job>,
    pub(super) film: Option<(u32, Film)>,
    /// The previous film, as long as the new one has pixels without a sample.
    pub(super) previous: Option<(u32, Film)>,
    pub(super) idle: IdleFilms,
    /// Of the same view in another size.
    pub(super) aside: Option<SetAside>,
    pub(super) stats: Stats,
    /// An image that is not shared, for its memory.
    pub(super) spare: Picture,
    /// Whether the image displayed last does not match the current settings.
    pub(super) redraw: bool,
    /// Number of images handed over so far.
    pub(super) n_pictures: u64,
    /// The job of the image handed over last.
    pub(super) pictured: u64,
    /// Requests for a film for saving.
    to_keep: Vec<ToKeep>,
}

impl<'a> Loop<'a> {
    pub fn new(shared: &'a Shared, denoiser: Denoiser, target: Target) -> Self {
        Self {
            shared,
            clock: Instant::now(),
            restarted_at: Instant::now(),
            scheduler: Scheduler::new(1, 1, target),
            display: Display::default(),
            look: ViewOptions::default(),
            views: Views::default(),
            denoiser,
            moving: MovingImage::default(),
            kept_images: MOST_IMAGES,
            region: None,
            is_uneven: false,
            question: None,
            job: None,
            film: None,
            previous: None,
            idle: IdleFilms::default(),
            aside: None,
            stats: Stats { asleep: true, ..Stats::default() },
            spare: Picture::default(),
            redraw: false,
            n_pictures: 0,
            pictured: u64::MAX,
            to_keep: Vec::new(),
        }
    }

    pub fn run(mut self) {
        while self.read_inbox() {
            let step = match &self.job {
                Some(_) => self.scheduler.next(self.clock.elapsed()),
                None => RenderStep::Sleep,
            };
            match step {
                RenderStep::Render { divider, .. } => {
                    // The first samples of the next size may take seconds, during which the exposure may change.
                    let is_new = |(of, film): &(u32, Film)| *of != divider || film.spp() == 0;
                    if self.redraw && self.film.as_ref().is_none_or(is_new) {
                        self.show(false);
                    }
                    self.render(step);
                }
                RenderStep::Sleep => self.sleep(),
            }
        }
    }

    /// Reads all messages; returns false if the thread should end.
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
        let orders = inbox.orders;
        if let Some(posted) = inbox.posted {
            tracing::trace!("cancelled in {:.1} ms", posted.elapsed().as_secs_f64() * 1e3);
            lock(&self.shared.cancels).add(posted.elapsed());
        }
        if let Some(threads) = orders.threads {
            self.set_threads(threads);
        }
        if let Some(target) = orders.target {
            self.scheduler.set_target(target);
        }
        if let Some(paused) = orders.paused {
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
                // The receiver may have been dropped.
                let _ = sender.send(film.clone());
            }
        }
        self.to_keep.extend(inbox.to_keep);
        // The current view is about to be discarded.
        self.hand_out(orders.job.is_some());
        if let Some(question) = inbox.question {
            self.question = Some(question);
        }
        let region_before = self.region;
        if let Some(region) = orders.region {
            self.region = region;
        }
        if let Some(job) = orders.job {
            self.start(job);
        } else if self.region != region_before {
            self.scheduler_sees_region();
            self.redraw = true;
        }
        if let (Some((generation, prepared)), Some(job)) = (inbox.prepared, &mut self.job)
            && generation == job.generation
        {
            job.prepared = prepared;
            // The number of visited nodes per ray has changed, and nothing of the image.
            self.views.inspected = None;
            self.redraw |= !self.look.inspection.is_of_film();
        }
        // The position belongs to another image.
        let generation = self.job.as_ref().map(|job| job.generation);
        self.question.take_if(|(question, _)| Some(question.generation) != generation);
        self.answer(false);
        true
    }

    /// The region in pixels of the film, once every pixel has a sample at full resolution.
    pub(super) fn active_region(&self) -> Option<Region> {
        let (divider, film) = self.film.as_ref()?;
        (*divider == 1 && film.spp() > 0).then(|| film.region_of(self.region?)).flatten()
    }

    /// Passes the rendered region and its progress to the scheduler.
    pub(super) fn scheduler_sees_region(&mut self) {
        let Some((1, film)) = &self.film else { return };
        let region = self.active_region();
        let error = film.error_estimate_in(region.as_ref()).map(|error| error.relative);
        let spp = film.spp_in(region.as_ref());
        self.stats.progress.estimated_error = error;
        self.scheduler.set_region(region.map(|region| region.n_pixels()), spp, error);
    }

    /// Answers the pending question once the film has its part of the answer; with `no_better`, at once.
    fn answer(&mut self, no_better: bool) {
        let (Some((question, _)), Some(job)) = (&self.question, &self.job) else { return };
        let film = self.film.as_ref().filter(|(divider, film)| *divider == 1 && film.spp() > 0);
        if film.is_none() && !no_better {
            return;
        }
        let size = UVec2::new(job.width, job.height);
        let place = DVec2::new(question.x, question.y).clamp(DVec2::ZERO, DVec2::ONE) * size.as_dvec2();
        let pixel = place.as_uvec2().min(size - 1);
        let light_traced = film.map(|(_, film)| film.light_traced(pixel.x, pixel.y));
        let first = film.map_or(0, |(_, film)| film.first_sample());
        let samples = first..first.saturating_add(question.n_samples);
        let pool = lock(&self.shared.pool).clone();
        let result = catch_unwind(AssertUnwindSafe(|| {
            let explanation = pool.install(|| explain(&job.prepared, &job.settings, size, pixel, samples))?;
            Some((explanation, seen_surface(&job.prepared, size, pixel)))
        }));
        let sender = self.question.take().map(|(_, sender)| sender);
        match (result, sender) {
            (Ok(Some((explanation, seen))), Some(sender)) => {
                // The receiver may have been dropped.
                let _ = sender.send(Answer { explanation, light_traced, seen });
            }
            (Err(panic), _) => self.fail(panic.as_ref()),
            _ => {}
        }
        self.wake();
    }

    fn set_threads(&mut self, threads: usize) {
        let niceness = self.shared.yielding.then_some(NICENESS);
        let pools =
            make_pool(threads, WORKERS, niceness).and_then(|pool| Ok((pool, make_pool(threads, BESIDE, niceness)?)));
        match pools {
            Ok((pool, beside)) => {
                self.stats.progress.threads = pool.current_num_threads();
                *lock(&self.shared.pool) = pool;
                *lock(&self.shared.beside) = beside;
                self.scheduler.forget_speed();
            }
            Err(error) => self.stats.failure = Some(error),
        }
    }

    /// Executes one step of the scheduler, and shows its image.
    fn render(&mut self, step: RenderStep) {
        let RenderStep::Render { divider, mut target_spp, mut at_most } = step else { return };
        let Some(job) = &self.job else { return };
        if self.film.as_ref().is_none_or(|(of, _)| *of != divider) {
            let size = (job.width.div_ceil(divider), job.height.div_ceil(divider));
            let mut film = match self.idle.take(size) {
                Some(mut film) => {
                    let pool = lock(&self.shared.pool).clone();
                    let stop = || self.shared.interrupt.load(Ordering::Relaxed);
                    if !pool.install(|| film.clear_unless(&stop)) {
                        return self.idle.keep(film);
                    }
                    film
                }
                None => match Film::try_with_tile_size(size.0, size.1, tile_size(size, self.stats.progress.threads)) {
                    Ok(film) => film,
                    Err(error) => return self.give_up(error.to_string()),
                },
            };
            film.set_preview(divider > 1);
            if self.wanted_denoising() != Denoising::Raw {
                let pool = lock(&self.shared.pool).clone();
                pool.install(|| film.note_surfaces());
            }
            match self.film.replace((divider, film)) {
                Some(old) if old.1.spp() > 0 => self.previous = Some(old),
                old => old.into_iter().for_each(|(_, film)| self.idle.keep(film)),
            }
            self.stats.progress.n_bad = 0;
            self.stats.progress.n_above = 0;
            self.stats.progress.bad.clear();
            self.is_uneven = false;
            // Guides are gathered beside the first samples.
            self.request_denoised(false);
        }
        let region = self.active_region();
        self.is_uneven |= region.is_some();
        let is_raw = self.wanted_denoising() == Denoising::Raw;
        let Some((_, film)) = &mut self.film else { return };
        if divider == 1 && !self.to_keep.is_empty() && !self.is_uneven && film.max_spp() > film.spp() {
            // A saved image must be reproducible from its sample count, so all pixels get the same number of samples.
            (target_spp, at_most) = (film.max_spp().max(1), None);
        }
        let pool = lock(&self.shared.pool).clone();
        let start = Instant::now();
        let mut settings = job.settings;
        if divider > 1 {
            // Coarse films are short-lived: an allocation does not pay.
            settings.allocation = SampleAllocation::Uniform;
            if !is_raw {
                // Other noise than that of the image before, with which it is mixed.
                settings.seed = settings.seed.wrapping_add(job.generation as u32);
            }
        }
        let interrupt = &self.shared.interrupt;
        let stop = || interrupt.load(Ordering::Relaxed) || at_most.is_some_and(|limit| start.elapsed() >= limit);
        let result = catch_unwind(AssertUnwindSafe(|| {
            pool.install(|| advance_region(&job.prepared, &settings, film, region.as_ref(), target_spp, &stop))
        }));
        let seconds = start.elapsed().as_secs_f64();
        tracing::trace!("rendered for {:.1} ms at 1/{divider}", seconds * 1e3);
        let pass = match result {
            Ok(pass) => pass,
            Err(panic) => return self.fail(panic.as_ref()),
        };
        let stats = &mut self.stats;
        // Ray rates are averages over about half a second.
        if stats.recent_seconds > 0.5 {
            stats.recent_seconds *= 0.5;
            for rays in [&mut stats.recent_rays.camera, &mut stats.recent_rays.bounce, &mut stats.recent_rays.shadow] {
                *rays /= 2;
            }
        }
        stats.recent_rays += pass.rays;
        stats.recent_seconds += seconds;
        let progress = &mut stats.progress;
        progress.rays += pass.rays;
        progress.seconds += seconds;
        progress.elapsed = self.restarted_at.elapsed().as_secs_f64();
        progress.n_bad += pass.n_bad;
        progress.n_above += pass.n_above;
        progress.bad.extend(pass.bad.into_iter().take(16_usize.saturating_sub(progress.bad.len())));
        let interrupted = !pass.completed && interrupt.load(Ordering::Relaxed);
        let replaced = interrupted && lock(&self.shared.inbox).orders.job.is_some();
        let error = film.error_estimate_in(region.as_ref()).map(|error| error.relative);
        progress.estimated_error = error.filter(|_| divider == 1);
        if divider == 1 && job.prepared.features().caustics {
            progress.caustics = known_caustic_choice(&job.prepared, &job.settings, (film.width(), film.height()));
        }
        if divider == 1 {
            progress.n_portals = known_portal_count(&job.prepared);
        }
        let report = StepReport { paths: pass.rays.camera, seconds, spp: film.spp_in(region.as_ref()), error };
        let can_be_seen = film.spp() > 0;
        self.is_uneven &= region.is_some() || film.max_spp() > film.spp();
        let is_due = self.scheduler.finished(step, report, self.clock.elapsed());
        if can_be_seen && let Some((_, film)) = self.previous.take() {
            self.idle.keep(film);
        }
        if region.is_none() && self.region.is_some() {
            // There may be an active region from now on.
            self.scheduler_sees_region();
        }
        self.hand_out(false);
        self.answer(false);
        self.take_settled();
        if !replaced {
            self.request_denoised(false);
        }
        if !replaced && (self.redraw || (is_due && self.previous.is_none())) {
            let finished = Instant::now();
            let relighting = self.show(false);
            if divider > 1 {
                self.let_it_be_seen(finished + relighting);
            }
        }
    }

    /// Pauses the workers until a coarse image is displayed: if the processors draw the window too, more samples for a
    /// coarse film would delay the image or the next input. While an animation plays, until the next frame of it is due, which
    /// needs the processors for its meshes.
    ///
    /// - `finished`: when its samples were complete, later by what its surfaces took.
    fn let_it_be_seen(&mut self, finished: Instant) {
        let number = self.n_pictures;
        let seen = || self.shared.seen.load(Ordering::Acquire);
        if seen() == 0 || seen() >= number {
            return;
        }
        let is_interrupted = || self.shared.interrupt.load(Ordering::Acquire);
        let inbox = lock(&self.shared.inbox);
        // The next step follows whether the window displayed the image in time or not.
        drop(self.shared.arrived.wait_timeout_while(inbox, LONGEST_DRAW, |_| seen() < number && !is_interrupted()));
        if seen() >= number {
            self.scheduler.shown_after(finished.elapsed());
        }
        if let Some(pace) = self.job.as_ref().and_then(|job| job.pace) {
            let due = self.restarted_at + Duration::from_secs_f64(LATE * pace.min(SLOWEST_FRAME));
            let left = due.saturating_duration_since(Instant::now());
            drop(self.shared.arrived.wait_timeout_while(lock(&self.shared.inbox), left, |_| !is_interrupted()));
        }
    }

    /// Sends the film to the pending requests: at full resolution, and denoised if that is displayed then; or with
    /// `no_better` as it is.
    fn hand_out(&mut self, no_better: bool) {
        if self.to_keep.is_empty() {
            return;
        }
        let Some((divider, film)) = self.visible() else { return };
        if !((*divider == 1 && (self.is_uneven || film.max_spp() == film.spp())) || no_better) {
            return;
        }
        let displayed = self.displayed_denoised(film);
        // The first denoised image of a view is made already.
        let waits = displayed.is_none() && !no_better && self.wanted_denoising() != Denoising::Raw;
        if waits && self.to_keep.iter().all(|request| request.denoised) {
            return;
        }
        let film = film.clone();
        for ToKeep { sender, denoised } in self.to_keep.extract_if(.., |request| !(waits && request.denoised)) {
            // Fails if the receiver has been dropped.
            let _ = sender.send(KeptFilm { film: film.clone(), denoised: displayed.clone().filter(|_| denoised) });
        }
    }

    /// The newest film with a sample in every pixel.
    pub(super) fn visible(&self) -> Option<&(u32, Film)> {
        self.film.as_ref().filter(|(_, film)| film.spp() > 0).or(self.previous.as_ref())
    }

    /// Shows the final state and waits for the next message.
    fn sleep(&mut self) {
        self.hand_out(true);
        self.answer(true);
        // Without a film, the requests fail instead of waiting forever.
        self.to_keep.clear();
        self.question = None;
        self.take_settled();
        self.request_denoised(true);
        let shown = {
            let stats = &lock(&self.shared.outbox).stats;
            stats.asleep
                && stats.generation == self.stats.generation
                && stats.progress.threads == self.stats.progress.threads
        };
        if self.film.is_some() && (!shown || self.redraw) {
            self.show(true);
        } else if !shown {
            lock(&self.shared.outbox).stats = Stats { asleep: true, ..self.stats.clone() };
            self.wake();
        }
        let mut inbox = lock(&self.shared.inbox);
        while !self.shared.interrupt.load(Ordering::Acquire) && !self.denoiser.has_news() {
            self.shared.sleeping.store(true, Ordering::Release);
            inbox = self.shared.arrived.wait(inbox).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Handles a panic in the renderer, which must not end the window: reports it, and renders nothing until something
    /// changes.
    fn fail(&mut self, panic: &(dyn std::any::Any + Send)) {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        self.give_up(format!("the renderer failed: {}", text.unwrap_or("no reason given")));
    }

    /// Stops rendering until something changes, and reports the reason.
    fn give_up(&mut self, reason: String) {
        self.stats.failure = Some(reason);
        (self.job, self.film, self.previous) = (None, None, None);
        self.idle.forget();
        lock(&self.shared.outbox).stats = Stats { asleep: true, ..self.stats.clone() };
        self.wake();
    }

    pub(super) fn wake(&self) {
        if let Some(waker) = &self.shared.waker {
            waker();
        }
    }
}

/// Side of the tiles of a film of this size in pixels.
fn tile_size((width, height): (u32, u32), n_threads: usize) -> u32 {
    let n_tiles = width.div_ceil(Film::TILE_SIZE) * height.div_ceil(Film::TILE_SIZE);
    if (n_tiles as usize) < FEWEST_TILES * n_threads { SMALL_TILE } else { Film::TILE_SIZE }
}
