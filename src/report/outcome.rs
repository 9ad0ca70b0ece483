//! Results of a report for one scene.

use crate::render::Display;
use crate::report::{ConvergenceCurve, DenoisedCurve, LinearPicture, Made, is_another_scene};
use std::path::PathBuf;

/// All measurements of one scene.
#[derive(Clone, Debug)]
pub struct SceneOutcome {
    pub title: String,
    pub width: u32,
    pub height: u32,
    /// How its images are developed.
    pub display: Display,
    pub curve: ConvergenceCurve,
    /// The same samples, denoised.
    pub denoised: Vec<DenoisedCurve>,
    pub ablations: Vec<Ablation>,
    pub reference: LinearPicture,
    /// How an own reference was made; `None` for a given one.
    pub reference_made: Option<Made>,
    pub reference_path: Option<PathBuf>,
    /// Share of the image that differs from a given reference by more than noise can ([`crate::report::foreign_share`]); `None`
    /// for an own reference.
    pub foreign_share: Option<f64>,
    /// Image at 4 samples per pixel, or fewer if there are no more: its quality while framing a shot.
    pub early: LinearPicture,
    pub last: LinearPicture,
}

/// A curve with one technique switched off.
#[derive(Clone, Debug)]
pub struct Ablation {
    /// The technique that is switched off.
    pub technique: &'static str,
    pub curve: ConvergenceCurve,
    /// Whether the image is identical bit for bit: the scene does not use the technique.
    pub is_unused: bool,
}

impl Ablation {
    /// Ratio of the times to equal error without and with the technique, by relMSE times seconds at the last step.
    pub fn cost(&self, with: &ConvergenceCurve) -> f64 {
        self.curve.last().inefficiency() / with.last().inefficiency()
    }
}

impl SceneOutcome {
    /// Message about a reference that shows something else.
    pub fn mismatch(&self) -> Option<String> {
        let share = self.foreign_share.filter(|share| is_another_scene(*share))?;
        let path = self.reference_path.as_ref().map_or(String::new(), |path| path.display().to_string());
        Some(format!(
            "{path} does not look like an image of {}: {:.0} % of the image differs by more than noise, and more \
             samples do not help; is it a different scene, view, exposure or lighting?",
            self.title,
            100.0 * share
        ))
    }

    /// Upper bound on the share of the reference's own error in the last step's relMSE.
    pub fn share_of_reference(&self) -> Option<f64> {
        let error = self.reference_made?.relative_error?;
        Some(error * error / self.curve.last().distance.relative_mse)
    }
}
