//! The scene as the workers see it: flat, read-only, shared.
//!
//! It comes in three parts with lives of their own, so that a change replaces no more than it must: a moved camera
//! keeps [`Geometry`] and [`Shading`], a new material keeps [`Geometry`].

use super::ambient::AmbientLight;
use super::bound::radiance_bound;
use super::caustics::CasterTable;
use super::environment::EnvironmentSampler;
use super::light::LightTable;
use super::medium::Bodies;
use super::wide::{ClassicTable, MaterialTable, SurfaceTable};
use super::{Camera, Emission, Environment, Material, MaterialId, Texture};
use firstlight_kdtree::{SceneTree, Shape};
use firstlight_mesh::Mesh;
use glam::{Mat3, Vec3};
use std::sync::Arc;

#[derive(Clone, Debug)]
pub struct Snapshot {
    pub geometry: Arc<Geometry>,
    pub shading: Arc<Shading>,
    pub camera: Camera,
}

impl Snapshot {
    /// The bodies that the camera is inside of; see [`Bodies::around`].
    pub(super) fn camera_media(&self) -> Vec<u32> {
        if !self.shading.features.glass {
            return Vec::new();
        }
        self.shading.bodies.around(&self.geometry, self.camera.eye)
    }
}

/// Where everything is. Object `i` here is object `i` of the tree.
#[derive(Debug)]
pub struct Geometry {
    pub objects: Vec<Object>,
    pub tree: SceneTree,
    pub(super) surfaces: SurfaceTable,
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
    pub(super) fn material_of(&self, prim: u32) -> MaterialId {
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

/// How everything looks and shines; built for one [`Geometry`], because lights are objects.
#[derive(Debug)]
pub struct Shading {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub environment: Environment,
    /// What the air outside of all glass absorbs, per metre; light from the environment has passed it already.
    pub air: Vec3,
    pub(super) ambient: AmbientLight,
    /// Whether each material looks up a texture, and so needs surface coordinates.
    pub(super) textured: Vec<bool>,
    /// What each material adds itself.
    pub(super) emission: Vec<Option<Emission>>,
    pub lights: LightTable,
    pub(super) bodies: Bodies,
    pub(super) environment_sampler: Option<EnvironmentSampler>,
    pub(super) material_table: MaterialTable,
    pub(super) classic_table: ClassicTable,
    /// What gathers light, where something does.
    pub(super) casters: Option<CasterTable>,
    /// See [`super::bound`].
    pub(super) radiance_bound: Option<f32>,
    pub features: Features,
}

/// What the scene uses: what it does not use costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Some surface can send a path through itself, so paths keep track of what they are inside of.
    pub glass: bool,
    /// Something absorbs light between surfaces: there may be glass, or there is air that does.
    pub media: bool,
    /// Some light can be found by choosing a point or direction on it.
    pub light_sampling: bool,
    /// The surroundings shine.
    pub environment: bool,
    /// Some material looks up a texture.
    pub textures: bool,
    /// Something smooth gathers the light of some lamp, so paths are traced from lamps as well.
    pub caustics: bool,
}

impl Geometry {
    /// The two lists run in parallel.
    pub fn build(shapes: Vec<Shape>, objects: Vec<Object>) -> Self {
        assert_eq!(shapes.len(), objects.len(), "each shape needs its object");
        let tree = SceneTree::build(shapes);
        let surfaces = SurfaceTable::build(&tree);
        Self { objects, tree, surfaces }
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
        let bodies = Bodies::build(geometry, &materials);
        let casters = CasterTable::build(geometry, &materials, &lights);
        let glass = materials.iter().any(Material::is_clear);
        let features = Features {
            glass,
            media: materials.iter().any(Material::absorbs),
            light_sampling: !lights.is_empty() || environment_sampler.is_some(),
            environment: !matches!(environment, Environment::Black),
            textures: materials.iter().any(|material| material.is_textured(&materials)),
            caustics: casters.is_some(),
        };
        let material_table = MaterialTable::build(geometry, &materials);
        let classic_table = ClassicTable::build(&materials);
        let textured = (0..materials.len()).map(|id| materials[id].is_textured(&materials)).collect();
        let ambient = AmbientLight::of(&environment);
        let air = Vec3::ZERO;
        let mut shading = Self {
            materials,
            textures,
            environment,
            air,
            ambient,
            textured,
            emission,
            lights,
            bodies,
            environment_sampler,
            material_table,
            classic_table,
            casters,
            radiance_bound: None,
            features,
        };
        shading.radiance_bound = radiance_bound(&shading);
        shading
    }

    /// The same under air that absorbs light, per metre.
    pub fn with_air(mut self, absorption: Vec3) -> Self {
        self.air = absorption;
        self.features.media |= absorption != Vec3::ZERO;
        self
    }
}
