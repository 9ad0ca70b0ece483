//! What the paths of an image see on their way: the first surface that is not specular, gathered while they are traced.
//!
//! For images that are shown for a moment, where a pass of its own ([`crate::integrators::features`]) would take a third
//! of the time of a sample. No ray is traced for it. It is coarser than those features in two ways: whether a surface
//! is specular is decided by its material, not by the random choice of a path, and paths that end on their way see the
//! specular surface that they met first.

use crate::integrators::common::seen::Seen;
use crate::integrators::simd::first_hits::{FirstHits, see_first_hits};
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::integrators::visible_albedo::visible_albedo;
use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use crate::shading::vertex::Vertex;
use firstlight_kdtree::{HitBatch, InstructionSet};
use glam::Vec3;

/// Segments after which a specular surface counts as it is.
const MOST_SEGMENTS: u32 = 8;

const MISSES: usize = 0;

/// Watches the waves of one worker.
#[derive(Default)]
pub(crate) struct FirstSurfaces {
    /// By slot. The material is that of the surface that is seen, not that of a mirror or glass on the way.
    pub seen: Vec<Seen>,
    /// By slot: has seen nothing but specular surfaces.
    is_pending: Vec<bool>,
    n_pending: usize,
    /// Hits that are not handled sixteen at a time.
    left: Vec<u32>,
}

impl FirstSurfaces {
    /// Before the paths of a wave.
    pub fn start(&mut self, n_slots: usize) {
        self.seen.clear();
        self.seen.resize(n_slots, Seen::NOTHING);
        self.is_pending.clear();
        self.is_pending.resize(n_slots, true);
        self.n_pending = n_slots;
    }

    /// After the hits of a segment are sorted, before the paths go on.
    ///
    /// - `depth`: number of the segment, from 1.
    pub fn see(
        &mut self,
        scene: &Prepared,
        set: Option<InstructionSet>,
        depth: u32,
        paths: &PathBatch,
        hits: &HitBatch,
        sorted: &SortedHits,
    ) {
        if depth > MOST_SEGMENTS || self.n_pending == 0 {
            return;
        }
        let mut left = std::mem::take(&mut self.left);
        for kind in 0..KINDS {
            let mut order = sorted.of_kind(kind);
            if depth == 1
                && kind != MISSES
                && let Some(set) = set.filter(|_| !scene.tables.features.media)
            {
                let (materials, seen) = (&sorted.materials, &mut self.seen[..]);
                left.clear();
                let group = FirstHits { scene, paths, hits, materials, order, seen, left: &mut left };
                if see_first_hits(set, kind - 1, group) {
                    order.iter().for_each(|&i| self.is_pending[paths.slot[i as usize] as usize] = false);
                    left.iter().for_each(|&i| self.is_pending[paths.slot[i as usize] as usize] = true);
                    self.n_pending = self.n_pending.saturating_sub(order.len() - left.len());
                    order = &left;
                }
            }
            for &i in order {
                let i = i as usize;
                let slot = paths.slot[i] as usize;
                if !self.is_pending[slot] {
                    continue;
                }
                let goes_on = kind != MISSES && self.see_one(scene, depth, paths, hits, sorted.materials[i], i);
                if kind == MISSES {
                    self.seen[slot] = Seen { albedo: within(paths.throughput_of(i)), ..Seen::NOTHING };
                }
                if !goes_on {
                    self.is_pending[slot] = false;
                    self.n_pending -= 1;
                }
            }
        }
        self.left = left;
    }

    /// Looks at one hit; whether it is specular, so that what lies beyond it counts.
    fn see_one(
        &mut self,
        scene: &Prepared,
        depth: u32,
        paths: &PathBatch,
        hits: &HitBatch,
        material: u32,
        i: usize,
    ) -> bool {
        let Some(hit) = hits.get(i) else { return false };
        let slot = paths.slot[i] as usize;
        let is_specular = scene.shading.materials[material as usize].is_purely_specular(&scene.shading.materials)
            && scene.tables.emission[material as usize].is_none();
        if is_specular && depth > 1 {
            return true;
        }
        let ray = paths.rays.get(i);
        let vertex = Vertex::new(scene, &ray, &hit, material);
        self.seen[slot] = Seen {
            albedo: within(paths.throughput_of(i) * visible_albedo(scene, &vertex, material)),
            emitted: Vec3::ZERO,
            normal: vertex.normal,
            position: vertex.position,
            depth: hit.t * ray.dir.dot(scene.camera.forward),
            object: hit.object,
            material,
        };
        is_specular
    }
}

/// Weights of the pixel filter and of sampling are those of light, not of colours.
fn within(albedo: Vec3) -> Vec3 {
    albedo.clamp(Vec3::ZERO, Vec3::ONE)
}
