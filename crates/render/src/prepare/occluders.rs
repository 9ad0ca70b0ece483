//! The objects of a scene with cutouts or panes, apart: those that block each ray that hits them, and the others.
//!
//! Whether a shadow ray meets an opaque object is known at any hit, which is found much sooner than the closest one. Only
//! rays that meet none ask for the closest hits of the other objects, which decide whether a ray goes on. Both trees
//! share the nodes of the scene's tree.

use crate::core::snapshot::Geometry;
use firstlight_kdtree::SceneTree;

/// See the [module](self).
#[derive(Debug)]
pub(crate) struct Occluders {
    /// Objects that no ray passes.
    pub opaque: SceneTree,
    /// Objects that have a material with cutouts or panes.
    pub passable: SceneTree,
    /// The object of the scene for each object of `passable`.
    pub passable_objects: Vec<u32>,
}

impl Occluders {
    /// Returns `None` if objects of one of the kinds are missing.
    ///
    /// - `can_pass`: per material.
    pub fn build(geometry: &Geometry, can_pass: &[bool]) -> Option<Self> {
        let is_passable = |&object: &u32| {
            let materials = &geometry.objects[object as usize].materials;
            materials.iter().any(|&id| can_pass[id as usize])
        };
        let (passable_objects, opaque): (Vec<u32>, Vec<u32>) =
            (0..geometry.objects.len() as u32).partition(is_passable);
        if passable_objects.is_empty() || opaque.is_empty() {
            return None;
        }
        let statics = geometry.tree.statics();
        let tree = |objects: &[u32]| {
            let shapes = objects.iter().map(|&object| geometry.tree.shapes()[object as usize].clone());
            SceneTree::build_with(shapes.collect(), &statics)
        };
        Some(Self { opaque: tree(&opaque), passable: tree(&passable_objects), passable_objects })
    }
}
