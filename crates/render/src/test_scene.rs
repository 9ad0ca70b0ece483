//! A scene of a few shapes, for tests.

use crate::core::camera::Camera;
use crate::core::environment::Environment;
use crate::core::material::Material;
use crate::core::snapshot::{Geometry, Object, Shading, Snapshot};
use crate::prepare::prepared::Prepared;
use firstlight_kdtree::Shape;
use std::sync::Arc;

/// The camera is at the origin and looks along −z, with a vertical field of view of 90°.
pub(crate) fn prepared(
    shapes: Vec<Shape>,
    objects: Vec<Object>,
    materials: Vec<Material>,
    environment: Environment,
) -> Prepared {
    let camera = Camera::default();
    let geometry = Arc::new(Geometry::build(shapes, objects));
    Prepared::new(Snapshot { geometry, shading: Arc::new(Shading::new(materials, Vec::new(), environment)), camera })
}
