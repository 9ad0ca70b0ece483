//! Features of a camera path.

use crate::core::material::MaterialId;
use glam::Vec3;

/// Features of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Colour of the surface times those of the mirrors and glass on the path to it, 0..1; the product of the latter if
    /// the path leaves the scene.
    pub albedo: Vec3,
    /// Radiance that arrives from an emitter or from beyond the scene without scattering, W·m⁻²·sr⁻¹; zero where it is
    /// not asked for.
    pub emitted: Vec3,
    /// Shading normal, unit, on the visible side; zero for a miss.
    pub normal: Vec3,
    /// Position in the snapshot's frame, metres; zero for a miss.
    pub position: Vec3,
    /// Depth along the view axis over the whole path, metres: that of the mirror image behind a mirror. Infinite for a
    /// miss.
    pub depth: f32,
    /// The object that the camera ray hits, also if it is a mirror or glass; [`Seen::NONE`] for none.
    pub object: u32,
    /// Material of that object.
    pub material: MaterialId,
}

impl Seen {
    /// No object, no material.
    pub const NONE: u32 = u32::MAX;

    /// Features of a camera ray that leaves the scene.
    pub const NOTHING: Self = Self {
        albedo: Vec3::ONE,
        emitted: Vec3::ZERO,
        normal: Vec3::ZERO,
        position: Vec3::ZERO,
        depth: f32::INFINITY,
        object: Self::NONE,
        material: Self::NONE,
    };

    /// Features of two paths that begin alike, with this share of the other one, 0..1; the depth is that of the path
    /// that hits something, if one does not.
    pub fn mixed_with(&self, other: &Self, share: f32) -> Self {
        let depth = match (self.depth.is_finite(), other.depth.is_finite()) {
            (true, true) => self.depth + share * (other.depth - self.depth),
            (true, false) => self.depth,
            _ => other.depth,
        };
        Self {
            albedo: self.albedo.lerp(other.albedo, share),
            emitted: self.emitted.lerp(other.emitted, share),
            normal: self.normal.lerp(other.normal, share),
            position: self.position.lerp(other.position, share),
            depth,
            ..*self
        }
    }
}
