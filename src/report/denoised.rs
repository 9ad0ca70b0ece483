//! The steps of a convergence curve, denoised: by firstlight, and by Open Image Denoise where it is installed.

use super::{CurveStep, Distance, LinearPicture};
use crate::oidn::{Oidn, OidnError};
use crate::render::{Denoised, Display, SurfaceGuides, denoise_source};
use glam::Vec3;

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

/// The names of the denoisers, in this order; the first needs nothing to be installed.
const NAMES: [&str; 3] = ["denoised", "Open Image Denoise combined with raw", "Open Image Denoise alone"];

/// Denoises each step and compares it with `reference`, which must have the same size.
///
/// - `guides`: of the scene; `oidn`: the library, if it is installed.
///
/// # Errors
/// If the library reports one.
pub fn denoised_curves(
    steps: &[CurveStep],
    guides: &SurfaceGuides,
    oidn: Option<&Oidn>,
    reference: &LinearPicture,
    display: &Display,
) -> Result<Vec<DenoisedCurve>, OidnError> {
    let mut curves: Vec<DenoisedCurve> = NAMES.map(|name| DenoisedCurve { name, steps: Vec::new() }).into();
    for step in steps {
        let measured = |pixels: Vec<Vec3>, estimate| {
            let (width, height) = (step.picture.width, step.picture.height);
            let picture = LinearPicture { width, height, pixels };
            DenoisedStep { spp: step.spp, distance: Distance::between(&picture, reference, display), estimate }
        };
        let combined = |found: Denoised| measured(found.color, Some((found.error, found.error_95)));
        let never = || false;
        curves[0].steps.extend(denoise_source(&step.source, guides, &never).map(combined));
        if let Some(oidn) = oidn {
            curves[1].steps.extend(oidn.denoise(&step.source, guides, &never)?.map(combined));
            curves[2].steps.push(measured(oidn.filter_source(&step.source, guides)?, None));
        }
    }
    curves.retain(|curve| !curve.steps.is_empty());
    Ok(curves)
}
