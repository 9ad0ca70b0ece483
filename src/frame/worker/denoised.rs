//! When the film is denoised, and which denoised image is displayed.
//!
//! Images of a moving camera are smoothed at once, by the render thread. At full resolution the settled filter runs
//! beside the samples ([`crate::frame::worker::denoiser`]) on a copy of the film, as soon as that has guides and a few samples, and then
//! each time that the film has a quarter more and there was time for them; sooner if the raw image is about to become
//! the better one. Until the first result, images are smoothed; while the raw image is the better one, it is mixed with
//! the latest result.

use crate::frame::core::denoising::Denoising;
use crate::frame::worker::denoiser::{Request, ToDenoise};
use crate::frame::worker::shared::{KeptDenoised, lock};
use crate::frame::worker::thread::Loop;
use crate::frame::worker::views::{Settled, ViewKey};
use crate::render::{
    DenoiseSource, Film, Inspection, MovingImage, Relighting, develop, develop_colors, guide_samples, relight,
    smooth_film,
};
use glam::{UVec2, Vec3};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Ratio of sampling time to denoising time: the next denoising waits until that much time has been spent on samples,
/// unless the raw image would become the better one within as much. Half as much is enough if the film has doubled its
/// samples, none if it has [`MANY_MORE`].
const SAMPLES_FIRST: u32 = 4;
/// Samples of the film over those of its denoised image from which on a new one does not wait.
const MANY_MORE: u32 = 4;

/// Samples per pixel of the first denoised image of a view, and those that it has if it takes that long to get them.
/// With a single one nothing is known of the noise: the smoothed image is as good.
const FIRST_SAMPLES: [(u32, Duration); 3] =
    [(4, Duration::ZERO), (2, Duration::from_millis(700)), (1, Duration::from_secs(3))];

/// Samples per pixel of the guides of the first denoised image of a view; later ones have [`guide_samples`].
const FIRST_GUIDE_SAMPLES: u32 = 8;

impl Loop<'_> {
    /// The noise that the image is to be displayed with; raw where something else is displayed.
    pub(super) fn wanted_denoising(&self) -> Denoising {
        if self.look.inspection == Inspection::Picture { self.look.denoising } else { Denoising::Raw }
    }

    /// Takes over a denoised image of the current view.
    pub(super) fn take_settled(&mut self) {
        let Some(mut settled) = self.denoiser.take() else { return };
        if self.settled_key().is_some_and(|key| key == settled.key) && settled.filter == self.look.filter {
            tracing::debug!(
                "denoised {} samples per pixel with guides of {}, in {:.2} s, {:.2} s after the restart",
                settled.spp,
                settled.guide_samples,
                settled.took.as_secs_f64(),
                self.restarted_at.elapsed().as_secs_f64()
            );
            self.views.settle_again = Some(Instant::now() + SAMPLES_FIRST * settled.took);
            self.redraw |= self.wanted_denoising() != Denoising::Raw;
            // This view will not be smoothed any more. Coarse images need little memory.
            self.moving.forget_image();
            if let Some(still) = settled.still.take() {
                self.moving.settle(still);
            }
            self.views.settled = Some(settled);
            self.views.smooth_again = None;
            if let Some((_, film)) = &mut self.film {
                film.forget_surfaces();
            }
        }
    }

    /// Identifies denoised images of the film at full resolution.
    pub(super) fn settled_key(&self) -> Option<ViewKey> {
        let (job, (divider, film)) = (self.job.as_ref()?, self.film.as_ref()?);
        let size = UVec2::new(film.width(), film.height());
        (*divider == 1).then_some(ViewKey { generation: job.generation, inspection: Inspection::Picture, size })
    }

    /// The denoised image of a view, by the filter that is wanted.
    fn settled(&self, key: ViewKey) -> Option<&Settled> {
        self.views.settled.as_ref().filter(|settled| settled.key == key && settled.filter == self.look.filter)
    }

    /// Has the film denoised if it is time, or guides gathered if the view has none.
    ///
    /// - `is_last`: no samples will follow, so that it is time whenever there are new ones.
    pub(super) fn request_denoised(&self, is_last: bool) {
        if self.wanted_denoising() == Denoising::Raw || self.denoiser.is_busy() {
            return;
        }
        let (Some(job), Some((1, film)), Some(key)) = (&self.job, &self.film, self.settled_key()) else { return };
        let (before, guides_before) = self.settled(key).map_or((0, 0), |settled| (settled.spp, settled.guide_samples));
        let is_first = before == 0;
        let spp = film.spp_in(self.active_region().as_ref());
        // Rays take time from samples: better guides come later here than where an image is made once.
        let guide_samples = match (is_first, is_last) {
            (true, false) => FIRST_GUIDE_SAMPLES,
            (false, false) => guide_samples(spp / 4),
            (_, true) => guide_samples(spp),
        };
        let pool = lock(&self.shared.pool).clone();
        let mut is_urgent = is_first;
        let image = if self.denoiser.guide_samples(key) < FIRST_GUIDE_SAMPLES && !is_last {
            // The film gets more samples meanwhile, from which the first image is made then.
            None
        } else {
            let left =
                self.views.settle_again.map_or(Duration::ZERO, |at| at.saturating_duration_since(Instant::now()));
            let took = self.settled(key).map_or(Duration::ZERO, |settled| settled.took);
            // Half as long is enough for twice the samples.
            let most = if spp >= 2 * before { SAMPLES_FIRST / 2 * took } else { Duration::ZERO };
            let waits = left > most && spp < MANY_MORE * before;
            is_urgent |= self.settled(key).is_some_and(|settled| self.is_nearly_overtaken(settled, spp));
            let elapsed = self.restarted_at.elapsed();
            let is_soon = match is_first {
                true => !FIRST_SAMPLES.iter().any(|(samples, after)| spp >= *samples && elapsed >= *after),
                false => waits && !is_urgent,
            };
            let is_due = match is_last {
                true => spp > before || guides_before < guide_samples,
                false => spp > before && !is_soon && 4 * u64::from(spp) >= 5 * u64::from(before),
            };
            // A copy of the film would delay the answer to what has arrived.
            let is_awaited = !is_last && self.shared.interrupt.load(Ordering::Relaxed);
            if film.spp() == 0 || !is_due || is_awaited {
                return;
            }
            Some(ToDenoise {
                filter: self.look.filter,
                source: pool.install(|| DenoiseSource::of(film)),
                spp,
                exposure: self.display.exposure(),
            })
        };
        self.denoiser.request(Request {
            key,
            prepared: job.prepared.clone(),
            settings: job.settings,
            guide_samples,
            image,
            is_urgent,
            threads: pool.current_num_threads(),
        });
    }

    /// Develops the image as it is wanted and can be had now; `None` if another view or job has arrived meanwhile.
    ///
    /// - `moving`: smooths what is not denoised.
    pub(super) fn develop_wanted(
        &self,
        moving: &mut MovingImage,
        (divider, film): (u32, &Film),
        key: ViewKey,
        (width, height): (u32, u32),
        rgba: &mut Vec<u8>,
    ) -> Option<Developed> {
        let wanted = self.wanted_denoising();
        let develop_raw = |rgba: &mut Vec<u8>| develop(film, &self.display, width, height, rgba);
        let Some(job) = self.job.as_ref().filter(|_| wanted != Denoising::Raw) else {
            develop_raw(rgba);
            return Some(Developed::raw());
        };
        // The first image of a view is displayed whatever comes next, or nothing would be displayed during a long
        // movement.
        let stop = || self.pictured == job.generation && self.shared.interrupt.load(Ordering::Relaxed);
        let settled = self.settled(key).filter(|_| divider == 1);
        let of_settled = settled.map(|settled| OfSettled { error: settled.denoised.error, spp: settled.spp });
        if let Some((settled, share)) = settled.and_then(|settled| Some((settled, self.raw_share(settled)?)))
            && wanted == Denoising::Denoised
        {
            develop_colors(&mixed(film, settled, share), key.size.into(), &self.display, (width, height), rgba);
            return Some(Developed { settled: of_settled, is_mixed: true, ..Developed::as_is(wanted) });
        }
        let surfaces = self.scheduler.surfaces(divider);
        let (mut smoothing, mut relighting) = (None, None);
        let smoothed = match settled {
            Some(_) => None,
            // Only the display has changed.
            None if self.is_smoothed(key) => Some(moving.latest()),
            None => {
                let start = Instant::now();
                let is_smooth = smooth_film(&mut moving.filter, &job.prepared, &job.settings, film, &stop).is_some();
                smoothing = is_smooth.then(|| start.elapsed());
                let how = Relighting {
                    surfaces: UVec2::new(job.width.div_ceil(surfaces), job.height.div_ceil(surfaces)),
                    weight: film.spp() as f32 * self.scheduler.weight(divider),
                    window: UVec2::new(job.width, job.height),
                    exposure: self.display.exposure(),
                };
                let relit = match is_smooth {
                    true => relight(moving, &job.prepared, &job.settings, film, &how, &stop),
                    false => None,
                };
                if relit.is_some() {
                    let took = start.elapsed();
                    match surfaces == divider {
                        true => smoothing = Some(took),
                        false => relighting = Some((surfaces, took.saturating_sub(smoothing.unwrap_or_default()))),
                    }
                }
                relit
            }
        };
        let colors = settled.map(|settled| (settled.denoised.color.as_slice(), key.size)).or(smoothed);
        let Some((colors, size)) = colors else {
            if stop() {
                return None;
            }
            develop_raw(rgba);
            return Some(Developed::raw());
        };
        develop_colors(colors, size.into(), &self.display, (width, height), rgba);
        if wanted == Denoising::Split {
            let mut raw = Vec::new();
            develop_raw(&mut raw);
            split(rgba, &raw, width as usize);
        }
        Some(Developed { denoising: wanted, settled: of_settled, is_mixed: false, smoothing, relighting })
    }

    /// The denoised image that is displayed of the film; `None` where it is the raw or a smoothed one.
    pub(super) fn displayed_denoised(&self, film: &Film) -> Option<KeptDenoised> {
        let is_current = self.film.as_ref().is_some_and(|(_, current)| std::ptr::eq(current, film));
        let settled = self.settled(self.settled_key().filter(|_| is_current)?)?;
        let colors = match self.wanted_denoising() {
            Denoising::Raw => return None,
            Denoising::Denoised if let Some(share) = self.raw_share(settled) => mixed(film, settled, share),
            Denoising::Denoised | Denoising::Split => settled.denoised.color.clone(),
        };
        Some(KeptDenoised { colors, by: settled.by })
    }

    /// Share of the raw image in a mix with one that was denoised from fewer samples; `None` unless the raw image has
    /// become the better one, as far as both errors are known. A busy machine may leave no time for denoising.
    fn raw_share(&self, settled: &Settled) -> Option<f32> {
        let raw = self.stats.progress.estimated_error.filter(|_| self.active_region().is_none())?;
        share_of_better(raw, settled.denoised.error)
    }

    /// Whether the raw image will be the better one before another image is denoised, if that does not begin now. Noise
    /// would come back to the display until then.
    ///
    /// - `spp`: samples per pixel now.
    fn is_nearly_overtaken(&self, settled: &Settled, spp: u32) -> bool {
        let Some(raw) = self.stats.progress.estimated_error.filter(|_| self.active_region().is_none()) else {
            return false;
        };
        let left = time_until_overtaken(raw, settled.denoised.error, self.restarted_at.elapsed());
        2 * u64::from(spp) >= 3 * u64::from(settled.spp) && left <= SAMPLES_FIRST * settled.took
    }

    /// Whether an image of the film would look like the one before or come too soon after it.
    pub(super) fn is_displayed(&self, divider: u32, key: ViewKey) -> bool {
        if divider > 1 || self.wanted_denoising() == Denoising::Raw {
            return false;
        }
        let settled = self.settled(key);
        match settled {
            Some(settled) => self.wanted_denoising() == Denoising::Denoised && self.raw_share(settled).is_none(),
            None => self.is_smoothed(key),
        }
    }

    /// Whether a smoothed image of this view at full resolution is there, and too new to be made again.
    fn is_smoothed(&self, key: ViewKey) -> bool {
        self.views.smooth_again.is_some_and(|(of, until)| of == key && Instant::now() < until)
    }

    /// Notes how long an image of the film at full resolution took, if it was smoothed: samples come first.
    pub(super) fn note_smoothing(&mut self, divider: u32, key: ViewKey, took: Duration) {
        if divider == 1 && self.wanted_denoising() != Denoising::Raw {
            self.views.smooth_again = Some((key, Instant::now() + SAMPLES_FIRST * took));
        }
    }
}

/// A mix of the raw and the denoised image.
///
/// - `share`: that of the raw one, 0..1.
fn mixed(film: &Film, settled: &Settled, share: f32) -> Vec<Vec3> {
    let mut colors = film.means();
    colors.iter_mut().zip(&settled.denoised.color).for_each(|(raw, denoised)| *raw = denoised.lerp(*raw, share));
    colors
}

/// How an image was developed.
pub struct Developed {
    pub denoising: Denoising,
    /// The image of the settled filter, if there is one.
    pub settled: Option<OfSettled>,
    /// That one is mixed with the raw image, which has more samples.
    pub is_mixed: bool,
    /// How long it was smoothed.
    pub smoothing: Option<Duration>,
    /// Divider of the finer surfaces that light was put on, and how long that took.
    pub relighting: Option<(u32, Duration)>,
}

/// A denoised image, for the status.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OfSettled {
    /// Its relative error.
    pub error: f64,
    /// Samples per pixel of which it was made.
    pub spp: u32,
}

impl Developed {
    pub fn raw() -> Self {
        Self::as_is(Denoising::Raw)
    }

    fn as_is(denoising: Denoising) -> Self {
        Self { denoising, settled: None, is_mixed: false, smoothing: None, relighting: None }
    }
}

/// Share of the raw image in a mix of both that has the least error if their errors are independent; `None` if the
/// denoised image is the better one.
///
/// - `raw`, `denoised`: relative errors.
fn share_of_better(raw: f64, denoised: f64) -> Option<f32> {
    let [a, b] = [raw, denoised].map(|error| error * error);
    (raw < denoised).then_some((b / (a + b)) as f32)
}

/// Time until the raw image of a film has the error of a denoised one: errors fall with the square root of the time.
///
/// - `raw`, `denoised`: relative errors; `elapsed`: time that the samples took so far.
fn time_until_overtaken(raw: f64, denoised: f64, elapsed: Duration) -> Duration {
    let factor = (raw / denoised).powi(2) - 1.0;
    Duration::try_from_secs_f64(elapsed.as_secs_f64() * factor.max(0.0)).unwrap_or(Duration::MAX)
}

/// Puts the left half of the raw image over the denoised one, with a line between the two.
fn split(rgba: &mut [u8], raw: &[u8], width: usize) {
    let middle = width / 2;
    for (to, from) in rgba.chunks_exact_mut(4 * width).zip(raw.chunks_exact(4 * width)) {
        to[..4 * middle].copy_from_slice(&from[..4 * middle]);
        to[4 * middle..4 * (middle + 1)].fill(255);
    }
}

#[cfg(test)]
mod tests {
    use super::{Duration, share_of_better, split, time_until_overtaken};

    #[test]
    fn a_denoised_image_is_overtaken_when_the_samples_have_its_error() {
        let left = |raw, denoised| time_until_overtaken(raw, denoised, Duration::from_secs(4));
        assert_eq!(left(0.1, 0.05), Duration::from_secs(12));
        assert_eq!((left(0.05, 0.05), left(0.01, 0.05)), (Duration::ZERO, Duration::ZERO));
        assert_eq!(left(0.1, 0.0), Duration::MAX);
    }

    #[test]
    fn a_raw_image_is_mixed_in_once_it_is_the_better_one() {
        assert_eq!(share_of_better(0.05, 0.05), None);
        assert_eq!(share_of_better(0.1, 0.05), None);
        assert_eq!(share_of_better(0.0, 0.05), Some(1.0));
        assert!((share_of_better(0.01, 0.03).unwrap() - 0.9).abs() < 1e-6);
    }

    #[test]
    fn the_left_half_is_raw_and_a_line_lies_between() {
        for width in [1, 2, 5] {
            let (mut rgba, raw) = (vec![2; 4 * width * 3], vec![1; 4 * width * 3]);
            split(&mut rgba, &raw, width);
            for row in rgba.chunks_exact(4 * width) {
                let expected = (0..width).flat_map(|x| {
                    [if x < width / 2 {
                        1
                    } else if x == width / 2 {
                        255
                    } else {
                        2
                    }; 4]
                });
                assert_eq!(row, expected.collect::<Vec<u8>>());
            }
        }
    }
}
