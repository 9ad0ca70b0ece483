//! From a hit to everything that shading needs to know of the place.

use super::bsdf::{Blend, Lobe, MAX_LOBES};
use super::light::sphere_uv;
use super::medium::MediumStack;
use super::{ColorInput, Material, MaterialId, ScalarInput, Snapshot};
use crate::geometry::{Frame, Ray};
use crate::kdtree::{Hit, Shape};
use glam::{Vec2, Vec3};

/// A point on a surface, seen along a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub position: Vec3,
    /// Bound on the absolute error of `position`, metres per axis.
    pub error: Vec3,
    /// Unit, on the side that the ray came from.
    pub geometric_normal: Vec3,
    /// Unit, and never facing away from the ray.
    pub normal: Vec3,
    /// Surface coordinates, see [`super::Texture`].
    pub uv: Vec2,
    /// Whether the ray met the front: the outside of a closed surface.
    pub front: bool,
    /// Unit, back along the ray.
    pub wo: Vec3,
}

impl Vertex {
    #[inline]
    pub fn new(scene: &Snapshot, ray: &Ray, hit: &Hit) -> Self {
        let geometry = &*scene.geometry;
        let point = geometry.tree.surface_point(ray, hit);
        let wo = -ray.dir;
        let front = wo.dot(point.geometric_normal) >= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let geometric_normal = side * point.geometric_normal;
        let mut normal = geometric_normal;
        let mut uv = Vec2::new(hit.u, hit.v);
        match &geometry.tree.shapes()[hit.object as usize] {
            Shape::Mesh { world_from_object, .. } => {
                let mesh = geometry.objects[hit.object as usize].mesh.as_ref().expect("a mesh shape has a mesh");
                let [a, b, c] = mesh.triangles[hit.prim as usize].map(|i| i as usize);
                let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
                if !mesh.normals.is_empty() {
                    let object =
                        weights.x * mesh.normals[a] + weights.y * mesh.normals[b] + weights.z * mesh.normals[c];
                    // Normals move with the inverse transpose: the cofactors, without the division.
                    let m = world_from_object.matrix3;
                    let (x, y, z) = (Vec3::from(m.x_axis), Vec3::from(m.y_axis), Vec3::from(m.z_axis));
                    let cofactors = object.x * y.cross(z) + object.y * z.cross(x) + object.z * x.cross(y);
                    let mirrored = x.dot(y.cross(z)) < 0.0;
                    let smooth = if mirrored { -cofactors } else { cofactors }.normalize_or(point.geometric_normal);
                    // A normal that the viewer sees from behind would reflect light into the surface.
                    let facing = if smooth.dot(geometric_normal) < 0.0 { -smooth } else { smooth };
                    normal = if facing.dot(wo) > 0.0 { facing } else { geometric_normal };
                }
                if !mesh.uvs.is_empty() {
                    uv = weights.x * mesh.uvs[a] + weights.y * mesh.uvs[b] + weights.z * mesh.uvs[c];
                }
            }
            Shape::Plane { point: origin, normal } => {
                let frame = Frame::around(*normal);
                let local = point.position - *origin;
                uv = Vec2::new(local.dot(frame.x), local.dot(frame.y));
            }
            Shape::Sphere { .. } | Shape::Spheres { .. } => uv = sphere_uv(point.geometric_normal),
            Shape::Quad { .. } | Shape::Triangle { .. } => {}
        }
        Self { position: point.position, error: point.error, geometric_normal, normal, uv, front, wo }
    }
}

/// The material of a hit.
#[inline]
pub(super) fn material_of(scene: &Snapshot, hit: &Hit) -> MaterialId {
    let object = &scene.geometry.objects[hit.object as usize];
    match &object.materials[..] {
        [only] => *only,
        many => {
            let mesh = object.mesh.as_ref().expect("only meshes have several slots");
            let slot = mesh.slots.get(hit.prim as usize).map_or(0, |&slot| usize::from(slot));
            many[slot.min(many.len() - 1)]
        }
    }
}

impl ColorInput {
    #[inline]
    pub(super) fn eval(self, scene: &Snapshot, uv: Vec2) -> Vec3 {
        match self {
            Self::Constant(color) => color,
            Self::Texture(id) => scene.shading.textures[id as usize].eval(uv),
        }
    }
}

impl ScalarInput {
    #[inline]
    pub(super) fn eval(self, scene: &Snapshot, uv: Vec2) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Texture(id) => scene.shading.textures[id as usize].eval(uv).x,
        }
    }
}

/// The lobes of a blend at a vertex; `None` where all of it is black.
pub(super) fn blend_at(scene: &Snapshot, id: MaterialId, vertex: &Vertex, media: &MediumStack) -> Option<Blend> {
    let mut parts = [(Lobe::Glass { eta: 1.0 }, 0.0); MAX_LOBES];
    let mut n = 0;
    collect(scene, id, vertex, media, 1.0, &mut |lobe, weight| {
        parts[n] = (lobe, weight);
        n += 1;
    });
    (n > 0).then(|| Blend::new(&parts[..n]))
}

fn collect(
    scene: &Snapshot,
    id: MaterialId,
    vertex: &Vertex,
    media: &MediumStack,
    weight: f32,
    push: &mut impl FnMut(Lobe, f32),
) {
    match &scene.shading.materials[id as usize] {
        Material::Blend { weight: share, a, b } => {
            let share = share.eval(scene, vertex.uv).clamp(0.0, 1.0);
            collect(scene, *a, vertex, media, weight * (1.0 - share), push);
            collect(scene, *b, vertex, media, weight * share, push);
        }
        _ if weight == 0.0 => {}
        _ => {
            if let Some(lobe) = lobe_at(scene, id, vertex, media) {
                push(lobe, weight);
            }
        }
    }
}

/// The one lobe of a plain material; `None` where the surface is black.
#[inline]
pub(super) fn lobe_at(scene: &Snapshot, id: MaterialId, vertex: &Vertex, media: &MediumStack) -> Option<Lobe> {
    let uv = vertex.uv;
    match &scene.shading.materials[id as usize] {
        Material::Diffuse { albedo } => Some(Lobe::Diffuse { albedo: albedo.eval(scene, uv) }),
        Material::Mirror { reflectance } => Some(Lobe::Mirror { reflectance: reflectance.eval(scene, uv) }),
        Material::Metal { alpha, reflectance, fresnel, compensate } => Some(Lobe::Metal {
            alpha: alpha.eval(scene, uv).clamp(0.0, 1.0),
            reflectance: reflectance.eval(scene, uv),
            fresnel: *fresnel,
            compensate: *compensate,
        }),
        Material::Glass { .. } => Some(Lobe::Glass { eta: media.eta(scene, id, vertex.front) }),
        Material::Emissive { .. } | Material::Blend { .. } => None,
    }
}
