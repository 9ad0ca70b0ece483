//! From the film to the displayed image: developed or inspected, scaled to the window size, with overlays.

use super::thread::Loop;
use super::views::ViewKey;
use super::{Stats, lock};
use crate::render::{
    FEATURE_SAMPLES, Inspected, Inspection, denoise_film, depths, develop, develop_colors, gather_guides, inspect,
    tint_sharp_zone,
};
use glam::UVec2;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Ratio of sampling time to denoising time: the next denoising waits until that much time has been spent on samples.
const SAMPLES_FIRST: u32 = 4;

impl Loop<'_> {
    /// Develops the film and hands the image over, unless the previous image has not been taken yet and `last` is
    /// false.
    pub(super) fn show(&mut self, last: bool) {
        let film = self.film.as_ref().filter(|(_, film)| film.spp() > 0).or(self.previous.as_ref());
        let (Some(job), Some((divider, film))) = (&self.job, film) else { return };
        // Coarse images are never denoised, for latency.
        let denoises = self.look.inspection == Inspection::Denoised && *divider == 1;
        let key = ViewKey {
            generation: job.generation,
            inspection: self.look.inspection,
            size: UVec2::new(film.width(), film.height()),
        };
        let stats = Stats {
            denoised_error: self.stats.denoised_error.filter(|_| denoises),
            film_width: film.width(),
            film_height: film.height(),
            divider: *divider,
            spp: film.spp(),
            region: self.active_region().map(|region| (region, film.spp_in(Some(&region)))),
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
        let waits = |&(of, until): &(ViewKey, Instant)| of == key && Instant::now() < until;
        if denoises && !last && !self.redraw && self.views.denoised.as_ref().is_some_and(waits) {
            return;
        }
        let start = Instant::now();
        let pool = lock(&self.shared.pool).clone();
        let (width, height) = (job.width, job.height);
        let picture = &mut self.spare;
        let interrupt = &self.shared.interrupt;
        // Another view or job has arrived: this image would not be displayed.
        let stop = || interrupt.load(Ordering::Relaxed);
        let mut legend = None;
        if denoises {
            let known = self.views.guides.take().filter(|(of, _)| *of == key).map(|(_, guides)| guides);
            let made = pool.install(|| {
                let gather = || gather_guides(&job.prepared, &job.settings, key.size, FEATURE_SAMPLES, &stop);
                let guides = known.or_else(gather)?;
                let denoised = denoise_film(&job.prepared, film, &guides, &stop)?;
                develop_colors(&denoised.color, key.size.into(), &self.display, (width, height), &mut picture.rgba);
                Some((guides, denoised.error))
            });
            let Some((guides, error)) = made else { return };
            self.views.guides = Some((key, guides));
            let now = Instant::now();
            self.views.denoised = Some((key, now + SAMPLES_FIRST * (now - start)));
            self.stats.denoised_error = Some(error);
            lock(&self.shared.outbox).stats.denoised_error = Some(error);
        } else if matches!(self.look.inspection, Inspection::Picture | Inspection::Denoised) {
            pool.install(|| develop(film, &self.display, width, height, &mut picture.rgba));
        } else {
            let known = self.views.inspected.take().filter(|(of, _)| *of == key && !key.inspection.is_of_film());
            let view = known
                .map(|(_, view)| view)
                .or_else(|| pool.install(|| inspect(key.inspection, &job.prepared, &job.settings, film, &stop)));
            let Some(view) = view else { return };
            enlarge(&view, width, height, &mut picture.rgba);
            legend = view.legend;
            self.views.inspected = Some((key, view));
        }
        if self.look.sharp_zone && job.prepared.camera.lens_radius > 0.0 {
            let key = ViewKey { inspection: Inspection::Depth, ..key };
            let known = self.views.depths.take().filter(|(of, _)| *of == key).map(|(_, depths)| depths);
            let Some(depths) = known.or_else(|| pool.install(|| depths(&job.prepared, key.size, &stop))) else {
                return;
            };
            let camera = &job.prepared.camera;
            let zone = camera.sharp_zone(height);
            let size = UVec2::new(width, height);
            pool.install(|| tint_sharp_zone(&mut picture.rgba, size, &depths, key.size, zone, camera.focus_distance));
            self.views.depths = Some((key, depths));
        }
        self.n_pictures += 1;
        (picture.width, picture.height, picture.number) = (width, height, self.n_pictures);
        let is_raw = self.look.inspection == Inspection::Denoised && !denoises;
        picture.inspection = if is_raw { Inspection::Picture } else { self.look.inspection };
        picture.legend = legend;
        (picture.generation, picture.divider, picture.spp) = (job.generation, *divider, film.spp());
        {
            let mut outbox = lock(&self.shared.outbox);
            std::mem::swap(&mut outbox.picture, &mut self.spare);
            outbox.fresh = true;
        }
        tracing::trace!("tone-mapped in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
        self.redraw = false;
        self.wake();
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
