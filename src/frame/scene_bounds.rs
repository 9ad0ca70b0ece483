//! Size and home position of the scene, for navigation.

use crate::frame::core::rig::{Rig, Turning};
use crate::frame::navigation::Surroundings;
use crate::scene::Extent;
use bevy_ecs::prelude::Resource;
use glam::DVec3;

/// Size and home position of the scene, for navigation.
#[derive(Resource, Clone, Debug)]
pub struct SceneBounds {
    /// A sphere around the finite objects, for framing and speeds.
    pub extent: Extent,
    /// Corners of the boxes of these objects, for framing.
    pub corners: Vec<DVec3>,
    /// The camera as it was when the scene was opened.
    pub home: Rig,
    /// The mode of turning.
    pub turning: Turning,
    /// Distance to the target of flying, metres.
    pub pace: Option<f64>,
}

impl SceneBounds {
    /// Returns the reference sizes for commands, in an image of this aspect (width over height).
    pub fn surroundings(&self, aspect: f64) -> Surroundings {
        let Extent { center, radius } = self.extent;
        Surroundings { center, radius, home: self.home, aspect, turning: self.turning, pace: self.pace }
    }
}
