//! The size of an image.

use bevy_ecs::prelude::Resource;

/// Size of the film as specified by the scene, pixels. A window has its own size.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSize {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl Default for FilmSize {
    fn default() -> Self {
        Self { width: 1280, height: 720 }
    }
}
