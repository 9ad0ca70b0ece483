//! Cache of the latest choices of how to render caustics in a scene.

use crate::core::camera::Camera;
use crate::core::caustic_plan::CausticChoice;
use crate::core::settings::RenderSettings;
use glam::UVec2;
use std::sync::{Mutex, MutexGuard, PoisonError};

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
pub(crate) struct PlanCache {
    kept: Mutex<Vec<(PlanKey, CausticChoice)>>,
    /// The newest choice in the scene before a change.
    before: Option<CausticChoice>,
}

impl PlanKey {
    pub fn new(camera: &Camera, settings: &RenderSettings, size: UVec2) -> Self {
        let allocation = RenderSettings::default().allocation;
        Self { camera: *camera, settings: RenderSettings { seed: 0, simd: None, allocation, ..*settings }, size }
    }
}

impl PlanCache {
    /// An empty cache for a changed scene.
    pub fn after(before: &Self) -> Self {
        Self { kept: Mutex::default(), before: before.newest() }
    }

    pub fn find(&self, key: &PlanKey) -> Option<CausticChoice> {
        self.locked().iter().find(|(of, _)| of == key).map(|(_, choice)| *choice)
    }

    /// The newest choice, of any view; that of the scene before a change if there is none yet.
    pub fn newest(&self) -> Option<CausticChoice> {
        self.locked().last().map(|(_, choice)| *choice).or(self.before)
    }

    pub fn keep(&self, key: PlanKey, choice: CausticChoice) {
        let mut kept = self.locked();
        kept.retain(|(of, _)| *of != key);
        if kept.len() == MOST {
            kept.remove(0);
        }
        kept.push((key, choice));
    }

    fn locked(&self) -> MutexGuard<'_, Vec<(PlanKey, CausticChoice)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
