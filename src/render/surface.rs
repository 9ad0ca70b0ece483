//! From a hit to everything that shading needs to know of the place.

use super::bsdf::{Blend, Lobe, MAX_LOBES};
use super::light::sphere_uv;
use super::medium::MediumStack;
use super::{ColorInput, Material, MaterialId, ScalarInput, Snapshot};
use crate::geometry::{Frame, Ray, robust};
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
    /// From `position` towards the smooth surface that the interpolated normals tell of, metres; zero where they agree
    /// with the true surface or bend inwards.
    pub lift: Vec3,
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
        let mut lift = Vec3::ZERO;
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
                    let turn = if smooth.dot(geometric_normal) < 0.0 { -1.0 } else { 1.0 };
                    let facing = turn * smooth;
                    normal = if facing.dot(wo) > 0.0 { facing } else { geometric_normal };
                    let corners = [a, b, c].map(|i| (mesh.positions[i], turn * mesh.normals[i]));
                    lift = world_from_object.transform_vector3(lift_of(&corners, weights));
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
            Shape::Sphere { .. } => {
                uv = sphere_uv(match &geometry.objects[hit.object as usize].turned {
                    Some(object_from_world) => *object_from_world * point.geometric_normal,
                    None => point.geometric_normal,
                });
            }
            Shape::Spheres { world_from_object, .. } => {
                // Balls scale evenly, so the transpose is the inverse but for that factor.
                let m = world_from_object.matrix3;
                uv = sphere_uv((m.transpose() * point.geometric_normal).normalize());
            }
            Shape::Quad { .. } | Shape::Triangle { .. } => {}
        }
        Self { position: point.position, error: point.error, geometric_normal, normal, uv, front, wo, lift }
    }

    /// `wo` mirrored by the shading normal, unit.
    #[inline]
    pub fn mirrored(&self) -> Vec3 {
        (2.0 * self.normal.dot(self.wo) * self.normal - self.wo).normalize()
    }

    /// Whether light from `wi` can meet the side that `wo` sees.
    ///
    /// The true surface decides, unless a smooth one is to be seen in its place.
    #[inline]
    pub fn is_reached_from(&self, wi: Vec3) -> bool {
        let normal = if self.lift == Vec3::ZERO { self.geometric_normal } else { self.normal };
        wi.dot(normal) > 0.0
    }

    /// Where a ray starts that stays on the side of `wo`.
    ///
    /// On the smooth surface where there is one, so that the flat faces in its place cast no shadow on themselves.
    #[inline]
    pub fn leaving(&self, dir: Vec3) -> Vec3 {
        if self.lift == Vec3::ZERO {
            return self.passing(dir);
        }
        robust::offset_ray_origin(self.position + self.lift, self.error, self.geometric_normal, self.geometric_normal)
    }

    /// Where a ray starts that goes to the side where `dir` points.
    #[inline]
    pub fn passing(&self, dir: Vec3) -> Vec3 {
        robust::offset_ray_origin(self.position, self.error, self.geometric_normal, dir)
    }
}

/// From a point of a triangle to the smooth surface above it, in the triangle's space.
///
/// - `corners`: positions and unit normals, on the side from which the point is seen; `weights`: barycentric.
///
/// The point is projected onto the tangent plane of each corner that it lies below, and the results are weighted
/// (Hanika 2021, "Hacking the Shadow Terminator"). Zero where it lies below none: where the surface is flat or bends
/// the other way.
#[inline]
fn lift_of(corners: &[(Vec3, Vec3); 3], weights: Vec3) -> Vec3 {
    let [(a, _), (b, _), (c, _)] = *corners;
    let point = weights.x * a + weights.y * b + weights.z * c;
    // The weighted corners give the point itself: what is left are the projections.
    corners.iter().zip(weights.to_array()).map(|((p, normal), w)| -w * (point - p).dot(*normal).min(0.0) * normal).sum()
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
        Material::Phong { diffuse, specular, transparency, .. } => {
            let specular = specular.eval(scene, vertex.uv).clamp(0.0, 1.0);
            let opaque = weight * (1.0 - transparency);
            if opaque * (1.0 - specular) > 0.0 {
                push(Lobe::Diffuse { albedo: diffuse.eval(scene, vertex.uv) }, opaque * (1.0 - specular));
            }
            if opaque * specular > 0.0 {
                push(Lobe::Mirror { reflectance: Vec3::ONE }, opaque * specular);
            }
            if *transparency > 0.0 {
                push(Lobe::Glass { eta: media.eta(scene, id, vertex.front) }, weight * transparency);
            }
        }
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
        Material::Emissive { .. } | Material::Phong { .. } | Material::Blend { .. } => None,
    }
}
