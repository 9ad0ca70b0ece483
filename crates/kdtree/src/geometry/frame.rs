use firstlight_simd::frame_around;
use glam::Vec3;

/// A right-handed orthonormal frame around a unit normal, which is its z axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent, unit.
    pub x: Vec3,
    /// Second tangent, unit.
    pub y: Vec3,
    /// The normal, unit.
    pub z: Vec3,
}

impl Frame {
    /// Builds the frame around a normal; see [`frame_around`].
    #[inline]
    pub fn around(normal: Vec3) -> Self {
        let [x, y, z] = frame_around(normal.into()).map(Vec3::from);
        Self { x, y, z }
    }

    /// Converts a vector from frame coordinates to the coordinates in which the axes are given.
    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        local.x * self.x + local.y * self.y + local.z * self.z
    }

    /// Converts a vector to frame coordinates.
    #[inline]
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(world), self.y.dot(world), self.z.dot(world))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(20_000))]

        #[test]
        fn frames_are_orthonormal_right_handed_and_turn_back(
            n in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), tiny in -9i32..1, v in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0),
        ) {
            // Also close to the axis where the construction changes sign.
            let (n, v) = (Vec3::from(n), Vec3::from(v));
            let normal = (n * Vec3::new(10f32.powi(tiny), 10f32.powi(tiny), 1.0)).normalize_or(Vec3::NEG_Z);
            let Frame { x, y, z } = Frame::around(normal);
            prop_assert_eq!(z, normal);
            for (a, b, dot) in [(x, x, 1.0), (y, y, 1.0), (x, y, 0.0), (x, z, 0.0), (y, z, 0.0)] {
                prop_assert!((a.dot(b) - dot).abs() < 1e-6, "{x} {y} {z}");
            }
            prop_assert!((x.cross(y) - z).length() < 1e-6);
            let frame = Frame { x, y, z };
            prop_assert!((frame.to_local(frame.to_world(v)) - v).length() < 2e-6);
        }
    }
}
