//! What a picture is a function of: flat, read-only, shared.
//!
//! It comes in three parts with lives of their own, so that a change replaces no more than it must: a moved camera
//! keeps [`Geometry`] and [`Shading`], a new material keeps [`Geometry`]. What is derived from it is in
//! [`crate::prepare::prepared::Prepared`].

use crate::core::camera::Camera;
use crate::core::delta_light::DeltaLight;
use crate::core::environment::Environment;
use crate::core::material::{Material, MaterialId};
use crate::core::texture::Texture;
use firstlight_kdtree::{Hit, SceneTree, Shape};
use firstlight_mesh::Mesh;
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// Geometry, materials and camera of one picture, read-only and cheap to clone.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Where everything is.
    pub geometry: Arc<Geometry>,
    /// How everything looks.
    pub shading: Arc<Shading>,
    /// From where it is seen.
    pub camera: Camera,
}

impl Snapshot {
    /// Shares the parts, so that later snapshots can keep them.
    pub fn new(geometry: Geometry, shading: Shading, camera: Camera) -> Self {
        Self { geometry: Arc::new(geometry), shading: Arc::new(shading), camera }
    }
}

/// Where everything is. Object `i` here is object `i` of the tree.
#[derive(Debug)]
pub struct Geometry {
    /// What each object needs beyond its shape, by object index.
    pub objects: Vec<Object>,
    /// The tree over the shapes of the objects, by the same index.
    pub tree: SceneTree,
}

/// What an object needs beyond its shape.
#[derive(Clone, Debug, Default)]
pub struct Object {
    /// Normals, texture coordinates and slots of a mesh; `None` for all other shapes.
    pub mesh: Option<Arc<Mesh>>,
    /// One material a slot; all shapes but meshes have one slot.
    pub materials: Vec<MaterialId>,
    /// From the world to the object's own axes, a rotation; turns the texture of a lone sphere. `None` for none.
    pub turned: Option<Mat3>,
    /// A sphere that stands for a point light: the classic model puts all of its light into its centre.
    pub is_point_light: bool,
}

impl Object {
    /// Anything but a mesh, of one material.
    pub fn plain(material: MaterialId) -> Self {
        Self { materials: vec![material], ..Self::default() }
    }

    /// The material of a primitive.
    #[inline]
    pub(crate) fn material_of(&self, prim: u32) -> MaterialId {
        match &self.materials[..] {
            [only] => *only,
            many => {
                let mesh = self.mesh.as_ref().expect("only meshes have several slots");
                let slot = mesh.slots.get(prim as usize).map_or(0, |&slot| usize::from(slot));
                many[slot.min(many.len() - 1)]
            }
        }
    }
}

/// How everything looks and shines.
///
/// Material and texture ids lie within their lists, and a blend comes to no cycle and at most eight lobes.
#[derive(Clone, Debug)]
pub struct Shading {
    /// Materials by [`MaterialId`].
    pub materials: Vec<Material>,
    /// Textures by [`TextureId`](crate::core::texture::TextureId).
    pub textures: Vec<Texture>,
    /// Light that arrives from outside the scene.
    pub environment: Environment,
    /// What the air outside of all glass absorbs, per metre; light from the environment has passed it already.
    pub air: Vec3,
    /// Lights without size. They are in no tree: no ray hits them.
    pub delta_lights: Vec<DeltaLight>,
}

impl Geometry {
    /// Builds the tree over the objects. The two lists run in parallel.
    ///
    /// # Panics
    /// When the lists differ in length.
    pub fn build(shapes: Vec<Shape>, objects: Vec<Object>) -> Self {
        assert_eq!(shapes.len(), objects.len(), "each shape needs its object");
        Self { objects, tree: SceneTree::build(shapes) }
    }

    /// The material of what a ray hit.
    #[inline]
    pub(crate) fn material_of(&self, hit: &Hit) -> MaterialId {
        self.objects[hit.object as usize].material_of(hit.prim)
    }
}

impl Shading {
    /// In clear air, without lights that have no size.
    pub fn new(materials: Vec<Material>, textures: Vec<Texture>, environment: Environment) -> Self {
        Self { materials, textures, environment, air: Vec3::ZERO, delta_lights: Vec::new() }
    }
}
