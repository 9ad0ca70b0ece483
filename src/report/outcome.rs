//! What a report found out about one scene.

use super::{ConvergenceCurve, LinearPicture, Made, is_another_scene};
use crate::render::Display;
use std::path::PathBuf;

/// One scene, all of it measured.
#[derive(Clone, Debug)]
pub struct SceneOutcome {
    pub title: String,
    pub width: u32,
    pub height: u32,
    /// How its pictures are developed.
    pub display: Display,
    pub curve: ConvergenceCurve,
    pub ablations: Vec<Ablation>,
    pub reference: LinearPicture,
    /// Of an own reference; `None` for a given one.
    pub reference_made: Option<Made>,
    pub reference_path: Option<PathBuf>,
    /// Of a given reference, the share of the picture that differs from it by more than noise can
    /// ([`super::foreign_share`]); `None` for an own one.
    pub foreign_share: Option<f64>,
    /// After 4 samples a pixel, or fewer if there are no more: what framing a shot looks like.
    pub early: LinearPicture,
    pub last: LinearPicture,
}

/// A curve with one technique switched off.
#[derive(Clone, Debug)]
pub struct Ablation {
    /// What is missing.
    pub technique: &'static str,
    pub curve: ConvergenceCurve,
    /// Not a bit of the picture changed: the scene does not use it.
    pub is_unused: bool,
}

impl Ablation {
    /// How many times as long the same error takes without it, by relMSE times seconds at the last step.
    pub fn cost(&self, with: &ConvergenceCurve) -> f64 {
        self.curve.last().inefficiency() / with.last().inefficiency()
    }
}

impl SceneOutcome {
    /// What to say of a reference that shows something else.
    pub fn mismatch(&self) -> Option<String> {
        let share = self.foreign_share.filter(|share| is_another_scene(*share))?;
        let path = self.reference_path.as_ref().map_or(String::new(), |path| path.display().to_string());
        Some(format!(
            "{path} does not look like a picture of {}: {:.0} % of the picture differs by more than noise, and more \
             samples do not help; is it a different scene, view, exposure or lighting?",
            self.title,
            100.0 * share
        ))
    }

    /// The part of the last step's relMSE that may be the reference's own.
    pub fn share_of_reference(&self) -> Option<f64> {
        let error = self.reference_made?.relative_error?;
        Some(error * error / self.curve.last().distance.relative_mse)
    }
}
