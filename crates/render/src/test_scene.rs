//! A scene of a few shapes, for tests.

use crate::core::camera::Camera;
use crate::core::environment::Environment;
use crate::core::material::Material;
use crate::core::snapshot::{Geometry, Object, Shading, Snapshot};
use crate::prepare::prepared::Prepared;
use firstlight_kdtree::Shape;
use glam::Vec3;
use std::sync::Arc;

/// The camera is at the origin and looks along −z, with a vertical field of view of 90°.
pub(crate) fn prepared(
    shapes: Vec<Shape>,
    objects: Vec<Object>,
    materials: Vec<Material>,
    environment: Environment,
) -> Prepared {
    let camera = Camera {
        eye: Vec3::ZERO,
        right: Vec3::X,
        up: Vec3::Y,
        forward: Vec3::NEG_Z,
        tan_half_vfov: 1.0,
        orthographic: None,
        lens_radius: 0.0,
        focus_distance: 1.0,
        blades: 0,
        blade_rotation: 0.0,
    };
    let geometry = Arc::new(Geometry::build(shapes, objects));
    Prepared::new(Snapshot { geometry, shading: Arc::new(Shading::new(materials, Vec::new(), environment)), camera })
}
