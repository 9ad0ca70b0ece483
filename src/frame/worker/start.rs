//! The start of a job: with an empty film, or with the samples of the same view that were set aside when the image got
//! another size.

use crate::frame::core::status::RenderProgress;
use crate::frame::worker::aside::{SetAside, exchange};
use crate::frame::worker::shared::{Job, Stats, lock};
use crate::frame::worker::thread::Loop;
use crate::frame::worker::views::{Settled, ViewKey};
use std::time::{Duration, Instant};

impl Loop<'_> {
    /// Starts a job, with the samples that were set aside if it is for them.
    pub(super) fn start(&mut self, job: Job) {
        let size = (job.width, job.height);
        self.denoiser.want(job.generation);
        self.scheduler.set_pace(job.pace);
        let is_as_large = self.job.as_ref().is_some_and(|old| (old.width, old.height) == size);
        let has_same_view = self.job.as_ref().is_some_and(|old| old.view == job.view);
        if !self.job.as_ref().is_some_and(|old| old.prepared.has_scene_of(&job.prepared)) {
            self.kept_images = 1.0;
        }
        let settled_key = self.settled_key();
        let films = [self.previous.take(), self.film.take()];
        let mut continued = None;
        if is_as_large {
            films.into_iter().flatten().for_each(|(_, film)| self.idle.keep(film));
        } else {
            self.idle.forget();
            let [_, film] = films;
            let settled = self.views.settled.take().filter(|settled| Some(settled.key) == settled_key);
            let current = SetAside::of(film, settled, &self.stats, &self.scheduler).filter(|_| has_same_view);
            let before = self.aside.take().filter(|_| has_same_view);
            [continued, self.aside] = exchange(current, before, &job);
        }
        if !has_same_view {
            self.aside = None;
        }
        self.scheduler.resize(size.0, size.1, self.clock.elapsed());
        self.scheduler.set_region(None, 0, None);
        let threads = lock(&self.shared.pool).current_num_threads();
        let progress = RenderProgress { threads, ..RenderProgress::default() };
        self.stats = Stats { progress, generation: job.generation, ..Stats::default() };
        self.restarted_at = Instant::now();
        self.redraw = false;
        self.job = Some(job);
        if let Some(continued) = continued {
            self.go_on_with(continued);
        }
    }

    fn go_on_with(&mut self, SetAside { film, settled, stats, spent }: SetAside) {
        let (generation, threads) = (self.stats.generation, self.stats.progress.threads);
        self.restarted_at -= Duration::from_secs_f64(stats.progress.elapsed);
        let progress = RenderProgress { threads, ..stats.progress };
        self.stats = Stats { progress, generation, asleep: false, ..stats };
        self.views.settled = settled.map(|settled| Settled { key: ViewKey { generation, ..settled.key }, ..settled });
        self.views.settle_again = None;
        self.scheduler.go_on(film.spp(), spent);
        self.is_uneven = film.max_spp() > film.spp();
        self.film = Some((1, film));
        self.scheduler_sees_region();
        self.redraw = true;
        self.show(false);
    }
}
