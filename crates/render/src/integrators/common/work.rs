//! Cost of paths, counted rather than timed, so that decisions based on it are the same everywhere.
//!
//! The cost of a ray depends on the object that it hits: the more primitives that has, the deeper its tree. The actual
//! tree does not count: a final tree may replace a preview tree, and must not change the image.

use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use firstlight_kdtree::{HitBatch, RayClass, Shape};

/// Cost per tree level. The unit is a ray that hits an object without a tree, with its shading: about 50 ns.
const LEVEL: f64 = 0.35;
/// Cost factor of coherent rays.
const COHERENT: f64 = 0.5;
pub(crate) const SHADOW_RAY: f64 = 0.6;
/// Cost of finding the guiding distributions of a vertex, and of evaluating two directions.
const HINTS: f64 = 3.0;

/// Sums the cost of the paths of one worker.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// Cost of a ray that hits it, per object.
    of_object: Vec<f64>,
    pub total: f64,
    /// The part of `total` from the paths of each slot; empty if it is not wanted.
    pub of_slot: Vec<f64>,
}

impl Work {
    pub fn new(scene: &Prepared) -> Self {
        let parts = scene.geometry.tree.shapes().iter().map(|shape| match shape {
            Shape::Mesh { tree, .. } => tree.n_triangles(),
            Shape::Spheres { tree, .. } => tree.len(),
            _ => 1,
        });
        Self {
            of_object: parts.map(|n| 1.0 + LEVEL * (n.max(1) as f64).log2()).collect(),
            total: 0.0,
            of_slot: Vec::new(),
        }
    }

    /// Returns an empty sum that is also kept for each of `n` slots.
    pub fn per_slot(scene: &Prepared, n: usize) -> Self {
        Self { of_slot: vec![0.0; n], ..Self::new(scene) }
    }

    /// Adds rays and their hits.
    ///
    /// - `slots`: the slot of each ray.
    pub fn add_rays(&mut self, hits: &HitBatch, slots: &[u32], class: RayClass) {
        let factor = if class == RayClass::Coherent { COHERENT } else { 1.0 };
        for (&object, &slot) in hits.object.iter().zip(slots) {
            self.add(factor * self.of_object.get(object as usize).unwrap_or(&1.0), slot);
        }
    }

    /// Adds vertices with guided sampling.
    pub fn add_told(&mut self, scene: &Prepared, paths: &PathBatch, hits: &HitBatch) {
        let asks = |i: &usize| {
            let scatters = |hit| {
                let material = &scene.shading.materials[scene.geometry.material_of(&hit) as usize];
                !material.is_specular(&scene.shading.materials)
            };
            paths.track_of(*i).is_lost() && hits.get(*i).is_some_and(scatters)
        };
        for i in (0..paths.len()).filter(asks) {
            self.add(HINTS, paths.slot[i]);
        }
    }

    /// - `slots`: the slot of each shadow ray.
    pub fn add_shadow_rays(&mut self, slots: &[u32]) {
        for &slot in slots {
            self.add(SHADOW_RAY, slot);
        }
    }

    /// Adds connections of light paths to the lens.
    pub fn add_connections(&mut self, n: usize) {
        self.total += SHADOW_RAY * n as f64;
    }

    #[inline]
    fn add(&mut self, cost: f64, slot: u32) {
        self.total += cost;
        if let Some(of_slot) = self.of_slot.get_mut(slot as usize) {
            *of_slot += cost;
        }
    }
}
