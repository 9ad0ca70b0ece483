//! The snapshot: all inputs of an image, flat, read-only, shared.
//!
//! It has three parts that are replaced separately, so that a change replaces no more than necessary: a camera move
//! keeps [`Geometry`] and [`Shading`], a new material keeps [`Geometry`]. Data derived from it is in
//! [`crate::prepare::prepared::Prepared`].

use crate::core::camera::Camera;
use crate::core::delta_light::DeltaLight;
use crate::core::environment::Environment;
use crate::core::material::{Material, MaterialId};
use crate::core::texture::Texture;
use firstlight_kdtree::{Hit, SceneTree, Shape, StaticTree};
use firstlight_mesh::Mesh;
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// Geometry, materials and camera of one image, read-only and cheap to clone.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Objects and their shapes.
    pub geometry: Arc<Geometry>,
    /// Materials, textures and lights.
    pub shading: Arc<Shading>,
    /// The camera.
    pub camera: Camera,
}

impl Snapshot {
    /// Creates a snapshot; its parts are shared, so that later snapshots can keep them.
    pub fn new(geometry: Geometry, shading: Shading, camera: Camera) -> Self {
        Self { geometry: Arc::new(geometry), shading: Arc::new(shading), camera }
    }
}

/// The objects of a scene and their tree. Object `i` here is object `i` of the tree.
#[derive(Debug)]
pub struct Geometry {
    /// Data of each object besides its shape, by object index.
    pub objects: Vec<Object>,
    /// The tree over the shapes of the objects, by the same index.
    pub tree: SceneTree,
}

/// Data of an object besides its shape.
#[derive(Clone, Debug, Default)]
pub struct Object {
    /// Normals, texture coordinates and slots of a mesh; `None` for all other shapes.
    pub mesh: Option<Arc<Mesh>>,
    /// One material per slot; all shapes except meshes have one slot.
    pub materials: Vec<MaterialId>,
    /// Rotation from the world to the object's own axes, for the texture of a single sphere. `None` for the identity.
    pub turned: Option<Mat3>,
    /// Whether it is a sphere that represents a point light: the classic model puts all of its light into its centre.
    pub is_point_light: bool,
}

impl Object {
    /// Creates an object of one material, with any shape except a mesh.
    pub fn plain(material: MaterialId) -> Self {
        Self { materials: vec![material], ..Self::default() }
    }

    /// Returns the material of a primitive.
    #[inline]
    pub(crate) fn material_of(&self, prim: u32) -> MaterialId {
        match &self.materials[..] {
            [only] => *only,
            many => many[self.slot_of(prim)],
        }
    }

    /// Returns the index in [`Self::materials`] of a primitive's material.
    #[inline]
    pub fn slot_of(&self, prim: u32) -> usize {
        let slot = self.mesh.as_ref().and_then(|mesh| mesh.slots.get(prim as usize)).map_or(0, |&slot| slot.into());
        self.materials.len().saturating_sub(1).min(slot)
    }
}

/// Materials, textures and lights of a scene.
///
/// Material and texture ids are valid indices; a blend has no cycle and at most eight lobes.
#[derive(Clone, Debug)]
pub struct Shading {
    /// Materials by [`MaterialId`].
    pub materials: Vec<Material>,
    /// Textures by [`TextureId`](crate::core::texture::TextureId).
    pub textures: Vec<Texture>,
    /// Light that arrives from outside of the scene.
    pub environment: Environment,
    /// Absorption of the air outside of all glass, per metre; it does not affect the environment.
    pub air: Vec3,
    /// Delta lights. They are in no tree: no ray hits them.
    pub delta_lights: Vec<DeltaLight>,
}

impl Geometry {
    /// Builds the tree over the objects; both lists have the same order.
    ///
    /// # Panics
    /// If the lists differ in length.
    pub fn build(shapes: Vec<Shape>, objects: Vec<Object>) -> Self {
        Self::build_with(shapes, objects, &[])
    }

    /// Like [`Self::build`], with trees for meshes that stand still; see [`SceneTree::build_with`].
    ///
    /// # Panics
    /// Like [`Self::build`].
    pub fn build_with(shapes: Vec<Shape>, objects: Vec<Object>, statics: &[Arc<StaticTree>]) -> Self {
        assert_eq!(shapes.len(), objects.len(), "each shape needs its object");
        Self { objects, tree: SceneTree::build_with(shapes, statics) }
    }

    /// Returns the material of a hit.
    #[inline]
    pub(crate) fn material_of(&self, hit: &Hit) -> MaterialId {
        self.objects[hit.object as usize].material_of(hit.prim)
    }
}

impl Shading {
    /// Creates shading with clear air and without delta lights.
    pub fn new(materials: Vec<Material>, textures: Vec<Texture>, environment: Environment) -> Self {
        Self { materials, textures, environment, air: Vec3::ZERO, delta_lights: Vec::new() }
    }
}
