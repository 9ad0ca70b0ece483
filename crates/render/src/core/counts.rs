//! Ray counts.

use std::ops::AddAssign;

/// Rays traced, by class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays from the camera through a point of the film.
    pub camera: u64,
    /// Rays that continue a camera path from a surface, and all segments of light paths.
    pub bounce: u64,
    /// Rays that test the visibility of a light, or of the lens in light paths.
    pub shadow: u64,
}

impl RayCounts {
    /// Sum over all classes.
    pub fn total(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.bounce += other.bounce;
        self.shadow += other.shadow;
    }
}
