//! The components of the entities of a scene.
//!
//! | entity | components |
//! |---|---|
//! | object | [`Shape`], [`Placement`], [`MaterialSlots`] |
//! | material | [`SurfaceMaterial`] |
//! | light | [`PointLight`], [`SpotLight`] or [`DirectionalLight`], [`Placement`] |
//! | camera | [`View`](crate::format::view::View), [`Projection`](crate::format::view::Projection), [`Lens`](crate::format::view::Lens) |
//!
//! Any of them may have a `Name`, objects and lights [`Hidden`]. Spawn, change and remove them with ordinary bevy_ecs calls: the renderer follows.

use crate::format::placement::Placement;
use crate::format::sources::{EnvironmentSource, MeshOptions, MeshSource, TextureSource};
use crate::mesh::Mesh;
use crate::render::{self, Display, Param, Params, RenderSettings};
use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::{Component, Entity, Resource, World};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// The surface of an object, in object space; its [`Placement`] positions it in the world.
#[derive(Component, Clone, Debug)]
#[require(Placement, MaterialSlots)]
pub enum Shape {
    /// Centred at the origin. Its placement must scale uniformly.
    Sphere {
        /// Metres, above 0.
        radius: f64,
    },
    /// Infinite; contains the origin.
    Plane {
        /// Normal of the front side; any length but 0.
        normal: DVec3,
    },
    /// A parallelogram with a corner at the origin; the normal of its front is `edge_u` × `edge_v`.
    Quad {
        /// From the corner to the one at `u = 1`, metres.
        edge_u: DVec3,
        /// From the corner to the one at `v = 1`, metres.
        edge_v: DVec3,
    },
    /// A single triangle; its vertices are counter-clockwise as seen from the front.
    Triangle {
        /// The vertices, metres.
        vertices: [DVec3; 3],
    },
    /// A triangle mesh; objects with the same mesh share its kd-tree.
    Mesh(Arc<Mesh>),
    /// A group of spheres with one material. Its placement must scale uniformly.
    Spheres(Arc<Balls>),
}

impl Shape {
    /// Name of the kind of shape, for the user interface.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Sphere { .. } => "sphere",
            Self::Plane { .. } => "plane",
            Self::Quad { .. } => "quad",
            Self::Triangle { .. } => "triangle",
            Self::Mesh(_) => "mesh",
            Self::Spheres(_) => "spheres",
        }
    }
}

impl PartialEq for Shape {
    /// Meshes and groups of spheres are equal if they are the same allocation.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Sphere { radius: a }, Self::Sphere { radius: b }) => a == b,
            (Self::Plane { normal: a }, Self::Plane { normal: b }) => a == b,
            (Self::Quad { edge_u: a, edge_v: b }, Self::Quad { edge_u: c, edge_v: d }) => a == c && b == d,
            (Self::Triangle { vertices: a }, Self::Triangle { vertices: b }) => a == b,
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b),
            (Self::Spheres(a), Self::Spheres(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// A group of spheres, stored relative to its centre so that `f32` suffices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Balls {
    /// Metres, relative to `center`.
    pub centers: Vec<Vec3>,
    /// Metres, one per sphere.
    pub radii: Vec<f32>,
    /// Metres: added to `centers`, it gives coordinates in object space.
    pub center: DVec3,
}

impl Balls {
    /// - `centers`: object space, metres.
    /// - `radii`: metres, one per centre.
    pub fn new(centers: &[DVec3], radii: impl IntoIterator<Item = f64>) -> Self {
        let (min, max) = centers
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &point| (min.min(point), max.max(point)));
        let center = if centers.is_empty() { DVec3::ZERO } else { 0.5 * min + 0.5 * max };
        Self {
            centers: centers.iter().map(|&point| (point - center).as_vec3()).collect(),
            radii: radii.into_iter().map(|radius| radius as f32).collect(),
            center,
        }
    }

    /// # Errors
    /// If there are no spheres, or not as many radii as centres, or one is not finite or has no size.
    pub fn check(&self) -> Result<(), String> {
        if self.centers.is_empty() || self.centers.len() != self.radii.len() {
            return Err(format!("there are {} centres and {} radii", self.centers.len(), self.radii.len()));
        }
        let is_sound = |(c, r): (&Vec3, &f32)| c.is_finite() && r.is_finite() && *r > 0.0;
        match self.centers.iter().zip(&self.radii).position(|sphere| !is_sound(sphere)) {
            Some(i) => Err(format!("sphere {i} needs a finite centre and a positive radius")),
            None => Ok(()),
        }
    }
}

/// The material entities of an object, one per slot of its mesh; all other shapes have one slot.
///
/// A triangle whose slot is not listed uses the last one; without any material it is grey.
#[derive(Component, Clone, Debug, Default, PartialEq, Eq)]
pub struct MaterialSlots(pub Vec<Entity>);

/// Parameters of materials in the world: parts by entity, textures by reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InWorld;

impl Params for InWorld {
    type Color = ColorParam;
    type Scalar = ScalarParam;
    type Rgb = Vec3;
    type Material = Entity;
}

/// A material whose textures and parts are in the world.
pub type Material = render::Material<InWorld>;

/// The material of the surfaces that use this entity.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct SurfaceMaterial(pub Material);

impl SurfaceMaterial {
    /// The material of an entity; `None` if it is not a material.
    pub fn of(world: &World, entity: Entity) -> Option<&Material> {
        world.get::<Self>(entity).map(|Self(material)| material)
    }
}

/// The material of surfaces without one.
pub const GREY: Material = Material::Diffuse { albedo: ColorParam::Rgb(Vec3::splat(0.5)) };

/// The textures of a material.
pub fn textures_of(material: &Material) -> impl Iterator<Item = &Arc<SurfaceTexture>> {
    material.params().into_iter().filter_map(|(_, param)| match param {
        Param::Color(ColorParam::Texture(texture)) | Param::Scalar(ScalarParam::Texture(texture)) => Some(texture),
        _ => None,
    })
}

/// A colour, linear Rec. 709, or a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorParam {
    /// The same colour everywhere.
    Rgb(Vec3),
    /// The colour of a texture at the surface point.
    Texture(Arc<SurfaceTexture>),
}

impl From<Vec3> for ColorParam {
    fn from(rgb: Vec3) -> Self {
        Self::Rgb(rgb)
    }
}

/// A number, or a texture, of which the red channel is used.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalarParam {
    /// The same number everywhere.
    Number(f32),
    /// The red channel of a texture at the surface point.
    Texture(Arc<SurfaceTexture>),
}

impl From<f32> for ScalarParam {
    fn from(number: f32) -> Self {
        Self::Number(number)
    }
}

/// A texture with its name and description in the scene file.
#[derive(Clone, Debug)]
pub struct SurfaceTexture {
    /// Its name in the scene file.
    pub name: String,
    /// Its description in the scene file.
    pub part: TextureSource,
    /// The texture itself.
    pub texture: render::Texture,
}

/// Textures are equal if they are the same allocation.
impl PartialEq for SurfaceTexture {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

/// Origin of the mesh of an object, for saving and reloading it.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct MeshOrigin {
    /// The file or the built-in mesh.
    pub source: MeshSource,
    /// What was done with it.
    pub options: MeshOptions,
    /// Whether the materials come from the file of the mesh.
    pub own_materials: bool,
}

/// An object or a light that is left out of the image: it is not seen and gives no light.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hidden;

/// Position of an entity in its scene file. Entities without one come after all others, ordered by `Entity`.
///
/// The order of objects affects the rounding of the image; this makes it the same in every process.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ordinal(pub u32);

/// Light from infinitely far away.
#[derive(Resource, Clone, Debug, Default)]
pub struct SceneEnvironment {
    /// Radiance by direction, W·m⁻²·sr⁻¹.
    pub light: render::Environment,
    /// Its description, for saving.
    pub part: EnvironmentSource,
    /// Absorption of the air per metre; `light` is not absorbed.
    pub air: Vec3,
}

impl PartialEq for SceneEnvironment {
    /// Images are equal if they are the same allocation.
    fn eq(&self, other: &Self) -> bool {
        use render::Environment::{Black, Constant, Gradient, Image};
        if self.air != other.air {
            return false;
        }
        match (&self.light, &other.light) {
            (Black, Black) => true,
            (Constant(a), Constant(b)) => a == b,
            (Gradient { zenith: a, horizon: b, ground: c }, Gradient { zenith: d, horizon: e, ground: f }) => {
                a == d && b == e && c == f
            }
            (Image { image: a, scale: b, rotation: c }, Image { image: d, scale: e, rotation: f }) => {
                Arc::ptr_eq(a, d) && b == e && c == f
            }
            _ => false,
        }
    }
}

/// Integrator, maximum depth and seed.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendering(pub RenderSettings);

/// Exposure and tone curve; they do not affect the samples.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct DisplaySettings(pub Display);

/// Replaces a component by another value; one that is equal is not touched.
pub(crate) fn put<T: Component<Mutability = Mutable> + PartialEq>(world: &mut World, entity: Entity, value: T) {
    if let Some(mut old) = world.get_mut::<T>(entity)
        && *old != value
    {
        *old = value;
    }
}
