//! What paths cost, counted and not timed, so that who decides by it decides alike everywhere.
//!
//! A ray costs by what it hits: the more parts that has, the deeper is the tree that the ray went through. Trees themselves
//! are not asked: there may be a better one of the same mesh soon, and it must change no picture.

use crate::prepare::prepared::Prepared;
use crate::shading::paths::PathBatch;
use firstlight_kdtree::{HitBatch, RayClass, Shape};

/// The unit is a ray that hits something without parts, with all that is done for it: some 50 ns.
const LEVEL: f64 = 0.35;
/// Camera rays run side by side.
const COHERENT: f64 = 0.5;
const SHADOW_RAY: f64 = 0.6;
/// To find the hints of a vertex, and how likely two directions are by them.
const HINTS: f64 = 2.0;

/// Adds up what the paths of one worker cost.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// Of a ray that hits it, for each object.
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

    /// Rays, and what they have hit.
    pub fn add_rays(&mut self, hits: &HitBatch, n: usize, class: RayClass) {
        let sum: f64 = hits.object[..n].iter().map(|&object| self.of_object.get(object as usize).unwrap_or(&1.0)).sum();
        self.total += if class == RayClass::Coherent { COHERENT * sum } else { sum };
    }

    /// Vertices of paths that are told where light comes from.
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
