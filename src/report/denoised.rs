//! The steps of a convergence curve, denoised: by firstlight, and by Open Image Denoise where it is installed.

use crate::frame::core::oidn::{Oidn, OidnError};
use crate::render::{Denoised, Display, SurfaceGuides, denoise_source, guide_samples};
use crate::report::curve::{CurveSeconds, seconds_to};
use crate::report::{CurveStep, Distance, LinearPicture, cpu_seconds};
use glam::Vec3;
use std::time::Instant;

/// One denoiser at all steps of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct DenoisedCurve {
    pub name: &'static str,
    pub steps: Vec<DenoisedStep>,
}

/// One denoised image compared with the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenoisedStep {
    pub spp: u32,
    /// Until the image is there: samples, feature buffers, and denoising once. CPU seconds per thread, as
    /// [`Spent::seconds`](crate::report::Spent::seconds).
    pub seconds: f64,
    pub distance: Distance,
    /// The error that it tells of itself with its 95 % interval; `None` for a filter alone, which tells none.
    pub estimate: Option<(f64, [f64; 2])>,
}

impl DenoisedStep {
    /// Root of relMSE.
    pub fn error(&self) -> f64 {
        self.distance.relative_mse.sqrt()
    }

    /// Estimated over measured error; 1 is perfect. `None` if either is unknown or 0.
    pub fn calibration(&self) -> Option<f64> {
        self.estimate.filter(|_| self.error() > 0.0).map(|(estimate, _)| estimate / self.error())
    }
}

impl DenoisedCurve {
    /// CurveSeconds until the relative error is down to `error`; `None` if it is not, in the measured steps.
    pub fn seconds_to(&self, error: f64) -> Option<CurveSeconds> {
        let mut points: Vec<(f64, f64)> =
            self.steps.iter().map(|step| (step.seconds, step.distance.relative_mse)).collect();
        // A single sample per pixel takes longer to denoise: an image of more samples may be there sooner.
        for i in (1..points.len()).rev() {
            points[i - 1].0 = points[i - 1].0.min(points[i].0);
        }
        let first = points.first().copied()?;
        // The first step is the earliest image there can be.
        let at_once = || (first.1 <= error * error).then_some(CurveSeconds::Interpolated(first.0));
        seconds_to(&points, None, error * error).or_else(at_once)
    }
}

/// CPU seconds per thread of the current pool that `work` takes; wall seconds where the system tells no CPU time.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let (cpu, start) = (cpu_seconds(), Instant::now());
    let done = work();
    let wall = start.elapsed().as_secs_f64();
    let of_cpu = cpu_seconds().zip(cpu).map(|(now, before)| (now - before) / rayon::current_num_threads() as f64);
    (done, of_cpu.unwrap_or(wall))
}

/// The names of the denoisers, in this order; the first needs nothing to be installed.
const NAMES: [&str; 3] = ["denoised", "Open Image Denoise combined with raw", "Open Image Denoise alone"];

/// Denoises each step and compares it with `reference`, which must have the same size.
///
/// - `gather`: gathers guides of at least so many samples per pixel, and returns them with the seconds that all calls took
///   so far; `oidn`: the library, if it is installed.
///
/// # Errors
/// If the library reports one.
pub fn denoised_curves(
    steps: &[CurveStep],
    gather: &mut dyn FnMut(u32) -> (SurfaceGuides, f64),
    oidn: Option<&Oidn>,
    reference: &LinearPicture,
    display: &Display,
) -> Result<Vec<DenoisedCurve>, OidnError> {
    let mut curves: Vec<DenoisedCurve> = NAMES.map(|name| DenoisedCurve { name, steps: Vec::new() }).into();
    for step in steps {
        let (guides, guides_took) = &gather(guide_samples(step.spp));
        let measured = |pixels: Vec<Vec3>, took: f64, estimate| {
            let (width, height) = (step.picture.width, step.picture.height);
            let picture = LinearPicture { width, height, pixels };
            let seconds = step.spent.seconds() + guides_took + took;
            DenoisedStep { spp: step.spp, seconds, distance: Distance::between(&picture, reference, display), estimate }
        };
        let combined =
            |(found, took): (Denoised, f64)| measured(found.color, took, Some((found.error, found.error_95)));
        let never = || false;
        let (own, took) = timed(|| denoise_source(&step.source, guides, &never));
        curves[0].steps.extend(own.map(|found| combined((found, took))));
        if let Some(oidn) = oidn {
            let (found, took) = timed(|| oidn.denoise(&step.source, guides, &never));
            curves[1].steps.extend(found?.map(|found| combined((found, took))));
            let (filtered, took) = timed(|| oidn.filter_source(&step.source, guides));
            curves[2].steps.push(measured(filtered?, took, None));
        }
    }
    curves.retain(|curve| !curve.steps.is_empty());
    Ok(curves)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_count_from_the_first_image_that_is_good_enough() {
        let step = |spp, seconds, error: f64| {
            let distance = Distance { relative_mse: error * error, rmse: 0.0, flip: 0.0 };
            DenoisedStep { spp, seconds, distance, estimate: None }
        };
        let curve = DenoisedCurve {
            name: "denoised",
            // The first step is slow to denoise.
            steps: vec![step(1, 0.3, 0.04), step(2, 0.2, 0.03), step(4, 0.4, 0.015)],
        };
        assert_eq!(curve.seconds_to(0.05), Some(CurveSeconds::Interpolated(0.2)));
        let Some(CurveSeconds::Interpolated(seconds)) = curve.seconds_to(0.02) else { panic!("between two steps") };
        assert!((0.2..0.4).contains(&seconds), "{seconds}");
        assert_eq!(curve.seconds_to(0.01), None, "beyond the measured steps");
    }
}
