//! Kd-tree over the triangles of one mesh, in the mesh's own space.

use crate::geometry::Aabb;
use glam::Vec3;

/// How much time a build spends on the speed of its rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildPreset {
    /// A first picture within tens of milliseconds.
    Quick,
    /// The full surface area heuristic.
    #[default]
    Best,
    /// Split at the median, axes in turn: what the 1990s did; kept for comparison.
    Median,
}

/// Built once from a mesh and never edited; a changed mesh gets a new tree.
#[derive(Debug)]
pub struct MeshTree {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) bounds: Aabb,
}

impl MeshTree {
    /// Indices must lie within `positions`, and positions must be finite.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]], _preset: BuildPreset) -> Self {
        Self {
            positions: positions.to_vec(),
            triangles: triangles.to_vec(),
            bounds: Aabb::from_points(triangles.iter().flatten().map(|&i| positions[i as usize])),
        }
    }

    pub fn bounds(&self) -> Aabb {
        self.bounds
    }
}
