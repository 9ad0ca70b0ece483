//! Random numbers that depend only on a case and the index of a ray, so that each ray can be replayed.

use glam::Vec3;

/// SplitMix64 (Steele, Lea and Flood 2014), seeded with a hash of test scene and index.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    pub fn new(test_scene: u64, index: u64) -> Self {
        let mut random = Self(test_scene.wrapping_mul(0x2545_F491_4F6C_DD1D) ^ index);
        Self(random.next())
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number in `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A number in `[0, 1)`.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A number in `[-1, 1)`.
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    /// A point in the cube of side 2 about the origin.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A uniformly distributed unit direction.
    pub fn direction(&mut self) -> Vec3 {
        let z = self.signed();
        let (sin, cos) = (std::f32::consts::PI * self.signed()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, z).normalize()
    }

    /// A unit direction on the side of `normal`; every second one within 10⁻¹ to 10⁻⁴ rad of the surface.
    pub fn leaving(&mut self, normal: Vec3) -> Vec3 {
        let dir = self.direction();
        let dir = if dir.dot(normal) < 0.0 { -dir } else { dir };
        if self.below(2) == 0 {
            return dir;
        }
        let along = (dir - dir.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
        let angle = 10f32.powf(-1.0 - 3.0 * self.unit());
        (along + angle * normal).normalize()
    }

    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }
}
