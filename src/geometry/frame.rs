use glam::Vec3;

/// A right-handed orthonormal frame around a unit normal, which is its z axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub x: Vec3,
    pub y: Vec3,
    pub z: Vec3,
}

impl Frame {
    /// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    #[inline]
    pub fn around(normal: Vec3) -> Self {
        let sign = 1.0_f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            x: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            y: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            z: normal,
        }
    }

    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        local.x * self.x + local.y * self.y + local.z * self.z
    }

    #[inline]
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(world), self.y.dot(world), self.z.dot(world))
    }
}
