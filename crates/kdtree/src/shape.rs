//! Shapes, ray classes and hits: the input and output of queries.

use super::mesh_tree::MeshTree;
use super::ray::RELATIVE_PADDING;
use super::sphere_tree::{SphereTree, sphere_bounds};
use super::support::Support;
use crate::geometry::{Aabb, quad_corners};
use glam::{Affine3A, DAffine3, Vec3};
use std::sync::Arc;

/// The geometry of one object, in the space of the snapshot unless said otherwise.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A sphere, seen from outside and inside.
    Sphere {
        /// Centre, metres.
        center: Vec3,
        /// Radius in metres, positive.
        radius: f32,
    },
    /// An infinite plane.
    Plane {
        /// A point of the plane, metres.
        point: Vec3,
        /// Unit normal of the front.
        normal: Vec3,
    },
    /// A parallelogram; its front faces along `edge_u × edge_v`.
    Quad {
        /// The corner at `u = v = 0`, metres.
        corner: Vec3,
        /// From the corner to the one at `u = 1`, metres.
        edge_u: Vec3,
        /// From the corner to the one at `v = 1`, metres.
        edge_v: Vec3,
    },
    /// A single triangle; on its front the vertices run counter-clockwise.
    Triangle {
        /// The corners, metres.
        vertices: [Vec3; 3],
    },
    /// A mesh, placed by an invertible map.
    Mesh {
        /// The triangles and the tree over them, in the mesh's own space.
        tree: Arc<MeshTree>,
        /// Map from the mesh's own space to that of the snapshot.
        world_from_object: Affine3A,
        /// Where its hits are decided.
        space: HitSpace,
    },
    /// A cloud of spheres with its own tree; `world_from_object` rotates, translates and scales uniformly.
    Spheres {
        /// The tree over the spheres, in the object's own space.
        tree: Arc<SphereTree>,
        /// Map from the object's own space to that of the snapshot.
        world_from_object: Affine3A,
    },
}

impl Shape {
    /// Whether both are the same geometry: by value, and meshes and clouds if they share their tree.
    pub fn is_same(&self, other: &Self) -> bool {
        use Shape::*;
        match (self, other) {
            (Sphere { center: a, radius: r }, Sphere { center: b, radius: s }) => (a, r) == (b, s),
            (Plane { point: a, normal: n }, Plane { point: b, normal: m }) => (a, n) == (b, m),
            (Quad { corner: a, edge_u: u, edge_v: v }, Quad { corner: b, edge_u: other_u, edge_v: other_v }) => {
                (a, u, v) == (b, other_u, other_v)
            }
            (Triangle { vertices: a }, Triangle { vertices: b }) => a == b,
            (
                Mesh { tree: a, world_from_object: map, space },
                Mesh { tree: b, world_from_object: other_map, space: other_space },
            ) => Arc::ptr_eq(a, b) && (map, space) == (other_map, other_space),
            (Spheres { tree: a, world_from_object: map }, Spheres { tree: b, world_from_object: other_map }) => {
                Arc::ptr_eq(a, b) && map == other_map
            }
            _ => false,
        }
    }

    /// Map from the space in which hits are decided to that of the snapshot.
    pub(super) fn world_from_object(&self) -> Affine3A {
        match self {
            Self::Mesh { space: HitSpace::World, .. } => Affine3A::IDENTITY,
            Self::Mesh { world_from_object, .. } | Self::Spheres { world_from_object, .. } => *world_from_object,
            _ => Affine3A::IDENTITY,
        }
    }
}

/// The space in which rays and the triangles of a mesh are tested, which decides how coordinates are rounded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HitSpace {
    /// That of the mesh, in its own tree: rays are transformed. For meshes that are used several times or move.
    #[default]
    Object,
    /// That of the snapshot, in a tree that the mesh shares with others: vertices are transformed, once. For meshes that
    /// are used once and stand still.
    World,
}

/// A hint about the rays of a batch: it selects the traversal, never the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayClass {
    /// Neighbours in the batch are similar: camera rays and their shadow rays, in tile order.
    Coherent,
    /// Everything else.
    Incoherent,
}

/// One hit; fields as in [`super::batch::HitBatch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of `dir`.
    pub t: f32,
    /// First surface coordinate.
    pub u: f32,
    /// Second surface coordinate.
    pub v: f32,
    /// Index of the primitive within the object.
    pub prim: u32,
    /// Index of the object in the scene tree.
    pub object: u32,
}

/// Returns the inverse, computed in `f64` and rounded once to `f32`.
pub(super) fn inverse(matrix: &Affine3A) -> Affine3A {
    let wide = DAffine3::from_mat3_translation(matrix.matrix3.as_dmat3(), matrix.translation.as_dvec3()).inverse();
    Affine3A::from_mat3_translation(wide.matrix3.as_mat3(), wide.translation.as_vec3())
}

/// Transforms a vector, in an order of roundings that every instruction set repeats.
#[inline]
pub(super) fn transform_vector(map: &Affine3A, v: Vec3) -> Vec3 {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(Vec3::from);
    (x * v.x + y * v.y) + z * v.z
}

#[inline]
pub(super) fn transform_point(map: &Affine3A, p: Vec3) -> Vec3 {
    transform_vector(map, p) + Vec3::from(map.translation)
}

/// Returns the bounds of an object in the world, padded for the rounding of rays transformed into its own space. Empty
/// for planes and for objects without surface.
pub(super) fn object_bounds(shape: &Shape) -> Aabb {
    match shape {
        Shape::Plane { .. } => Aabb::EMPTY,
        Shape::Sphere { center, radius } => sphere_bounds(*center, *radius),
        Shape::Quad { corner, edge_u, edge_v } => Aabb::from_points(quad_corners(*corner, *edge_u, *edge_v)),
        Shape::Triangle { vertices } => Aabb::from_points(*vertices),
        Shape::Mesh { tree, world_from_object, .. } => placed_bounds(tree.bounds(), world_from_object, None),
        Shape::Spheres { tree, world_from_object } => placed_bounds(tree.bounds(), world_from_object, None),
    }
}

/// Returns the bounds of a placed object in the world, padded for the rounding of rays transformed into its own space.
///
/// - `own`: bounds in the object's own space.
/// - `support`: makes the result tight; without it the result bounds the transformed box.
pub(super) fn placed_bounds(own: Aabb, map: &Affine3A, support: Option<&Support>) -> Aabb {
    if own.is_empty() {
        return own;
    }
    let corners = (0..8).map(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { own.min[axis] } else { own.max[axis] };
        transform_point(map, Vec3::new(pick(0), pick(1), pick(2)))
    });
    let whole = Aabb::from_points(corners);
    // The inverse map may amplify errors by the condition number of the matrix.
    let condition = max_row_sum(map) * max_row_sum(&inverse(map));
    let largest = whole.min.abs().max(whole.max.abs()).max_element() + map.translation.abs().max_element();
    let padding = RELATIVE_PADDING * condition * largest;
    let around = support.map_or(whole, |support| support.bounds(map).intersection(whole));
    Aabb { min: around.min - padding, max: around.max + padding }
}

fn max_row_sum(map: &Affine3A) -> f32 {
    let m = map.matrix3;
    (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element()
}
