//! The objects of a scene with cutouts, apart: those that block each ray that hits them, and the others.
//!
//! Whether a shadow ray meets an opaque object is known at any hit, which is found much sooner than the closest one. Only
//! rays that meet none ask for the closest hits of objects with cutouts, which decide where a ray goes on. Both trees
//! share the nodes of the scene's tree.

use crate::core::material_queries::Cutout;
use crate::core::snapshot::Geometry;
use firstlight_kdtree::SceneTree;

/// See the [module](self).
#[derive(Debug)]
pub(crate) struct Occluders {
    /// Objects without cutouts.
    pub opaque: SceneTree,
    /// Objects that have a material with cutouts.
    pub cut: SceneTree,
    /// The object of the scene for each object of `cut`.
    pub cut_objects: Vec<u32>,
}

impl Occluders {
    /// Returns `None` if objects of one of the kinds are missing.
    ///
    /// - `cutouts`: per material.
    pub fn build(geometry: &Geometry, cutouts: &[Option<Cutout>]) -> Option<Self> {
        let is_cut = |&object: &u32| {
            let materials = &geometry.objects[object as usize].materials;
            materials.iter().any(|&id| cutouts[id as usize].is_some())
        };
        let (cut_objects, opaque): (Vec<u32>, Vec<u32>) = (0..geometry.objects.len() as u32).partition(is_cut);
        if cut_objects.is_empty() || opaque.is_empty() {
            return None;
        }
        let statics = geometry.tree.statics();
        let tree = |objects: &[u32]| {
            let shapes = objects.iter().map(|&object| geometry.tree.shapes()[object as usize].clone());
            SceneTree::build_with(shapes.collect(), &statics)
        };
        Some(Self { opaque: tree(&opaque), cut: tree(&cut_objects), cut_objects })
    }
}
