//! What the entities of a scene are made of.
//!
//! | entity | components |
//! |---|---|
//! | object | [`Shape`], [`Placement`], [`MaterialSlots`] |
//! | material | [`SurfaceMaterial`] |
//! | light | [`PointLight`], [`SpotLight`] or [`DirectionalLight`], [`Placement`] |
//! | camera | [`View`](super::View), [`Projection`](super::Projection), [`Lens`](super::Lens) |
//!
//! Any of them may have a `Name`. Spawn, change and remove them with ordinary bevy_ecs calls: the picture follows.

use super::placement::Placement;
use super::sources::{EnvironmentSource, MeshShading, MeshSource, TextureSource};
use crate::mesh::Mesh;
use crate::render::{self, Display, Param, Params, RenderSettings};
use bevy_ecs::prelude::{Component, Entity, Resource, World};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// The surface of an object, in its own space; its [`Placement`] says where that is.
#[derive(Component, Clone, Debug)]
#[require(Placement, MaterialSlots)]
pub enum Shape {
    /// About the origin; metres. Its placement must scale evenly.
    Sphere {
        /// Metres, positive.
        radius: f64,
    },
    /// Infinite, through the origin.
    Plane {
        /// The direction of the front, any length but 0.
        normal: DVec3,
    },
    /// A parallelogram with a corner at the origin; its front looks along `edge_u` × `edge_v`.
    Quad {
        /// From the corner to the one at `u = 1`, metres.
        edge_u: DVec3,
        /// From the corner to the one at `v = 1`, metres.
        edge_v: DVec3,
    },
    /// A single triangle; its front is where its vertices run counter-clockwise.
    Triangle {
        /// The corners, metres.
        vertices: [DVec3; 3],
    },
    /// Shared by all objects that use it, together with its tree.
    Mesh(Arc<Mesh>),
    /// Many spheres of one material. Its placement must scale evenly.
    Spheres(Arc<Balls>),
}

impl Shape {
    /// What people call it.
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
    /// Meshes and clouds are equal when they are the same one in memory.
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

/// Many spheres, stored about their centre so that `f32` suffices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Balls {
    /// Metres, relative to `center`.
    pub centers: Vec<Vec3>,
    /// Metres, one a ball.
    pub radii: Vec<f32>,
    /// Metres: what is added to a centre to get its coordinates in the object's own space.
    pub center: DVec3,
}

impl Balls {
    /// One radius a centre.
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
}

/// The material entities of an object, one a slot of its mesh; every other shape has one slot.
///
/// A triangle whose slot is not listed uses the last one; with none at all it is plain grey.
#[derive(Component, Clone, Debug, Default, PartialEq, Eq)]
pub struct MaterialSlots(pub Vec<Entity>);

/// By entity, and by the texture itself.
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

/// What the surfaces that use this entity do to light.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct SurfaceMaterial(pub Material);

impl SurfaceMaterial {
    /// The material of an entity; `None` for one that is no material.
    pub fn of(world: &World, entity: Entity) -> Option<&Material> {
        world.get::<Self>(entity).map(|Self(material)| material)
    }
}

/// The material of surfaces that have none.
pub const GREY: Material = Material::Diffuse { albedo: ColorParam::Rgb(Vec3::splat(0.5)) };

/// The textures that a material looks up.
pub fn textures_of(material: &Material) -> impl Iterator<Item = &Arc<SurfaceTexture>> {
    material.params().into_iter().filter_map(|(_, param)| match param {
        Param::Reflectance(ColorParam::Texture(texture))
        | Param::Radiance(ColorParam::Texture(texture))
        | Param::Factor(ColorParam::Texture(texture))
        | Param::Map(ColorParam::Texture(texture))
        | Param::Share(ScalarParam::Texture(texture)) => Some(texture),
        _ => None,
    })
}

/// A colour, linear Rec. 709, or a texture.
#[derive(Clone, Debug)]
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

impl PartialEq for ColorParam {
    /// Textures are equal when they are the same one in memory.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Rgb(a), Self::Rgb(b)) => a == b,
            (Self::Texture(a), Self::Texture(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// A number, or the red channel of a texture.
#[derive(Clone, Debug)]
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

impl PartialEq for ScalarParam {
    /// Textures are equal when they are the same one in memory.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => a == b,
            (Self::Texture(a), Self::Texture(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// A texture with the name and the description that a scene file has for it.
#[derive(Clone, Debug)]
pub struct SurfaceTexture {
    /// Its name in the scene file.
    pub name: String,
    /// Its description in the scene file.
    pub part: TextureSource,
    /// The texture itself, ready to be looked up.
    pub texture: render::Texture,
}

/// Shines evenly into all directions; to the path tracer it is a small glowing sphere or a point.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(Placement)]
pub struct PointLight {
    /// Radiant intensity, W·sr⁻¹.
    pub intensity: Vec3,
    /// Metres. With 0 it is a point: it casts hard shadows, and no ray ever hits it.
    pub radius: f64,
}

/// Shines from a point into a cone; no ray ever hits it.
///
/// At the angle a from the axis it sends `intensity` · t², with t = (cos a − cos outer) / (cos inner − cos outer),
/// clamped to 0..1.
///
/// Source: glTF 2.0, KHR_lights_punctual.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(Placement)]
pub struct SpotLight {
    /// Radiant intensity within the inner cone, W·sr⁻¹.
    pub intensity: Vec3,
    /// Along the axis of the cone, away from its tip, in the light's own space: its [`Placement`] turns it. Any length
    /// but 0.
    pub direction: DVec3,
    /// Degrees from the axis, from 0 to the outer angle; the intensity falls off from here on.
    pub inner_angle_deg: f64,
    /// Degrees from the axis, above 0 and at most 90; no light beyond.
    pub outer_angle_deg: f64,
}

/// Shines from infinitely far away, parallel; no ray ever hits it. The air absorbs nothing of its light, as of the
/// environment's.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(Placement)]
pub struct DirectionalLight {
    /// On a surface that faces the light, W·m⁻².
    pub irradiance: Vec3,
    /// Where the light goes, in the light's own space: its [`Placement`] turns it. Any length but 0.
    pub direction: DVec3,
}

/// Where the mesh of an object came from, for saving and reloading it.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct MeshOrigin {
    /// The file or the built-in mesh.
    pub source: MeshSource,
    /// How its normals are found.
    pub shading: MeshShading,
    /// Share of the faces that were kept, 0..1.
    pub simplify: Option<f64>,
    /// Materials come from the mesh's own file.
    pub own_materials: bool,
}

/// The place of an entity in its scene file. What has none comes after, in the order of its entity.
///
/// The picture's bits depend on the order of objects; this keeps them the same in every process.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ordinal(pub u32);

/// Light from infinitely far away.
#[derive(Resource, Clone, Debug, Default)]
pub struct SceneEnvironment {
    /// Radiance by direction, W·m⁻²·sr⁻¹.
    pub light: render::Environment,
    /// What the scene file says, for saving.
    pub part: EnvironmentSource,
    /// What the air absorbs, per metre; `light` has passed it already.
    pub air: Vec3,
}

impl PartialEq for SceneEnvironment {
    /// Pictures are equal when they are the same one in memory.
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

/// The size that the scene asks for, pixels. A window has a size of its own.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSize {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl Default for FilmSize {
    fn default() -> Self {
        Self { width: 1280, height: 720 }
    }
}

/// Light model, depth and seed.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendering(pub RenderSettings);

/// Exposure and tone curve; no sample depends on them.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct DisplaySettings(pub Display);
