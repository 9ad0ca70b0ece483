//! The steps of a simplification, kept: any number of triangles in between at the cost of a copy.

use super::assemble::{Original, Remaining, assemble};
use super::greedy::Log;
use super::prepare::PreparedMesh;
use crate::Mesh;
use glam::DVec3;

/// A mesh and the order in which its edges collapse. A slider is a prefix of it.
#[derive(Debug)]
pub struct CollapseOrder {
    start: PreparedMesh,
    log: Log,
    center: DVec3,
    has_normals: bool,
    has_uvs: bool,
    slots: Vec<u16>,
}

impl CollapseOrder {
    pub(super) fn new(mesh: &Mesh, start: PreparedMesh, log: Log) -> Self {
        let (has_normals, has_uvs) = (!mesh.normals.is_empty(), !mesh.uvs.is_empty());
        Self { start, log, center: mesh.center, has_normals, has_uvs, slots: mesh.slots.clone() }
    }

    /// The most and the fewest triangles to be had.
    pub fn face_range(&self) -> (usize, usize) {
        let died: usize = self.log.collapses.iter().map(|c| c.died as usize).sum();
        (self.start.triangles.len(), self.start.triangles.len() - died)
    }

    /// The mesh with at most `faces` triangles, or as few as there can be. Linear in the size of the full mesh.
    pub fn mesh_with(&self, faces: usize) -> Mesh {
        let count = self.start.positions.len();
        let mut positions = self.start.positions.clone();
        let mut wedges = self.start.wedges.clone();
        let mut went_to: Vec<u32> = (0..count as u32).collect();
        let mut wedge_went_to: Vec<u32> = (0..wedges.len() as u32).collect();
        let (mut left, mut joins) = (self.start.triangles.len(), self.log.joins.iter());
        for collapse in &self.log.collapses {
            if left <= faces {
                break;
            }
            left -= collapse.died as usize;
            went_to[collapse.from as usize] = collapse.to;
            positions[collapse.to as usize] = collapse.position;
            for join in joins.by_ref().take(collapse.joins as usize) {
                wedge_went_to[join.from as usize] = join.to;
                wedges[join.to as usize] = join.wedge;
            }
        }
        let end = |went_to: &mut [u32], mut item: u32| {
            while went_to[item as usize] != item {
                went_to[item as usize] = went_to[went_to[item as usize] as usize];
                item = went_to[item as usize];
            }
            item
        };
        let mut remaining = Remaining::default();
        for (t, corners) in self.start.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|v| end(&mut went_to, v));
            if a == b || b == c || c == a {
                continue;
            }
            remaining.triangles.push([a, b, c]);
            remaining.sources.push(self.start.sources[t]);
            if !wedges.is_empty() {
                let corner_wedges = &self.start.corner_wedges[3 * t..3 * t + 3];
                remaining.corner_wedges.extend(corner_wedges.iter().map(|&w| end(&mut wedge_went_to, w)));
            }
        }
        let original = Original {
            scale: self.start.scale,
            center: self.center,
            slots: &self.slots,
            has_normals: self.has_normals,
            has_uvs: self.has_uvs,
        };
        assemble(&remaining, &positions, &wedges, &original)
    }
}
