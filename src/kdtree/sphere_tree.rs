//! Kd-tree over many balls that share one material, in the space of their object.

use glam::Vec3;

#[derive(Debug)]
pub struct SphereTree {
    pub(super) centers: Vec<Vec3>,
    pub(super) radii: Vec<f32>,
}

impl SphereTree {
    /// One radius per centre; radii positive, all numbers finite.
    pub fn build(centers: &[Vec3], radii: &[f32]) -> Self {
        assert_eq!(centers.len(), radii.len(), "each ball needs a centre and a radius");
        Self { centers: centers.to_vec(), radii: radii.to_vec() }
    }

    /// Centre and radius of one ball, in the space of the object.
    #[inline]
    pub fn sphere(&self, prim: u32) -> (Vec3, f32) {
        (self.centers[prim as usize], self.radii[prim as usize])
    }

    pub fn len(&self) -> usize {
        self.centers.len()
    }

    pub fn is_empty(&self) -> bool {
        self.centers.is_empty()
    }
}
