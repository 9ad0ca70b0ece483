//! Rendering without a window: until a target is reached, on the current rayon pool.

use crate::render::{
    BadSample, ErrorEstimate, Exposed, Film, RayCounts, Region, RenderSettings, SampleAllocation, advance_region,
};
use crate::scene::BadValue;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// When to stop: at the first limit that is reached. Without any, rendering never ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Samples per pixel; for an adaptive film the mean over all pixels.
    pub spp: Option<u32>,
    /// Seconds of rendering.
    pub seconds: Option<f64>,
    /// Estimated relative error of the whole image.
    pub error: Option<f64>,
}

impl Target {
    /// Checks the values.
    ///
    /// # Errors
    /// If a limit is not a positive number.
    pub fn check(&self) -> Result<(), BadValue> {
        for (field, value) in [("seconds", self.seconds), ("error", self.error)] {
            if value.is_some_and(|value| !(value > 0.0)) {
                return Err(BadValue::OutOfRange {
                    field,
                    value: value.unwrap_or_default().to_string(),
                    allowed: "be a positive number".to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Whether a limit is reached at these samples per pixel, seconds of rendering and relative error.
    pub fn reached(&self, spp: u32, seconds: f64, error: Option<f64>) -> bool {
        self.spp.is_some_and(|goal| spp >= goal)
            || self.seconds.is_some_and(|goal| seconds >= goal)
            || self.error.zip(error).is_some_and(|(goal, error)| error <= goal)
    }
}

/// Progress of a render, reported a few times per second.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Minimum samples per pixel; for an adaptive film the mean over all pixels.
    pub spp: u32,
    /// Seconds of rendering so far.
    pub seconds: f64,
    /// Rays traced so far, by class.
    pub rays: RayCounts,
    /// Error of the film, once it can be estimated.
    pub error: Option<ErrorEstimate>,
}

/// Result of a render.
#[derive(Clone, Debug, Default)]
pub struct OfflineReport {
    /// Wall time in seconds.
    pub seconds: f64,
    /// Rays traced, by class.
    pub rays: RayCounts,
    /// Number of samples that were rejected because they were not finite.
    pub n_bad: u64,
    /// The first few of them.
    pub bad: Vec<BadSample>,
    /// Number of samples brighter than any radiance in the scene can be, see
    /// [`PassReport::n_above`](crate::render::PassReport::n_above).
    pub n_above: u64,
    /// The first few of them.
    pub above: Vec<BadSample>,
}

/// Adds samples to `film` until `target` is reached; `progress` returns false to stop early.
///
/// With a time limit, at least one sample per pixel is taken, and the film may end with a partial pass.
pub fn render_offline<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film: &mut Film,
    target: Target,
    progress: impl FnMut(Progress) -> bool,
) -> OfflineReport {
    render_region_until(scene, settings, film, None, target, &|| false, progress)
}

/// Like [`render_offline`], for a region of the film, or all of it; samples, error and target are those of the region.
/// Ended within milliseconds by `stop`, which is called often by all workers; the film then may have a partial pass, or
/// pixels without a sample.
pub fn render_region_until<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film: &mut Film,
    region: Option<&Region>,
    target: Target,
    stop: &(dyn Fn() -> bool + Sync),
    progress: impl FnMut(Progress) -> bool,
) -> OfflineReport {
    render(scene.into(), settings, (film, region), target, None, stop, progress)
}

/// Like [`render_region_until`] for all of the film, where the target error is that of another image made of the film, such as the denoised
/// one.
///
/// - `error_of`: the error of that image, if known; called at 4 samples per pixel, then four times between
///   two powers of two, so that the result does not depend on the speed of the machine.
pub fn render_measured_until<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film: &mut Film,
    target: Target,
    error_of: &mut dyn FnMut(&Film) -> Option<f64>,
    stop: &(dyn Fn() -> bool + Sync),
    progress: impl FnMut(Progress) -> bool,
) -> OfflineReport {
    let spp = film.spp();
    // A film that is resumed may be there already.
    let is_look = target.error.is_some() && spp > 0 && next_measurement(spp - 1) == spp;
    if is_look && target.reached(spp, 0.0, error_of(film)) {
        return OfflineReport::default();
    }
    render(scene.into(), settings, (film, None), target, Some(error_of), stop, progress)
}

fn render(
    scene: Exposed,
    settings: &RenderSettings,
    (film, region): (&mut Film, Option<&Region>),
    target: Target,
    mut error_of: Option<&mut dyn FnMut(&Film) -> Option<f64>>,
    stop: &(dyn Fn() -> bool + Sync),
    mut progress: impl FnMut(Progress) -> bool,
) -> OfflineReport {
    /// Approximate seconds between reports.
    const SLICE: f64 = 0.25;
    let start = Instant::now();
    let deadline = target
        .seconds
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .and_then(|limit| start.checked_add(limit));
    let goal = target.spp.unwrap_or(u32::MAX);
    let mut report = OfflineReport::default();
    let mut step = 1;
    while film.spp_in(region) < goal {
        let slice_start = Instant::now();
        let before = film.spp_in(region);
        let late = || stop() || (before > 0 && deadline.is_some_and(|deadline| Instant::now() >= deadline));
        let at_most = before.saturating_add(step).min(goal);
        let look = target.error.map(|error| match settings.allocation {
            _ if error_of.is_some() => next_measurement(before),
            SampleAllocation::Adaptive(_) if region.is_none() => next_look(before),
            _ => first_worth_a_look(film, region, error, at_most),
        });
        let next = look.map_or(at_most, |look| look.min(at_most));
        let pass = advance_region(scene, settings, film, region, next, &late);
        report.rays += pass.rays;
        report.n_bad += pass.n_bad;
        report.bad.extend(pass.bad.into_iter().take(16_usize.saturating_sub(report.bad.len())));
        report.n_above += pass.n_above;
        report.above.extend(pass.above.into_iter().take(16_usize.saturating_sub(report.above.len())));
        report.seconds = start.elapsed().as_secs_f64();
        let (spp, seconds, error) = (film.spp_in(region), report.seconds, film.error_estimate_in(region));
        let go_on = progress(Progress { spp, seconds, rays: report.rays, error });
        let error = match &mut error_of {
            _ if look != Some(spp) || !go_on || stop() => None,
            Some(error_of) => error_of(film),
            None => error.map(|error| error.relative),
        };
        if !go_on || stop() || target.reached(spp, seconds, error) {
            break;
        }
        // Whole passes that take about a slice, growing slowly while the rate is unknown.
        let rate = f64::from(next - before) / slice_start.elapsed().as_secs_f64().max(1e-9);
        step = ((rate * SLICE) as u32).clamp(1, step.saturating_mul(4));
    }
    report.seconds = start.elapsed().as_secs_f64();
    report
}

/// Returns the next sample count at which the error of an adaptive film is checked: eight times between two powers of
/// two. The error changes with every block that doubles its samples, and the checks must not depend on the speed of the
/// machine.
fn next_look(now: u32) -> u32 {
    let step = (1 << now.max(1).ilog2()) / 8;
    let step = step.max(1);
    (now / step + 1).saturating_mul(step)
}

/// Returns the next sample count at which the error of another image is measured: four times between two powers of two,
/// from four samples per pixel on.
fn next_measurement(now: u32) -> u32 {
    let now = now.max(3);
    let step = ((1 << now.ilog2()) / 4).max(1);
    (now / step + 1).saturating_mul(step)
}

/// Returns the first sample count up to `at_most` at which an even film could reach the target: where its extrapolated
/// error is down to `target`, or the next power of two, where the error is measured again.
fn first_worth_a_look(film: &Film, region: Option<&Region>, target: f64, at_most: u32) -> u32 {
    let now = film.spp_in(region);
    let measured_next = (now + 1).checked_next_power_of_two().unwrap_or(u32::MAX);
    let last = at_most.min(measured_next);
    let estimate = film.error_estimate_in(region);
    let is_enough = |spp: &u32| estimate.is_some_and(|estimate| estimate.relative_at(*spp) <= target);
    (now + 1..last).find(is_enough).unwrap_or(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::advance;
    use crate::scene::{Extraction, LoadOptions, Rendering, SceneInputs, SceneSource, load};

    /// Compared with a check after every sample.
    #[test]
    fn a_target_error_ends_at_the_first_sample_that_meets_it() {
        let scene = load(&SceneSource::Builtin("cornell".to_owned()), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
        let settings = world.resource::<Rendering>().0;
        for goal in [0.3, 0.2, 0.12] {
            let mut film = Film::new(24, 24);
            render_offline(&prepared, &settings, &mut film, Target { error: Some(goal), ..Target::default() }, |_| {
                true
            });
            let mut slow = Film::new(24, 24);
            while slow.error_estimate().is_none_or(|error| error.relative > goal) {
                let next = slow.spp() + 1;
                advance(&prepared, &settings, &mut slow, next, &|| false);
            }
            assert_eq!(film.spp(), slow.spp(), "to {goal}");
        }
    }
}
