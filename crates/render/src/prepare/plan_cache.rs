//! Cache of the latest choices of how to render caustics in a scene.

use crate::core::camera::Camera;
use crate::core::caustic_plan::CausticChoice;
use crate::core::settings::RenderSettings;
use glam::UVec2;
use std::sync::{Mutex, PoisonError};

/// Number of entries: the views and sizes between which a user switches.
const MOST: usize = 4;

/// Dependencies of a choice besides the scene: not the seed, the instruction set, or the sample allocation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlanKey {
    camera: Camera,
    settings: RenderSettings,
    size: UVec2,
}

/// See the head of this file.
#[derive(Debug, Default)]
pub(crate) struct PlanCache(Mutex<Vec<(PlanKey, CausticChoice)>>);

impl PlanKey {
    pub fn new(camera: &Camera, settings: &RenderSettings, size: UVec2) -> Self {
        let allocation = RenderSettings::default().allocation;
        Self { camera: *camera, settings: RenderSettings { seed: 0, simd: None, allocation, ..*settings }, size }
    }
}

impl PlanCache {
    pub fn find(&self, key: &PlanKey) -> Option<CausticChoice> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|(of, _)| of == key).map(|(_, choice)| *choice)
    }

    /// The newest choice, of any view.
    pub fn newest(&self) -> Option<CausticChoice> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.last().map(|(_, choice)| *choice)
    }

    pub fn keep(&self, key: PlanKey, choice: CausticChoice) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(of, _)| *of != key);
        if kept.len() == MOST {
            kept.remove(0);
        }
        kept.push((key, choice));
    }
}
