//! Data by object, as arrays for SIMD.

use crate::prepare::arrays::push;
use crate::prepare::instance_table::InstanceTable;
use firstlight_kdtree::geometry::Frame;
use firstlight_kdtree::{SceneTree, Shape, quad_rim, sphere_error};
use firstlight_simd::padded;
use glam::Vec3;

/// Kinds of shapes; [`OTHER`] is handled by the scalar code.
pub(crate) const OTHER: u32 = 0;
pub(crate) const FLAT: u32 = 1;
pub(crate) const BALL: u32 = 2;
pub(crate) const PLANE: u32 = 3;
/// Shapes with their own space.
pub(crate) const MESH: u32 = 4;
pub(crate) const CLOUD: u32 = 5;

/// The objects of a scene.
#[derive(Debug, Default)]
pub(crate) struct SurfaceTable {
    pub kind: Vec<u32>,
    /// Corner of a quad, centre of a sphere, point of a plane.
    pub a: [Vec<f32>; 3],
    /// The edges of a quad, the axes of a plane.
    pub b: [Vec<f32>; 3],
    pub c: [Vec<f32>; 3],
    /// Minimum distance of points of a quad from its edge, in its coordinates; for a sphere the first is the error of a
    /// point per axis besides rounding, metres.
    pub least: [Vec<f32>; 2],
    pub normal: [Vec<f32>; 3],
    /// Offset of the next ray from a quad along its normal, metres; for a sphere the radius.
    pub offset: Vec<f32>,
    /// Row in `instances` of shapes with their own space.
    pub row: Vec<u32>,
    pub instances: InstanceTable,
}

impl SurfaceTable {
    /// Whether the shading normal of an object is its true normal.
    pub fn is_shaded_as_it_is(&self, object: u32) -> bool {
        [FLAT, BALL, PLANE, CLOUD].contains(&self.kind[object as usize])
    }

    pub fn build(tree: &SceneTree) -> Self {
        let mut table = Self::default();
        let mut n_instances = 0;
        for (object, shape) in tree.shapes().iter().enumerate() {
            let (kind, points, normal, least, offset) = match shape {
                Shape::Quad { corner, edge_u, edge_v } => {
                    let rim = quad_rim(*corner, *edge_u, *edge_v);
                    let offset = rim.normal.abs().dot(rim.error);
                    (FLAT, [*corner, *edge_u, *edge_v], rim.normal, rim.least, offset)
                }
                Shape::Sphere { center, radius } => {
                    let error = sphere_error(*center, *radius);
                    (BALL, [*center, Vec3::ZERO, Vec3::ZERO], Vec3::Z, [error, 0.0], *radius)
                }
                Shape::Plane { point, normal } => {
                    let frame = Frame::around(*normal);
                    (PLANE, [*point, frame.x, frame.y], *normal, [0.0; 2], 0.0)
                }
                Shape::Mesh { .. } => (MESH, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
                Shape::Spheres { .. } => (CLOUD, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
                Shape::Triangle { .. } => (OTHER, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
            };
            table.row.push(n_instances);
            if [MESH, CLOUD].contains(&kind) {
                table.instances.add(tree, object);
                n_instances += 1;
            }
            let [a, b, c] = points;
            table.kind.push(kind);
            push(&mut table.a, a);
            push(&mut table.b, b);
            push(&mut table.c, c);
            push(&mut table.normal, normal);
            table.least.iter_mut().zip(least).for_each(|(array, least)| array.push(least));
            table.offset.push(offset);
        }
        let Self { kind, a, b, c, least, normal, offset, row, instances } = table;
        Self {
            kind: padded(kind),
            row: padded(row),
            instances: instances.padded(),
            a: a.map(padded),
            b: b.map(padded),
            c: c.map(padded),
            least: least.map(padded),
            normal: normal.map(padded),
            offset: padded(offset),
        }
    }
}
