//! Convergence curve: one scene at 1, 2, 4 … samples per pixel, with the cost and the error of each step.

use crate::render::{
    DenoiseSource, Display, ErrorEstimate, Film, Prepared, RayCounts, RenderSettings, advance, compute_tables,
};
use crate::report::curve::{CurveSeconds, seconds_at, seconds_to, slope};
use crate::report::{Distance, LinearPicture};
use std::time::{Duration, Instant};

/// Where a curve ends: at the last power of two within both limits, but never before the first step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveLimits {
    /// Samples per pixel.
    pub spp: u32,
    /// Wall time; a step that would exceed it is not started.
    pub seconds: Option<f64>,
}

/// The image of one step, and its cost.
#[derive(Clone, Debug)]
pub struct CurveStep {
    pub spp: u32,
    pub spent: Spent,
    pub estimate: Option<ErrorEstimate>,
    pub picture: LinearPicture,
    /// What the denoiser reads of the film.
    pub source: DenoiseSource,
}

/// Cost of the samples so far: rendering alone, without loading, building or comparing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    pub wall_seconds: f64,
    /// Sum over all threads; `None` if the system does not report it.
    pub cpu_seconds: Option<f64>,
    pub threads: usize,
    pub camera_paths: u64,
    pub rays: u64,
}

impl Spent {
    /// CPU seconds per thread: an estimate of the wall time on an idle machine. Wall time if there is no CPU time.
    pub fn seconds(&self) -> f64 {
        self.cpu_seconds.map_or(self.wall_seconds, |cpu| cpu / self.threads as f64)
    }

    pub fn rays_per_second(&self) -> f64 {
        self.rays as f64 / self.seconds().max(1e-9)
    }

    pub fn paths_per_second(&self) -> f64 {
        self.camera_paths as f64 / self.seconds().max(1e-9)
    }
}

/// Renders `prepared` on the current rayon pool until `limits`. `progress` receives the completed fraction, 0..1.
///
/// If `stop` returns true, the current step is discarded and the completed steps are returned, possibly none.
pub fn measure_curve(
    prepared: &Prepared,
    settings: &RenderSettings,
    (width, height): (u32, u32),
    limits: CurveLimits,
    progress: &mut dyn FnMut(f64),
    stop: &(dyn Fn() -> bool + Sync),
) -> Vec<CurveStep> {
    compute_tables(prepared);
    let mut film = Film::new(width, height);
    let mut steps: Vec<CurveStep> = Vec::new();
    let mut rays = RayCounts::default();
    let mut pace = Pace::default();
    let (mut wall, mut cpu) = (Duration::ZERO, cpu_seconds().map(|_| 0.0));
    let mut spp = 1;
    loop {
        while film.spp() < spp {
            let goal = film.spp().saturating_add(pace.spp()).min(spp);
            let (start, cpu_start) = (Instant::now(), cpu_seconds());
            let before = film.spp();
            rays += advance(prepared, settings, &mut film, goal, stop).rays;
            if stop() && film.spp() < goal {
                return steps;
            }
            let elapsed = start.elapsed();
            wall += elapsed;
            cpu = cpu.zip(cpu_start.zip(cpu_seconds())).map(|(sum, (from, to))| sum + to - from);
            pace.took(goal - before, elapsed);
            let by_time = limits.seconds.map_or(0.0, |seconds| wall.as_secs_f64() / seconds);
            progress((f64::from(film.spp()) / f64::from(limits.spp)).max(by_time).min(1.0));
        }
        let spent = Spent {
            wall_seconds: wall.as_secs_f64(),
            cpu_seconds: cpu,
            threads: rayon::current_num_threads(),
            camera_paths: rays.camera,
            rays: rays.total(),
        };
        let (picture, source) = (LinearPicture::of(&film), DenoiseSource::of(&film));
        steps.push(CurveStep { spp, spent, estimate: film.error_estimate(), picture, source });
        // The next step takes as long as all steps before it.
        let too_long = limits.seconds.is_some_and(|seconds| 2.0 * spent.wall_seconds > seconds);
        match spp.checked_mul(2) {
            Some(next) if next <= limits.spp && !too_long => spp = next,
            _ => break,
        }
    }
    progress(1.0);
    steps
}

/// Chooses the number of samples per call, so that progress is reported a few times per second.
#[derive(Default)]
struct Pace {
    seconds_per_sample: f64,
}

impl Pace {
    fn spp(&self) -> u32 {
        const SLICE: f64 = 0.25;
        // Waves hold several samples of each pixel: with few samples per call the kernel would be half empty.
        if self.seconds_per_sample > 0.0 { (SLICE / self.seconds_per_sample).clamp(4.0, 4096.0) as u32 } else { 4 }
    }

    fn took(&mut self, spp: u32, elapsed: Duration) {
        self.seconds_per_sample = elapsed.as_secs_f64() / f64::from(spp);
    }
}

/// One step compared with the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub spp: u32,
    pub spent: Spent,
    pub distance: Distance,
    /// The renderer's own error estimate.
    pub estimate: Option<ErrorEstimate>,
}

impl Step {
    /// Root of relMSE: the relative error of the image.
    pub fn error(&self) -> f64 {
        self.distance.relative_mse.sqrt()
    }

    /// Estimated over measured error; 1 is perfect. `None` if the error is 0.
    pub fn calibration(&self) -> Option<f64> {
        let estimate = self.estimate.filter(|_| self.error() > 0.0);
        estimate.map(|estimate| estimate.relative / self.error())
    }

    /// relMSE times seconds: constant for independent samples; smaller is better.
    pub fn inefficiency(&self) -> f64 {
        self.distance.relative_mse * self.spent.seconds()
    }
}

/// All steps of one scene with one set of techniques.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvergenceCurve {
    pub steps: Vec<Step>,
}

impl ConvergenceCurve {
    /// Compares each step with `reference`, which must have the same size; needs at least one step.
    pub fn measure(steps: &[CurveStep], reference: &LinearPicture, display: &Display) -> Self {
        assert!(!steps.is_empty(), "a curve has at least one step");
        let measured = |step: &CurveStep| Step {
            spp: step.spp,
            spent: step.spent,
            distance: Distance::between(&step.picture, reference, display),
            estimate: step.estimate,
        };
        Self { steps: steps.iter().map(measured).collect() }
    }

    pub fn last(&self) -> &Step {
        self.steps.last().expect("a curve has at least one step")
    }

    /// The step with this number of samples per pixel.
    pub fn at(&self, spp: u32) -> Option<&Step> {
        self.steps.iter().find(|step| step.spp == spp)
    }

    /// CurveSeconds and relMSE of each step.
    pub fn points(&self) -> Vec<(f64, f64)> {
        self.steps.iter().map(|step| (step.spent.seconds(), step.distance.relative_mse)).collect()
    }

    /// Slope of log relMSE over log seconds, fitted to the later half of the steps; −1 for independent samples.
    ///
    /// The first steps take longer per sample than later ones (tables and caches are filled, waves are not full), and
    /// errors fall faster at first than later: including them would make the line steeper than the continuation of the
    /// curve.
    pub fn slope(&self) -> Option<f64> {
        let later = &self.steps[self.steps.len() / 2..];
        // A line needs two points.
        let later = if later.len() < 2 { &self.steps[..] } else { later };
        slope(&later.iter().map(|step| (step.spent.seconds(), step.distance.relative_mse)).collect::<Vec<_>>())
    }

    /// Predicted over actual seconds to the final estimated error; 1 is perfect. The prediction is made at the first
    /// step after a tenth of the time; `None` if that is the last step, or there is no estimate.
    pub fn foresight(&self) -> Option<f64> {
        let (last, _) = self.steps.split_last()?;
        let is_early = |step: &&Step| step.spent.seconds() >= 0.1 * last.spent.seconds() && step.spp < last.spp;
        let early = self.steps.iter().position(|step| is_early(&step))?;
        let spp = self.steps[early].estimate?.spp_for(last.estimate?.relative);
        let times = self.steps[..=early].iter().map(|step| (f64::from(step.spp), step.spent.seconds()));
        Some(seconds_at(&times.collect::<Vec<_>>(), f64::from(spp)) / last.spent.seconds())
    }

    /// CurveSeconds until the relative error is down to `error`; `None` if the curve does not reach it.
    pub fn seconds_to(&self, error: f64) -> Option<CurveSeconds> {
        seconds_to(&self.points(), self.slope(), error * error)
    }
}

/// CPU seconds of this process so far, summed over all threads; `None` if the system does not report them.
pub fn cpu_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
    }
    #[cfg(not(unix))]
    None
}
