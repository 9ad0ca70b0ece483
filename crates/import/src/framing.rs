//! The camera from which all of a model is seen, as large as the image allows.
//!
//! The view direction is fixed; each vertex lies inside the frustum if it is on the inner side of its four planes. The
//! farthest vertex along each of their normals therefore gives the tightest position of the camera in closed form.

use firstlight_format::bounds;
use firstlight_format::camera::CameraPart;
use firstlight_mesh::Mesh;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

const VFOV_DEG: f64 = 35.0;
/// Width of the image over that of the model, likewise the heights.
const MARGIN: f64 = 1.12;
/// Triangles of all objects together whose vertices are looked at; beyond it, boxes take the place of meshes.
const MOST_TRIANGLES: usize = 4_000_000;

/// Side of models whose front is at -Z.
pub const AWAY: DVec3 = DVec3::new(-1.0, 1.0, -1.0);

/// A three-quarter view from slightly above, and what it has to show.
#[derive(Clone, Debug)]
pub struct Framing {
    /// Signs of the direction of the front.
    side: DVec3,
    /// Unit vector from the model to the camera.
    back: DVec3,
    right: DVec3,
    up: DVec3,
    /// Tangents of half the angles of view, reduced by the margin.
    tangents: [f64; 2],
    /// Outer normals of the planes of the frustum: right, left, top, bottom.
    normals: [DVec3; 4],
    /// The largest product of a point with each of them, metres.
    reach: [f64; 4],
    /// Box of all points, metres.
    bounds: (DVec3, DVec3),
    triangles: usize,
}

impl Framing {
    /// - `side`: signs of the direction of the front; `aspect`: width over height of the image.
    pub fn new(side: DVec3, aspect: f64) -> Self {
        let back = side * DVec3::new(0.6, 0.38, 1.0).normalize();
        let right = DVec3::Y.cross(back).normalize();
        let up = back.cross(right);
        let vertical = (0.5 * VFOV_DEG).to_radians().tan() / MARGIN;
        let tangents = [vertical * aspect, vertical];
        let normals = [
            right + tangents[0] * back,
            -right + tangents[0] * back,
            up + tangents[1] * back,
            -up + tangents[1] * back,
        ];
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        Self { side, back, right, up, tangents, normals, reach: [f64::NEG_INFINITY; 4], bounds: nothing, triangles: 0 }
    }

    /// Signs of the direction of the front.
    pub fn side(&self) -> DVec3 {
        self.side
    }

    /// Whether nothing was added.
    pub fn is_empty(&self) -> bool {
        self.triangles == 0
    }

    /// The box of everything so far, metres.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    /// Adds a mesh that is placed in the world.
    ///
    /// - `corners`: those of the box of the mesh, which many instances may share.
    pub fn add(&mut self, mesh: &Mesh, (min, max): (DVec3, DVec3), world: &DAffine3) {
        self.triangles += mesh.triangles.len();
        if self.triangles <= MOST_TRIANGLES {
            let points = mesh.triangles.par_iter().flatten_iter().map(|&vertex| mesh.positions[vertex as usize]);
            let around =
                Self { reach: [f64::NEG_INFINITY; 4], bounds: (DVec3::INFINITY, DVec3::NEG_INFINITY), ..*self };
            let all = points.fold(
                || around.clone(),
                |mut all, point| {
                    all.add_point(world.transform_point3(point.as_dvec3() + mesh.center));
                    all
                },
            );
            self.join(&all.reduce(
                || around.clone(),
                |mut a, b| {
                    a.join(&b);
                    a
                },
            ));
        } else {
            for i in 0..8 {
                let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
                self.add_point(world.transform_point3(DVec3::new(pick(0), pick(1), pick(2))));
            }
        }
    }

    fn add_point(&mut self, point: DVec3) {
        for (reach, normal) in self.reach.iter_mut().zip(&self.normals) {
            *reach = reach.max(normal.dot(point));
        }
        self.bounds = (self.bounds.0.min(point), self.bounds.1.max(point));
    }

    fn join(&mut self, other: &Self) {
        for (reach, more) in self.reach.iter_mut().zip(other.reach) {
            *reach = reach.max(more);
        }
        self.bounds = (self.bounds.0.min(other.bounds.0), self.bounds.1.max(other.bounds.1));
    }

    /// The camera that shows all points.
    ///
    /// With c its position and t the tangent of one axis, `normal · p <= normal · c` holds on both sides if
    /// `2 t (back · c) >= reach + reach'`; it is then in the middle between both sides.
    pub fn camera(&self) -> CameraPart {
        let [right, left, top, bottom] = self.reach;
        let [horizontal, vertical] = self.tangents;
        let center = 0.5 * (self.bounds.0 + self.bounds.1);
        let depth = center.dot(self.back);
        let nearest = depth + bounds::MIN_SIZE;
        let distance = (0.5 * (right + left) / horizontal).max(0.5 * (top + bottom) / vertical).max(nearest);
        let target = 0.5 * (right - left) * self.right + 0.5 * (top - bottom) * self.up + depth * self.back;
        let eye = target + (distance - depth) * self.back;
        CameraPart { vfov: VFOV_DEG, ..CameraPart::looking_at(eye, target) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::placing::corners_of;
    use firstlight_mesh::procedural;
    use glam::{DQuat, DVec2};

    /// Position in the image, −1..1 on both axes, of each corner of the mesh.
    fn projected(camera: &CameraPart, mesh: &Mesh, world: &DAffine3, aspect: f64) -> Vec<DVec2> {
        let forward = (camera.look_at.unwrap() - camera.eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let tangent = (0.5 * camera.vfov).to_radians().tan();
        let corners = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize].as_dvec3() + mesh.center);
        let seen = |corner: DVec3| {
            let p = world.transform_point3(corner) - camera.eye;
            let depth = p.dot(forward);
            assert!(depth > 0.0, "behind the camera");
            DVec2::new(p.dot(right) / (depth * tangent * aspect), p.dot(up) / (depth * tangent))
        };
        corners.map(seen).collect()
    }

    #[test]
    fn models_of_any_shape_fill_the_image_and_are_whole() {
        let knot = procedural::serpent_knot(&procedural::SerpentKnot::default());
        let meshes = [procedural::cuboid(DVec3::ONE), knot, procedural::icosphere(8)];
        let scales = [DVec3::ONE, DVec3::new(30.0, 0.2, 1.0), DVec3::new(1.0, 0.1, 40.0), DVec3::new(0.1, 9.0, 0.2)];
        for (mesh, scale) in meshes.iter().flat_map(|mesh| scales.map(|scale| (mesh, scale))) {
            for (turn, far, aspect) in [(0.0, 0.0, 16.0 / 9.0), (0.7, 1e6, 1.0), (2.4, -3.0, 0.5)] {
                let turned = DQuat::from_rotation_z(turn) * DQuat::from_rotation_x(0.5 * turn);
                let world = DAffine3::from_scale_rotation_translation(scale, turned, DVec3::splat(far));
                let mut framing = Framing::new(DVec3::ONE, aspect);
                framing.add(mesh, corners_of(mesh), &world);
                let points = projected(&framing.camera(), mesh, &world, aspect);
                let largest = points.iter().fold(DVec2::ZERO, |largest, point| largest.max(point.abs()));
                let case = format!("{scale} {turn} {aspect}: {largest}");
                assert!((largest.max_element() - 1.0 / MARGIN).abs() < 1e-3, "{case}");
                // Along the axis that it fills, it is in the middle.
                let (min, max) = points.iter().fold((DVec2::MAX, DVec2::MIN), |(a, b), &p| (a.min(p), b.max(p)));
                let axis = usize::from(largest.y > largest.x);
                assert!((min + max)[axis].abs() < 1e-3, "{case}");
            }
        }
    }
}
