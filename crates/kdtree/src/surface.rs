//! Surface points of hits, with bounds on their errors.
//!
//! The point is computed from the surface, not from `origin + t · dir`, and the bound is wide enough that
//! [`crate::geometry::robust::offset_ray_origin`] moves the origin of the next ray to where it cannot hit the surface
//! it leaves again. The bound covers:
//!
//! - the rounding of the point itself (Pharr, Jakob and Humphreys 2023, section 6.8);
//! - the distance by which the watertight test moves the vertices, as seen from that point: `5u` of their distance
//!   each, so the whole triangle stays within that slab, and a ray that starts outside of it and points away never hits
//!   it;
//! - for an instance, the transforms of the point and of the direction to the world and back.
//!
//! At the edge of a triangle that is not enough: the neighbour is as uncertain as the triangle itself, so a ray that
//! starts where the two meet may start behind it and leak. Points are kept clear of the edge by as much ([`INSET`]).
//!
//! Start reading at [`PlacedShapes::surface_point`].

use super::shape::{Hit, HitSpace, Shape, inverse, transform_point, transform_vector};
use super::static_tree::placed_vertices;
use crate::geometry::robust::{UNIT_ROUNDOFF, gamma};
use crate::geometry::{Aabb, Ray, quad_corners};
use glam::{Affine3A, Mat3A, Vec2, Vec3};

/// The point at which a ray hits a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point on the surface, metres, in the space of the snapshot.
    pub position: Vec3,
    /// Bound on the absolute error of `position`, metres per axis, including that of later ray tests from there.
    pub error: Vec3,
    /// Unit normal of the front: `cross(v1 - v0, v2 - v0)` of a triangle in its own space (transformed so that outside
    /// stays outside under mirroring), `edge_u × edge_v` of a quad, outwards for a sphere, the plane's own.
    pub geometric_normal: Vec3,
    /// Weights of vertices 1 and 2 of a triangle, 0..1 along the edges of a quad, otherwise 0.
    pub uv: Vec2,
}

/// Maps between an object's own space and the world, with bounds on their rounding errors.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    pub object_from_world: Affine3A,
    /// Inverse transpose: transforms normals, up to length.
    pub normal_from_object: Mat3A,
    /// |world_from_object|, component by component.
    world_from_object_abs: Mat3A,
    /// |world_from_object| · |object_from_world|: the growth of a relative error in the world on the round trip.
    pub round_trip: Mat3A,
    /// The corresponding growth for the translations.
    pub round_trip_offset: Vec3,
    /// Largest growth of the relative error of a direction.
    pub condition: f32,
    /// Addition to the error of points by the round trip, in the object's own metres.
    pub rim: f32,
    /// −1 for a mesh whose triangles are mirrored in the space of their test, otherwise 1.
    pub side: f32,
}

impl Instance {
    pub fn new(shape: &Shape) -> Self {
        let world_from_object = shape.world_from_object();
        let object_from_world = inverse(&world_from_object);
        let abs = |m: Mat3A| Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
        let row_sum = |m: Mat3A| (m.x_axis + m.y_axis + m.z_axis).max_element();
        let (there, back) = (abs(world_from_object.matrix3), abs(object_from_world.matrix3));
        let offset = there * object_from_world.translation.abs() + world_from_object.translation.abs();
        let round_trip = there * back;
        let reach = match shape {
            Shape::Mesh { tree, space: HitSpace::Object, .. } if !tree.bounds().is_empty() => {
                let Aabb { min, max } = tree.bounds();
                there * min.abs().max(max.abs()) + Vec3::from(world_from_object.translation.abs())
            }
            _ => Vec3::ZERO,
        };
        let side = match shape {
            Shape::Mesh { world_from_object: map, space: HitSpace::World, .. } if map.matrix3.determinant() < 0.0 => {
                -1.0
            }
            _ => 1.0,
        };
        let rim = gamma(8) * (round_trip * reach + Vec3::from(offset)).max_element() * row_sum(back);
        Self {
            object_from_world,
            normal_from_object: object_from_world.matrix3.transpose(),
            world_from_object_abs: there,
            round_trip,
            round_trip_offset: offset.into(),
            condition: row_sum(there) * row_sum(back),
            rim,
            side,
        }
    }

    /// Transforms a ray into the object's own space. The direction is not normalised, so `t` is the same in both
    /// spaces.
    #[inline]
    pub fn ray(&self, ray: &Ray) -> Ray {
        Ray {
            origin: transform_point(&self.object_from_world, ray.origin),
            dir: transform_vector(&self.object_from_world, ray.dir),
            t_max: ray.t_max,
        }
    }

    /// Transforms a point, its error (the same on each axis) and its normal to the world.
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

/// Minimum distance of a point from the edges of its triangle, as a multiple of its error bound along one axis.
///
/// A ray that starts `e` above one face and `4e` from the edge lies at least `e` in front of the other face, for all
/// angles between the faces down to 30°.
pub const INSET: f32 = 4.0;

struct LocalPoint {
    position: Vec3,
    error: Vec3,
    normal: Vec3,
}

/// All objects of a scene and their instances, in parallel lists.
#[derive(Debug, Default)]
pub(super) struct PlacedShapes {
    pub shapes: Vec<Shape>,
    pub instances: Vec<Instance>,
}

impl PlacedShapes {
    /// Returns the surface point of a hit that this tree reported for this ray.
    #[inline]
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let uv = Vec2::new(hit.u, hit.v);
        match &self.shapes[hit.object as usize] {
            Shape::Triangle { vertices } => {
                let local = triangle_point(vertices, hit.u, hit.v, 1.0, 0.0);
                SurfacePoint {
                    position: local.position,
                    error: local.error,
                    geometric_normal: local.normal.normalize(),
                    uv,
                }
            }
            Shape::Mesh { tree, world_from_object, space: HitSpace::World } => {
                let vertices = placed_vertices(tree.vertices(hit.prim), world_from_object);
                let LocalPoint { position, error, normal } = triangle_point(&vertices, hit.u, hit.v, 1.0, 0.0);
                let side = self.instances[hit.object as usize].side;
                SurfacePoint { position, error, geometric_normal: side * normal.normalize(), uv }
            }
            Shape::Mesh { tree, world_from_object, .. } => {
                let instance = &self.instances[hit.object as usize];
                let local = triangle_point(&tree.vertices(hit.prim), hit.u, hit.v, instance.condition, instance.rim);
                instance.carry_to_world(world_from_object, local, uv)
            }
            Shape::Quad { corner, edge_u, edge_v } => {
                let QuadRim { normal, error, least } = quad_rim(*corner, *edge_u, *edge_v);
                let clear = |at: f32, least: f32| at.clamp(least, 1.0 - least);
                let position = *corner + clear(hit.u, least[0]) * *edge_u + clear(hit.v, least[1]) * *edge_v;
                SurfacePoint { position, error, geometric_normal: normal, uv }
            }
            Shape::Sphere { center, radius } => {
                let (position, error, geometric_normal) = sphere_point(ray, hit.t, *center, *radius);
                SurfacePoint { position, error, geometric_normal, uv }
            }
            Shape::Spheres { tree, world_from_object } => {
                let instance = &self.instances[hit.object as usize];
                let (center, radius) = tree.sphere(hit.prim);
                let (position, error, normal) = sphere_point(&instance.ray(ray), hit.t, center, radius);
                // A grazing direction that rounding tilts inwards cuts off a chord of at most that angle.
                let error = error + gamma(4) * instance.condition * radius;
                instance.carry_to_world(world_from_object, LocalPoint { position, error, normal }, uv)
            }
            Shape::Plane { point, normal } => {
                let (point, wide) = (point.as_dvec3(), normal.as_dvec3());
                let near = ray.origin.as_dvec3() + f64::from(hit.t) * ray.dir.as_dvec3();
                let position = (near - wide * ((near - point).dot(wide) / wide.length_squared())).as_vec3();
                let wide_error = F64_ERROR * (point.abs().max_element() + position.as_dvec3().abs().max_element());
                let error = 2.0 * UNIT_ROUNDOFF * position.abs() + wide_error as f32;
                SurfacePoint { position, error, geometric_normal: *normal, uv }
            }
        }
    }
}

/// Data shared by all points of a quad.
pub struct QuadRim {
    /// Unit normal.
    pub normal: Vec3,
    /// Error bound, as in [`SurfacePoint`].
    pub error: Vec3,
    /// Inset of points from the edges, as for triangles: the least `u` and `v`, and the same distance from 1.
    pub least: [f32; 2],
}

/// Returns normal, error bound and inset of a quad with this corner and these edges, metres; the edges must not be
/// parallel.
#[inline]
pub fn quad_rim(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> QuadRim {
    // The tested corners are rounded themselves.
    let size = corner.abs() + edge_u.abs() + edge_v.abs();
    let middle = corner + 0.5 * edge_u + 0.5 * edge_v;
    let error = gamma(6) * size + 2.0 * test_slab(&quad_corners(corner, edge_u, edge_v), middle, 1.0);
    let (cross, area) = wide_cross(edge_u, edge_v);
    let inset = INSET * error.max_element() / area;
    let least = [edge_v, edge_u].map(|across| (inset * across.length()).min(0.5));
    QuadRim { normal: cross.normalize(), error, least }
}

/// Returns the error of a point of a sphere along each axis, without the rounding of the point itself. Close to the
/// origin, where `f32` resolves more than the centre in `f64`, the precision of `f64` decides.
#[inline]
pub fn sphere_error(center: Vec3, radius: f32) -> f32 {
    (F64_ERROR * f64::from(center.abs().max_element() + radius)) as f32
}

/// Returns the point of a triangle with its error and normal.
///
/// - `condition`: growth of the relative error of the next ray's direction on its way into this space.
/// - `rim`: addition to the error on the way to the world.
#[inline]
fn triangle_point(vertices: &[Vec3; 3], u: f32, v: f32, condition: f32, rim: f32) -> LocalPoint {
    let [a, b, c] = *vertices;
    let at = |u: f32, v: f32| {
        let w = 1.0 - u - v;
        let position = w * a + u * b + v * c;
        let size = w.abs() * a.abs() + u * b.abs() + v * c.abs();
        (position, gamma(7) * size + test_slab(vertices, position, condition))
    };
    let (cross, doubled_area) = wide_cross(b - a, c - a);
    let (mut position, mut error) = at(u, v);
    // The longest edge is at most four times as long as its largest component: most points are clear of the edges.
    let longest = (b - a).abs().max((c - a).abs()).max_element() * 4.0;
    let inset = INSET * (error.max_element() + rim);
    if u.min(v).min(1.0 - u - v) * doubled_area < inset * longest {
        let [u, v] = clear_of_rim(vertices, [u, v], doubled_area, inset);
        (position, error) = at(u, v);
    }
    LocalPoint { position, error, normal: cross }
}

/// Returns the weights of vertices 1 and 2, moved so that the point is `inset` away from all edges, or as far as
/// possible.
#[cold]
fn clear_of_rim(&[a, b, c]: &[Vec3; 3], [u, v]: [f32; 2], doubled_area: f32, inset: f32) -> [f32; 2] {
    // The weight of a vertex is the distance from the opposite edge over the height of the vertex above it.
    let least = [b.distance(c), c.distance(a), a.distance(b)].map(|edge| inset * edge / doubled_area);
    let sum: f32 = least.iter().sum();
    let weights = if sum < 1.0 {
        let kept = [1.0 - u - v, u, v].map(|weight| weight.max(0.0));
        std::array::from_fn(|k| least[k] + (1.0 - sum) * kept[k])
    } else if sum.is_finite() {
        // Thinner than twice the inset: the point goes to the middle.
        least.map(|least| least / sum)
    } else {
        [1.0 - u - v, u, v]
    };
    [weights[1], weights[2]]
}

/// Returns half the thickness of the slab that contains the polygon under every rounding of a test from `point`: `5u`
/// of the distance of its vertices along each axis and `8u` of their depth along the ray, twice over.
#[inline]
fn test_slab<const N: usize>(vertices: &[Vec3; N], point: Vec3, condition: f32) -> Vec3 {
    let reach = vertices.iter().fold(Vec3::ZERO, |reach, vertex| reach.max((*vertex - point).abs()));
    Vec3::splat((16.0 + 4.0 * condition) * UNIT_ROUNDOFF * reach.max_element())
}

/// Returns the cross product, accurate to one rounding for needles too, scaled so that it neither underflows nor
/// overflows; and its largest component, which is its length within a factor of √3.
#[inline]
fn wide_cross(a: Vec3, b: Vec3) -> (Vec3, f32) {
    let cross = a.as_dvec3().cross(b.as_dvec3());
    let largest = cross.abs().max_element();
    if largest > 0.0 { ((cross / largest).as_vec3(), largest as f32) } else { (Vec3::ZERO, 0.0) }
}

/// Relative error bound of a few roundings in `f64`, here and in the test of the next ray.
pub const F64_ERROR: f64 = 16.0 * f64::EPSILON;

/// Returns the hit projected onto the sphere, its error, and the outward normal.
#[inline]
fn sphere_point(ray: &Ray, t: f32, center: Vec3, radius: f32) -> (Vec3, Vec3, Vec3) {
    let near = ray.origin.as_dvec3() + f64::from(t) * ray.dir.as_dvec3();
    let outwards = (near - center.as_dvec3()).normalize();
    let position = (center.as_dvec3() + f64::from(radius) * outwards).as_vec3();
    (position, 2.0 * UNIT_ROUNDOFF * position.abs() + sphere_error(center, radius), outwards.as_vec3())
}
