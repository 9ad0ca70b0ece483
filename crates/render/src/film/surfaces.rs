//! What the first samples of each pixel see of surfaces, where an image is to be denoised while the camera moves.
//!
//! Gathered by the very paths that bring light ([`crate::integrators::path::first_surfaces`]), so it is there with the first
//! sample and costs no ray of its own. Feature buffers that are saved are made with more care
//! ([`crate::film::features`]).

use crate::integrators::common::seen::Seen;
use glam::Vec3;

/// Sums over the first samples of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SurfaceSums {
    albedo: Vec3,
    normal: Vec3,
    position: Vec3,
    n: u16,
    /// Samples that see an emitter or nothing.
    n_bright: u16,
}

/// What a pixel shows, the mean over its first samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelSurface {
    /// Share of light that is reflected, times the colours of mirrors and glass on the way, 0..1 a channel.
    pub albedo: Vec3,
    /// Shading normal; shorter than 1 where a pixel shows several.
    pub normal: Vec3,
    /// In the frame of the snapshot, metres.
    pub position: Vec3,
    /// Whether an emitter or the environment is seen, in part at least: light that has next to no noise.
    pub is_bright: bool,
}

impl SurfaceSums {
    /// Whether there is a sample.
    pub fn is_noted(&self) -> bool {
        self.n > 0
    }

    /// So many samples of a pixel count; the rest would cost more than they tell.
    pub const MOST: u32 = 8;

    /// - `emits`: whether what is seen is an emitter.
    pub fn add(&mut self, seen: &Seen, emits: bool) {
        self.albedo += seen.albedo;
        self.normal += seen.normal;
        self.position += seen.position;
        self.n += 1;
        self.n_bright += u16::from(emits || seen.material == Seen::NONE);
    }

    /// Of a pixel without samples it is bright, so that nothing is made of it.
    pub fn mean(&self) -> PixelSurface {
        let share = 1.0 / f32::from(self.n.max(1));
        PixelSurface {
            albedo: self.albedo * share,
            normal: self.normal * share,
            position: self.position * share,
            is_bright: self.n_bright > 0 || self.n == 0,
        }
    }
}
