//! Bounds, corners, area and volume of a mesh.

use super::Mesh;
use firstlight_kdtree::geometry::Aabb;
use glam::{DVec3, Vec3};

impl Mesh {
    /// The bounds of all vertices, relative to `center`.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.positions.iter().copied())
    }

    /// The corners of a triangle, relative to `center`.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// The normal of a triangle times twice its area; zero for a triangle without area.
    #[inline]
    pub fn doubled_area_normal(&self, triangle: usize) -> DVec3 {
        // Single precision would lose the normals of triangles smaller than about 1e-19.
        let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3());
        (b - a).cross(c - a)
    }

    /// Surface area in square metres.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| 0.5 * self.doubled_area_normal(t).length()).sum()
    }

    /// Volume of a closed mesh in cubic metres; positive if its triangles face outwards.
    pub fn signed_volume(&self) -> f64 {
        let sixfold = |t| {
            let [a, b, c] = self.corners(t).map(|p| p.as_dvec3());
            a.dot(b.cross(c))
        };
        (0..self.triangles.len()).map(sixfold).sum::<f64>() / 6.0
    }
}
