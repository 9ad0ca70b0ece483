//! What a report found out about one scene.

use super::{Ladder, LinearPicture, Made};
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
    pub ladder: Ladder,
    pub ablations: Vec<Ablation>,
    pub reference: LinearPicture,
    /// Of an own reference; `None` for a given one.
    pub reference_made: Option<Made>,
    pub reference_path: Option<PathBuf>,
    /// After 4 samples a pixel, or fewer if there are no more: what framing a shot looks like.
    pub early: LinearPicture,
    pub last: LinearPicture,
}

/// A ladder with one technique switched off.
#[derive(Clone, Debug)]
pub struct Ablation {
    /// What is missing.
    pub technique: &'static str,
    pub ladder: Ladder,
    /// Not a bit of the picture changed: the scene does not use it.
    pub is_unused: bool,
}

impl Ablation {
    /// How many times as long the same error takes without it, by relMSE times seconds at the last step.
    pub fn cost(&self, with: &Ladder) -> f64 {
        self.ladder.last().inefficiency() / with.last().inefficiency()
    }
}

impl SceneOutcome {
    /// The part of the last step's relMSE that may be the reference's own.
    pub fn share_of_reference(&self) -> Option<f64> {
        let error = self.reference_made?.relative_error?;
        Some(error * error / self.ladder.last().distance.relative_mse)
    }
}
