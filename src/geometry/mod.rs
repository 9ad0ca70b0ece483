//! Rays, boxes and the arithmetic that keeps them honest. Knows no trees, materials or entities.

mod aabb;
mod frame;
mod ray;
pub mod robust;

pub use aabb::Aabb;
pub use frame::Frame;
pub use ray::Ray;
