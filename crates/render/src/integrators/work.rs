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
const SHADOW_RAY: f64 = 0.6;
/// Cost of finding the guiding distributions of a vertex, and of evaluating two directions.
const HINTS: f64 = 2.0;

/// Sums the cost of the paths of one worker.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// Cost of a ray that hits it, per object.
    of_object: Vec<f64>,
    pub total: f64,
}

impl Work {
    pub fn new(scene: &Prepared) -> Self {
        let parts = scene.geometry.tree.shapes().iter().map(|shape| match shape {
            Shape::Mesh { tree, .. } => tree.n_triangles(),
            Shape::Spheres { tree, .. } => tree.len(),
            _ => 1,
        });
        Self { of_object: parts.map(|n| 1.0 + LEVEL * (n.max(1) as f64).log2()).collect(), total: 0.0 }
    }

    /// Adds rays and their hits.
    pub fn add_rays(&mut self, hits: &HitBatch, n: usize, class: RayClass) {
        let sum: f64 = hits.object[..n].iter().map(|&object| self.of_object.get(object as usize).unwrap_or(&1.0)).sum();
        self.total += if class == RayClass::Coherent { COHERENT * sum } else { sum };
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
        self.total += HINTS * (0..paths.len()).filter(asks).count() as f64;
    }

    pub fn add_shadow_rays(&mut self, n: usize) {
        self.total += SHADOW_RAY * n as f64;
    }
}
