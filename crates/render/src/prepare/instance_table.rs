//! Data of objects with their own space, as arrays for SIMD.

use crate::prepare::arrays::push;
use firstlight_kdtree::{HitSpace, SceneTree, Shape};
use firstlight_simd::padded;
use glam::{Mat3A, Vec3};

/// Matrices: three columns of three coordinates.
pub(crate) type Columns = [[Vec<f32>; 3]; 3];

/// One row per object with its own space.
#[derive(Debug, Default)]
pub(crate) struct InstanceTable {
    pub world_from_object: Columns,
    pub world_offset: [Vec<f32>; 3],
    pub object_from_world: Columns,
    pub object_offset: [Vec<f32>; 3],
    /// Transforms face normals, up to length; see [`firstlight_kdtree::SceneTree::instance`].
    pub normal_from_object: Columns,
    /// Transforms vertex normals, up to length, to the outside.
    pub cofactors: Columns,
    pub round_trip: Columns,
    pub round_trip_offset: [Vec<f32>; 3],
    pub condition: Vec<f32>,
    pub rim: Vec<f32>,
    /// For meshes of [`HitSpace::World`] −1 if they are mirrored, otherwise 1; 0 for all others.
    pub side: Vec<f32>,
}

impl InstanceTable {
    /// Adds a row for an object of the tree.
    pub fn add(&mut self, tree: &SceneTree, object: usize) {
        let (Shape::Mesh { world_from_object, .. } | Shape::Spheres { world_from_object, .. }) = &tree.shapes()[object]
        else {
            panic!("object {object} has no space of its own");
        };
        let instance = tree.instance(object);
        push_columns(&mut self.world_from_object, world_from_object.matrix3);
        push(&mut self.world_offset, world_from_object.translation.into());
        push_columns(&mut self.object_from_world, instance.object_from_world.matrix3);
        push(&mut self.object_offset, instance.object_from_world.translation.into());
        push_columns(&mut self.normal_from_object, instance.normal_from_object);
        let m = world_from_object.matrix3;
        let (x, y, z) = (Vec3::from(m.x_axis), Vec3::from(m.y_axis), Vec3::from(m.z_axis));
        let side = if x.dot(y.cross(z)) < 0.0 { -1.0 } else { 1.0 };
        let cofactors = [y.cross(z), z.cross(x), x.cross(y)].map(|column| (side * column).into());
        push_columns(&mut self.cofactors, Mat3A::from_cols(cofactors[0], cofactors[1], cofactors[2]));
        push_columns(&mut self.round_trip, instance.round_trip);
        push(&mut self.round_trip_offset, instance.round_trip_offset);
        self.condition.push(instance.condition);
        self.rim.push(instance.rim);
        let is_placed = matches!(tree.shapes()[object], Shape::Mesh { space: HitSpace::World, .. });
        self.side.push(if is_placed { instance.side } else { 0.0 });
    }

    /// Pads the arrays for gather operations.
    pub fn padded(self) -> Self {
        let vectors = |v: [Vec<f32>; 3]| v.map(padded);
        Self {
            world_from_object: self.world_from_object.map(vectors),
            world_offset: vectors(self.world_offset),
            object_from_world: self.object_from_world.map(vectors),
            object_offset: vectors(self.object_offset),
            normal_from_object: self.normal_from_object.map(vectors),
            cofactors: self.cofactors.map(vectors),
            round_trip: self.round_trip.map(vectors),
            round_trip_offset: vectors(self.round_trip_offset),
            condition: padded(self.condition),
            rim: padded(self.rim),
            side: padded(self.side),
        }
    }
}

fn push_columns(to: &mut Columns, m: Mat3A) {
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    to.iter_mut().zip(columns).for_each(|(arrays, column)| push(arrays, column.into()));
}
