//! Texture coordinates by projection from the six sides of a box.

use super::Mesh;
use glam::{Vec2, Vec3};
use std::array::from_fn;

/// Normal, and the directions in which `u` and `v` grow, per side: `v` is up on the walls, and no side is mirrored.
const SIDES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::NEG_Z, Vec3::Y],
    [Vec3::NEG_X, Vec3::Z, Vec3::Y],
    [Vec3::Z, Vec3::X, Vec3::Y],
    [Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y],
    [Vec3::Y, Vec3::X, Vec3::NEG_Z],
    [Vec3::NEG_Y, Vec3::X, Vec3::Z],
];

impl Mesh {
    /// Replaces the first texture coordinates by those of box projection, also called cubic projection: each triangle
    /// is projected along the axis that it faces most. The square 0..1 is as wide as the longest side of the mesh's
    /// bounding box, and centred on it. Vertices whose triangles face different sides are split.
    ///
    /// Tangents, if there are any, are computed again.
    pub fn with_box_coordinates(mut self) -> Self {
        let had_tangents = !self.tangents.is_empty();
        self.tangents.clear();
        let bounds = self.bounds();
        let middle = 0.5 * (bounds.min + bounds.max);
        // A mesh that is a point shows the middle of the image.
        let per_metre = 1.0 / (bounds.max - bounds.min).max_element().max(f32::MIN_POSITIVE);
        let side_of = |t: usize| {
            let normal = self.doubled_area_normal(t).as_vec3();
            let facing: [f32; 6] = from_fn(|side| SIDES[side][0].dot(normal));
            (1..6).fold(0, |best, side| if facing[side] > facing[best] { side } else { best })
        };
        let sides: Vec<usize> = (0..self.triangles.len()).flat_map(|t| [side_of(t); 3]).collect();
        let of_vertex = self.split_by(&sides);
        let coordinates = |(side, position): (&Option<usize>, &Vec3)| {
            let [_, along_u, along_v] = SIDES[side.unwrap_or(0)];
            let place = per_metre * (*position - middle);
            Vec2::new(along_u.dot(place), along_v.dot(place)) + 0.5
        };
        self.uvs = of_vertex.iter().zip(&self.positions).map(coordinates).collect();
        if had_tangents { self.with_tangents() } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural;

    #[test]
    fn a_cube_has_the_image_on_each_side() {
        let cube = procedural::cube();
        let bare = Mesh { uvs: Vec::new(), ..cube.clone() };
        assert_eq!(bare.with_box_coordinates(), cube);
    }

    #[test]
    fn each_triangle_of_a_sphere_keeps_its_shape_up_to_a_slope_of_its_side() {
        let sphere = procedural::icosphere(6).with_vertex_normals();
        let mesh = sphere.clone().with_box_coordinates();
        mesh.validate().unwrap();
        assert_eq!(mesh.triangles.len(), sphere.triangles.len());
        assert!(mesh.positions.len() > sphere.positions.len(), "seams");
        for (triangle, old) in mesh.triangles.iter().zip(&sphere.triangles) {
            let uv = triangle.map(|vertex| mesh.uvs[vertex as usize]);
            for k in 0..3 {
                assert_eq!(mesh.positions[triangle[k] as usize], sphere.positions[old[k] as usize]);
                assert_eq!(mesh.normals[triangle[k] as usize], sphere.normals[old[k] as usize]);
                assert!(uv[k].cmpge(Vec2::splat(-1e-6)).all() && uv[k].cmple(Vec2::splat(1.0 + 1e-6)).all());
            }
            // Nothing is mirrored, and the least favourable slope is that of the corner of a cube, 1/√3.
            let area = (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]);
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let whole = (b - a).cross(c - a).length() / 4.0;
            assert!(area > 0.55 * whole && area < 1.001 * whole, "{area} of {whole}");
        }
    }

    #[test]
    fn tangents_are_those_of_the_new_coordinates() {
        let torus = procedural::torus(1.0, 0.3, 12, 6).with_vertex_normals().with_tangents();
        let projected = torus.clone().with_box_coordinates();
        projected.validate().unwrap();
        let expected = Mesh { tangents: Vec::new(), ..torus }.with_box_coordinates().with_tangents();
        assert_eq!(projected, expected);
    }

    #[test]
    fn a_mesh_without_extent_has_finite_coordinates() {
        let positions = [glam::DVec3::splat(3.0); 3];
        let mesh = Mesh::from_f64(&positions, vec![[0, 1, 2]]).unwrap().with_box_coordinates();
        mesh.validate().unwrap();
    }
}
