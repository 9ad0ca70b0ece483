//! The recorded steps of a simplification, from which a mesh of any intermediate size can be made in linear time.

use super::assemble::{Original, Remaining, assemble};
use super::greedy::Log;
use super::prepare::PreparedMesh;
use crate::Mesh;
use glam::DVec3;

/// A mesh and the order in which its edges collapse. A position of a slider is a prefix of it.
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

    /// The largest and the smallest possible number of triangles.
    pub fn face_range(&self) -> (usize, usize) {
        let died: usize = self.log.collapses.iter().map(|c| c.died as usize).sum();
        (self.start.triangles.len(), self.start.triangles.len() - died)
    }

    /// Returns the mesh with at most `faces` triangles, or as few as possible. Linear in the size of the full mesh.
    pub fn mesh_with(&self, faces: usize) -> Mesh {
        let count = self.start.positions.len();
        let mut positions = self.start.positions.clone();
        let mut wedges = self.start.wedges.clone();
        let mut merged_into: Vec<u32> = (0..count as u32).collect();
        let mut wedge_merged_into: Vec<u32> = (0..wedges.len() as u32).collect();
        let (mut left, mut joins) = (self.start.triangles.len(), self.log.joins.iter());
        for collapse in &self.log.collapses {
            if left <= faces {
                break;
            }
            left -= collapse.died as usize;
            merged_into[collapse.from as usize] = collapse.to;
            positions[collapse.to as usize] = collapse.position;
            for join in joins.by_ref().take(collapse.joins as usize) {
                wedge_merged_into[join.from as usize] = join.to;
                wedges[join.to as usize] = join.wedge;
            }
        }
        let end = |merged_into: &mut [u32], mut item: u32| {
            while merged_into[item as usize] != item {
                merged_into[item as usize] = merged_into[merged_into[item as usize] as usize];
                item = merged_into[item as usize];
            }
            item
        };
        let mut remaining = Remaining::default();
        for (t, corners) in self.start.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|v| end(&mut merged_into, v));
            if a == b || b == c || c == a {
                continue;
            }
            remaining.triangles.push([a, b, c]);
            remaining.sources.push(self.start.sources[t]);
            if !wedges.is_empty() {
                let corner_wedges = &self.start.corner_wedges[3 * t..3 * t + 3];
                remaining.corner_wedges.extend(corner_wedges.iter().map(|&w| end(&mut wedge_merged_into, w)));
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
