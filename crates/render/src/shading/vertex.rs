//! From a hit to a surface interaction.

use crate::core::material::{ColorInput, MaterialId, ScalarInput};
use crate::core::material_queries::Emission;
use crate::core::texture::TexturePoint;
use crate::prepare::light::shape::sphere_uv;
use crate::prepare::prepared::Prepared;
use crate::shading::dielectric::reflect;
use crate::shading::tangent::{self, Tangent};
use firstlight_kdtree::geometry::{Frame, Ray, robust};
use firstlight_kdtree::{Hit, Shape};
use firstlight_mesh::Mesh;
use firstlight_simd::{Real, Vector3, three};
use glam::{Vec2, Vec3, Vec4};
use std::f32::consts::{PI, TAU};
use std::ops::{Add, Mul};

/// A surface point seen along a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub position: Vec3,
    /// Bound on the absolute error of `position`, metres per axis.
    pub error: Vec3,
    /// Unit, on the side that the ray came from.
    pub geometric_normal: Vec3,
    /// Shading normal, unit; never faces away from the ray.
    pub normal: Vec3,
    /// Shading normal independent of the view direction on this side, even if it faces away from the ray.
    pub smooth_normal: Vec3,
    /// `smooth_normal` before normal mapping.
    pub interpolated: Vec3,
    /// Set for materials that need it, see [`Material::asks_for_tangents`](crate::core::material::Material::asks_for_tangents).
    pub tangent: Tangent,
    /// Texture coordinates; on spheres only for textured materials.
    pub texture_point: TexturePoint,
    /// Whether the ray hit the front: the outside of a closed surface.
    pub front: bool,
    /// Unit, back along the ray.
    pub wo: Vec3,
    /// From `position` towards the smooth surface that the interpolated normals imply, metres; zero where it coincides
    /// with the true surface or bends inwards.
    pub lift: Vec3,
    /// See [`crate::core::material::Material::turns_normals_over`].
    pub turns_over: bool,
}

impl Vertex {
    /// `material`: that of the hit, see [`material_of`].
    #[inline]
    pub fn new(scene: &Prepared, ray: &Ray, hit: &Hit, material: MaterialId) -> Self {
        let geometry = &*scene.geometry;
        let point = geometry.tree.surface_point(ray, hit);
        let wo = -ray.dir;
        let front = wo.dot(point.geometric_normal) >= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let geometric_normal = side * point.geometric_normal;
        let mut smooth_normal = geometric_normal;
        let mut texture_point = TexturePoint::from(Vec2::new(hit.u, hit.v));
        let mut lift = Vec3::ZERO;
        let mut tangent = Tangent::default();
        let asks_for_tangent = scene.tables.with_tangents[material as usize];
        match &geometry.tree.shapes()[hit.object as usize] {
            Shape::Mesh { world_from_object, .. } => {
                let mesh = geometry.objects[hit.object as usize].mesh.as_ref().expect("a mesh shape has a mesh");
                let [a, b, c] = mesh.triangles[hit.prim as usize].map(|i| i as usize);
                let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
                if !mesh.normals.is_empty() {
                    let object =
                        weights.x * mesh.normals[a] + weights.y * mesh.normals[b] + weights.z * mesh.normals[c];
                    // Normals transform by the inverse transpose: the cofactors, without the division.
                    let m = world_from_object.matrix3;
                    let (x, y, z) = (Vec3::from(m.x_axis), Vec3::from(m.y_axis), Vec3::from(m.z_axis));
                    let cofactors = object.x * y.cross(z) + object.y * z.cross(x) + object.z * x.cross(y);
                    let mirrored = x.dot(y.cross(z)) < 0.0;
                    let smooth = if mirrored { -cofactors } else { cofactors }.normalize_or(point.geometric_normal);
                    // A normal that faces away from the viewer would reflect light into the surface.
                    let turn = if smooth.dot(geometric_normal) < 0.0 { -1.0 } else { 1.0 };
                    smooth_normal = turn * smooth;
                    let corners = [a, b, c].map(|i| mesh.positions[i].into());
                    let normals = [a, b, c].map(|i| (turn * mesh.normals[i]).into());
                    lift = world_from_object.transform_vector3(lift_of(&corners, &normals, &weights.to_array()).into());
                }
                texture_point = mesh_texture_point(mesh, hit);
                if asks_for_tangent {
                    let normal = side * smooth_normal;
                    tangent = Tangent::of_mesh(mesh, [a, b, c], weights, world_from_object, normal);
                }
            }
            Shape::Plane { point: origin, normal } => {
                let frame = Frame::around(*normal);
                let local = point.position - *origin;
                texture_point = Vec2::new(local.dot(frame.x), local.dot(frame.y)).into();
                if asks_for_tangent {
                    tangent = Tangent::of_derivatives(frame.x, frame.y);
                }
            }
            // Longitude and latitude cost as much as everything else.
            Shape::Sphere { .. } | Shape::Spheres { .. }
                if !scene.tables.textured[material as usize] && !asks_for_tangent => {}
            Shape::Sphere { radius, .. } => {
                let turned = geometry.objects[hit.object as usize].turned;
                let outwards = turned.map_or(point.geometric_normal, |map| map * point.geometric_normal);
                texture_point = sphere_uv(outwards).into();
                tangent = tangent_of_sphere(outwards, *radius, |v| turned.map_or(v, |map| map.transpose() * v));
            }
            Shape::Spheres { tree, world_from_object } => {
                // Spheres are scaled uniformly, so the transpose is the inverse up to a factor.
                let m = world_from_object.matrix3;
                let outwards = (m.transpose() * point.geometric_normal).normalize();
                texture_point = sphere_uv(outwards).into();
                let (_, radius) = tree.sphere(hit.prim);
                tangent = tangent_of_sphere(outwards, radius, |v| m * v);
                tangent.along_u = tangent.along_u.normalize();
            }
            Shape::Quad { edge_u, edge_v, .. } => {
                if asks_for_tangent {
                    tangent = Tangent::of_derivatives(*edge_u, *edge_v);
                }
            }
            Shape::Triangle { vertices: [a, b, c] } => {
                if asks_for_tangent {
                    tangent = Tangent::of_derivatives(*b - *a, *c - *a);
                }
            }
        }
        let (position, error) = (point.position, point.error);
        let normal = geometric_normal;
        let mut vertex = Self {
            position,
            error,
            geometric_normal,
            normal,
            smooth_normal,
            interpolated: smooth_normal,
            tangent,
            texture_point,
            front,
            wo,
            lift,
            turns_over: false,
        };
        if asks_for_tangent && let Some((map, scale)) = scene.shading.materials[material as usize].normal_map() {
            vertex.smooth_normal = vertex.turned(scene, map, scale);
            vertex.turns_over = scene.shading.materials[material as usize].turns_normals_over();
        }
        vertex.seen_along(wo)
    }

    /// Returns the emitted radiance at this point, W·m⁻²·sr⁻¹. Vertex colours do not tint emission.
    #[inline]
    pub fn emitted(&self, scene: &Prepared, emission: &Emission) -> Vec3 {
        emission.scale * emission.radiance.eval(scene, TexturePoint { color: Vec4::ONE, ..self.texture_point })
    }

    /// Weight of the second part of a blend, 0..1.
    #[inline]
    pub fn share_of_second(&self, scene: &Prepared, weight: ScalarInput, by_side: bool) -> f32 {
        if by_side { f32::from(!self.front) } else { weight.eval(scene, self.texture_point).clamp(0.0, 1.0) }
    }

    /// Returns the same point seen from another direction on the same side.
    ///
    /// - `wo`: unit, towards the viewer.
    #[inline]
    pub fn seen_along(&self, wo: Vec3) -> Self {
        let faces_away = self.smooth_normal.dot(wo) <= 0.0;
        let seen = Self { wo, normal: if faces_away { self.geometric_normal } else { self.smooth_normal }, ..*self };
        if self.is_mapped() { seen.with_bent_normal() } else { seen }
    }

    /// Whether the shading normal is from a normal map.
    #[inline]
    pub fn is_mapped(&self) -> bool {
        self.smooth_normal != self.interpolated
    }

    /// Returns the shading normal of another normal map than the material's own; see [`tangent`].
    pub fn mapped_normal(&self, scene: &Prepared, map: ColorInput) -> Vec3 {
        if !map.is_normal_map() {
            return self.interpolated_seen();
        }
        let turned = self.turned(scene, map, 1.0);
        tangent::bent(turned.into(), self.interpolated_seen().into(), self.wo.into()).into()
    }

    /// Returns the normal of a map on the side of the viewer, not bent.
    fn turned(&self, scene: &Prepared, map: ColorInput, scale: f32) -> Vec3 {
        let side = if self.front { 1.0 } else { -1.0 };
        if let ColorInput::Texture(id) = map
            && let Some(slope) = scene.shading.textures[id as usize].slope(&self.texture_point)
        {
            return side * tangent::normal_of_relief(scale * slope, &self.tangent, side * self.interpolated);
        }
        let (coded, front) = (map.eval(scene, self.texture_point).into(), (side * self.interpolated).into());
        let axes = tangent::tangent_axes(self.tangent.along_u.into(), self.tangent.handedness, front);
        side * Vec3::from(tangent::normal_of_map(coded, scale, axes, front))
    }

    #[cold]
    fn with_bent_normal(self) -> Self {
        let (normal, surface) = (self.smooth_normal, self.interpolated_seen());
        let facing = match self.turns_over {
            true => tangent::turned_over(normal, surface, self.wo),
            false => tangent::bent(normal.into(), surface.into(), self.wo.into()).into(),
        };
        Self { normal: facing, ..self }
    }

    /// The shading normal without normal mapping.
    pub fn interpolated_seen(&self) -> Vec3 {
        if self.interpolated.dot(self.wo) <= 0.0 { self.geometric_normal } else { self.interpolated }
    }

    /// Returns the same point seen from the far side.
    ///
    /// - `wo`: unit, towards the viewer there.
    #[inline]
    pub fn seen_through(&self, wo: Vec3) -> Self {
        let [geometric_normal, smooth_normal, interpolated] =
            [self.geometric_normal, self.smooth_normal, self.interpolated].map(|normal| -normal);
        let (front, lift) = (!self.front, Vec3::ZERO);
        Self { geometric_normal, smooth_normal, interpolated, front, lift, ..*self }.seen_along(wo)
    }

    /// Returns the shading normal for a viewer at `wo` on the far side, negated to this side. With it, a surface
    /// evaluates the BSDF between the two sides as seen from there.
    #[inline]
    pub fn normal_from_behind(&self, wo: Vec3) -> Vec3 {
        -self.seen_through(wo).normal
    }

    /// `wo` mirrored at the shading normal, unit.
    #[inline]
    pub fn mirrored(&self) -> Vec3 {
        reflect(self.wo.into(), self.normal.into()).into()
    }

    /// Whether light from `wi` can reach the side that faces `wo`.
    ///
    /// The true surface decides, unless a smooth one replaces it.
    #[inline]
    pub fn is_reached_from(&self, wi: Vec3) -> bool {
        wi.dot(self.reach_normal()) > 0.0
    }

    /// Whether a sampled direction leads to the intended side of the true surface.
    #[inline]
    pub fn leads_on(&self, wi: Vec3, passes: bool) -> bool {
        if passes { wi.dot(self.geometric_normal) < 0.0 } else { self.is_reached_from(wi) }
    }

    /// The normal of the side from which light must come, see [`Self::is_reached_from`].
    #[inline]
    pub fn reach_normal(&self) -> Vec3 {
        if self.lift == Vec3::ZERO { self.geometric_normal } else { self.interpolated_seen() }
    }

    /// Origin of a ray that stays on the side of `wo`.
    ///
    /// It is on the smooth surface if there is one, so that its flat faces cast no shadow on themselves.
    #[inline]
    pub fn leaving(&self, dir: Vec3) -> Vec3 {
        if self.lift == Vec3::ZERO {
            return self.passing(dir);
        }
        robust::offset_ray_origin(self.position + self.lift, self.error, self.geometric_normal, self.geometric_normal)
    }

    /// Origin of a ray to the side of `dir`.
    #[inline]
    pub fn passing(&self, dir: Vec3) -> Vec3 {
        robust::offset_ray_origin(self.position, self.error, self.geometric_normal, dir)
    }
}

/// Returns the vector from a point of a triangle to the smooth surface above it, in the triangle's space.
///
/// - `corners`: positions; `normals`: unit, on the side from which the point is seen; `weights`: barycentric.
///
/// The point is projected onto the tangent plane of each vertex below which it lies, and the results are weighted
/// (Hanika 2021, "Hacking the Shadow Terminator"). Zero if it lies below none: where the surface is flat or concave.
#[inline(always)]
pub(crate) fn lift_of<R: Real>(corners: &[Vector3<R>; 3], normals: &[Vector3<R>; 3], weights: &[R; 3]) -> Vector3<R> {
    let [a, b, c] = *corners;
    let point = a * weights[0] + b * weights[1] + c * weights[2];
    // The weighted vertices give the point itself: the projections remain.
    let lifts = three!(|k| normals[k] * (-weights[k] * (point - corners[k]).dot(normals[k]).at_most(0.0)));
    lifts[0] + lifts[1] + lifts[2]
}

/// Returns the point of a hit on a mesh for texture lookups.
#[inline]
pub(crate) fn mesh_texture_point(mesh: &Mesh, hit: &Hit) -> TexturePoint {
    let corners = mesh.triangles[hit.prim as usize].map(|i| i as usize);
    let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
    let uv = if mesh.uvs.is_empty() { Vec2::new(hit.u, hit.v) } else { interpolated(&mesh.uvs, corners, weights) };
    let uv2 = if mesh.uvs2.is_empty() { uv } else { interpolated(&mesh.uvs2, corners, weights) };
    let color = if mesh.colors.is_empty() { Vec4::ONE } else { interpolated(&mesh.colors, corners, weights) };
    TexturePoint { uv: [uv, uv2], color }
}

/// Interpolates a mesh attribute at a point of a triangle.
#[inline]
fn interpolated<T: Copy + Add<Output = T>>(attribute: &[T], corners: [usize; 3], weights: Vec3) -> T
where
    f32: Mul<T, Output = T>,
{
    let [a, b, c] = corners.map(|corner| attribute[corner]);
    weights.x * a + weights.y * b + weights.z * c
}

/// Tangent of a sphere by longitude and latitude.
///
/// - `outwards`: unit, in its own space, from which `to_world` leads; `radius`: before that, metres.
fn tangent_of_sphere(outwards: Vec3, radius: f32, to_world: impl Fn(Vec3) -> Vec3) -> Tangent {
    let across = Vec3::Y.cross(outwards);
    let east = across.normalize_or(Vec3::X);
    let (by_u, by_v) = (TAU * radius * across, PI * radius * outwards.cross(east));
    Tangent { along_u: to_world(east), ..Tangent::of_derivatives(to_world(by_u), to_world(by_v)) }
}

/// Returns the material of a hit.
#[inline]
pub(crate) fn material_of(scene: &Prepared, hit: &Hit) -> MaterialId {
    scene.geometry.objects[hit.object as usize].material_of(hit.prim)
}

impl ColorInput {
    #[inline]
    pub(crate) fn eval(self, scene: &Prepared, point: impl Into<TexturePoint>) -> Vec3 {
        match self {
            Self::Constant(color) => color,
            Self::Texture(id) => scene.shading.textures[id as usize].eval(point),
        }
    }
}

impl ScalarInput {
    #[inline]
    pub(crate) fn eval(self, scene: &Prepared, point: impl Into<TexturePoint>) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Texture(id) => scene.shading.textures[id as usize].eval(point).x,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::environment::Environment;
    use crate::core::material::Material;
    use crate::core::snapshot::Object;
    use crate::test_scene::prepared;
    use firstlight_kdtree::{BuildPreset, MeshTree};
    use firstlight_mesh::{Mesh, procedural};
    use glam::Affine3A;
    use std::sync::Arc;

    fn scene_of(mesh: Mesh, world_from_object: Affine3A) -> Prepared {
        let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
        let object = Object { mesh: Some(Arc::new(mesh)), ..Object::plain(0) };
        let grey = Material::Diffuse { albedo: ColorInput::Constant(Vec3::splat(0.5)) };
        let shape = Shape::Mesh { tree, world_from_object, space: Default::default() };
        prepared(vec![shape], vec![object], vec![grey], Environment::Black)
    }

    /// Rays from outside towards a unit sphere, on a grid.
    fn rays() -> impl Iterator<Item = Ray> {
        let n = 160;
        (0..n * n).map(move |i| {
            let (x, y) = (2.0 * (i % n) as f32 / n as f32 - 1.0, 2.0 * (i / n) as f32 / n as f32 - 1.0);
            Ray::new(Vec3::new(0.97 * x + 1e-3, 0.97 * y + 2e-3, 4.0), Vec3::NEG_Z)
        })
    }

    /// Root mean square error of the irradiance of a coarse sphere of radius `size` from one side, against the exact
    /// sphere: with the lifted origin, and without.
    fn light_errors(frequency: u32, map: Affine3A) -> (f64, f64) {
        let light = Vec3::new(0.96, 0.28, 0.0);
        let scene = scene_of(procedural::icosphere(frequency).with_vertex_normals(), map);
        let tree = &scene.geometry.tree;
        let (mut n, mut lifted, mut plain) = (0, 0.0, 0.0);
        let to_world =
            |ray: Ray| Ray::new(map.transform_point3(ray.origin), map.transform_vector3(ray.dir).normalize());
        for ray in rays() {
            let (d, b) = (ray.dir, ray.origin.dot(ray.dir));
            let disc = b * b - ray.origin.length_squared() + 1.0;
            let ray = to_world(ray);
            let Some(hit) = tree.closest_hit(&ray) else { continue };
            if disc <= 0.0 {
                continue;
            }
            let (outwards, vertex) = (ray_point(&ray, &map, d, b, disc), Vertex::new(&scene, &ray, &hit, 0));
            let wi = map.transform_vector3(light).normalize();
            let truth = outwards.dot(light).max(0.0);
            let arriving = |vertex: &Vertex| {
                let cos = vertex.normal.dot(wi).max(0.0);
                let open = cos > 0.0
                    && vertex.is_reached_from(wi)
                    && tree.closest_hit(&Ray::new(vertex.leaving(wi), wi)).is_none();
                if open { cos } else { 0.0 }
            };
            let flat = Vertex { lift: Vec3::ZERO, ..vertex };
            n += 1;
            lifted += f64::from(arriving(&vertex) - truth).powi(2);
            plain += f64::from(arriving(&flat) - truth).powi(2);
        }
        ((lifted / f64::from(n)).sqrt(), (plain / f64::from(n)).sqrt())
    }

    /// The exact normal at the hit, in the sphere's space.
    fn ray_point(ray: &Ray, map: &Affine3A, dir: Vec3, b: f32, disc: f32) -> Vec3 {
        let origin = map.inverse().transform_point3(ray.origin);
        (origin + (-b - disc.sqrt()) * dir).normalize()
    }

    #[test]
    fn a_coarse_ball_is_lit_like_the_true_one() {
        for frequency in [2, 4, 8] {
            let (lifted, plain) = light_errors(frequency, Affine3A::IDENTITY);
            println!("icosphere {}: rms {lifted:.4}, without {plain:.4}", 20 * frequency * frequency);
            assert!(lifted < 0.9 * plain, "{frequency}: {lifted} against {plain}");
        }
        // Size and mirroring make no difference.
        let (plain, _) = light_errors(4, Affine3A::IDENTITY);
        for scale in [Vec3::splat(1e-3), Vec3::splat(500.0), Vec3::new(-1.0, 1.0, 1.0)] {
            let (scaled, _) = light_errors(4, Affine3A::from_scale(scale));
            assert!((scaled - plain).abs() < 0.05 * plain, "{scale}: {scaled} for {plain}");
        }
    }

    #[test]
    fn surfaces_that_are_flat_or_bend_inwards_are_not_lifted() {
        let flat = scene_of(procedural::icosphere(3).flat(), Affine3A::IDENTITY);
        let smooth = scene_of(procedural::icosphere(3).with_vertex_normals(), Affine3A::IDENTITY);
        for ray in rays() {
            let within = Ray::new(Vec3::new(0.1, 0.2, 0.05), (ray.origin - Vec3::Z * 3.5).normalize());
            for (scene, ray, size) in [(&flat, &ray, 1e-6), (&smooth, &within, 1e-6), (&smooth, &ray, 0.1)] {
                if let Some(hit) = scene.geometry.tree.closest_hit(ray) {
                    let lift = Vertex::new(scene, ray, &hit, 0).lift.length();
                    assert!(lift <= size, "{lift}");
                }
            }
        }
    }
}
