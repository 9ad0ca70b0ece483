//! Light from infinitely far away.

use super::ImageTexture;
use glam::Vec3;
use std::sync::Arc;

/// Radiance that arrives from outside the scene, W·m⁻²·sr⁻¹.
#[derive(Clone, Debug, Default)]
pub enum Environment {
    #[default]
    Black,
    Constant(Vec3),
    /// A smooth sky: `horizon` to `zenith` above, `ground` below.
    Gradient {
        zenith: Vec3,
        horizon: Vec3,
        ground: Vec3,
    },
    /// Equirectangular picture: its middle column looks along −Z, its top row along +Y.
    Image {
        image: Arc<ImageTexture>,
        scale: Vec3,
        /// Radians about +Y.
        rotation: f32,
    },
}
