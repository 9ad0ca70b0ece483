//! Rays, boxes, shapes, and robust intersection arithmetic. Knows no trees, materials or entities.

mod aabb;
mod frame;
mod quad;
mod ray;
pub mod robust;
mod sphere;
mod triangle;

pub use aabb::Aabb;
pub use frame::Frame;
pub use quad::{intersect_quad, quad_corners};
pub use ray::Ray;
pub use sphere::{intersect_plane, intersect_sphere};
pub use triangle::{Shear, TriangleHit, intersect_triangle};
pub use triangle::{TINY_EDGE, tiny_edges};
