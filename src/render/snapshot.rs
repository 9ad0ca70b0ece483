//! The scene as the workers see it: flat, read-only, shared.
//!
//! It comes in three parts with lives of their own, so that a change replaces no more than it must: a moved camera
//! keeps [`Geometry`] and [`Shading`], a new material keeps [`Geometry`].

use super::environment::EnvironmentSampler;
use super::light::LightTable;
use super::{Camera, Emission, Environment, Material, MaterialId, Texture};
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
    /// What each material adds itself.
    pub(super) emission: Vec<Option<Emission>>,
    pub lights: LightTable,
    pub(super) environment_sampler: Option<EnvironmentSampler>,
    pub features: Features,
}

/// What the scene uses: what it does not use costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Some surface can send a path through itself, so paths keep track of what they are inside of.
    pub glass: bool,
    /// Some light can be found by choosing a point or direction on it.
    pub light_sampling: bool,
    /// The surroundings shine.
    pub environment: bool,
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
    ///
    /// Material and texture ids lie within their lists, and a blend comes to no cycle and at most eight lobes.
    pub fn build(
        geometry: &Geometry,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        environment: Environment,
    ) -> Self {
        let emission: Vec<_> = (0..materials.len() as u32).map(|id| Emission::of(&materials, id)).collect();
        let lights = LightTable::build(geometry, &emission, &textures);
        let environment_sampler = EnvironmentSampler::build(&environment);
        let features = Features {
            glass: materials.iter().any(|material| matches!(material, Material::Glass { .. })),
            light_sampling: !lights.is_empty() || environment_sampler.is_some(),
            environment: !matches!(environment, Environment::Black),
        };
        Self { materials, textures, environment, emission, lights, environment_sampler, features }
    }
}
