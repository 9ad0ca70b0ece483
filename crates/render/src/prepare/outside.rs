//! Rays that enter the scene from infinitely far away.

use crate::sampling::uniform_disc;
use firstlight_kdtree::geometry::{Frame, Ray};
use firstlight_kdtree::{SceneTree, Shape};
use glam::{Vec2, Vec3};

/// What must be known of a scene to start outside of it.
#[derive(Debug)]
pub(crate) struct Outside {
    /// Bounding sphere of all finite objects.
    center: Vec3,
    radius: f32,
    /// A point and the normal of each infinite plane.
    planes: Vec<(Vec3, Vec3)>,
}

impl Outside {
    pub fn of(tree: &SceneTree) -> Self {
        let bounds = tree.bounds();
        let (center, radius) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min).length());
        let planes = tree.shapes().iter().filter_map(|shape| match shape {
            Shape::Plane { point, normal } => Some((*point, *normal)),
            _ => None,
        });
        let planes = planes.collect();
        let is_finite = radius.is_finite() && center.is_finite();
        Self {
            center: if is_finite { center } else { Vec3::ZERO },
            radius: if is_finite { radius } else { 0.0 },
            planes,
        }
    }

    /// Returns a ray from outside of all finite objects; `None` if an infinite plane occludes it before.
    ///
    /// - `to_light`: unit; the ray comes from there.
    /// - `center`, `radius`: sphere, metres, whose projection along the direction is hit uniformly.
    /// - `u`: two independent uniform numbers in `[0, 1)`.
    pub fn ray_from(&self, to_light: Vec3, (center, radius): (Vec3, f32), u: Vec2) -> Option<Ray> {
        let Vec2 { x, y } = radius * uniform_disc(u);
        let way = self.radius + self.center.distance(center) + radius;
        let origin = center + Frame::around(to_light).to_world(Vec3::new(x, y, way));
        (!self.is_shaded(origin, to_light)).then(|| Ray::new(origin, -to_light))
    }

    /// Whether some plane occludes light to `position`, outside of all finite objects.
    fn is_shaded(&self, position: Vec3, to_light: Vec3) -> bool {
        self.planes.iter().any(|(point, normal)| {
            let (height, slope) = ((*point - position).dot(*normal), to_light.dot(*normal));
            height / slope > 0.0
        })
    }
}
