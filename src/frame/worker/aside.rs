//! Samples of a view in another size: opening the panel and closing it again loses none.

use crate::frame::core::scheduler::Scheduler;
use crate::frame::worker::shared::{Job, Stats};
use crate::frame::worker::views::Settled;
use crate::render::Film;

/// A film at full resolution, and what belongs to it.
pub struct SetAside {
    pub film: Film,
    pub settled: Option<Settled>,
    pub stats: Stats,
    /// As in [`Scheduler::spent`].
    pub spent: f64,
}

impl SetAside {
    /// `None` without a sample in every pixel at full resolution.
    pub fn of(
        film: Option<(u32, Film)>,
        settled: Option<Settled>,
        stats: &Stats,
        scheduler: &Scheduler,
    ) -> Option<Self> {
        let (_, film) = film.filter(|(divider, film)| *divider == 1 && film.spp() > 0)?;
        Some(Self { film, settled, stats: stats.clone(), spent: scheduler.spent() })
    }

    fn is_for(&self, job: &Job) -> bool {
        (self.film.width(), self.film.height()) == (job.width, job.height)
    }
}

/// Returns what `job` continues, and what to set aside meanwhile. Of two that it does not continue, that with more
/// samples per pixel: sizes come and go while a window is resized.
///
/// - `current`, `before`: of the view of `job`.
pub fn exchange(current: Option<SetAside>, before: Option<SetAside>, job: &Job) -> [Option<SetAside>; 2] {
    match (current, before) {
        (current, Some(before)) if before.is_for(job) => [Some(before), current],
        (Some(current), Some(before)) if before.film.spp() > current.film.spp() => [None, Some(before)],
        (current, before) => [None, current.or(before)],
    }
}
