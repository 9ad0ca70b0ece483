//! The upper level: a tree over the finite objects of a scene, with the infinite planes beside it.

use super::{HitBatch, MeshTree, RayBatch, SphereTree};
use crate::geometry::Ray;
use glam::{Affine3A, Vec3};
use std::sync::Arc;

/// The geometry of one object, in the space of the snapshot unless said otherwise.
#[derive(Clone, Debug)]
pub enum Shape {
    Sphere {
        center: Vec3,
        radius: f32,
    },
    /// Infinite; `normal` is unit.
    Plane {
        point: Vec3,
        normal: Vec3,
    },
    /// A parallelogram; its front looks along `edge_u × edge_v`.
    Quad {
        corner: Vec3,
        edge_u: Vec3,
        edge_v: Vec3,
    },
    Triangle {
        vertices: [Vec3; 3],
    },
    Mesh {
        tree: Arc<MeshTree>,
        world_from_object: Affine3A,
    },
    /// `world_from_object` rotates, moves and scales evenly.
    Spheres {
        tree: Arc<SphereTree>,
        world_from_object: Affine3A,
    },
}

/// What the caller knows of a batch: it picks the traversal, never the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayClass {
    /// Neighbours in the batch run side by side: camera rays and their shadow rays, in tile order.
    Coherent,
    /// Everything else.
    Incoherent,
}

#[derive(Debug, Default)]
pub struct SceneTree {
    shapes: Vec<Shape>,
}

impl SceneTree {
    /// Object `i` of all later hits is `shapes[i]`.
    pub fn build(shapes: Vec<Shape>) -> Self {
        Self { shapes }
    }

    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The nearest hit of each ray with `0 < t < t_max`; `hits` is reset to the size of the batch.
    pub fn closest_hits(&self, rays: &RayBatch, _class: RayClass, hits: &mut HitBatch) {
        hits.reset(rays.len());
        for i in 0..rays.len() {
            if let Some(hit) = self.closest_hit(&rays.get(i)) {
                (hits.t[i], hits.u[i], hits.v[i]) = (hit.t, hit.u, hit.v);
                (hits.prim[i], hits.object[i]) = (hit.prim, hit.object);
            }
        }
    }

    /// Whether anything lies on each ray with `0 < t < t_max`; `occluded` is resized to the batch.
    pub fn any_hits(&self, rays: &RayBatch, _class: RayClass, occluded: &mut Vec<bool>) {
        occluded.clear();
        occluded.extend((0..rays.len()).map(|i| self.closest_hit(&rays.get(i)).is_some()));
    }

    /// One ray, for the mouse.
    pub fn closest_hit(&self, _ray: &Ray) -> Option<Hit> {
        todo!()
    }
}

/// One hit; fields as in [`HitBatch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub prim: u32,
    pub object: u32,
}
