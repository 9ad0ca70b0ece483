//! What a person moves through.

use super::navigation::{Rig, Surroundings, Turning};
use crate::scene::Extent;
use bevy_ecs::prelude::Resource;
use glam::DVec3;

/// What the scene is, seen by who moves through it.
#[derive(Resource, Clone, Debug)]
pub struct SceneBounds {
    pub extent: Extent,
    /// Corners of the boxes of the things that made it, for framing.
    pub corners: Vec<DVec3>,
    pub home: Rig,
    pub turning: Turning,
    /// Metres to what is flown towards.
    pub pace: Option<f64>,
}

impl SceneBounds {
    pub fn surroundings(&self, aspect: f64) -> Surroundings {
        let Extent { center, radius } = self.extent;
        Surroundings { center, radius, home: self.home, aspect, turning: self.turning, pace: self.pace }
    }
}
