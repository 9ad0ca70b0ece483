//! The size of an image.

/// Size of the film as specified by the scene, pixels. A window has its own size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::prelude::Resource))]
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
