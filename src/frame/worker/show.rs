//! From the film to the displayed image: developed or inspected, scaled to the window size, with overlays.

use crate::frame::core::denoising::Denoising;
use crate::frame::core::status::RenderProgress;
use crate::frame::worker::denoised::Developed;
use crate::frame::worker::shared::{Stats, lock};
use crate::frame::worker::thread::{Loop, MOST_IMAGES};
use crate::frame::worker::views::ViewKey;
use crate::render::{Inspected, Inspection, depths, inspect, tint_sharp_zone};
use glam::UVec2;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

impl Loop<'_> {
    /// Develops the film and hands the image over, unless the previous image has not been taken yet and `last` is
    /// false. Returns how long it took to put its light on finer surfaces.
    pub(super) fn show(&mut self, last: bool) -> Duration {
        let film = self.film.as_ref().filter(|(_, film)| film.spp() > 0).or(self.previous.as_ref());
        let (Some(job), Some((divider, film))) = (&self.job, film) else { return Duration::ZERO };
        let key = ViewKey {
            generation: job.generation,
            inspection: self.look.inspection,
            size: UVec2::new(film.width(), film.height()),
        };
        let progress = RenderProgress {
            film_width: film.width(),
            film_height: film.height(),
            divider: *divider,
            spp: film.spp(),
            region: self.active_region().map(|region| (region, film.spp_in(Some(&region)))),
            ..self.stats.progress.clone()
        };
        let stats = Stats { progress, asleep: last, done: self.scheduler.reached(), ..self.stats.clone() };
        self.stats = stats.clone();
        {
            let mut outbox = lock(&self.shared.outbox);
            let waits = outbox.fresh && outbox.picture.generation == job.generation;
            outbox.stats = stats;
            if waits && !last && !self.redraw && outbox.stats.progress.divider == outbox.picture.divider {
                return Duration::ZERO;
            }
        }
        if !last && !self.redraw && self.is_displayed(*divider, key) {
            // The figures beside it are new.
            self.wake();
            return Duration::ZERO;
        }
        let start = Instant::now();
        let pool = lock(&self.shared.pool).clone();
        let (width, height) = (job.width, job.height);
        let mut rgba = std::mem::take(&mut self.spare.rgba);
        let interrupt = &self.shared.interrupt;
        // Another view or job has arrived: this image would not be displayed.
        let stop = || interrupt.load(Ordering::Relaxed);
        let mut legend = None;
        let mut developed = Developed::raw();
        if self.look.inspection == Inspection::Picture {
            let mut moving = std::mem::take(&mut self.moving);
            if self.views.relit != Some((job.generation, *divider)) {
                self.views.relit = Some((job.generation, *divider));
                moving.start_view(std::mem::replace(&mut self.kept_images, MOST_IMAGES));
            }
            let develop = || self.develop_wanted(&mut moving, (*divider, film), key, (width, height), &mut rgba);
            let done = pool.install(develop);
            self.moving = moving;
            let Some(done) = done else { return Duration::ZERO };
            developed = done;
            if *divider > 1 {
                self.scheduler.smoothed(*divider, developed.smoothing.unwrap_or_default().as_secs_f64());
                if let Some((surfaces, took)) = developed.relighting {
                    self.scheduler.relit(surfaces, took.as_secs_f64());
                }
            }
        } else {
            let known = self.views.inspected.take().filter(|(of, _)| *of == key && !key.inspection.is_of_film());
            let view = known
                .map(|(_, view)| view)
                .or_else(|| pool.install(|| inspect(key.inspection, &job.prepared, &job.settings, film, &stop)));
            let Some(view) = view else { return Duration::ZERO };
            enlarge(&view, width, height, &mut rgba);
            legend = view.legend;
            self.views.inspected = Some((key, view));
        }
        if self.look.sharp_zone && job.prepared.camera.lens_radius > 0.0 {
            let key = ViewKey { inspection: Inspection::Depth, ..key };
            let known = self.views.depths.take().filter(|(of, _)| *of == key).map(|(_, depths)| depths);
            let Some(depths) = known.or_else(|| pool.install(|| depths(&job.prepared, key.size, &stop))) else {
                return Duration::ZERO;
            };
            let camera = &job.prepared.camera;
            let zone = camera.sharp_zone(height);
            let size = UVec2::new(width, height);
            pool.install(|| tint_sharp_zone(&mut rgba, size, &depths, key.size, zone, camera.focus_distance));
            self.views.depths = Some((key, depths));
        }
        let Developed { denoising, settled, is_mixed, smoothing, relighting } = developed;
        let denoised_error = settled.map(|settled| settled.error);
        self.n_pictures += 1;
        self.pictured = job.generation;
        let picture = &mut self.spare;
        (picture.width, picture.height, picture.number) = (width, height, self.n_pictures);
        (picture.inspection, picture.denoising, picture.legend) = (self.look.inspection, denoising, legend);
        (picture.generation, picture.divider, picture.spp) = (job.generation, *divider, film.spp());
        picture.rgba = rgba;
        let divider = *divider;
        let awaits_denoised = divider == 1 && self.wanted_denoising() != Denoising::Raw && denoised_error.is_none();
        let denoised_by = self.views.settled.as_ref().map_or(self.look.filter, |settled| settled.by);
        let progress = &mut self.stats.progress;
        (progress.denoising, progress.denoised_by) = (denoising, denoised_by);
        (progress.denoised_error, progress.mixes_raw) = (denoised_error, is_mixed);
        progress.denoised_spp = settled.map_or(0, |settled| settled.spp);
        progress.awaits_denoised = awaits_denoised;
        if let Some(took) = smoothing {
            self.note_smoothing(divider, key, took);
        }
        {
            let mut outbox = lock(&self.shared.outbox);
            std::mem::swap(&mut outbox.picture, &mut self.spare);
            outbox.fresh = true;
            outbox.stats.progress = self.stats.progress.clone();
        }
        tracing::trace!("tone-mapped in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
        self.redraw = false;
        self.wake();
        relighting.map_or(Duration::ZERO, |(_, took)| took)
    }
}

/// Scales by nearest neighbour: colours that stand for numbers cannot be averaged.
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
