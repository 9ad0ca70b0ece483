//! From a hit to the point on the surface, with a bound on the error of that point.
//!
//! The point is built from the surface, not from `origin + t · dir`, and the bound is wide enough that
//! [`crate::geometry::robust::offset_ray_origin`] puts the next ray where the surface it leaves cannot be met again:
//!
//! - the rounding of the point itself (Pharr, Jakob and Humphreys 2023, section 6.8);
//! - what the watertight test moves the vertices by, as seen from that point: `5u` of their distance each, so the
//!   whole triangle stays within that slab, and a ray that starts outside of it and points away never meets it;
//! - for an instance, the way to the world and back again, of the point and of the direction.
//!
//! Start reading at [`SceneTree::surface_point`].

use super::scene_tree::{Hit, SceneTree, Shape, transform_point, transform_vector};
use crate::geometry::robust::{UNIT_ROUNDOFF, gamma};
use crate::geometry::{Ray, quad_corners};
use glam::{Affine3A, Mat3A, Vec2, Vec3};

/// Where a ray met a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    pub position: Vec3,
    /// Bound on the absolute error of `position`, metres per axis, including that of later ray tests from there.
    pub error: Vec3,
    /// Unit. The front: `cross(v1 - v0, v2 - v0)` of a triangle in its own space (carried to the world so that outside stays
    /// outside under mirroring), `edge_u × edge_v` of a quad, outwards for a sphere, the plane's own.
    pub geometric_normal: Vec3,
    /// Weights of vertices 1 and 2 of a triangle, 0..1 along the edges of a quad, otherwise 0.
    pub uv: Vec2,
}

/// Maps between an object's own space and the world, with bounds on what the maps cost in precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub object_from_world: Affine3A,
    /// Inverse transpose: carries normals, up to length.
    normal_from_object: Mat3A,
    /// |world_from_object|, component by component.
    world_from_object_abs: Mat3A,
    /// |world_from_object| · |object_from_world|: what a relative error in the world becomes on the way there and back.
    round_trip: Mat3A,
    /// The same of the translations.
    round_trip_offset: Vec3,
    /// Largest growth of a relative error of a direction.
    condition: f32,
}

impl Instance {
    pub fn new(shape: &Shape) -> Self {
        let world_from_object = match shape {
            Shape::Mesh { world_from_object, .. } | Shape::Spheres { world_from_object, .. } => *world_from_object,
            _ => Affine3A::IDENTITY,
        };
        let object_from_world = super::scene_tree::inverse(&world_from_object);
        let abs = |m: Mat3A| Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
        let row_sum = |m: Mat3A| (m.x_axis + m.y_axis + m.z_axis).max_element();
        let (there, back) = (abs(world_from_object.matrix3), abs(object_from_world.matrix3));
        let offset = there * object_from_world.translation.abs() + world_from_object.translation.abs();
        Self {
            object_from_world,
            normal_from_object: object_from_world.matrix3.transpose(),
            world_from_object_abs: there,
            round_trip: there * back,
            round_trip_offset: offset.into(),
            condition: row_sum(there) * row_sum(back),
        }
    }

    /// The direction keeps its length in the world's measure, so `t` means the same on both sides.
    #[inline]
    pub fn ray(&self, ray: &Ray) -> Ray {
        Ray {
            origin: transform_point(&self.object_from_world, ray.origin),
            dir: transform_vector(&self.object_from_world, ray.dir),
            t_max: ray.t_max,
        }
    }

    /// Carries a point, its error (the same on each axis) and its normal to the world.
    #[inline]
    fn carry_to_world(&self, map: &Affine3A, local: LocalPoint, uv: Vec2) -> SurfacePoint {
        let position = transform_point(map, local.position);
        let mapped = self.world_from_object_abs * (local.position.abs() * gamma(4) + local.error);
        let back = self.round_trip * position.abs() + self.round_trip_offset;
        SurfacePoint {
            position,
            error: mapped + gamma(8) * back,
            geometric_normal: (self.normal_from_object * local.normal).normalize(),
            uv,
        }
    }
}

struct LocalPoint {
    position: Vec3,
    error: Vec3,
    normal: Vec3,
}

impl SceneTree {
    /// The point of a hit that this tree gave for this ray.
    #[inline]
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let uv = Vec2::new(hit.u, hit.v);
        match &self.shapes()[hit.object as usize] {
            Shape::Triangle { vertices } => {
                let local = triangle_point(vertices, hit.u, hit.v, 1.0);
                SurfacePoint {
                    position: local.position,
                    error: local.error,
                    geometric_normal: local.normal.normalize(),
                    uv,
                }
            }
            Shape::Mesh { tree, world_from_object } => {
                let instance = &self.instances[hit.object as usize];
                let local = triangle_point(&tree.vertices(hit.prim), hit.u, hit.v, instance.condition);
                instance.carry_to_world(world_from_object, local, uv)
            }
            Shape::Quad { corner, edge_u, edge_v } => {
                let corners = quad_corners(*corner, *edge_u, *edge_v);
                let position = *corner + hit.u * *edge_u + hit.v * *edge_v;
                // The corners that are tested are rounded themselves.
                let size = corner.abs() + edge_u.abs() + edge_v.abs();
                SurfacePoint {
                    position,
                    error: gamma(6) * size + test_slab(&corners, position, 1.0),
                    geometric_normal: wide_cross(*edge_u, *edge_v).normalize(),
                    uv,
                }
            }
            Shape::Sphere { center, radius } => {
                let (position, error, geometric_normal) = sphere_point(ray, hit.t, *center, *radius);
                SurfacePoint { position, error, geometric_normal, uv }
            }
            Shape::Spheres { tree, world_from_object } => {
                let instance = &self.instances[hit.object as usize];
                let (center, radius) = tree.sphere(hit.prim);
                let (position, error, normal) = sphere_point(&instance.ray(ray), hit.t, center, radius);
                // A grazing direction that rounding tips inwards cuts off a chord of at most that angle.
                let error = error + gamma(4) * instance.condition * radius;
                instance.carry_to_world(world_from_object, LocalPoint { position, error, normal }, uv)
            }
            Shape::Plane { point, normal } => {
                let (point, wide) = (point.as_dvec3(), normal.as_dvec3());
                let near = ray.origin.as_dvec3() + f64::from(hit.t) * ray.dir.as_dvec3();
                let position = (near - wide * ((near - point).dot(wide) / wide.length_squared())).as_vec3();
                let error = 2.0 * UNIT_ROUNDOFF * position.abs();
                SurfacePoint { position, error, geometric_normal: *normal, uv }
            }
        }
    }
}

/// - `condition`: growth of a relative error of the next ray's direction on its way into this space.
#[inline]
fn triangle_point(vertices: &[Vec3; 3], u: f32, v: f32, condition: f32) -> LocalPoint {
    let [a, b, c] = *vertices;
    let w = 1.0 - u - v;
    let position = w * a + u * b + v * c;
    let size = w.abs() * a.abs() + u * b.abs() + v * c.abs();
    LocalPoint {
        position,
        error: gamma(7) * size + test_slab(vertices, position, condition),
        normal: wide_cross(b - a, c - a),
    }
}

/// Half the thickness of the slab that holds the polygon, however a test from `point` rounds it: `5u` of the
/// distance of its vertices along each axis and `8u` of their depth along the ray, twice over.
#[inline]
fn test_slab<const N: usize>(vertices: &[Vec3; N], point: Vec3, condition: f32) -> Vec3 {
    let reach = vertices.iter().fold(Vec3::ZERO, |reach, vertex| reach.max((*vertex - point).abs()));
    Vec3::splat((16.0 + 4.0 * condition) * UNIT_ROUNDOFF * reach.max_element())
}

/// The cross product, exact to a rounding for needles too, scaled so that it neither vanishes nor overflows.
#[inline]
fn wide_cross(a: Vec3, b: Vec3) -> Vec3 {
    let cross = a.as_dvec3().cross(b.as_dvec3());
    let largest = cross.abs().max_element();
    if largest > 0.0 { (cross / largest).as_vec3() } else { Vec3::ZERO }
}

/// The hit projected onto the sphere, its error, and the outward normal.
#[inline]
fn sphere_point(ray: &Ray, t: f32, center: Vec3, radius: f32) -> (Vec3, Vec3, Vec3) {
    let near = ray.origin.as_dvec3() + f64::from(t) * ray.dir.as_dvec3();
    let outwards = (near - center.as_dvec3()).normalize();
    let position = (center.as_dvec3() + f64::from(radius) * outwards).as_vec3();
    // One rounding to f32; everything before it is exact by comparison.
    (position, 2.0 * UNIT_ROUNDOFF * position.abs(), outwards.as_vec3())
}
