//! From the film to what is seen: developed or inspected, as large as the window, with what lies over it.

use super::thread::Loop;
use super::views::ViewKey;
use super::{Stats, lock};
use crate::render::{Inspected, Inspection, depths, develop, inspect, tint_sharp_zone};
use glam::UVec2;
use std::sync::atomic::Ordering;
use std::time::Instant;

impl Loop<'_> {
    /// Develops the film and hands it over, unless the last picture still waits to be taken and will do for now.
    pub(super) fn show(&mut self, last: bool) {
        let film = self.film.as_ref().filter(|(_, film)| film.spp() > 0).or(self.previous.as_ref());
        let (Some(job), Some((divider, film))) = (&self.job, film) else { return };
        let stats = Stats {
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
        let start = Instant::now();
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
        (picture.inspection, picture.legend) = (self.look.inspection, legend);
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
