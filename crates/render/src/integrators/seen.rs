//! What a camera path sees, without light.

use crate::core::material::MaterialId;
use glam::Vec3;

/// What one sample sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Colour of the surface times that of the mirrors and glass on the way, 0..1; of the way alone where it leaves the
    /// scene.
    pub albedo: Vec3,
    /// Shading normal, unit, on the side that is seen; zero where nothing is.
    pub normal: Vec3,
    /// In the frame of the snapshot, metres; zero where nothing is seen.
    pub position: Vec3,
    /// Length of the whole way along the view axis, metres: of the mirror image where there is a mirror. Infinite where
    /// nothing is seen.
    pub depth: f32,
    /// What the camera ray itself meets, a mirror or glass included; [`Seen::NONE`] for nothing.
    pub object: u32,
    /// Its material.
    pub material: MaterialId,
}

impl Seen {
    /// No object, no material.
    pub const NONE: u32 = u32::MAX;

    /// What a path sees that leaves the scene at once.
    pub const NOTHING: Self = Self {
        albedo: Vec3::ONE,
        normal: Vec3::ZERO,
        position: Vec3::ZERO,
        depth: f32::INFINITY,
        object: Self::NONE,
        material: Self::NONE,
    };
}
