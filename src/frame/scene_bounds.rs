//! What a person moves through.

use super::navigation::{Rig, Surroundings, Turning};
use crate::scene::Extent;
use bevy_ecs::prelude::Resource;
use glam::DVec3;

/// What the scene is, seen by who moves through it.
#[derive(Resource, Clone, Debug)]
pub struct SceneBounds {
    /// A sphere around the finite things, for framing and speeds.
    pub extent: Extent,
    /// Corners of the boxes of the things that made it, for framing.
    pub corners: Vec<DVec3>,
    /// The camera as it was when the scene was opened.
    pub home: Rig,
    /// What a turn keeps level.
    pub turning: Turning,
    /// Metres to what is flown towards.
    pub pace: Option<f64>,
}

impl SceneBounds {
    /// What commands are measured by in a picture of this aspect (width over height).
    pub fn surroundings(&self, aspect: f64) -> Surroundings {
        let Extent { center, radius } = self.extent;
        Surroundings { center, radius, home: self.home, aspect, turning: self.turning, pace: self.pace }
    }
}
